"""A person's game: phases, time, and the same bits as the agents'."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gymnasium.utils import seeding
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.config import EnvConfig
from roller_env.envs.single import RollerEnv
from roller_env.play.keyboard import KeyboardWrapper
from roller_env.play.session import MAX_CATCH_UP_S, GameSession, Phase, play_config
from roller_env.replay import Recorder, verify
from roller_env.simulation import Simulation, Transition
from tests.play.lane import (
    COIN_X_M,
    FRAME_S,
    Float64,
    Witness,
    ball_x,
    game,
    lane,
    play,
    play_until,
)

KEY_N = 5.08
INTRO_S = 6.0


def test_nothing_moves_before_the_start_button_but_the_scenery() -> None:
    session = game(started=False)
    before = session.simulation.qpos
    play(session, 1.0, "w")
    assert session.phase is Phase.START
    assert (session.simulation.qpos == before).all()
    assert session.frame().clock_s == pytest.approx(1.0)


def test_the_keys_work_six_seconds_after_the_start() -> None:
    session = game(skip_intro=False)
    assert session.phase is Phase.INTRO
    started = ball_x(session)
    assert play_until(session, Phase.PLAYING, "w") == pytest.approx(INTRO_S, abs=2 * FRAME_S)
    assert ball_x(session) == pytest.approx(started, abs=0.01)
    play(session, 1.0, "w")
    assert ball_x(session) > started + 1.0


def test_without_the_intro_the_keys_work_at_once() -> None:
    session = game()
    assert session.phase is Phase.PLAYING
    play(session, 0.5, "w")
    assert ball_x(session) > 0.3


def test_a_key_let_go_stops_pushing_and_the_ball_rolls_on() -> None:
    session = game(lane(coins=[], finish={"at": (13.0, 0.0, 0.5), "size": (0.5, 6.0, 1.0)}))
    witness_speeds = []
    play(session, 1.0, "w")
    for _ in range(3):
        before = ball_x(session)
        play(session, 0.25)
        witness_speeds.append((ball_x(session) - before) / 0.25)
    assert witness_speeds[0] > 3.0
    assert witness_speeds == pytest.approx([witness_speeds[0]] * 3, rel=0.01)


def test_two_keys_push_along_the_diagonal() -> None:
    witness = Witness()
    play(game(observers=[witness]), 0.1, "wa")
    assert witness.forces[0][-1].tolist() == pytest.approx(np.array([[KEY_N, KEY_N]]))


@settings(max_examples=15)
@given(
    st.lists(
        st.tuples(st.floats(0.0, 0.3), st.sampled_from(["", "w", "wa", "a", "s", "sd", "wd"])),
        min_size=1,
        max_size=40,
    ),
    st.integers(0, 10**6),
)
def test_the_same_actions_give_agents_the_same_bits_whatever_the_frames(
    frames: list[tuple[float, str]], seed: int
) -> None:
    witness = Witness()
    session = game(seed=seed, observers=[witness])
    for length, held in frames:
        session.advance(length, held)
    simulation = Simulation(EnvConfig(level=lane(), control_dt_s=1 / 240), 1)
    simulation.seed([seeding.np_random(witness.seeds[-1])[0]])
    simulation.reset()
    for force in witness.forces[-1]:
        simulation.step(force)
    assert (simulation.qpos == session.simulation.qpos).all()
    for name, values in simulation.state.named().items():
        assert (values == session.simulation.state.named()[name]).all(), name


def test_an_environment_with_held_keys_plays_the_same_game() -> None:
    session = game(seed=5)
    play(session, 1.0, "wd")
    env = KeyboardWrapper(RollerEnv(level=lane(), action="directions", control_dt_s=1 / 240))
    env.reset(seed=5)
    for _ in range(int(session.simulation.state.steps[0])):
        env.step("wd")
    unwrapped = env.unwrapped
    assert isinstance(unwrapped, RollerEnv)
    assert (unwrapped.simulation.qpos == session.simulation.qpos).all()


@pytest.mark.parametrize("physics", ["fast", "default", "accurate", "rigid"])
def test_a_second_of_frames_is_a_second_of_the_presets_steps(physics: str) -> None:
    session = game(physics=physics)
    assert session.simulation.config.substeps == 1
    play(session, 1.0, "w")
    assert session.result.time_s == pytest.approx(1.0, abs=1.5 * FRAME_S)
    assert session.dropped_s == 0.0


def test_a_stall_slows_the_game_and_does_not_make_it_jump() -> None:
    session = game()
    before = session.result.time_s
    made = session.advance(5.0, "w")
    assert made * session.simulation.duration_s == pytest.approx(MAX_CATCH_UP_S)
    assert session.result.time_s - before == pytest.approx(MAX_CATCH_UP_S)
    assert session.dropped_s == pytest.approx(5.0 - MAX_CATCH_UP_S)


def test_a_key_is_in_the_physics_in_the_frame_in_which_it_is_held() -> None:
    witness = Witness()
    session = game(observers=[witness])
    session.advance(FRAME_S)
    session.advance(FRAME_S, "w")
    assert [force[0, 0] for force in witness.forces[0]] == pytest.approx([0.0] * 4 + [KEY_N] * 4)


def test_the_picture_is_late_by_less_than_a_step_and_moves_evenly() -> None:
    session = game(lane(coins=[]))
    play(session, 0.5, "w")
    play(session, 0.1)
    step, drawn, ends = session.simulation.duration_s, [], []
    for _ in range(100):
        # Frames that share no beat with the physics' steps.
        session.advance(0.0071)
        frame = session.frame()
        drawn.append(frame.qpos()[0])
        ends.append(ball_x(session))
    speed = (drawn[-1] - drawn[0]) / (99 * 0.0071)
    assert np.diff(drawn) == pytest.approx(np.full(99, speed * 0.0071), rel=0.02)
    behind = np.array(ends) - drawn
    assert (behind >= -1e-12).all()
    assert (behind <= speed * step * 1.01).all()


def test_the_ball_is_drawn_turning_by_slerp() -> None:
    session = game(lane(coins=[]))
    play(session, 1.0, "w")
    frame = session.frame()
    turn = slice(3, 7)
    before, after = frame.before[turn], frame.after[turn]
    half = replace(frame, fraction=0.5).qpos()[turn]
    assert np.linalg.norm(half) == pytest.approx(1.0)
    # Half way by slerp: as far from the one as from the other.
    assert abs(half @ before) == pytest.approx(abs(half @ after), abs=1e-12)
    assert abs(half @ before) > abs(before @ after)


def test_a_frame_does_not_change_while_the_game_goes_on() -> None:
    session = game()
    play(session, 0.2, "w")
    frame = session.frame()
    drawn, steps = frame.qpos(), int(frame.state.steps[0])
    play(session, 1.0, "w")
    assert (frame.qpos() == drawn).all()
    assert frame.state.steps[0] == steps


def test_a_pause_stops_time_and_the_scenery() -> None:
    session = game()
    play(session, 0.3, "w")
    session.pause()
    assert session.phase is Phase.PAUSED
    before, clock = session.simulation.qpos, session.frame().clock_s
    play(session, 2.0, "w")
    assert (session.simulation.qpos == before).all()
    assert session.frame().clock_s == clock
    session.resume()
    play(session, 0.2, "w")
    assert (session.simulation.qpos != before).any()


def test_a_pause_in_the_intro_goes_on_with_the_intro() -> None:
    session = game(skip_intro=False)
    play(session, 2.0)
    session.pause()
    play(session, 60.0)
    session.resume()
    assert session.phase is Phase.INTRO
    assert play_until(session, Phase.PLAYING) == pytest.approx(INTRO_S - 2.0, abs=2 * FRAME_S)


def test_the_finish_ends_the_game_with_points_percent_and_time() -> None:
    session = game()
    took = play_until(session, Phase.ENDED, "w")
    result = session.frame().result
    assert result.success
    assert (result.coins, result.score_percent, session.frame().coins_in_level) == (1, 100.0, 1)
    assert result.time_s == pytest.approx(took, abs=2 * FRAME_S)


def test_after_the_end_the_ball_is_frozen_and_the_particles_fly_on() -> None:
    session = game()
    play_until(session, Phase.ENDED, "w")
    before, clock = session.simulation.qpos, session.frame().clock_s
    play(session, 1.0, "s")
    assert (session.simulation.qpos == before).all()
    assert session.frame().clock_s == pytest.approx(clock + 1.0)


def test_a_fall_loads_the_level_again_and_goes_on_without_an_intro() -> None:
    witness = Witness()
    session = game(lane(coins=[{"at": (-1.0, 0.0, 0.4)}]), skip_intro=False, observers=[witness])
    play_until(session, Phase.PLAYING)
    for _ in range(round(20.0 / FRAME_S)):
        if session.falls:
            break
        session.advance(FRAME_S, "s")
    assert (session.falls, session.episode, session.phase) == (1, 1, Phase.PLAYING)
    assert witness.results[0].fall
    assert witness.results[0].coins == 1
    assert session.result.coins == 0
    assert ball_x(session) == pytest.approx(0.0, abs=0.05)


def test_nothing_is_drawn_between_the_place_of_a_fall_and_the_start() -> None:
    session = game()
    while not session.falls:
        session.advance(FRAME_S, "s")
    frame = session.frame()
    assert frame.qpos()[0] == pytest.approx(0.0, abs=0.05)


def test_restart_loads_the_level_again_and_control_stays_on() -> None:
    session = game(skip_intro=False)
    play_until(session, Phase.PLAYING)
    play(session, 1.5, "w")
    assert session.result.coins == 1
    session.restart()
    assert session.phase is Phase.PLAYING
    assert session.result.coins == 0
    assert ball_x(session) == 0.0
    play(session, 0.5, "w")
    assert ball_x(session) > 0.3


def test_restart_does_not_skip_the_start_panel() -> None:
    session = game(started=False)
    session.restart()
    assert session.phase is Phase.START


def test_the_time_limit_ends_the_game() -> None:
    session = game(lane(time_limit_s=2.0))
    assert play_until(session, Phase.ENDED) == pytest.approx(2.0, abs=2 * FRAME_S)
    assert session.result.truncated
    assert not session.result.success


def test_points_are_counted_when_the_ball_is_near_enough_to_the_coin() -> None:
    session = game()
    while session.result.coins == 0:
        session.advance(FRAME_S, "w")
    assert ball_x(session) == pytest.approx(COIN_X_M - 0.762, abs=0.1)


def test_every_episode_has_a_seed_of_its_own_and_is_told_of_once() -> None:
    witness = Witness()
    session = game(seed=40, observers=[witness])
    play(session, 0.2, "w")
    session.restart()
    play(session, 0.2)
    session.restart()
    session.close()
    session.close()
    assert witness.seeds == [40, 41, 42]
    assert len(witness.results) == 3


class Recording:
    """Keeps the last ended episode as a replay."""

    def __init__(self) -> None:
        self.replays: list[Any] = []
        self._recorder: Recorder | None = None

    def on_reset(self, simulation: Simulation, seed: int) -> None:
        self._recorder = Recorder(simulation, "human")
        self._recorder.begin(seed=seed)

    def on_step(self, simulation: Simulation, force_n: Float64, transition: Transition) -> None:
        assert self._recorder is not None
        self._recorder.record(force_n)

    def on_rewind(self, simulation: Simulation) -> None:
        assert self._recorder is not None
        self._recorder.rewind()

    def on_end(self, simulation: Simulation, result: Any) -> None:
        assert self._recorder is not None
        self.replays.append(self._recorder.replay())


@pytest.mark.parametrize("skip_intro", [True, False])
def test_a_played_game_is_a_replay_that_verifies(skip_intro: bool) -> None:
    recording = Recording()
    session = game(skip_intro=skip_intro, observers=[recording])
    play_until(session, Phase.ENDED, "w")
    verification = verify(recording.replays[0])
    assert verification.is_exact, str(verification)
    assert recording.replays[0].result.success


@settings(max_examples=15)
@given(
    back_to=st.lists(st.floats(0.0, 1.5), min_size=1, max_size=4),
    held=st.lists(st.sampled_from(["w", "wa", "d", ""]), min_size=5, max_size=5),
)
def test_a_game_that_went_back_is_the_game_of_the_keys_that_count(
    back_to: list[float], held: list[str]
) -> None:
    recording = Recording()
    session = game(observers=[recording])
    play(session, 0.7, held[0])
    for moment, keys in zip(back_to, held[1:], strict=False):
        session.pause()
        session.seek(moment)
        session.resume()
        play(session, 0.4, keys)
    session.close()
    verification = verify(recording.replays[0])
    assert verification.is_exact, str(verification)


def test_whoever_goes_back_and_does_the_same_again_gets_the_same_bits() -> None:
    session = game()
    play(session, 1.0, "w")
    there = session.simulation.qpos
    session.pause()
    session.seek(0.35)
    assert session.frame().result.time_s == pytest.approx(0.35, abs=1 / 240)
    assert (session.simulation.qpos != there).any()
    session.seek(9.0)
    assert (session.simulation.qpos == there).all()
    assert not session.practice
    session.seek(0.35)
    while session.simulation.state.steps[0] < 240:
        session.step_once("w")
    assert (session.simulation.qpos == there).all()
    assert session.practice


def test_whoever_leaves_while_looking_back_keeps_the_whole_game() -> None:
    recording = Recording()
    session = game(observers=[recording])
    play(session, 1.0, "w")
    session.pause()
    session.seek(0.2)
    session.restart()
    assert len(recording.replays[0]) == 240
    assert verify(recording.replays[0]).is_exact


def test_a_game_played_step_by_step_is_practice() -> None:
    session = game()
    session.pause()
    session.step_once("w")
    assert session.practice


def test_the_intro_is_no_time_of_a_players() -> None:
    session = game(skip_intro=False)
    play_until(session, Phase.PLAYING)
    play(session, 1.0, "w")
    session.pause()
    assert session.intro_s == INTRO_S
    assert session.moments_s == pytest.approx((0.0, 1.0), abs=2 * FRAME_S)
    session.seek(0.0)
    assert session.result.time_s == pytest.approx(INTRO_S)
    session.restart()
    assert session.intro_s == 0.0


def test_only_in_a_pause_one_goes_back() -> None:
    session = game()
    play(session, 0.5, "w")
    there = session.simulation.qpos
    session.seek(0.1)
    session.step_once("w")
    assert (session.simulation.qpos == there).all()


def test_a_long_game_forgets_moments_but_none_that_it_cannot_play_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("roller_env.play.history.KEYFRAMES", 5)
    session = game(lane(coins=[]))
    places: list[Float64] = []
    for _ in range(150):
        session.advance(FRAME_S, "wd" if len(places) % 40 < 20 else "as")
        places.append(session.simulation.qpos)
    session.pause()
    for number in (149, 3, 80, 81, 20, 149):
        session.seek((number + 1) * FRAME_S)
        assert (session.simulation.qpos == places[number]).all()


def test_in_slow_motion_a_second_is_a_part_of_a_second() -> None:
    session = game()
    session.set_speed(0.25)
    play(session, 1.0, "w")
    assert session.result.time_s == pytest.approx(0.25, abs=1.5 * FRAME_S)
    assert session.practice
    session.set_speed(100.0)
    assert session.speed == 4.0


class Eastward:
    """An agent that rolls forward, and counts how often it was asked."""

    def __init__(self) -> None:
        self.asked = self.resets = 0

    def reset(self) -> None:
        self.resets += 1

    def __call__(self, simulation: Simulation) -> Any:
        self.asked += 1
        return np.array([1, 0, 0, 0], np.int8)


def test_an_agent_plays_until_a_key_is_held_and_again_when_it_is_given_the_ball() -> None:
    agent = Eastward()
    session = game(agent=agent)
    play(session, 0.5)
    assert session.frame().agent_plays
    assert ball_x(session) > 0.3
    play(session, FRAME_S, "a")
    assert not session.frame().agent_plays
    asked = agent.asked
    play(session, 0.2)
    assert agent.asked == asked
    session.hand_back()
    play(session, 0.2)
    assert session.frame().agent_plays
    assert agent.asked > asked


def test_keys_held_at_the_start_panel_or_in_the_intro_do_not_take_the_ball_from_the_agent() -> None:
    session = game(agent=Eastward(), skip_intro=False)
    play(session, 1.0, "w")
    assert session.agent_plays


def test_without_an_agent_there_is_nobody_to_give_the_ball_to() -> None:
    session = game()
    session.hand_back()
    assert not session.agent_plays


def test_direct_keys_are_read_once_every_step_of_the_physics() -> None:
    config = play_config("flat", "fast")
    assert (config.action, config.substeps, config.control_dt_s) == ("keys", 1, 1 / 120)
    assert GameSession(config).phase is Phase.START
