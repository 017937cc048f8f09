"""Named physics settings: how finely and how exactly MuJoCo is asked to compute."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from typing import Final, Literal


@dataclass(frozen=True, slots=True)
class PhysicsPreset:
    """One setting of MuJoCo's solver; the level's geometry and materials are not part of it.

    Attributes:
        name: what the ``physics`` option of the environments calls it.
        dt_s: physics time step, seconds.
        integrator: MuJoCo's name of the integrator.
        cone: friction cone. Pyramidal cones bend the ball's heading and are for experiments only.
        impratio: ratio of frictional to normal constraint impedance; more means less creep.
        iterations: most iterations of the Newton solver in a step.
        tolerance: improvement at which the solver stops before that.
    """

    name: str
    dt_s: float
    integrator: Literal["Euler", "implicit", "implicitfast", "RK4"] = "implicitfast"
    cone: Literal["elliptic", "pyramidal"] = "elliptic"
    impratio: float = 10.0
    iterations: int = 20
    tolerance: float = 1e-8


PRESETS: Final[dict[str, PhysicsPreset]] = {
    preset.name: preset
    for preset in (
        PhysicsPreset("fast", dt_s=1 / 120),
        PhysicsPreset("default", dt_s=1 / 240),
        PhysicsPreset("accurate", dt_s=1 / 960, integrator="RK4", iterations=50, tolerance=1e-12),
    )
}


def physics_preset(physics: str | PhysicsPreset) -> PhysicsPreset:
    """Return the preset of that name, or the preset itself.

    Raises:
        ValueError: there is no preset of that name; the message has the nearest one.
    """
    if isinstance(physics, PhysicsPreset):
        return physics
    if physics not in PRESETS:
        near = get_close_matches(physics, PRESETS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(
            f"physics: found {physics!r}; allowed are {', '.join(map(repr, PRESETS))}{hint}"
        )
    return PRESETS[physics]
