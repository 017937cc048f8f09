"""Where engines fail: seams, thin walls, edges, corners, slabs that close, many boxes at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roller_env.physics.rigid.scene import SolidBox
from tests.physics.rigid.world import GRAVITY, RADIUS_M, RESTING_M, World, floor

NANOMETRE = 1e-9


@pytest.mark.parametrize("speed", [1.0, 5.0, 20.0])
def test_a_ball_does_not_feel_the_seams_of_a_floor_of_tiles(speed: float) -> None:
    tiles = [
        SolidBox((x + 0.5, y + 0.5, -0.2), (0.5, 0.5, 0.2)) for x in range(-2, 30) for y in (-1, 0)
    ]
    spin = (0.0, speed / RADIUS_M, 0.0)
    world = World(tiles).put((0.0, 0.013, RESTING_M), (speed, 0.0, 0.0), spin).run(1.0)
    assert world.way()[:, 2] == pytest.approx(RESTING_M, abs=NANOMETRE)
    assert world.states.velocity[0] == pytest.approx([speed, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("speed", [20.0, 200.0, 1000.0])
def test_nothing_goes_through_a_millimetre_of_wall(speed: float) -> None:
    wall = SolidBox((10.0, 0.0, 0.0), (0.0005, 500.0, 500.0))
    world = World([wall]).put((0.0, 0.0, 0.0), (speed, 0.0, 0.0)).run(0.6)
    assert world.states.position[0, 0] <= 10.0 - 0.0005 - RADIUS_M


@pytest.mark.parametrize("y", [0.0, 0.1, 0.35])
def test_a_ball_that_falls_46_metres_onto_an_edge_is_not_in_it(y: float) -> None:
    box = SolidBox((0.0, -5.0, -1.0), (3.0, 5.0, 1.0))
    world = World([box]).put((0.0, y, RADIUS_M + 46.0))
    for _ in range(70):
        before = world.energy()
        world.step()
        assert world.depth()[0] < 1e-7
        assert world.energy()[0] - before[0] < 1e-7


def test_a_ball_at_rest_in_a_corner_of_three_stays() -> None:
    walls = [
        SolidBox((1.0 + RADIUS_M, 0.0, 0.0), (1.0, 5.0, 5.0)),
        SolidBox((0.0, 1.0 + RADIUS_M, 0.0), (5.0, 1.0, 5.0)),
    ]
    world = World([floor(), *walls]).put((0.0, 0.0, RESTING_M)).run(1.0, (5.08, 5.08, 0.0))
    assert world.states.position[0] == pytest.approx([0.0, 0.0, RADIUS_M], abs=2.0 * NANOMETRE)
    assert np.abs(world.states.velocity).max() < 1e-9


def test_a_plate_carries_the_ball_down_and_stops_with_it() -> None:
    plate = SolidBox((0.0, 0.0, -0.5), (2.0, 2.0, 0.5), slab=0)
    world = World([plate], slab_stop=[-0.1]).put((0.3, 0.0, RESTING_M))
    world.commands.slab_velocity[:] = -0.0406
    world.run(4.0)
    assert world.states.slab[0, 0] == -0.1
    assert world.states.position[0] == pytest.approx([0.3, 0.0, RESTING_M - 0.1], abs=2 * NANOMETRE)


def test_a_gate_that_comes_down_on_the_ball_is_held_up_by_it() -> None:
    gate = SolidBox((0.0, 0.0, 2.0), (1.0, 1.0, 1.0), slab=0)
    world = World([floor(), gate], slab_stop=[-1.0]).put((0.2, 0.1, RESTING_M))
    world.commands.slab_velocity[:] = -0.8
    world.run(2.0)
    assert world.states.slab[0, 0] == pytest.approx(2.0 * RADIUS_M - 1.0, abs=1e-6)
    assert world.depth()[0] < 1e-7
    assert world.counts.blocked[0] > 0


@pytest.mark.parametrize("beside", [0.0, 5e-6, 1.2e-5])
def test_a_ball_hits_a_wall_and_a_gate_that_sinks_in_its_plane_as_one(beside: float) -> None:
    """It touches the gate's face and the wall's edge, whose normals are next to the same."""
    wall = SolidBox((1.0 + RADIUS_M, -5.0, 2.0), (1.0, 5.0, 5.0))
    gate = SolidBox((1.0 + RADIUS_M, 5.0, 2.0), (1.0, 5.0, 5.0), slab=0)
    world = World([floor(), wall, gate], slab_stop=[-4.0])
    world.put((-0.5e-9, beside, RESTING_M), (0.983, 0.079, 0.0), (-0.196, 2.42, -0.45))
    world.states.slab_velocity[:] = -0.8
    world.run(0.05, (5.08, -5.08, 0.0))
    assert world.states.slab[0, 0] == pytest.approx(-0.04, abs=1e-12)
    assert world.states.velocity[0, 0] == pytest.approx(0.0, abs=1e-12)
    assert world.counts.unsolved.sum() == world.counts.blocked.sum() == 0


def test_a_ball_that_falls_into_a_wedge_that_jams_does_not_bounce_out_of_it() -> None:
    """One side is elastic, the other is not, and friction holds the ball between them."""
    normals = np.array([[0.5614, -0.8043, 0.195], [-0.0152, 0.5835, 0.812]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sides = []
    for n, elasticity in zip(normals, (0.5, 0.0), strict=True):
        rotation = Rotation.align_vectors([n], [[0.0, 0.0, 1.0]])[0].as_matrix()
        middle = -(RADIUS_M + 1.0 + 1e-9) * n
        sides.append(SolidBox(tuple(middle), (9.0, 9.0, 1.0), rotation.tolist(), 0.944, elasticity))
    world = World(sides).put((0.0, 0.0, 0.0), (1.1, 1.07, -0.75), (-3.2, 3.2, -0.2))
    before = world.energy()[0]
    world.run(0.05)
    assert world.counts.unsolved.sum() == 0
    assert world.depth().max() < 1e-8
    assert world.energy()[0] <= before + 1e-9


def test_balls_among_many_turned_boxes_stay_outside_and_gain_no_energy() -> None:
    generator = np.random.default_rng(3)
    boxes = [
        SolidBox(
            tuple(generator.uniform(-2.5, 2.5, 3)),
            tuple(generator.uniform(0.1, 0.8, 3)),
            Rotation.random(random_state=generator).as_matrix().tolist(),
        )
        for _ in range(60)
    ]
    world = World([*boxes, SolidBox((0.0, 0.0, -5.0), (9.0, 9.0, 0.5))], 32)
    world.states.position[:] = [0.0, 0.0, 5.0]
    world.states.position[:, :2] += generator.uniform(-2.5, 2.5, (32, 2))
    for _ in range(60):
        before = world.energy()
        world.step()
        assert world.depth().max() < 1e-6
        assert (world.energy() - before).max() < 1e-7
    assert world.counts.forced.sum() == 0


def test_the_bits_are_the_same_for_any_split_of_the_balls() -> None:
    generator = np.random.default_rng(5)
    wall = SolidBox((3.0, 0.0, 0.0), (0.5, 50.0, 0.4))
    starts = generator.uniform([-1.0, -1.0, 0.6], [1.0, 1.0, 2.0], (6, 3))
    speeds = generator.normal(0.0, 4.0, (6, 3))
    whole = World([floor(elasticity=0.5), wall], 6)
    whole.states.position[:], whole.states.velocity[:] = starts, speeds
    whole.run(2.0, (3.0, 1.0, 0.0))
    for ball in range(6):
        alone = World([floor(elasticity=0.5), wall])
        alone.put(tuple(starts[ball]), tuple(speeds[ball])).run(2.0, (3.0, 1.0, 0.0))
        assert alone.states.position[0].tobytes() == whole.states.position[ball].tobytes()
        assert alone.states.orientation[0].tobytes() == whole.states.orientation[ball].tobytes()


def test_a_falling_ball_turns_about_its_axis_by_its_speed() -> None:
    world = World([floor()]).put((0.0, 0.0, 500.0), angular_velocity=(0.0, 0.0, 3.0)).run(1.0)
    assert world.states.orientation[0] == pytest.approx(
        [math.cos(1.5), 0.0, 0.0, math.sin(1.5)], abs=1e-12
    )
    assert world.states.position[0, 2] == pytest.approx(500.0 - 0.5 * GRAVITY)
