"""MuJoCo's relaxed law of friction in the rigid engine, beside Coulomb's."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from roller_env.physics.rigid.law import COULOMB, RELAXED, ContactLaw
from roller_env.physics.rigid.scene import SolidBox
from tests.physics.rigid.world import FRICTION, GRAVITY, RADIUS_M, RESTING_M, World, floor

PLASTIC = ContactLaw(dilatancy=1.0)
"""The relaxed law with nothing of MuJoCo's restitution."""


def hop_speed(slip: float, friction: float, law: ContactLaw) -> float:
    """Return how fast a skid of that slip leaves flat ground.

    The impulse N obeys N = d mu (u - 7/2 mu N), d being the dilatancy.
    """
    return law.dilatancy * friction * slip / (1.0 + 3.5 * law.dilatancy * friction**2)


@pytest.mark.parametrize("friction", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_skid_hops_as_high_as_its_law_has_it(friction: float, share: float) -> None:
    law = ContactLaw(dilatancy=share)
    world = World([floor(friction)], law=law).put((0.0, 0.0, RESTING_M), (4.0, 0.0, 0.0))
    highest = 0.0
    for _ in range(5):
        world.step()
        highest = max(highest, world.way(points=2001)[:, 2].max() - RESTING_M)
    up = hop_speed(4.0, friction, law)
    # The path is looked at every 25 us: it misses the top by up to g dt^2 / 8.
    assert highest == pytest.approx(up**2 / (2.0 * GRAVITY), abs=2e-9)
    assert world.counts.forced.sum() == world.counts.unsolved.sum() == 0


def test_a_skid_that_hops_ends_rolling_with_five_sevenths_of_its_speed() -> None:
    world = World([floor()], law=PLASTIC).put((0.0, 0.0, RESTING_M), (4.0, 0.0, 0.0)).run(2.0)
    assert world.states.velocity[0] == pytest.approx([20.0 / 7.0, 0.0, 0.0], abs=1e-9)
    assert world.angular_velocity[0, 1] * RADIUS_M == pytest.approx(20.0 / 7.0, abs=1e-9)
    assert world.states.position[0, 2] == pytest.approx(RESTING_M, abs=1e-9)


@pytest.mark.parametrize("law", [COULOMB, PLASTIC, RELAXED])
def test_only_the_relaxed_law_throws_a_plastic_ball_up_that_arrives_flat(law: ContactLaw) -> None:
    """Without spin, at 4 m/s and 1 m/s downwards."""
    start = (0.0, 0.0, RADIUS_M + 1e-9)
    world = World([floor()], law=law).put(start, (4.0, 0.0, -1.0)).run(0.05)
    asked, restitution = law.dilatancy * FRICTION, law.least_restitution
    push = (asked * 4.0 + 1.0 + restitution) / (1.0 + 3.5 * FRICTION * asked)
    if law == COULOMB:
        assert world.states.position[0, 2] == pytest.approx(RESTING_M, abs=1e-9)
    else:
        assert push > 1.6
        up = world.states.velocity[0, 2] + GRAVITY * 0.05
        assert up == pytest.approx(push - 1.0, abs=1e-6)
        assert world.states.velocity[0, 0] == pytest.approx(4.0 - FRICTION * push, abs=1e-6)


def test_a_relaxed_elastic_ball_turns_its_slip_round() -> None:
    """Garwin's ball: both components of the contact's velocity come back with the elasticity."""
    start, arrives = (0.0, 0.0, RADIUS_M + 1e-9), (1.0, 0.0, -4.0)
    world = World([floor(0.5, 0.8)], law=RELAXED).put(start, arrives).run(0.05)
    v, w = world.states.velocity[0], world.angular_velocity[0]
    assert v[0] - RADIUS_M * w[1] == pytest.approx(-0.8, abs=1e-9)
    assert v[2] + 0.05 * GRAVITY == pytest.approx(3.2, abs=1e-6)


@pytest.mark.parametrize(("law", "rises"), [(COULOMB, False), (RELAXED, True)])
def test_a_key_throws_a_light_ball_up_by_the_relaxed_law_alone(
    law: ContactLaw, rises: bool
) -> None:
    world = World([floor()], law=law, mass_kg=0.1).put((0.0, 0.0, RESTING_M))
    highest = 0.0
    for _ in range(60):
        world.run(0.05, (5.08, 0.0, 0.0))
        highest = max(highest, world.way()[:, 2].max() - RESTING_M)
    assert (highest > 1.0) if rises else (abs(highest) < 1e-9)


@pytest.mark.parametrize("push", [0.9, 1.1])
def test_a_push_makes_a_ball_hop_where_friction_no_longer_holds_it(push: float) -> None:
    """It rolls up to a push of 7/2 mu m g."""
    force = push * 3.5 * FRICTION * GRAVITY
    world = World([floor()], law=PLASTIC).put((0.0, 0.0, RESTING_M))
    highest = 0.0
    for _ in range(20):
        world.run(0.05, (force, 0.0, 0.0))
        highest = max(highest, world.way()[:, 2].max() - RESTING_M)
    assert (highest > 1e-3) if push > 1.0 else (highest < 1e-9)
    assert world.counts.forced.sum() == 0


def test_a_ball_that_is_pressed_into_a_wall_rolls_on_both_by_either_law() -> None:
    wall = SolidBox((500.0 + RADIUS_M, 0.0, 0.0), (500.0, 500.0, 50.0), friction=1.0)
    for law in (COULOMB, RELAXED):
        world = World([floor(1.0), wall], law=law).put((-1e-9, 0.0, RESTING_M))
        world.run(1.0, (5.08, 5.08, 0.0))
        assert world.states.position[0, 1] == pytest.approx(0.5 * 5.08 / 1.8, abs=1e-8)


def test_relaxed_physics_is_played_through_gymnasium() -> None:
    env = gym.make("Roller/Classic-v0", physics="relaxed")
    env.reset(seed=1)
    for _ in range(50):
        observation, *_ = env.step(env.action_space.sample())
    assert np.isfinite(observation).all()
    env.close()
