"""The rigid engine against answers that are known in closed form, to a nanometre."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from roller_env.physics.rigid.scene import SolidBox
from tests.physics.rigid.world import (
    FRICTION,
    GRAVITY,
    RADIUS_M,
    RESTING_M,
    World,
    floor,
    slope,
)

NANOMETRE = 1e-9
KEY = 5.08
"""Of one key on the ball of 1 kg, m/s^2."""


def test_a_pushed_ball_rolls_with_five_sevenths_of_the_push() -> None:
    world = World([floor()]).put((0.0, 0.0, RESTING_M)).run(5.0, (KEY, 0.0, 0.0))
    assert world.states.position[0] == pytest.approx(
        [0.5 * KEY / 1.4 * 5.0**2, 0.0, RESTING_M], abs=NANOMETRE
    )
    assert world.angular_velocity[0, 1] * RADIUS_M == pytest.approx(KEY / 1.4 * 5.0)


@pytest.mark.parametrize("degrees", [5.0, 20.0, 40.0])
def test_a_ball_rolls_down_a_slope_or_slides_where_it_is_steep(degrees: float) -> None:
    angle = math.radians(degrees)
    normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
    world = World([slope(degrees)]).put(tuple(normal * RESTING_M)).run(2.0)
    rolls = 5.0 / 7.0 * GRAVITY * math.sin(angle)
    slides = GRAVITY * (math.sin(angle) - FRICTION * math.cos(angle))
    way = np.linalg.norm(world.states.position[0] - normal * RESTING_M)
    assert way == pytest.approx(0.5 * max(rolls, slides) * 2.0**2, abs=NANOMETRE)


def test_a_skidding_ball_rolls_after_two_sevenths_of_its_speed_over_friction() -> None:
    world = World([floor()]).put((0.0, 0.0, RESTING_M), (4.0, 0.0, 0.0)).run(2.0)
    end = 2.0 * 4.0 / (7.0 * FRICTION * GRAVITY)
    way = 4.0 * end - 0.5 * FRICTION * GRAVITY * end**2 + 5.0 / 7.0 * 4.0 * (2.0 - end)
    assert world.states.position[0, 0] == pytest.approx(way, abs=NANOMETRE)
    assert world.states.velocity[0, 0] == pytest.approx(5.0 / 7.0 * 4.0, abs=NANOMETRE)


def test_a_skid_across_a_push_turns_as_the_equations_say() -> None:
    world = World([floor()]).put((0.0, 0.0, RESTING_M), (4.0, 1.0, 0.0), (3.0, 1.0, 2.0))
    world.run(0.3, (0.0, KEY, 0.0))

    def rates(_: float, state: np.ndarray) -> list[float]:
        vx, vy, wx, wy = state[2:]
        slip = np.array([vx - RADIUS_M * wy, vy + RADIUS_M * wx])
        drag = -FRICTION * GRAVITY * slip / np.hypot(*slip)
        turn = 2.5 / RADIUS_M
        return [vx, vy, drag[0], KEY + drag[1], turn * drag[1], -turn * drag[0]]

    start = [0.0, 0.0, 4.0, 1.0, 3.0, 1.0]
    end = solve_ivp(rates, (0.0, 0.3), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert world.states.position[0, :2] == pytest.approx(end[:2], abs=1e-12)
    assert world.states.velocity[0, :2] == pytest.approx(end[2:4], abs=1e-12)
    assert world.angular_velocity[0] == pytest.approx([*end[4:], 2.0], abs=1e-11)


def test_a_plastic_ball_that_falls_46_metres_stays_on_the_ground() -> None:
    world = World([floor()]).put((0.0, 0.0, RESTING_M + 46.0), (1.0, 0.0, 0.0)).run(6.0)
    fall = math.sqrt(2.0 * 46.0 / GRAVITY)
    # It rolls on with 5/7 of its speed: the impact has friction enough to stop the slip at once.
    x = fall + 5.0 / 7.0 * (6.0 - fall)
    assert world.states.position[0] == pytest.approx([x, 0.0, RESTING_M], abs=2.0 * NANOMETRE)
    assert world.counts.forced[0] == world.counts.unsolved[0] == 0


@pytest.mark.parametrize("elasticity", [0.2, 0.5, 0.8, 0.95])
def test_a_ball_bounces_back_with_the_elasticity_of_its_speed(elasticity: float) -> None:
    world = World([floor(elasticity=elasticity)]).put((0.0, 0.0, RADIUS_M + 1.0)).run(2.0)
    time, speed = math.sqrt(2.0 / GRAVITY), math.sqrt(2.0 * GRAVITY) * elasticity
    while time + 2.0 * speed / GRAVITY < 2.0 and speed > 1e-3:
        time, speed = time + 2.0 * speed / GRAVITY, speed * elasticity
    left = 2.0 - time
    height = max(speed * left - 0.5 * GRAVITY * left**2, 0.0) if speed > 1e-3 else 0.0
    assert world.states.position[0, 2] - RADIUS_M == pytest.approx(height, abs=3.0 * NANOMETRE)


def test_an_elastic_ball_thrown_at_45_degrees_leaves_rolling() -> None:
    # Coulomb's friction with tangential restitution 0: the impulse is enough to end the slip.
    world = World([floor(elasticity=0.8)]).put((0.0, 0.0, RADIUS_M + 1e-3), (4.0, 0.0, -4.0))
    world.step()
    assert world.states.velocity[0, 0] == pytest.approx(20.0 / 7.0, abs=1e-12)
    assert world.angular_velocity[0, 1] * RADIUS_M == pytest.approx(20.0 / 7.0, abs=1e-12)


def test_a_plastic_ball_thrown_flat_onto_the_ground_does_not_rise() -> None:
    world = World([floor()]).put((0.0, 0.0, RADIUS_M + 1e-3), (8.0, 0.0, -2.0)).run(1.0)
    assert world.way()[:, 2].max() == pytest.approx(RESTING_M, abs=NANOMETRE)


@pytest.mark.parametrize("friction", [0.3, 3.0])
def test_a_ball_pressed_into_a_wall_rolls_along_it_on_both(friction: float) -> None:
    wall = SolidBox((0.0, 1.0 + RADIUS_M, 0.0), (500.0, 1.0, 5.0), friction=friction)
    world = World([floor(friction=friction), wall]).put((0.0, 0.0, RESTING_M))
    world.run(1.0, (KEY, KEY, 0.0))
    assert world.states.position[0, 0] == pytest.approx(0.5 * KEY / 1.8, abs=NANOMETRE)


def test_a_ball_that_rolls_into_a_wall_climbs_it_with_two_sevenths_of_its_speed() -> None:
    wall = SolidBox((5.0, 0.0, 0.0), (1.0, 500.0, 5.0))
    world = World([floor(), wall])
    world.put((0.0, 0.0, RESTING_M), (4.0, 0.0, 0.0), (0.0, 4.0 / RADIUS_M, 0.0))
    highest = 0.0
    for _ in range(40):
        world.step()
        highest = max(highest, world.way(points=1001)[:, 2].max() - RADIUS_M)
    speed = 2.0 / 7.0 * 4.0
    # The path is looked at every 50 us: it misses the top by up to g dt^2 / 8.
    assert highest == pytest.approx(speed**2 / (2.0 * GRAVITY), abs=4e-9)


def test_a_light_ball_that_a_key_makes_slip_stays_on_the_ground() -> None:
    # 50.8 m/s^2 is a key on 0.1 kg.
    world = World([floor()]).put((0.0, 0.0, RESTING_M))
    for _ in range(60):
        world.run(0.05, (10.0 * KEY, 0.0, 0.0))
        assert world.way()[:, 2].max() < RESTING_M + NANOMETRE
