"""How much of an impact's speed comes back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.level import Level
from roller_env.physics.materials import damping_ratio, restitution
from roller_env.physics.presets import PRESETS
from tests.builders import (
    BALL_RADIUS_M,
    GROUND,
    WEIGHTLESS,
    Float64,
    World,
    make_level,
    make_world,
)

SPEEDS_M_S = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
ARRIVALS = np.linspace(0.01, 0.99, 8)
"""Shares of a time step after which the ball touches the ground."""

presets = pytest.mark.parametrize("physics", PRESETS)
elasticities = pytest.mark.parametrize("elasticity", [0.0, 0.2, 0.5, 0.8, 0.95])


@presets
@elasticities
def test_an_impact_gives_back_the_elasticity_at_every_speed(
    physics: str, elasticity: float
) -> None:
    """In gravity's absence, which over the contact would take its own part of slow impacts."""
    level = make_level(ball={"elasticity": elasticity}, gravity=WEIGHTLESS)
    speeds, arrivals = (a.ravel() for a in np.meshgrid(SPEEDS_M_S, ARRIVALS))
    world = make_world(level, seconds=0.6, count=len(speeds), physics=physics)
    world.position[:, 2] = BALL_RADIUS_M + speeds * world.dt_s * arrivals
    world.velocity[:, 2] = -speeds
    height = world.path()[:, :, 2]
    returned = np.diff(height, axis=1).max(axis=1) / world.dt_s / speeds
    np.testing.assert_allclose(returned, elasticity, atol=0.02)


@presets
@pytest.mark.parametrize("elasticity", [0.2, 0.5, 0.8, 0.95])
def test_a_dropped_ball_comes_back_to_the_elasticitys_square_of_the_height(
    physics: str, elasticity: float
) -> None:
    level = make_level(ball={"elasticity": elasticity}, start={"at": (0.0, 0.0, 6.0)})
    world = dropped(level, 5.0 + 0.15 * ARRIVALS, physics, seconds=3.0)
    height = world.path()[:, :, 2] - BALL_RADIUS_M
    first = (height < 0.0).argmax(axis=1)
    apex = np.array([row[index:].max() for row, index in zip(height, first, strict=True)])
    returned = np.sqrt(np.maximum(apex, 0.0) / height[:, 0])
    np.testing.assert_allclose(returned, elasticity, atol=0.03)


@presets
def test_a_ball_without_elasticity_does_not_bounce(physics: str) -> None:
    level = make_level(start={"at": (0.0, 0.0, 6.0)})
    world = dropped(level, 5.0 + 0.15 * ARRIVALS, physics, seconds=3.0)
    height = world.path()[:, :, 2] - BALL_RADIUS_M
    first = (height < 0.0).argmax(axis=1)
    assert all(row[index:].max() < 0.0 for row, index in zip(height, first, strict=True))


def test_the_elasticity_of_a_contact_is_the_balls_times_the_materials() -> None:
    rubber = GROUND | {"material": "rubber"}
    level = make_level(
        ball={"elasticity": 0.8},
        materials={"rubber": {"elasticity": 0.5}},
        boxes=[rubber],
        gravity=WEIGHTLESS,
    )
    world = make_world(level, seconds=0.6)
    world.position[0, 2] += 0.1
    world.velocity[0, 2] = -5.0
    world.path()
    assert world.velocity[0, 2] / 5.0 == pytest.approx(0.4, abs=0.02)


@presets
@pytest.mark.parametrize("elasticity", [0.0, 0.2, 0.5, 0.8])
def test_a_ball_that_fell_from_the_tubes_top_does_not_pass_a_16_quant_deck(
    physics: str, elasticity: float
) -> None:
    deck = {"at": (0.0, 0.0, -0.2032), "size": (20.0, 20.0, 0.4064)}
    start = {"at": (0.0, 0.0, 48.0)}
    level = make_level(
        ball={"elasticity": elasticity}, boxes=[deck], start=start, kill_height=-100.0
    )
    heights = 46.9 + 0.3 * ARRIVALS
    world = dropped(level, heights, physics, seconds=4.0)
    path = world.path()
    assert path[:, :, 2].min() > -0.2032, "the ball's centre never got half way through"
    assert (path[:, -1, 2] > BALL_RADIUS_M - 0.1).all(), "and it comes out again"


@presets
def test_a_dropped_rubber_ball_comes_to_rest(physics: str) -> None:
    level = make_level(ball={"elasticity": 0.8}, start={"at": (0.0, 0.0, 1.0)})
    world = dropped(level, np.array([0.3]), physics, seconds=4.0)
    world.path()
    late = world.path()[0, :, 2]
    assert np.ptp(late) < 1e-3


def dropped(level: Level, heights: Float64, physics: str, seconds: float) -> World:
    """Return a world whose balls' lowest points are at ``heights``, at rest."""
    world = make_world(level, seconds, len(heights), physics)
    world.position[:, 2] = BALL_RADIUS_M + heights
    return world


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.2, 0.5, 0.9, 0.999, 1.0, 1.001, 1.5, 4.0])
def test_the_restitution_formula_is_the_integrated_contacts(zeta: float) -> None:
    """Integrate x'' = -x - 2 zeta x' from touching until the contact would pull.

    The spring-damper pushes until x = 0 or until its force is 0, whichever is first.
    """
    dt, x, v = 1e-4, 0.0, -1.0

    def force(x: float, v: float) -> float:
        return -x - 2.0 * zeta * v

    while True:
        k1 = (v, force(x, v))
        k2 = (v + dt / 2 * k1[1], force(x + dt / 2 * k1[0], v + dt / 2 * k1[1]))
        x, v = x + dt * k2[0], v + dt * k2[1]
        if force(x, v) <= 0.0:
            break
    assert restitution(zeta) == pytest.approx(v, abs=5e-4)


@given(st.floats(0.001, 1.0))
def test_the_damping_ratio_inverts_the_restitution(elasticity: float) -> None:
    assert restitution(damping_ratio(elasticity)) == pytest.approx(elasticity, abs=1e-9)


@pytest.mark.parametrize("elasticity", [0.0, -0.1, 1.1, math.nan])
def test_a_restitution_that_no_contact_has_is_refused(elasticity: float) -> None:
    with pytest.raises(ValueError, match="elasticity must be in"):
        damping_ratio(elasticity)
