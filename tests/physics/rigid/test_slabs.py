"""Slabs that move in any direction: what they carry, push and lift."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from roller_env.physics.rigid.scene import SolidBox, SolidHull
from tests.physics.rigid.test_hulls import measured
from tests.physics.rigid.world import FRICTION, GRAVITY, RADIUS_M, RESTING_M, World, floor

NANOMETRE = 1e-9


def platform(friction: float = FRICTION) -> SolidBox:
    """Return a slab whose upper face is at height 0."""
    return SolidBox((0.0, 0.0, -0.1), (9.0, 9.0, 0.1), friction=friction, slab=0)


def test_a_platform_that_sets_out_takes_the_ball_along_with_two_sevenths_of_its_speed() -> None:
    world = World([platform()], slab_stop=[-6.0], slab_along=[(-1.0, 0.0, 0.0)])
    world.put((0.0, 0.0, RESTING_M))
    world.states.slab_velocity[:] = -2.0
    world.run(1.5)
    # It slips until it rolls over the platform, which leaves under it with 5/7 of the speed.
    end, speed = 2.0 * 2.0 / (7.0 * FRICTION * GRAVITY), 2.0 / 7.0 * 2.0
    way = 0.5 * FRICTION * GRAVITY * end**2 + speed * (1.5 - end)
    assert world.states.velocity[0] == pytest.approx([speed, 0.0, 0.0], abs=NANOMETRE)
    assert world.states.position[0] == pytest.approx([way, 0.0, RESTING_M], abs=NANOMETRE)
    assert world.states.slab[0] == pytest.approx([-3.0])


def test_a_platform_that_turns_round_brings_the_ball_to_where_it_was() -> None:
    world = World([platform()], slab_stop=[-6.0], slab_along=[(0.0, 1.0, 0.0)])
    world.put((0.0, 0.0, RESTING_M))
    for speed in (-1.0, 1.0):
        world.states.slab_velocity[:] = speed
        world.run(1.0)
    assert world.states.slab[0] == pytest.approx([0.0], abs=1e-12)
    # What is left are the ways of the two slips.
    assert world.states.velocity[0] == pytest.approx([0.0, 2.0 / 7.0, 0.0], abs=NANOMETRE)


@pytest.mark.parametrize("along", [(0.0, 0.0, -1.0), (0.0, 0.6, -0.8), (0.6, 0.0, -0.8)])
def test_a_lift_lifts_the_ball(along: tuple[float, float, float]) -> None:
    world = World([platform(10.0)], slab_stop=[-5.0], slab_along=[along])
    world.put((0.0, 0.0, RESTING_M))
    world.states.slab_velocity[:] = -1.5
    world.run(1.0)
    height = -along[2] * 1.5
    assert world.states.position[0, 2] == pytest.approx(height + RESTING_M, abs=NANOMETRE)
    assert world.states.velocity[0, 2] == pytest.approx(height, abs=NANOMETRE)


def test_a_smooth_door_that_slides_pushes_the_ball_before_it() -> None:
    door = SolidBox((-2.0, 0.0, 1.0), (0.5, 3.0, 1.0), friction=0.0, slab=0)
    world = World([floor(), door], slab_stop=[-9.0], slab_along=[(-1.0, 0.0, 0.0)])
    world.put((0.0, 0.0, RESTING_M))
    world.states.slab_velocity[:] = -1.0
    world.run(3.0)
    assert world.states.position[0, 0] == pytest.approx(1.5 + RADIUS_M, abs=2.0 * NANOMETRE)
    assert world.states.velocity[0] == pytest.approx([1.0, 0.0, 0.0], abs=NANOMETRE)
    assert world.angular_velocity[0, 1] * RADIUS_M == pytest.approx(1.0, abs=NANOMETRE)


def test_a_door_that_presses_the_ball_on_a_wall_is_held_up() -> None:
    wall = SolidBox((3.0, 0.0, 1.0), (0.5, 9.0, 2.0))
    door = SolidBox((-1.0, 0.0, 1.0), (0.5, 9.0, 1.0), slab=0)
    world = World([floor(), wall, door], slab_stop=[-9.0], slab_along=[(-1.0, 0.0, 0.0)])
    world.put((1.0, 0.0, RESTING_M))
    world.states.slab_velocity[:] = -1.0
    world.run(6.0)
    assert world.states.slab[0, 0] == pytest.approx(-(2.5 - 2.0 * RADIUS_M + 0.5), abs=1e-8)
    assert world.depth()[0] < NANOMETRE
    assert world.counts.blocked[0] > 0
    assert np.linalg.norm(world.states.velocity[0]) < 1e-6


def test_a_hull_is_a_slab_as_well() -> None:
    angle = math.radians(30.0)
    rise = 4.0 * math.tan(angle)
    ends = [(-2.0, 0.0), (2.0, 0.0), (2.0, rise)]
    wedge = SolidHull([(x, y, z) for x, z in ends for y in (-2.0, 2.0)], friction=0.0, slab=0)
    world = World([floor(0.0), wedge], slab_stop=[-3.0], slab_along=[(1.0, 0.0, 0.0)]).put(
        (-3.0, 0.0, RESTING_M)
    )
    world.states.slab_velocity[:] = -1.0
    world.run(1.0)
    # Nothing rubs: the ball is thrown before the wedge and up, and is not in it.
    assert world.states.velocity[0, 0] < 0.0
    (((gap, *_),),) = measured(
        [replace(wedge, slab=-1)], world.states.position - [world.states.slab[0, 0], 0.0, 0.0]
    )
    assert gap >= RADIUS_M
