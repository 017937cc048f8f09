from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from roller_env.game import cameras
from roller_env.game.state import GameState
from roller_env.pieces.camera_trigger import CAMERA_TRIGGER
from roller_env.pieces.lift_pad import LIFT_PAD
from roller_env.pieces.plate import PLATE
from roller_env.simulation import Simulation
from tests.simulation.driving import along_the_route, bits, simulation_of, wandering

Moment = Callable[[GameState], bool]

MOMENTS: dict[str, tuple[str, Moment]] = {
    "while_the_plate_sinks": (
        "gate",
        lambda s: bool((s.of(PLATE).struck > s.of(PLATE).down).any()),
    ),
    "while_the_gate_opens": ("gate", lambda s: bool(s.signals.any())),
    "while_the_lift_pushes": ("lift", lambda s: bool((s.of(LIFT_PAD).thrust_s > 2.0).any())),
    "while_the_camera_waits": (
        "classic",
        lambda s: bool(np.isfinite(s.of(CAMERA_TRIGGER).delay_s).any()),
    ),
    "while_the_camera_retreats": (
        "classic",
        lambda s: bool((s.camera.mode == cameras.MODE_RETREAT).any()),
    ),
    "in_the_middle_of_the_bridges": ("bridge", lambda s: bool(s.steps[0] == 90)),
}


def play_to(moment: Moment, simulation: Simulation) -> None:
    for _ in range(1500):
        simulation.step(along_the_route(simulation))
        if moment(simulation.state):
            return
    pytest.fail("the moment never came")


def continuation(simulation: Simulation, row: int, seed: int) -> list[bytes]:
    """Play ``row`` on with fixed actions and through a reset; return all that was seen."""
    seen = []
    only = np.ones(simulation.num_envs, dtype=bool)
    only[row] = False
    forces = wandering(1, seed)
    for step in range(120):
        if simulation.state.over[row] or step == 60:
            simulation.reset(np.array([row]))
        force = np.repeat(next(forces), simulation.num_envs, axis=0)
        transition = simulation.step(force, hold=only)
        seen.append(transition.reward[row].tobytes())
        seen.append(simulation.observe()[row].tobytes())
        seen.append(bits(simulation)[row])
    return seen


@pytest.mark.parametrize("when", MOMENTS)
def test_a_restored_game_goes_on_with_the_same_bits(when: str) -> None:
    level, moment = MOMENTS[when]
    options: dict[str, Any] = {"reward": "shaped", "observation": "rays"}
    one = simulation_of(level, seed=5, **options)
    play_to(moment, one)
    kept, shown = one.snapshot(), one.observe()
    expected = continuation(one, row=0, seed=7)

    one.restore(kept)
    assert one.observe().tobytes() == shown.tobytes()
    assert continuation(one, row=0, seed=7) == expected

    many = simulation_of(level, num_envs=4, seed=100, num_threads=2, **options)
    for forces, _ in zip(wandering(4), range(30), strict=False):
        many.step(forces)
    many.restore(kept, np.array([2]))
    assert many.observe()[2].tobytes() == shown.tobytes()
    assert continuation(many, row=2, seed=7) == expected

    many.restore(kept, np.array([2]))
    many.restore(many.snapshot(np.array([2])), np.array([0]))
    assert continuation(many, row=0, seed=7) == expected


def test_restoring_a_row_leaves_its_neighbours_alone() -> None:
    simulation = simulation_of("bridge", num_envs=3)
    kept = simulation.snapshot(np.array([0]))
    for forces, _ in zip(wandering(3), range(20), strict=False):
        simulation.step(forces)
    before = bits(simulation)
    simulation.restore(kept, np.array([1]))
    after = bits(simulation)
    assert (after[0], after[2]) == (before[0], before[2])
    assert after[1] != before[1]


def test_a_snapshot_is_a_copy_that_playing_does_not_change() -> None:
    simulation = simulation_of("bridge", num_envs=2)
    kept = simulation.snapshot()
    begin = bits(simulation)
    for forces, _ in zip(wandering(2), range(40), strict=False):
        simulation.step(forces)
    simulation.reset()
    simulation.restore(kept)
    assert bits(simulation) == begin


def test_a_game_that_was_over_is_over_again_when_it_is_restored() -> None:
    simulation = simulation_of("bridge", max_episode_steps=3)
    for _ in range(3):
        simulation.step(np.zeros((1, 2)))
    kept = simulation.snapshot()
    simulation.reset()
    simulation.restore(kept)
    assert simulation.state.over.tolist() == [True]
    assert not simulation.step(np.zeros((1, 2))).stepped.any()


def test_a_snapshot_of_another_level_is_refused_before_anything_changes() -> None:
    flat, bridge = simulation_of("flat"), simulation_of("bridge")
    before = bits(bridge)
    with pytest.raises(ValueError, match=r"snapshot: .*'flat'.*'bridge'"):
        bridge.restore(flat.snapshot())
    assert bits(bridge) == before


def test_rows_may_be_named_in_any_order() -> None:
    simulation, other = simulation_of("bridge", num_envs=3), simulation_of("bridge", num_envs=3)
    first, second, _ = bits(simulation)
    simulation.restore(simulation.snapshot(np.array([0, 1])), np.array([2, 0]))
    assert bits(simulation) == [second, second, first]
    other.restore(simulation.snapshot())
    simulation.reset(np.array([2, 0]))
    other.reset(np.array([0, 2]))
    assert bits(simulation) == bits(other)


@pytest.mark.parametrize("rows", [[0, 0], [3], [-1], [True, False, True], [0.5]])
def test_what_are_no_different_rows_is_refused_before_anything_changes(rows: list[Any]) -> None:
    simulation = simulation_of("bridge", num_envs=3)
    before = bits(simulation)
    with pytest.raises(ValueError, match=r"rows: found .* from 0 to 2"):
        simulation.reset(np.array(rows))
    with pytest.raises(ValueError, match=r"rows: found .* from 0 to 2"):
        simulation.snapshot(np.array(rows))
    assert bits(simulation) == before


@pytest.mark.parametrize("rows", [[0], [0, 1, 2], [0, 0], [0, 3], [-1, 0]])
def test_a_snapshot_is_refused_for_rows_that_do_not_fit_it(rows: list[int]) -> None:
    simulation = simulation_of("flat", num_envs=3)
    kept = simulation.snapshot(np.array([0, 1]))
    before = bits(simulation)
    with pytest.raises(ValueError, match="rows"):
        simulation.restore(kept, np.array(rows))
    assert bits(simulation) == before
