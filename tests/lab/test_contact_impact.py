"""Bouncing: the contact's own law, the rigid ball's, and how far elasticity can be believed."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from roller_env.lab.contact.impact import (
    BOUNCE,
    ELASTICITIES,
    RESTITUTION,
    falling_balls,
    returned_speed,
    rigid_bounce,
    soft_bounce,
)
from roller_env.lab.contact.scene import contact_of
from roller_env.lab.game import GRAVITY_M_S2
from roller_env.lab.methods import MUJOCO, MujocoMethod
from roller_env.lab.simulate import Path
from roller_env.physics.materials import IMPEDANCE, damping_ratio


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


def missed_share(integrator: str, part: float) -> float:
    """Return the impulse missing from a force that sets in after ``part`` of a step, of force * h.

    The Euler family sees it a step's rest too late, of which half a step is the same for all and
    makes up for holding it. RK4 gives it 5/6 of its step if two of its stages half way see it, else
    1/6.
    """
    if integrator != "RK4":
        return part - 0.5
    return part - 1.0 / 6.0 if part < 0.5 else part - 5.0 / 6.0


def touching_m_s2(speed_m_s: float) -> float:
    """Return how much a touch adds to the acceleration at once: B v, and d g instead of nothing."""
    return -BOUNCE.solref[1] * speed_m_s + IMPEDANCE * GRAVITY_M_S2


def furthest(integrator: str) -> tuple[float, float]:
    """Return the root mean square over all arrivals and the bound of a bounce's error, m/s.

    Of its height after 2 s, a second of step. The three impacts return e times what they miss, the
    later ones what the earlier gave too. A faster ball is higher in the last flight (it lasts
    ``up_s``) and comes later to it, while it still rises.
    """
    e, drop = BOUNCE.elasticity, fall_time(BOUNCE.height_m)
    angle = math.asin(damping_ratio(e))
    contact_s = (math.pi - 2.0 * angle) / (BOUNCE.frequency_rad_s * math.cos(angle))
    speeds = [GRAVITY_M_S2 * drop * e**impact for impact in range(4)]
    flights = 2.0 * (speeds[1] + speeds[2]) / GRAVITY_M_S2
    up_s = BOUNCE.horizon_s - drop - 3.0 * contact_s - flights
    rises = 2.0 / GRAVITY_M_S2 * (speeds[3] - GRAVITY_M_S2 * up_s)
    ways = (
        touching_m_s2(speeds[0]) * (e**3 * up_s - (e + e**2) * rises),
        touching_m_s2(speeds[1]) * (e**2 * up_s - e * rises),
        touching_m_s2(speeds[2]) * e * up_s,
    )
    parts = (np.arange(600) + 0.5) / 600
    missed = np.array([missed_share(integrator, float(part)) for part in parts])
    return (
        math.hypot(*ways) * float(missed.std()),
        sum(abs(way) for way in ways) * float(np.abs(missed).max()),
    )


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_an_impact_is_wrong_by_what_its_first_step_misses_of_the_damper(integrator: str) -> None:
    """So it depends on where in a step the ball touches the ground, with RK4 too.

    The last step misses K v h^2 / 2 at most: the push ends gently, having its slope only.
    """
    dt_s, speed = 2e-5, 4.0
    parts = (np.arange(30) + 0.5) / 30
    method = MujocoMethod(integrator)  # type: ignore[arg-type]
    contacts = [contact_of(0.0, BOUNCE.solref)] * len(parts)
    model = falling_balls(method, dt_s, contacts).compile()
    data = mujoco.MjData(model)
    data.qpos[:] = parts * dt_s * speed
    data.qvel[:] = -np.sqrt(speed**2 - 2.0 * GRAVITY_M_S2 * data.qpos)
    mujoco.mj_step(model, data, round(0.03 / dt_s))
    returned = np.sqrt(data.qvel**2 + 2.0 * GRAVITY_M_S2 * data.qpos)
    missed = np.array([missed_share(integrator, float(part)) for part in parts])
    expected = BOUNCE.elasticity * touching_m_s2(speed) * dt_s
    last_step = BOUNCE.solref[0] / BOUNCE.solref[1] * dt_s / 2.0
    np.testing.assert_allclose((returned - returned.mean()) / expected, -missed, atol=last_step)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_mujoco_approaches_its_contacts_own_law(integrator: str) -> None:
    """To first order, RK4 too: no method looks for the moment of the impact.

    One run's error over its step is anything up to the bound, since that moment falls anywhere in
    a step; only over many arrivals does it tell about the method. The contact's impedance changes
    which step has which luck (it moves the end by 0.02 mm), and not the errors of all: so two steps
    averaged 0.0008 with d = 0.99 and 0.0016 with d = 0.999. To the bound the Euler family's flights
    add at most g T/2.
    """
    method = MujocoMethod(integrator)  # type: ignore[arg-type]
    spread, bound = furthest(integrator)
    flights = 0.0 if integrator == "RK4" else GRAVITY_M_S2 * BOUNCE.horizon_s / 2.0
    for steps in (2000, 8000):
        arrivals = BOUNCE.horizon_s / np.arange(steps, steps + 24)
        errors = [BOUNCE.trial(method, float(dt_s)).errors()["position"] for dt_s in arrivals]
        slopes = np.array(errors) * BOUNCE.height_m / arrivals
        assert slopes.max() < bound + flights
        assert np.sqrt(np.mean(slopes**2)) == pytest.approx(spread, rel=0.25)


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
