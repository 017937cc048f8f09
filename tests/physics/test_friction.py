"""Pushing, rolling and sliding, against the closed forms of a rigid ball.

An Euler-family integrator puts a body that is pushed evenly from rest ahead by h/T of the way, h
being the time step and T the time; what the closed forms are met to beyond that is the contact's.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from roller_env.game.actions import KEY_FORCE_N
from roller_env.physics.presets import PRESETS
from tests.builders import BALL_RADIUS_M, GRAVITY, GROUND, World, make_level, make_world

SLIP = 5e-4
"""Share of the way that the soft contact may lose or gain."""

FRICTION = 0.3

presets = pytest.mark.parametrize("physics", PRESETS)


def lead_of_euler(world: World, seconds: float) -> float:
    """Return the share by which the integrator puts an evenly pushed ball ahead."""
    return 0.0 if world.compiled.preset.integrator == "RK4" else world.dt_s / seconds


@presets
@pytest.mark.parametrize(("keys", "force"), [((1, 0), 1.0), ((0, -1), 1.0), ((1, 1), math.sqrt(2))])
def test_a_pushed_ball_rolls_with_five_sevenths_of_a_sliding_ones_acceleration(
    physics: str, keys: tuple[int, int], force: float
) -> None:
    world = make_world(make_level(), seconds=2.0, physics=physics)
    world.force[0, :2] = KEY_FORCE_N * np.array(keys)
    way = np.linalg.norm(world.path()[0, -1, :2])
    expected = 0.5 * force * KEY_FORCE_N / 1.4 * 2.0**2
    assert way / expected - 1.0 == pytest.approx(lead_of_euler(world, 2.0), abs=SLIP)


@presets
@pytest.mark.parametrize("slope_deg", [5.0, 25.0])
def test_a_ball_rolls_down_a_slope_at_five_sevenths_of_gravitys_share(
    physics: str, slope_deg: float
) -> None:
    slope = math.radians(slope_deg)
    normal = np.array([math.sin(slope), 0.0, math.cos(slope)])
    board = GROUND | {"at": tuple(-2.0 * normal), "pitch_deg": slope_deg}
    start = {"at": tuple(BALL_RADIUS_M * normal)}
    level = make_level(boxes=[board], start=start, kill_height=-500.0)
    world = make_world(level, seconds=2.0, physics=physics)
    path = world.path()[0]
    way = np.linalg.norm(path[-1] - path[0])
    expected = 0.5 * 5.0 / 7.0 * GRAVITY * math.sin(slope) * 2.0**2
    assert way / expected - 1.0 == pytest.approx(lead_of_euler(world, 2.0), abs=SLIP)


@presets
def test_a_rolling_ball_does_not_slip(physics: str) -> None:
    world = make_world(make_level(), seconds=1.0, physics=physics)
    world.force[0, 0] = KEY_FORCE_N
    world.path()
    rim_speed = BALL_RADIUS_M * float(np.linalg.norm(world.spin[0]))
    assert rim_speed == pytest.approx(world.velocity[0, 0], rel=2e-3)


@presets
def test_a_rolling_ball_goes_on_rolling(physics: str) -> None:
    """There is no rolling resistance and no damping."""
    world = make_world(make_level(), seconds=2.0, physics=physics)
    world.path()
    world.velocity[0, 0] = 5.0
    world.spin[0, 1] = 5.0 / BALL_RADIUS_M
    world.path()
    assert world.velocity[0, 0] == pytest.approx(5.0, rel=1e-3)


@presets
def test_a_skidding_ball_rolls_at_five_sevenths_of_its_speed_in_due_time(physics: str) -> None:
    """At every heading: the elliptic cone prefers no direction."""
    headings = np.radians([0.0, 22.5, 45.0])
    world = make_world(make_level(), seconds=1.0, count=3, physics=physics)
    world.path()
    world.velocity[:, 0] = 3.0 * np.cos(headings)
    world.velocity[:, 1] = 3.0 * np.sin(headings)
    speed, rolls_after = skid(world, 3.0)
    heading = np.arctan2(world.velocity[:, 1], world.velocity[:, 0])
    np.testing.assert_allclose(speed, 5.0 / 7.0 * 3.0, rtol=2e-3)
    np.testing.assert_allclose(rolls_after, 2.0 * 3.0 / (7.0 * FRICTION * GRAVITY), rtol=0.05)
    assert np.degrees(np.abs(heading - headings)).max() < 0.1


@presets
@pytest.mark.parametrize("factor", [0.05, 0.2, 1.0, 2.0])
def test_the_friction_measured_is_the_balls_times_the_materials(
    physics: str, factor: float
) -> None:
    """Measured on the skid, which takes 2/7 of the speed at mu g.

    MuJoCo's cone lets a sliding ball hop (see the next test), so the skid ends with
    one of a few touches and not quite when it should.
    """
    ground = GROUND | {"material": "surface"}
    level = make_level(materials={"surface": {"friction": factor}}, boxes=[ground])
    world = make_world(level, seconds=1.0 / factor, physics=physics)
    world.path()
    world.velocity[0, 0] = 4.0
    _, rolls_after = skid(world, 4.0)
    measured = 2.0 / 7.0 * 4.0 / (GRAVITY * rolls_after[0])
    assert measured == pytest.approx(FRICTION * factor, rel=0.08)


@presets
def test_a_skidding_ball_hops_less_than_mu_times_its_slip(physics: str) -> None:
    """MuJoCo's friction cone is convex: what brakes a sliding ball also lifts it, by at most mu v.

    The mean friction is right nevertheless, because between the hops there is none.
    """
    world = make_world(make_level(), seconds=1.0, physics=physics)
    world.path()
    world.velocity[0, 0] = 4.0
    height = world.path()[0, :, 2].max() - BALL_RADIUS_M
    assert height < (FRICTION * 4.0) ** 2 / (2.0 * GRAVITY)


def skid(world: World, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the balls' speeds at the end, and when they first were within 0.5 % of 5/7."""
    path = world.path()[:, :, :2]
    speeds = np.linalg.norm(np.diff(path, axis=1), axis=2) / world.dt_s
    rolls = speeds <= 5.0 / 7.0 * speed * 1.005
    return speeds[:, -1], rolls.argmax(axis=1) * world.dt_s


def test_a_surface_without_friction_never_turns_the_ball() -> None:
    ground = GROUND | {"material": "nothing"}
    level = make_level(materials={"nothing": {"friction": 0.0}}, boxes=[ground])
    world = make_world(level, seconds=2.0)
    world.path()
    world.velocity[0, 0] = 4.0
    world.path()
    assert world.velocity[0, 0] == pytest.approx(4.0, rel=1e-3)
    assert np.linalg.norm(world.spin[0]) * BALL_RADIUS_M < 0.01


@presets
@pytest.mark.parametrize(("share", "slips"), [(0.95, False), (1.05, True)])
@pytest.mark.parametrize("heading_deg", [0.0, 45.0])
def test_a_ball_slips_only_if_pushed_with_more_than_seven_halves_of_friction(
    physics: str, share: float, slips: bool, heading_deg: float
) -> None:
    """Rolling takes 2/7 of the push as friction, so mu m g is used up at F = 3.5 mu m g."""
    world = make_world(make_level(), seconds=1.0, physics=physics)
    world.path()
    push = share * 3.5 * FRICTION * GRAVITY
    heading = math.radians(heading_deg)
    world.force[0, :2] = push * math.cos(heading), push * math.sin(heading)
    world.path()
    speed = np.linalg.norm(world.velocity[0])
    slip = speed - BALL_RADIUS_M * np.linalg.norm(world.spin[0])
    if slips:
        # m v' = F - mu m g and (2/5) m r w' = mu m g, so the slip grows by F - 3.5 mu m g.
        assert slip == pytest.approx(push - 3.5 * FRICTION * GRAVITY, rel=0.35)
    else:
        assert abs(slip) < 2e-3 * speed


@presets
@pytest.mark.parametrize(("slope_deg", "holds"), [(26.5, True), (28.0, False)])
def test_one_key_holds_the_ball_on_slopes_up_to_27_degrees(
    physics: str, slope_deg: float, holds: bool
) -> None:
    """A key pushes level, so up a slope it pushes with F cos(slope): tan(slope) = F / (m g)."""
    slope = math.radians(slope_deg)
    normal = np.array([math.sin(slope), 0.0, math.cos(slope)])
    board = GROUND | {"at": tuple(-2.0 * normal), "pitch_deg": slope_deg}
    level = make_level(
        boxes=[board], start={"at": tuple(BALL_RADIUS_M * normal)}, kill_height=-500.0
    )
    world = make_world(level, seconds=1.0, physics=physics)
    world.force[0, 0] = -KEY_FORCE_N
    path = world.path()[0]
    downhill = path[-1, 0] - path[0, 0]
    assert (downhill < 0.0) == holds


@presets
def test_a_ball_left_alone_stays_where_it_is(physics: str) -> None:
    world = make_world(make_level(), seconds=2.0, physics=physics)
    path = world.path()[0]
    assert np.abs(path[-1, :2]).max() < 1e-9
    assert np.linalg.norm(world.velocity[0]) < 1e-3
    assert np.linalg.norm(world.spin[0]) < 1e-6
