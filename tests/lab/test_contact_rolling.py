"""Rolling and skidding: closed forms, and what soft contacts and pyramidal cones make of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roller_env.lab.contact.rolling import (
    INCLINE,
    PUSH,
    ROLLS_BELOW,
    SKIDS,
    SOFT_SOLREF,
    SOFT_TIME_CONSTANT_S,
    Skid,
    SteadyRoll,
    roll_time,
    slip_speed,
)
from roller_env.lab.contact.scene import resting_depth
from roller_env.lab.game import FRICTION, GRAVITY_M_S2, RADIUS_M
from roller_env.lab.methods import MUJOCO, PYRAMIDAL, MujocoMethod
from roller_env.lab.simulate import Path

RK4 = MujocoMethod("RK4")
EULER_FAMILY = tuple(method for method in MUJOCO if method != RK4)
STRAIGHT, BETWEEN, ACROSS = SKIDS

steady = pytest.mark.parametrize("scene", [INCLINE, PUSH], ids=lambda scene: scene.name)


def test_the_closed_forms_are_those_of_a_rolling_ball() -> None:
    assert INCLINE.acceleration_m_s2 == pytest.approx(5 / 7 * 9.8044 * math.sin(math.radians(20)))
    assert PUSH.acceleration_m_s2 == pytest.approx(5.08 / 1.4)
    assert STRAIGHT.rolls_after_s == pytest.approx(0.2914, abs=1e-4)


@steady
@pytest.mark.parametrize("method", EULER_FAMILY, ids=lambda method: method.name)
@pytest.mark.parametrize("dt_s", [0.02, 1 / 60, 0.005])
def test_the_euler_family_is_ahead_by_h_over_t(
    scene: SteadyRoll, method: MujocoMethod, dt_s: float
) -> None:
    """Exactly, but for ``discrete``: implicit friction creeps into its start a little later."""
    errors = scene.trial(method, dt_s).errors()
    exactness = 1e-4 if method.integrator == "discrete" else 1e-6
    assert errors["position"] == pytest.approx(dt_s / scene.horizon_s, rel=exactness)


@steady
@pytest.mark.parametrize("dt_s", [0.02, 0.005])
def test_rk4_rolls_with_no_error_of_its_own(scene: SteadyRoll, dt_s: float) -> None:
    assert scene.trial(RK4, dt_s).errors()["position"] < 1e-12


@steady
def test_what_rk4_keeps_is_the_shorter_lever_of_a_ball_that_sinks_in(scene: SteadyRoll) -> None:
    """a = F / (m + I / (r - depth / 2)^2): MuJoCo puts the contact half way into the overlap.

    The creep of the soft friction is the rest, 2 % of it.
    """
    pull = GRAVITY_M_S2 * math.cos(math.radians(scene.slope_deg))
    depth = resting_depth(SOFT_SOLREF, pull)
    lever = RADIUS_M - depth / 2.0
    slower = 1.0 - 1.4 / (1.0 + 0.4 * (RADIUS_M / lever) ** 2)
    assert scene.trial(RK4, 0.01).errors()["acceleration"] == pytest.approx(slower, rel=0.03)


@steady
def test_a_rolling_ball_keeps_the_depth_that_the_contact_law_predicts(scene: SteadyRoll) -> None:
    path = scene.trial(RK4, 0.01).path
    angle = math.radians(scene.slope_deg)
    height = path.qpos[:, :3] @ np.array([math.sin(angle), 0.0, math.cos(angle)])
    np.testing.assert_allclose(height, height[0], atol=1e-12)


def test_the_soft_contact_throws_the_ball_up_beyond_the_predicted_step() -> None:
    """Euler's limit for damping B = 2 / tau is h = 2 / B = tau; ``discrete`` has none."""
    assert SOFT_TIME_CONSTANT_S < 0.05
    assert np.ptp(PUSH.trial(MujocoMethod("Euler"), 0.02).path.qpos[:, 2]) < 1e-12
    assert np.ptp(PUSH.trial(MujocoMethod("Euler"), 0.05).path.qpos[:, 2]) > 0.1
    assert np.ptp(PUSH.trial(MujocoMethod("discrete"), 0.05).path.qpos[:, 2]) < 1e-9


def shorter_lever(path: Path) -> float:
    """Return what friction loses of the spin it gives: MuJoCo puts the contact half way in."""
    depth = RADIUS_M - path.qpos[:, 2].min()
    return float(5.0 / 7.0 * depth / (2.0 * RADIUS_M))


def hop_at_the_end(path: Path) -> float:
    """Return the seconds by which a skid ends early or late for the ball's going up or down."""
    slip = slip_speed(path)
    rolls = int((slip <= ROLLS_BELOW * slip[0]).argmax())
    up = float(np.abs(path.qvel[rolls - 1 : rolls + 1, 2]).max())
    return up / GRAVITY_M_S2 / (1.0 - ROLLS_BELOW)


@pytest.mark.parametrize("method", MUJOCO, ids=lambda method: method.name)
@pytest.mark.parametrize("skid", SKIDS, ids=lambda skid: skid.name)
def test_friction_takes_its_share_of_all_that_the_ground_carries(
    skid: Skid, method: MujocoMethod
) -> None:
    """The ground carries the ball's weight and its hops: slip = v0 - 7/2 mu (g t + v_z)."""
    path = skid.trial(method, 0.001).path
    slip = slip_speed(path)
    carried = GRAVITY_M_S2 * path.time + path.qvel[:, 2]
    expected = skid.speed_m_s - 3.5 * FRICTION * carried
    skids = slip > ROLLS_BELOW * slip[0]
    assert skids.sum() > 250, "of 291 steps"
    slack = skid.speed_m_s * shorter_lever(path)
    np.testing.assert_allclose(slip[skids], expected[skids], atol=slack)


@pytest.mark.parametrize("method", MUJOCO, ids=lambda method: method.name)
@pytest.mark.parametrize("skid", SKIDS, ids=lambda skid: skid.name)
def test_the_elliptic_cone_lets_a_skid_last_as_long_at_every_heading(
    skid: Skid, method: MujocoMethod
) -> None:
    """To the hop with which it ends, of 9 mm/s at most with this step."""
    trial = skid.trial(method, 0.001)
    errors, path = trial.errors(), trial.path
    assert errors["roll_time"] < shorter_lever(path) + hop_at_the_end(path) / skid.rolls_after_s
    assert errors["heading"] < 1e-6


@pytest.mark.parametrize("method", PYRAMIDAL, ids=lambda method: method.name)
def test_the_pyramidal_cone_has_less_friction_across_its_edges(method: MujocoMethod) -> None:
    for skid, longer in ((STRAIGHT, 1.0), (ACROSS, math.sqrt(2.0))):
        trial = skid.trial(method, 0.001)
        errors, path = trial.errors(), trial.path
        slack = longer * shorter_lever(path) + hop_at_the_end(path) / skid.rolls_after_s
        assert errors["roll_time"] == pytest.approx(longer - 1.0, abs=slack)
        assert errors["heading"] < 1e-6, "by symmetry"


@pytest.mark.parametrize("method", PYRAMIDAL, ids=lambda method: method.name)
def test_the_pyramidal_cone_bends_the_heading_between_its_edges(method: MujocoMethod) -> None:
    errors = BETWEEN.trial(method, 0.001).errors()
    assert errors["heading"] > 3.0
    assert errors["place"] > 0.03


@pytest.mark.parametrize("method", [RK4, *PYRAMIDAL], ids=lambda method: method.name)
def test_a_skid_ends_at_five_sevenths_of_the_throw_with_any_cone(method: MujocoMethod) -> None:
    """Friction leaves the angular momentum about a point of the ground alone."""
    skid = BETWEEN
    final = skid.trial(method, 0.001).path.qvel[-1, :2]
    np.testing.assert_allclose(final, 5 / 7 * skid.speed_m_s * skid.direction, rtol=5e-4)


@pytest.mark.parametrize("method", EULER_FAMILY, ids=lambda method: method.name)
def test_a_skid_is_of_first_order_with_the_euler_family(method: MujocoMethod) -> None:
    steps = np.array([0.002, 0.001, 5e-4, 2e-4])
    errors = [ACROSS.trial(method, dt_s).errors()["position"] for dt_s in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.15)


def test_a_ball_that_never_rolls_has_no_time_to_roll() -> None:
    skid = STRAIGHT
    path = skid.trial(RK4, 0.01).path
    early = type(path)(path.time[:20], path.qpos[:20], path.qvel[:20])
    assert path.time[19] < skid.rolls_after_s
    assert roll_time(early) == math.inf
