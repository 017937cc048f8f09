"""What was played is played again, bit for bit, whoever played it and wherever."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.vector import AutoresetMode

from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.actions import ActionMode, forces
from roller_env.game.step import INTRO_S
from roller_env.level import shipped_levels
from roller_env.pieces.coin import COIN
from roller_env.replay import Recorder, ReplayError, verify
from tests.builders import make_level
from tests.replay.recording import pushed_otherwise, straight_on, wandered
from tests.simulation.driving import simulation_of, wandering


@pytest.mark.parametrize("level", shipped_levels())
@pytest.mark.parametrize("reward", ["points", "shaped"])
def test_a_game_of_any_level_is_the_same_when_played_again(level: str, reward: str) -> None:
    played = wandered(level, reward=reward, max_episode_steps=300)
    verification = verify(played)
    assert verification.is_exact, verification
    assert verification.result.total_reward == played.result.total_reward
    assert len(played) > 20


@pytest.mark.parametrize("physics", ["default", "accurate"])
@pytest.mark.parametrize("action", ["directions", "keys", "force"])
def test_any_preset_and_any_action_are_on_record(physics: str, action: ActionMode) -> None:
    rng = np.random.default_rng(1)
    simulation = simulation_of("gate", physics=physics, action=action, num_threads=1)
    recorder = Recorder(simulation)
    recorder.begin()
    of_mode: dict[str, npt.NDArray[Any]] = {
        "directions": rng.integers(9, size=60),
        "keys": rng.integers(2, size=(60, 4)),
        "force": rng.uniform(-1.0, 1.0, (60, 2)).astype(np.float32),
    }
    actions = of_mode[action]
    for done in actions:
        force = forces(action, done[None])
        simulation.step(force)
        recorder.record(force)
    played = recorder.replay()
    if action != "keys":  # Opposite keys cancel, and are then as if neither was held.
        assert np.array_equal(played.actions, actions)
    assert np.array_equal(played.force_n, forces(action, actions))
    assert verify(played).is_exact
    assert played.result.outcome == "not ended"
    assert played.options.preset.name == physics


def test_every_row_and_every_episode_of_many_games_is_played_again_alone() -> None:
    simulation = simulation_of("bridge", num_envs=7, seed=3, num_threads=2, physics="fast")
    recorder = Recorder(simulation)
    rows = np.array([0, 2, 6])
    recorder.begin(rows)
    pushes = wandering(7, seed=5)
    kept = []
    for _ in range(400):
        force = next(pushes)
        simulation.step(force)
        recorder.record(force)
        over = np.flatnonzero(simulation.state.over)
        kept += [recorder.replay(row) for row in np.intersect1d(over, rows)]
        simulation.reset(over)
        recorder.begin(np.intersect1d(over, rows))
    assert len(kept) > 2 * len(rows)
    assert len({played.start for played in kept}) == len(kept)
    for played in kept:
        assert verify(played).is_exact
        assert played.result.fall


def test_rows_held_back_are_not_on_record_for_that_step() -> None:
    simulation = simulation_of("flat", num_envs=2, num_threads=1, physics="fast")
    recorder = Recorder(simulation)
    recorder.begin([0, 1])
    for step in range(20):
        force = forces("directions", [1, 2])
        hold = np.array([step % 2 == 0, False])
        simulation.step(force, hold=hold)
        recorder.record(force)
    assert [len(recorder.replay(row)) for row in (0, 1)] == [10, 20]
    assert all(verify(recorder.replay(row)).is_exact for row in (0, 1))


def test_the_intro_is_on_record() -> None:
    played = wandered("flat", intro=True, max_episode_steps=200)
    assert played.intro
    assert verify(played).is_exact
    begin = round(INTRO_S / played.options.control_dt_s)
    assert np.abs(played.force_n[: begin - 1]).max() > 0.0
    assert not wandered("flat").intro


def test_an_environment_is_recorded_from_outside() -> None:
    environment = RollerEnv(level="flat", physics="fast")
    environment.reset(seed=4)
    recorder = Recorder(environment.simulation, player="a test")
    recorder.begin(seed=4)
    over, total = False, 0.0
    while not over:
        _, reward, terminated, truncated, info = environment.step(1)
        recorder.record(forces("directions", [1]))
        over, total = terminated or truncated, total + reward
    played = recorder.replay()
    assert verify(played).is_exact
    assert (played.seed, played.player) == (4, "a test")
    assert (played.result.coins, played.result.success) == (info["coins"], info["success"])
    assert played.result.total_reward == total


def test_a_vector_environment_that_resets_in_the_next_step_is_recorded_from_outside() -> None:
    environment = RollerVectorEnv(
        3, level="flat", physics="fast", autoreset_mode=AutoresetMode.NEXT_STEP
    )
    environment.reset(seed=0)
    recorder = Recorder(environment.simulation)
    recorder.begin([1])
    over = np.zeros(3, dtype=bool)
    kept = []
    for _ in range(260):
        _, _, terminated, truncated, _ = environment.step(np.array([0, 1, 5]))
        recorder.record(forces("directions", [0, 1, 5]))
        if over[1]:
            recorder.begin([1])
        over = terminated | truncated
        if over[1]:
            kept.append(recorder.replay(1))
    assert len(kept) > 1
    assert all(verify(played).is_exact for played in kept)


def test_a_game_whose_physics_fails_is_on_record_to_its_end() -> None:
    # So strong a pad throws so light a ball further than MuJoCo counts.
    pad = {"at": [0.0, 0.0, 0.1], "size": [2.0, 2.0, 0.2], "force_n": 1e6}
    start = {"at": (0.0, 0.0, 0.7)}
    level = make_level(start=start, ball={"mass_kg": 0.001}, lift_pads=[pad], time_limit_s=20.0)
    with pytest.warns(RuntimeWarning, match="diverged"):
        played = straight_on(level, 150, direction=0, physics="fast")
    assert played.result.diverged
    assert 50 < len(played) < 150
    with pytest.warns(RuntimeWarning, match="diverged"):
        assert verify(played).is_exact


def test_a_force_that_nobody_can_make_is_not_put_on_record() -> None:
    for action, newtons in (("directions", 2.0), ("keys", 200.0), ("force", 1e308)):
        simulation = simulation_of("flat", physics="fast", action=action)
        recorder = Recorder(simulation)
        recorder.begin()
        simulation.step(np.zeros((1, 2)))
        recorder.record(np.array([[newtons, 0.0]]))
        with pytest.raises(ReplayError, match=f"step 0, .* is no action of mode '{action}'"):
            recorder.replay()


@pytest.mark.parametrize("steps", [0, 1, 9, 10, 11, 20])
def test_the_beginning_and_the_end_have_checksums_however_long_it_is(steps: int) -> None:
    played = straight_on("flat", steps, physics="fast")
    assert played.checksums.every == 10
    assert len(played.checksums.table) == len({*range(0, steps, 10), 0, steps})
    assert verify(played).is_exact
    assert steps == 0 or not verify(pushed_otherwise(played, steps - 1)).is_exact


def test_a_game_that_was_reset_meanwhile_is_not_passed_off_as_the_one_on_record() -> None:
    simulation = simulation_of("flat", physics="fast")
    recorder = Recorder(simulation)
    recorder.begin()
    force = forces("directions", [1])
    simulation.step(force)
    recorder.record(force)
    simulation.reset()
    with pytest.raises(ValueError, match="found it at step 0 after 1 recorded"):
        recorder.replay()


def test_a_recording_begins_at_a_beginning() -> None:
    simulation = simulation_of("flat", num_envs=3, physics="fast")
    simulation.step(np.zeros((3, 2)))
    simulation.reset(np.array([1]))
    with pytest.raises(ValueError, match=r"found \[0, 2\] under way"):
        Recorder(simulation).begin([0, 1, 2])
    Recorder(simulation).begin([1])


def test_a_game_that_was_put_elsewhere_is_no_game_of_the_level() -> None:
    simulation = simulation_of("flat", num_envs=2, physics="fast")
    snapshot = simulation.snapshot()
    snapshot.game.of(COIN).taken[1, 0] = True
    simulation.restore(snapshot)
    with pytest.raises(ValueError, match=r"found \[1\] begun with a moving ball or without coins"):
        Recorder(simulation).begin([0, 1])
    snapshot = simulation.snapshot(np.array([0]))
    snapshot.bodies.velocity[0, 0] = 1.0
    simulation.restore(snapshot)
    assert simulation.ball_velocity[0].tolist() == [1.0, 0.0, 0.0]
    with pytest.raises(ValueError, match=r"found \[0\] begun with a moving ball"):
        Recorder(simulation).begin([0])


def test_a_step_that_the_recorder_was_not_told_of_is_noticed() -> None:
    simulation = simulation_of("flat", physics="fast")
    recorder = Recorder(simulation)
    recorder.begin()
    force = np.zeros((1, 2))
    simulation.step(force)
    simulation.step(force)
    with pytest.raises(ValueError, match="found it at step 2 after 0 recorded"):
        recorder.record(force)
    played = straight_on("flat", 5, physics="fast")
    assert len(played) == 5
