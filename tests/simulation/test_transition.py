"""The transition contract: what counts in a step, in which order, and what is shown after it."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from roller_env.game.observations import STATE_ENTRIES, split
from roller_env.game.rewards import RewardWeights
from roller_env.pieces.plate import PLATE
from roller_env.simulation import Simulation, Transition
from tests.builders import coin, make_level, resting
from tests.simulation.driving import along_the_route, force_on_ball, simulation_of, wandering

KEY_W = np.array([[5.08, 0.0]])
WEIGHTS = RewardWeights(coin=1.0, finish=100.0, fall=-10_000.0)


def observed(simulation: Simulation, name: str) -> npt.NDArray[np.float32]:
    """Return one entry of the first game's observation."""
    entry: npt.NDArray[np.float32] = split(simulation.observe(), STATE_ENTRIES)[name][0]
    return entry


def rolling(speed: float, **pieces: Any) -> Simulation:
    """Return a game on wide ground with the ball at the origin rolling towards +x."""
    simulation = simulation_of(make_level(**pieces), reward_weights=WEIGHTS)
    snapshot = simulation.snapshot()
    snapshot.bodies.velocity[0, 0] = speed
    snapshot.bodies.angular_velocity[0, 1] = speed / simulation.level.ball.radius
    simulation.restore(snapshot)
    return simulation


def push(simulation: Simulation) -> Transition:
    return simulation.step(np.repeat(KEY_W, simulation.num_envs, axis=0))


def finish(x: float) -> dict[str, Any]:
    return {"at": (x, 0.0, 0.5), "size": (0.2, 2.0, 1.0)}


def test_a_coin_is_paid_and_gone_from_view_in_the_step_in_which_it_is_reached() -> None:
    simulation = rolling(0.0, coins=[coin(3.0, 0.0, resting()[2])])
    for _ in range(60):
        before = simulation.ball_position[0, 0]
        reward = push(simulation).reward[0]
        after = simulation.ball_position[0, 0]
        reached = before < 3.0 - 0.762 <= after
        assert reward == (WEIGHTS.coin if reached else 0.0)
        assert observed(simulation, "coins_left")[0] == (after < 3.0 - 0.762)
        assert observed(simulation, "coins_present")[0] == (after < 3.0 - 0.762)
        if reached:
            return
    pytest.fail("the coin was never reached")


def test_a_coin_before_the_finish_counts_though_one_step_passes_both() -> None:
    simulation = rolling(60.0, coins=[coin(1.6, 0.0, resting()[2])], finish=finish(2.6))
    transition = push(simulation)
    assert transition.reward[0] == WEIGHTS.coin + WEIGHTS.finish
    assert transition.terminated[0]


def test_a_coin_behind_the_finish_does_not_count_in_the_step_that_ends_the_game() -> None:
    simulation = rolling(60.0, coins=[coin(2.6, 0.0, resting()[2])], finish=finish(1.0))
    transition = push(simulation)
    assert simulation.ball_position[0, 0] > 2.6
    assert transition.reward[0] == WEIGHTS.finish
    assert simulation.results(np.array([0]))["coins"][0] == 0


def test_a_pad_pushes_from_the_step_after_the_one_in_which_it_was_entered() -> None:
    pad = {"at": (2.0, 0.0, 0.0), "size": (1.0, 1.0, 0.1)}
    simulation = rolling(3.0, lift_pads=[pad])
    for _ in range(40):
        push(simulation)
        if observed(simulation, "thrust_left")[0] > 0.0:
            break
    assert observed(simulation, "thrust_left")[0] == pytest.approx(5.0)
    assert force_on_ball(simulation) == [5.08, 0.0, 0.0]
    push(simulation)
    assert force_on_ball(simulation) == pytest.approx([5.08, 0.0, 12.7])
    assert observed(simulation, "thrust_left")[0] == pytest.approx(4.95)


def test_a_plate_sinks_from_the_step_after_the_one_in_which_it_was_struck() -> None:
    simulation = simulation_of("gate", reward="shaped")
    while not simulation.state.of(PLATE).struck.any():
        simulation.step(along_the_route(simulation))
    assert observed(simulation, "plate_sinking")[0] == 1.0
    assert observed(simulation, "plate_present")[0] == 0.0
    rested = simulation.plate_displacement[0]
    simulation.step(along_the_route(simulation))
    sunk = rested - simulation.plate_displacement[0]
    assert 0.0 < sunk < 1.1 * 0.0406 * simulation.duration_s


def test_falling_terminates_and_is_paid_once() -> None:
    simulation = simulation_of("bridge", reward_weights=RewardWeights(coin=0.0, fall=-3.0))
    backwards = np.array([[-5.08, 0.0]])
    rewards = []
    for _ in range(300):
        transition = simulation.step(backwards)
        rewards.append(transition.reward[0])
        if transition.terminated[0]:
            break
        assert simulation.ball_position[0, 2] > simulation.level.kill_height
    results = simulation.results(np.array([0]))
    assert transition.terminated[0]
    assert not transition.truncated[0]
    assert (results["fall"][0], results["success"][0]) == (True, False)
    assert rewards == [0.0] * (len(rewards) - 1) + [-3.0]


def test_the_time_limit_truncates_after_its_last_whole_step() -> None:
    simulation = simulation_of(make_level(time_limit_s=0.5))
    truncated = [bool(push(simulation).truncated[0]) for _ in range(10)]
    assert truncated == [False] * 9 + [True]
    assert not simulation.state.terminated[0]
    assert observed(simulation, "time_left")[0] == 0.0
    assert simulation.results(np.array([0]))["time_s"][0] == pytest.approx(0.5)


@pytest.mark.parametrize("early", [0, 1])
def test_an_end_in_the_last_step_terminates_and_does_not_truncate(early: int) -> None:
    free = rolling(3.0, finish=finish(4.0))
    steps = next(n for n in itertools.count(1) if push(free).terminated[0])
    limit = (steps - early) * free.duration_s
    limited = rolling(3.0, finish=finish(4.0), time_limit_s=limit)
    for _ in range(steps - early):
        last = push(limited)
    assert (last.terminated[0], last.truncated[0]) == ((True, False), (False, True))[early]


def test_a_game_that_is_over_is_frozen_until_it_is_reset() -> None:
    simulation = rolling(60.0, finish=finish(1.0))
    push(simulation)
    shown, physics = simulation.observe(), simulation.snapshot().physics
    transition = push(simulation)
    assert (transition.stepped[0], transition.reward[0], transition.terminated[0]) == (
        False,
        0.0,
        True,
    )
    assert simulation.observe().tobytes() == shown.tobytes()
    assert simulation.snapshot().physics.tobytes() == physics.tobytes()


@pytest.mark.parametrize("wander", [False, True])
def test_shaping_telescopes_to_what_the_start_and_the_last_state_are_worth(wander: bool) -> None:
    shaped = simulation_of("bridge", reward="shaped", max_episode_steps=150)
    plain = simulation_of("bridge", reward="points", max_episode_steps=150)
    pushes = wandering(1)
    gamma, total, scale = shaped.config.discount, 0.0, 1.0
    while not shaped.state.over[0]:
        force = next(pushes) if wander else along_the_route(shaped)
        difference = shaped.step(force).reward[0] - plain.step(force).reward[0]
        total += scale * difference
        scale *= gamma
    # The ball starts before the first waypoint, where nothing of the route lies behind it.
    assert plain.state.over[0]
    assert shaped.state.fallen[0] == wander
    if wander:
        assert total == pytest.approx(0.0, abs=1e-9)
    else:
        assert 0.0 < total <= scale * shaped.config.reward_weights.progress
