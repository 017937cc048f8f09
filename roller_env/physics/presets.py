"""Named physics settings: how finely and how exactly MuJoCo is asked to compute."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

from roller_env import checks

Engine = Literal["mujoco", "rigid"]
FrictionLaw = Literal["coulomb", "relaxed"]
Integrator = Literal["Euler", "implicit", "implicitfast", "RK4"]
Cone = Literal["elliptic", "pyramidal"]
Solver = Literal["Newton", "PGS", "CG"]

MIN_DT_S: Final = 1e-5
MAX_ITERATIONS: Final = 1000
"""Limits of a preset, since a file must not be able to ask for days of work."""

_LONGEST_NAME: Final = 200


@dataclass(frozen=True, slots=True)
class PhysicsPreset:
    """One setting of an engine; the level's geometry and materials are not part of it.

    Of the engine ``rigid`` only the name, ``dt_s`` and ``law`` count.

    Attributes:
        name: what the ``physics`` option of the environments calls it.
        dt_s: physics time step, seconds.
        integrator: MuJoCo's name of the integrator.
        cone: friction cone. Pyramidal cones bend the ball's heading and are for experiments only.
        impratio: ratio of frictional to normal constraint impedance; more means less creep, of
            which the contacts' impedance of 0.999 leaves next to none, and dearer steps.
        solver: MuJoCo's name of the constraint solver. For the contact or two of a ball PGS is the
            cheaper; it takes more iterations, above all where a gate presses on the ball.
        iterations: most iterations of the solver in a step.
        tolerance: improvement at which the solver stops before that.
        engine: ``mujoco``, or ``rigid``: `roller_env.physics.rigid`.
        law: of friction and impact in the engine ``rigid``: ``coulomb``, or ``relaxed``, which is
            MuJoCo's; see `roller_env.physics.rigid.law`.

    Raises:
        ValueError: a value is not allowed; the message says what is.
    """

    name: str
    dt_s: float
    integrator: Integrator = "implicitfast"
    cone: Cone = "elliptic"
    impratio: float = 1.0
    solver: Solver = "Newton"
    iterations: int = 20
    tolerance: float = 1e-8
    engine: Engine = "mujoco"
    law: FrictionLaw = "coulomb"

    def __post_init__(self) -> None:
        """Refuse what MuJoCo cannot compute with, or not in any reasonable time."""
        seconds = f"a number of seconds from {MIN_DT_S:g} to 1"
        number, one_of = checks.number, checks.one_of
        checked = checks.each(
            {
                "name": lambda: _name(self.name),
                "dt_s": lambda: number("physics.dt_s", self.dt_s, MIN_DT_S, 1.0, seconds),
                "engine": lambda: one_of("physics.engine", self.engine, get_args(Engine)),
                "law": lambda: one_of("physics.law", self.law, get_args(FrictionLaw)),
                "integrator": lambda: one_of(
                    "physics.integrator", self.integrator, get_args(Integrator)
                ),
                "cone": lambda: one_of("physics.cone", self.cone, get_args(Cone)),
                "impratio": lambda: number(
                    "physics.impratio", self.impratio, 1e-6, 1e6, "a number from 1e-6 to 1e6"
                ),
                "solver": lambda: one_of("physics.solver", self.solver, get_args(Solver)),
                "iterations": lambda: checks.whole(
                    "physics.iterations", self.iterations, 1, MAX_ITERATIONS
                ),
                "tolerance": lambda: number(
                    "physics.tolerance", self.tolerance, 0.0, 1.0, "a number from 0 to 1"
                ),
            }
        )
        for name, value in checked.items():
            object.__setattr__(self, name, value)


def _name(name: object) -> str:
    if isinstance(name, str) and 0 < len(name) <= _LONGEST_NAME:
        return name
    raise ValueError(
        f"physics.name: found {name!r}; must be text of 1 to {_LONGEST_NAME} characters"
    )


FAST: Final = PhysicsPreset("fast", dt_s=1 / 120, solver="PGS", iterations=500)
"""For training: less than half the cost of ``default``, all its promises but for a lane of seams.

Errors: 0.16 % of the way after 5 s of driving, headings exact, 0.29 % on the classic course, depth
of the 46.9 m fall 0.43 of what falls through (passes a deck of 16 quants from 70 m/s on),
elasticity 0.016, friction 0.001; 49 seams in a row that cannot be merged throw the ball over a
quant high at 39 % of all speeds (``default``: 5 %). Cost: 0.54 CPU ms for a simulated second of the
classic level."""

DEFAULT: Final = PhysicsPreset("default", dt_s=1 / 240)
"""For playing and judging: keeps every promise.

Errors: 0.08 % after 5 s of driving, headings exact, 0.20 % on the classic course, depth of the fall
0.22 of what falls through, elasticity 0.016, friction 0.0003. Cost: 1.2 CPU ms for a simulated
second."""

ACCURATE: Final = PhysicsPreset(
    "accurate", dt_s=1 / 960, integrator="RK4", iterations=50, tolerance=1e-12
)
"""For references: smooth motion to 1e-6, and the least hop of a skidding ball (4 mm, not 35).

Errors: 0.00006 % after 5 s of driving, headings exact, 0.05 % on the classic course, depth of the
fall 0.07 of what falls through, elasticity 0.019, friction 0.0001. Cost: 15 CPU ms for a simulated
second."""

RIGID: Final = PhysicsPreset("rigid", dt_s=1 / 240, engine="rigid")
"""The rigid-ball engine: exact impacts and rolling, no softness, many times cheaper."""

RELAXED: Final = PhysicsPreset("relaxed", dt_s=1 / 240, engine="rigid", law="relaxed")
"""The rigid-ball engine with MuJoCo's law of friction: what ``default`` would be without softness.

A ball that slips lifts off the ground, as it does in MuJoCo."""

MUJOCO_PRESETS: Final[dict[str, PhysicsPreset]] = {
    preset.name: preset for preset in (FAST, DEFAULT, ACCURATE)
}
"""Those of MuJoCo, by name. Their errors and costs are from ``python scripts/presets.py``; see
docs/presets.md."""


PRESETS: Final[dict[str, PhysicsPreset]] = {
    **MUJOCO_PRESETS,
    **{preset.name: preset for preset in (RIGID, RELAXED)},
}
"""All that the option ``physics`` knows by name."""


def physics_preset(physics: str | PhysicsPreset) -> PhysicsPreset:
    """Return the preset of that name, or the preset itself.

    Raises:
        ValueError: there is no preset of that name; the message has the nearest one.
    """
    if isinstance(physics, PhysicsPreset):
        return physics
    return PRESETS[checks.one_of("physics", physics, tuple(PRESETS))]
