"""Friction and elasticity -> MuJoCo's contact parameters.

MuJoCo has no coefficient of restitution. A contact is a spring and a damper of the *acceleration*,
``x'' = -K x - B x'`` (K in 1/s^2, B in 1/s, whatever the mass), that pushes and never pulls. Such
a contact has a restitution that follows from the damping ratio ``zeta = B / (2 sqrt(K))`` alone
(Schwager & Poeschel 2007, "Coefficient of restitution and linear-dashpot model revisited"):

    zeta = sin(a) < 1:   e = exp(-(pi - 2 a) tan(a))
    zeta = cosh(b) > 1:  e = exp(-2 b coth(b))

which can be inverted. That takes a contact of many steps: it is deep, and gravity, which acts all
the while, takes a part of what comes back. Where the integrator is of the Euler family an elastic
contact therefore lasts one step: the damper alone, with ``B h = 1 + e``, turns an approach at v
into ``v - h B v = -e v``, whatever the speed, and the ball gets in no deeper than it moves in a
step. The same damper acts on the slip, so a bounce turns slip round as well, as it does on a
rubber ball (Garwin 1969, "Kinematics of an ultraelastic rough ball"). RK4 looks at a contact four
times a step and cannot do it in one; it gets the spring.

The direct form ``solref = (-K, -B)`` is used since in the (time constant, ratio) form the stiffness
grows as 1/ratio^2 and bouncy balls gain energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from roller_env.physics.presets import PhysicsPreset

PLASTIC_RESTITUTION = 0.015
"""What an elasticity of 0 is given. A linear contact cannot have exactly 0: the overdamped spring
that would need pushes the ball out of the ground ever more slowly (rate e * B)."""

IMPEDANCE = 0.999
"""Constraint impedance d, constant: the ball rests (1 - d) g d / K deep, friction slips 1 - d.

Depth is what makes seams: over the classic level's bridge at 15 m/s a ball is thrown 5 mm up with
d = 0.99 and 0.03 mm with this, at the same cost (``scripts/presets.py``). MuJoCo allows 0.9999."""

DAMPING_STEPS = 0.9
"""B h, the share of the approach speed that one step of the plastic contact removes; explicit
integration of the damper needs it below 1."""

RESTING_STIFFNESS = 0.0135
"""K h^2 of an elastic contact of one step: the share of its depth that a step pushes the ball out.
About as the plastic contact's, so that a ball rests equally deep on everything."""

BOUNCE_STEPS = 24.0
"""Steps that an elastic contact lasts with RK4. The restitution varies by about 0.5 / BOUNCE_STEPS
with the moment within a step at which the ball arrives."""


@dataclass(frozen=True, slots=True)
class ContactParameters:
    """What a MuJoCo geom of higher priority than the ball is given.

    Attributes:
        friction: Coulomb coefficient of the pair.
        solref: direct form, (-K, -B): minus stiffness in 1/s^2, minus damping in 1/s.
        solimp: constraint impedance (dmin, dmax, width, midpoint, power).
    """

    friction: float
    solref: tuple[float, float]
    solimp: tuple[float, float, float, float, float]


def restitution(zeta: float) -> float:
    """Return the coefficient of restitution of a linear contact of damping ratio ``zeta`` >= 0."""
    if zeta < 1.0:
        angle = math.asin(zeta)
        return math.exp(-(math.pi - 2.0 * angle) * math.tan(angle))
    if zeta == 1.0:
        return math.exp(-2.0)
    beta = math.acosh(zeta)
    return math.exp(-2.0 * beta / math.tanh(beta))


@lru_cache(maxsize=256)
def damping_ratio(elasticity: float) -> float:
    """Return the damping ratio whose restitution is ``elasticity``; in (0, 1].

    Raises:
        ValueError: the elasticity is not in (0, 1].
    """
    if not 0.0 < elasticity <= 1.0:
        raise ValueError(f"elasticity must be in (0, 1], found {elasticity}")
    low, high = 0.0, 1.0
    while restitution(high) > elasticity:
        high *= 2.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if restitution(middle) > elasticity else (low, middle)
    return (low + high) / 2


def contact_parameters(
    friction: float, elasticity: float, preset: PhysicsPreset
) -> ContactParameters:
    """Return contact parameters with the pair's measured friction and restitution.

    Args:
        friction: Coulomb coefficient of the pair, >= 0.
        elasticity: coefficient of restitution of the pair, 0 to 1.
        preset: the physics settings; the time step bounds how stiff a contact may be.
    """
    stiffness, damping = _spring(elasticity, preset)
    return ContactParameters(
        friction, (-stiffness, -damping), (IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0)
    )


def _spring(elasticity: float, preset: PhysicsPreset) -> tuple[float, float]:
    """Return K in 1/s^2 and B in 1/s."""
    rate = 1.0 / preset.dt_s
    if elasticity > PLASTIC_RESTITUTION and preset.integrator != "RK4":
        # The ball arrives anywhere in a step, and the spring adds K h times its depth: on average
        # half of this, which the damper gives up beforehand.
        excess = RESTING_STIFFNESS / 2.0
        return RESTING_STIFFNESS * rate**2, (1.0 + elasticity - excess) * rate
    zeta = damping_ratio(max(elasticity, PLASTIC_RESTITUTION))
    if elasticity <= PLASTIC_RESTITUTION:
        omega = DAMPING_STEPS * rate / (2.0 * zeta)
    else:
        omega = _phase_at_release(zeta) * rate / BOUNCE_STEPS
    return omega**2, 2.0 * zeta * omega


def _phase_at_release(zeta: float) -> float:
    """Return omega times the duration of the contact, from touching to letting go."""
    if zeta < 1.0:
        angle = math.asin(zeta)
        return (math.pi - 2.0 * angle) / math.cos(angle)
    if zeta == 1.0:
        return 2.0
    beta = math.acosh(zeta)
    return 2.0 * beta / math.sinh(beta)
