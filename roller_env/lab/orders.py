"""With which power of the time step an error falls: measured against theory.

The time step is halved again and again, and the order is the slope of log error over log dt by
least squares over the last three halvings whose errors are all above rounding. So the data choose
the range, by one rule for all: as far into the asymptotic range as float64 lets one see.

Theory is the method's order, but for the cases of `EXPECTATIONS`, where something makes the error
vanish or fall faster. Each has its reason in words.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from roller_env.lab.free import FreeScene
from roller_env.lab.methods import FREE, MUJOCO, RIGID_BODY, Method

HORIZON_S: Final = 1.0
"""Short, so that an error of first order is far from saturation at a step one can afford."""

HALVINGS: Final = 3
"""Of the time step, that a slope spans: four points."""

AGREES: Final = 0.15
"""Largest difference between measured and expected order."""

FLOOR: Final = 3e-13
"""Errors below it may be rounding. That of the middle axis' tumble was seen to be 1.5e-13."""

SMALLEST_STEP_HALVINGS: Final = {1: 8, 2: 7, 3: 6, 4: 5}
"""How often a tenth of the horizon is halved at most, by the method's order."""

QUICK_HALVINGS_LESS: Final = 1

EXACT: Final = math.inf
"""The order of an error that is rounding at every time step."""


@dataclass(frozen=True, slots=True)
class Expectation:
    """Why some methods' errors fall otherwise than by their order."""

    scenes: frozenset[str]
    measures: frozenset[str]
    methods: frozenset[str]
    order: float
    reason: str


@dataclass(frozen=True, slots=True)
class Order:
    """One row of the table of orders."""

    scene: str
    measure: str
    method: str
    theory: float
    """Infinite where the method gives this exactly."""
    measured: float
    """Infinite where every error is rounding; NaN where too few are above it for a slope."""
    smallest_dt_s: float
    largest_dt_s: float
    """The range the slope was measured over."""
    reason: str
    """Why theory is not the method's own order; empty where it is."""

    @property
    def agrees(self) -> bool:
        """Whether what was measured is what theory expects."""
        return self.measured == self.theory or abs(self.measured - self.theory) <= AGREES


def measured_orders(scene: FreeScene, *, quick: bool = False) -> Iterator[Order]:
    """Yield a row for each method and each of the scene's errors, over `HORIZON_S`."""
    short = scene.over(HORIZON_S)
    for method in short.methods:
        halvings = SMALLEST_STEP_HALVINGS[method.order] - (QUICK_HALVINGS_LESS if quick else 0)
        steps_s = [short.moment_s / 2**k for k in range(halvings + 1)]
        runs = [_errors(short, method, dt) for dt in steps_s]
        for measure in runs[0]:
            yield _row(short, measure, method, steps_s, [run[measure] for run in runs])


def _errors(scene: FreeScene, method: Method, dt_s: float) -> dict[str, float]:
    trial = scene.trial(method, dt_s)
    trial.run()
    return dict(trial.errors())


def _row(
    scene: FreeScene, measure: str, method: Method, steps_s: list[float], errors: list[float]
) -> Order:
    theory, reason = expected(scene.name, measure, method)
    order, smallest, largest = slope(steps_s, errors)
    return Order(scene.name, measure, method.name, theory, order, smallest, largest, reason)


def slope(steps_s: Sequence[float], errors: Sequence[float]) -> tuple[float, float, float]:
    """Return the order that errors show, and the smallest and largest time step it is taken over.

    Args:
        steps_s: time steps, each half of the one before.
        errors: one a step.

    Returns:
        `EXACT` when every error is under `FLOOR`; NaN when fewer than four in a row are above it,
        or one of those is not finite.
    """
    above = [k for k, error in enumerate(errors) if not error <= FLOOR]
    if not above:
        return EXACT, steps_s[-1], steps_s[0]
    window = slice(above[-1] - HALVINGS, above[-1] + 1)
    if window.start < 0 or not all(FLOOR < error < math.inf for error in errors[window]):
        return math.nan, steps_s[-1], steps_s[0]
    order = np.polyfit(np.log(steps_s[window]), np.log(errors[window]), 1)[0]
    return float(order), steps_s[above[-1]], steps_s[window.start]


# --- what theory expects ---------------------------------------------------------------------


def expected(scene: str, measure: str, method: Method) -> tuple[float, str]:
    """Return the order to expect and, where it is not the method's own, the reason."""
    for one in EXPECTATIONS:
        if scene in one.scenes and measure in one.measures and method.name in one.methods:
            return one.order, one.reason
    return float(method.order), ""


def _names(methods: Iterable[Method], *, least_order: int = 1) -> frozenset[str]:
    return frozenset(method.name for method in methods if method.order >= least_order)


_EVERY: Final = _names(FREE)
_STEADY_SPIN: Final = frozenset({"simple-box", "constant-spin"})
_ADDING: Final = frozenset({"ours explicit_euler", "ours rk4", "ours rk4_body"})
_SPLITTINGS: Final = frozenset({"ours splitting2", "ours splitting4"})

EXPECTATIONS: Final = (
    Expectation(
        frozenset({"simple-box", "complex-box", "projectile"}),
        frozenset({"velocity"}),
        _EVERY,
        EXACT,
        "the force is constant, so the velocity is linear in time and every method adds it up "
        "exactly",
    ),
    Expectation(
        frozenset({"simple-box"}),
        frozenset({"position"}),
        _EVERY,
        EXACT,
        "no force acts: the path is a straight line",
    ),
    Expectation(
        frozenset({"complex-box", "projectile"}),
        frozenset({"position"}),
        _names(FREE, least_order=2),
        EXACT,
        "the path is a parabola, a polynomial of second degree, which a method of second or "
        "higher order follows exactly",
    ),
    Expectation(
        frozenset({"projectile"}),
        frozenset({"energy"}),
        _names(FREE, least_order=2),
        EXACT,
        "position and velocity are exact, and with them the energy",
    ),
    Expectation(
        frozenset(
            {"simple-box", "complex-box", "asymmetric-top", "middle-axis", "symmetric-top"}
            | _STEADY_SPIN
        ),
        frozenset({"angular_momentum"}),
        _names(RIGID_BODY) - {"ours rk4_body"},
        EXACT,
        "angular momentum in the world frame is a primary value, and without a torque no method "
        "touches it",
    ),
    Expectation(
        _STEADY_SPIN,
        frozenset({"angular_momentum"}),
        _names(MUJOCO) | {"ours rk4_body"},
        EXACT,
        "about a principal axis Euler's equations have no gyroscopic term, so the angular velocity "
        "in the body stays what it was",
    ),
    Expectation(
        _STEADY_SPIN,
        frozenset({"energy"}),
        _EVERY,
        EXACT,
        "the spin about a principal axis stays, however wrong the angle",
    ),
    Expectation(
        _STEADY_SPIN,
        frozenset({"attitude"}),
        frozenset({"ours explicit_euler"}),
        2.0,
        "adding the spin to the quaternion turns it by 2 atan(w dt / 2), which is w dt without a "
        "term in dt^2: the error of a step is of third order, for a constant spin only",
    ),
    Expectation(
        _STEADY_SPIN,
        frozenset({"attitude"}),
        _EVERY - _ADDING,
        EXACT,
        "the orientation is turned by a rotation vector, and a constant spin is one rotation",
    ),
    Expectation(
        frozenset({"symmetric-top"}),
        frozenset({"attitude", "angular_velocity", "energy"}),
        _SPLITTINGS,
        EXACT,
        "with two equal moments the parts of the splitting commute, so that one after the other "
        "they are the motion itself",
    ),
    *(
        Expectation(
            frozenset({"symmetric-top"}),
            frozenset({"energy"}),
            methods,
            order,
            "the tilt of a symmetric top is steady, so its energy can only drift at a steady "
            "rate. The leading term of the error of a method of even order runs backwards in time "
            "as it runs forwards and allows no drift: the next term is the first that does",
        )
        for methods, order in (
            (frozenset({"MuJoCo RK4", "ours rk4", "ours rk4_body", "ours lie_rk4"}), 5.0),
            (frozenset({"ours buss2"}), 3.0),
        )
    ),
)
"""Every case in which an error does not fall by the method's order."""
