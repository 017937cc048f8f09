"""Laws of contact: what an impact leaves of a velocity, and what a slip does to the normal one.

**Coulomb and Newton** (C. A. de Coulomb, *Théorie des machines simples*, 1785; I. Newton,
*Principia*, 1687): friction opposes the slip and is mu times the normal force; an impact leaves
minus e times the normal velocity. What slips along a plane stays on it.

**Relaxed**: MuJoCo's. Its forces minimise a convex energy within the friction cones, as M. Anitescu
has it (*Optimization-based simulation of nonsmooth rigid multibody dynamics*, 2006). Velocities and
impulses are then complementary in the cone and its dual cone, which asks of every contact

    v_n >= mu |u|

with equality where it slips: the friction cone's flow is associated, its angle of dilatancy that
of friction, and a body that slips lifts off (E. Todorov, *Convex and analytically-invertible
dynamics with contacts and constraints*, 2014, gives MuJoCo's form). Rolling, flight and impacts
that stick are as Coulomb has them, until two contacts stick no more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class ContactLaw:
    """What contacts do, besides the friction and the elasticity of their materials.

    Attributes:
        dilatancy: ratio to the friction coefficient of ``v_n / |u|`` where a contact slips: 0 with
            Coulomb's law, 1 with its convex relaxation.
        least_restitution: the coefficient of restitution of what is less elastic, plastic included.
        reversal: ratio to the elasticity of the tangential restitution, of materials that are more
            elastic than that: 1 turns the slip round as a bounce does the approach (R. L. Garwin,
            *Kinematics of an ultraelastic rough ball*, 1969).
    """

    dilatancy: float = 0.0
    least_restitution: float = 0.0
    reversal: float = 0.0

    def restitution(self, elasticity: float) -> float:
        """Return Newton's coefficient of restitution of a material."""
        return max(elasticity, self.least_restitution)

    def tangential_restitution(self, elasticity: float) -> float:
        """Return what share of its slip a material turns round."""
        return self.reversal * elasticity if elasticity > self.least_restitution else 0.0


COULOMB: Final = ContactLaw()
"""Coulomb's friction, Newton's restitution, tangential restitution 0."""

RELAXED: Final = ContactLaw(dilatancy=1.0, least_restitution=0.0092, reversal=1.0)
"""As MuJoCo's preset ``default`` does, were its contacts hard.

Its plastic contact takes 0.9 of the approach in a step, which leaves the ball U + 1/9 of a step's
way deep, U in (0, 1) being when in the step it arrived, and pushes it out by 0.015 of that a step:
`roller_env.physics.materials`, ``PLASTIC_RESTITUTION`` and ``DAMPING_STEPS``. On average that is
a restitution of 0.0092."""

LAWS: Final = {"coulomb": COULOMB, "relaxed": RELAXED}
"""By the name that a preset has for them."""
