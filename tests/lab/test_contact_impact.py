"""Bouncing: the contact's own law, the rigid ball's, and how far elasticity can be believed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roller_env.lab.contact.impact import (
    BOUNCE,
    ELASTICITIES,
    RESTITUTION,
    returned_speed,
    rigid_bounce,
    soft_bounce,
)
from roller_env.lab.contact.scene import GRAVITY_M_S2
from roller_env.lab.contact.trial import Path
from roller_env.lab.methods import MUJOCO, MujocoMethod
from roller_env.physics.materials import damping_ratio


def fall_time(height_m: float) -> float:
    return math.sqrt(2.0 * height_m / GRAVITY_M_S2)


def test_a_rigid_ball_falls_as_a_stone_and_comes_back_to_the_elasticitys_square() -> None:
    assert rigid_bounce(1.0, 0.8, 0.2) == pytest.approx(1.0 - 0.5 * GRAVITY_M_S2 * 0.04)
    once_up = (1.0 + 0.8) * fall_time(1.0)
    assert rigid_bounce(1.0, 0.8, once_up) == pytest.approx(0.64)
    twice_up = (1.0 + 2.0 * 0.8 + 0.64) * fall_time(1.0)
    assert rigid_bounce(1.0, 0.8, twice_up) == pytest.approx(0.8**4)
    assert rigid_bounce(1.0, 1.0, 6.0 * fall_time(1.0)) == pytest.approx(1.0)


@pytest.mark.parametrize("elasticity", [0.5, 0.8, 0.95])
def test_a_soft_contact_becomes_a_rigid_one_as_it_stiffens(elasticity: float) -> None:
    def away(frequency: float) -> float:
        solref = (-(frequency**2), -2.0 * damping_ratio(elasticity) * frequency)
        return abs(soft_bounce(1.0, solref, 1.0) - rigid_bounce(1.0, elasticity, 1.0))

    assert away(20_000.0) < 2e-3
    assert away(20_000.0) < away(2000.0) / 5.0


def test_a_soft_bounce_that_has_ended_is_refused() -> None:
    with pytest.raises(ValueError, match=r"found 60; the ball is at rest after \d"):
        soft_bounce(1.0, BOUNCE.solref, 60.0)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_mujoco_approaches_its_contacts_own_law(integrator: str) -> None:
    """To first order, RK4 too: no method looks for the moment of the impact.

    How far off one run is depends on where in a step the ball arrives, so several are averaged.
    """
    method = MujocoMethod(integrator)  # type: ignore[arg-type]
    steps = np.array([0.002, 0.0016, 0.00125, 0.001, 0.0008])
    coarse, fine = (
        np.mean([BOUNCE.trial(method, float(dt_s)).errors()["position"] for dt_s in some])
        for some in (steps, steps / 10.0)
    )
    assert fine < 2e-3
    assert coarse / 20.0 < fine < coarse / 5.0


def test_a_spring_throws_eulers_ball_above_the_drop_beyond_the_predicted_step() -> None:
    """h = 2 / frequency, 10 ms."""
    for dt_s, too_high in ((0.02, True), (0.005, False)):
        path = BOUNCE.trial(MujocoMethod("Euler"), dt_s).path
        after = path.qpos[path.time > fall_time(1.0), 0]
        assert (after.max() > 1.0) == too_high


@pytest.mark.parametrize("elasticity", [one for one in ELASTICITIES if one > 0.0])
def test_the_discrete_integrator_never_bounces_on_the_games_contact(elasticity: float) -> None:
    """It takes the contact's damper implicitly, and the game's contact is that damper alone."""
    errors = RESTITUTION.trial(MujocoMethod("discrete"), 0.001).errors()
    assert errors[f"e={elasticity:g}"] == pytest.approx(elasticity)


@pytest.mark.parametrize("method", MUJOCO, ids=lambda method: method.name)
@pytest.mark.parametrize("dt_s", [0.002, 5e-4])
def test_no_elasticity_is_no_bounce_with_any_method(method: MujocoMethod, dt_s: float) -> None:
    assert RESTITUTION.trial(method, dt_s).errors()["e=0"] < 0.015


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast", "RK4"])
def test_fast_impacts_give_back_the_levels_elasticity(integrator: str) -> None:
    """The calibration's own band, which `tests/physics/test_restitution.py` holds, is 0.02.

    Gravity's part in a contact of one step is g h / v, and RK4's contact lasts 24 steps.
    """
    steps = 24 if integrator == "RK4" else 1
    method = MujocoMethod(integrator)  # type: ignore[arg-type]
    gravity = steps * GRAVITY_M_S2 * 5e-4 / 2.0
    assert RESTITUTION.trial(method, 5e-4).errors()["fast"] < 0.02 + gravity


def test_slow_impacts_believe_it_the_better_the_smaller_the_step() -> None:
    errors = [RESTITUTION.trial(MujocoMethod("Euler"), dt).errors()["worst"] for dt in (2e-3, 2e-4)]
    assert errors[1] < errors[0] / 5.0


def test_the_returned_speed_is_that_at_the_ground() -> None:
    """One ball that comes back at 2 m/s, one that has not been down yet, one that stays."""
    time = np.linspace(0.0, 0.3, 4)
    up = 2.0 - GRAVITY_M_S2 * 0.1
    rise = 2.0 * 0.1 - 0.5 * GRAVITY_M_S2 * 0.01
    height = np.array([[0.1, 0.5, 0.1], [-0.01, 0.4, -0.1], [rise, 0.2, -0.05], [0.3, 0.1, -0.02]])
    velocity = np.array([[-2.0, -1.0, -1.0], [-1.0, -2.0, 0.1], [up, -3.0, 0.1], [0.0, -4.0, 0.1]])
    np.testing.assert_allclose(returned_speed(Path(time, height, velocity)), [2.0, 0.0, 0.0])
