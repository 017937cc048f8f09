"""Rows of several levels, on several threads, some of them later than others."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from roller_env.physics.rigid.scene import MOST_NEAR, RigidLevel, SolidBox, pack
from roller_env.physics.rigid.states import States, make_counts, make_states
from roller_env.physics.rigid.step import advance
from roller_env.physics.rigid.workspace import make_workspace
from tests.physics.rigid.levels import NAMES, rigid_level
from tests.physics.rigid.world import GRAVITY, RADIUS_M, RESTING_M, World, floor

STEP_S, CAP_S = 1 / 20, 1 / 120
BALLS = 40


def play(names: tuple[str, ...], of_row: np.ndarray, threads: int) -> tuple[States, np.ndarray]:
    """Return the states of balls in packed levels after 3 s of the same keys, and their paths."""
    levels = [rigid_level(name) for name in names]
    scenes = pack([rigid for _, rigid in levels])
    states = make_states(scenes, BALLS)
    states.position[:] = [levels[number][0].start.at for number in of_row]
    counts = make_counts(BALLS)
    path, knots = np.zeros((BALLS, 60, 6)), np.zeros(BALLS, dtype=np.int64)
    workspace = make_workspace(scenes, threads)
    generator = np.random.default_rng(1)
    parts = np.array_split(np.arange(BALLS), threads)

    def part(thread: int) -> None:
        rows = parts[thread]
        ways = path[rows[0] : rows[-1] + 1], knots[rows[0] : rows[-1] + 1]
        advance(
            scenes, of_row, states.packed, counts, workspace, STEP_S, CAP_S, rows, *ways, thread
        )

    with ThreadPoolExecutor(threads) as pool:
        for step in range(60):
            if step % 5 == 0:
                states.force[:, :2] = generator.choice([-5.08, 0.0, 5.08], (BALLS, 2))
            if step == 20:
                states.slab_velocity[:] = -0.8
            list(pool.map(part, range(threads)))
    return states, path


def test_packed_levels_and_threads_change_no_bit() -> None:
    of_row = np.arange(BALLS) % len(NAMES)
    whole, path = play(NAMES, of_row, 1)
    split, split_path = play(NAMES, of_row, 3)
    assert path.tobytes() == split_path.tobytes()
    for a, b in zip(whole, split, strict=True):
        assert a.tobytes() == b.tobytes()
    for number, name in enumerate(NAMES):
        alone, alone_path = play((name,), np.zeros(BALLS, dtype=np.int64), 1)
        mine = of_row == number
        assert path[mine].tobytes() == alone_path[mine].tobytes()
        assert whole.orientation[mine].tobytes() == alone.orientation[mine].tobytes()


def test_a_ball_that_waits_moves_only_for_what_is_left() -> None:
    world = World([floor()]).put((0.0, 0.0, 500.0))
    world.commands.delay[:] = 0.03
    world.step()
    assert world.states.position[0, 2] == pytest.approx(500.0 - 0.5 * GRAVITY * 0.02**2)
    assert world.states.delay[0] == 0.0
    assert world.path[0, 0, 2] == 500.0


def test_a_slab_goes_up_again_and_stops_where_it_began() -> None:
    plate = SolidBox((0.0, 0.0, -0.5), (2.0, 2.0, 0.5), slab=0)
    world = World([plate], slab_stop=[-0.1]).put((0.3, 0.0, RESTING_M))
    world.commands.slab_velocity[:] = -0.5
    world.run(0.5)
    assert world.states.slab[0, 0] == -0.1
    world.commands.slab_velocity[:] = 0.05
    world.run(3.0)
    assert world.states.slab[0, 0] == 0.0
    assert world.states.position[0, 2] == pytest.approx(RESTING_M, abs=2e-9)


def test_more_boxes_in_one_place_than_can_be_listed_are_refused() -> None:
    boxes = [SolidBox((0.0, 0.0, 0.0), (0.5, 0.5, 0.5))] * (MOST_NEAR + 1)
    with pytest.raises(ValueError, match=rf"levels\[0\]: found {MOST_NEAR + 1} solids"):
        pack([RigidLevel(boxes, RADIUS_M, GRAVITY)])


def test_a_box_of_a_slab_that_is_not_there_is_refused() -> None:
    box = SolidBox((0.0, 0.0, 0.0), (0.5, 0.5, 0.5), slab=1)
    with pytest.raises(ValueError, match="found slab 1 to 1; must be -1 to 0"):
        pack([RigidLevel([box], RADIUS_M, GRAVITY, slab_stop=[-1.0])])


def test_a_hundred_thousand_balls_take_less_than_a_gigabyte() -> None:
    scenes = pack([rigid_level("classic")[1]])
    count = 100_000
    arrays = [make_states(scenes, count).packed, *make_counts(count)]
    assert sum(array.nbytes for array in arrays) < 50e6


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e12])
def test_a_ball_out_of_all_bounds_ends_its_step_and_leaves_others_alone(bad: float) -> None:
    wall = SolidBox((3.0, 0.0, 0.0), (0.5, 50.0, 5.0))
    alone, beside = World([floor(), wall]), World([floor(), wall], 3)
    for world in (alone, beside):
        world.put((0.0, 0.0, RESTING_M), (4.0, 1.0, 0.0))
    beside.states.velocity[0] = bad
    beside.states.spin[2] = bad
    alone.run(1.0)
    beside.run(1.0)
    assert beside.states.position[1].tobytes() == alone.states.position[0].tobytes()
