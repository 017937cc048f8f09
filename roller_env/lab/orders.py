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
from typing import Any, Final, NamedTuple

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
"""How often a tenth of the horizon is halved at most, by the method's order; quick: once less."""

EXACT: Final = math.inf
"""The order of an error that is rounding at every time step."""


def measured_orders(scene: FreeScene, *, quick: bool = False) -> Iterator[dict[str, Any]]:
    """Yield a row for each method and each of the scene's errors, over `HORIZON_S`.

    Returns:
        ``scene``, ``measure`` and ``method``; ``theory`` and ``measured`` order (see `slope`) with
        the ``smallest_dt_s`` and ``largest_dt_s`` it was taken over, whether it ``agrees``, and the
        ``reason`` why theory is not the method's own order, empty where it is.
    """
    short = scene.over(HORIZON_S)
    for method in short.methods:
        halvings = SMALLEST_STEP_HALVINGS[method.order] - quick
        steps_s = [short.moment_s / 2**k for k in range(halvings + 1)]
        trials = [short.trial(method, dt) for dt in steps_s]
        for trial in trials:
            trial.run()
        errors = [trial.errors() for trial in trials]
        for measure in errors[0]:
            theory, reason = expected(scene.name, measure, method)
            order, smallest, largest = slope(steps_s, [run[measure] for run in errors])
            yield {
                "scene": scene.name,
                "measure": measure,
                "method": method.name,
                "theory": theory,
                "measured": order,
                "smallest_dt_s": smallest,
                "largest_dt_s": largest,
                "agrees": agrees(theory, order),
                "reason": reason,
            }


def agrees(theory: float, measured: float) -> bool:
    """Say whether what was measured is what theory expects."""
    return measured == theory or abs(measured - theory) <= AGREES


def slope(steps_s: Sequence[float], errors: Sequence[float]) -> tuple[float, float, float]:
    """Return the order that errors show, and the smallest and largest time step it is taken over.

    Each step is half of the one before. `EXACT` when every error is under `FLOOR`; NaN when fewer
    than four in a row are above it, or one of those is not finite.
    """
    above = [k for k, error in enumerate(errors) if not error <= FLOOR]
    if not above:
        return EXACT, steps_s[-1], steps_s[0]
    window = slice(above[-1] - HALVINGS, above[-1] + 1)
    if window.start < 0 or not all(FLOOR < error < math.inf for error in errors[window]):
        return math.nan, steps_s[-1], steps_s[0]
    order = np.polyfit(np.log(steps_s[window]), np.log(errors[window]), 1)[0]
    return float(order), steps_s[above[-1]], steps_s[window.start]


class Expectation(NamedTuple):
    """Which methods' errors fall otherwise than by their order, and which of `REASONS` is why."""

    scenes: set[str]
    measures: set[str]
    methods: set[str]
    order: float
    reason: str


def expected(scene: str, measure: str, method: Method) -> tuple[float, str]:
    """Return the order to expect and, where it is not the method's own, the reason."""
    for one in EXPECTATIONS:
        if scene in one.scenes and measure in one.measures and method.name in one.methods:
            return one.order, REASONS[one.reason]
    return float(method.order), ""


def _names(methods: Iterable[Method], *, least_order: int = 1) -> set[str]:
    return {method.name for method in methods if method.order >= least_order}


REASONS: Final = {
    "constant force": "the force is constant, so the velocity is linear in time and every method "
    "adds it up exactly",
    "straight": "no force acts: the path is a straight line",
    "parabola": "the path is a parabola, a polynomial of second degree, which a method of second "
    "or higher order follows exactly",
    "exact motion": "position and velocity are exact, and with them the energy",
    "primary": "angular momentum in the world frame is a primary value, and without a torque no "
    "method touches it",
    "principal axis": "about a principal axis Euler's equations have no gyroscopic term, so the "
    "angular velocity in the body stays what it was",
    "steady spin": "the spin about a principal axis stays, however wrong the angle",
    "arc tangent": "adding the spin to the quaternion turns it by 2 atan(w dt / 2), which is w dt "
    "without a term in dt^2: the error of a step is of third order, for a constant spin only",
    "one rotation": "the orientation is turned by a rotation vector, and a constant spin is one "
    "rotation",
    "commuting": "with two equal moments the parts of the splitting commute, so that one after the "
    "other they are the motion itself",
    "no drift": "the tilt of a symmetric top is steady, so its energy can only drift at a steady "
    "rate. The leading term of the error of a method of even order runs backwards in time as it "
    "runs forwards and allows no drift: the next term is the first that does",
}
"""Why an error does not fall by the method's order."""

_ALL: Final = _names(FREE)
_SECOND: Final = _names(FREE, least_order=2)
_IN_BODY_AXES: Final = _names(MUJOCO) | {"ours rk4_body"}
_STEADY: Final = {"simple-box", "constant-spin"}
_TOPS: Final = {"asymmetric-top", "middle-axis", "symmetric-top"}
_SYMMETRIC: Final = {"symmetric-top"}
_THROWN: Final = {"complex-box", "projectile"}
_FREELY: Final = _STEADY | _TOPS | {"complex-box"}
_SPIN: Final = {"angular_momentum"}
_TURNING: Final = {"attitude", "angular_velocity", "energy"}
_ADDING: Final = {"ours explicit_euler", "ours rk4", "ours rk4_body"}
_SPLITTING: Final = {"ours splitting2", "ours splitting4"}
_RK4: Final = {"MuJoCo RK4", "ours rk4", "ours rk4_body", "ours lie_rk4"}

EXPECTATIONS: Final = (
    Expectation({"simple-box"} | _THROWN, {"velocity"}, _ALL, EXACT, "constant force"),
    Expectation({"simple-box"}, {"position"}, _ALL, EXACT, "straight"),
    Expectation(_THROWN, {"position"}, _SECOND, EXACT, "parabola"),
    Expectation({"projectile"}, {"energy"}, _SECOND, EXACT, "exact motion"),
    Expectation(_FREELY, _SPIN, _names(RIGID_BODY) - _IN_BODY_AXES, EXACT, "primary"),
    Expectation(_STEADY, _SPIN, _IN_BODY_AXES, EXACT, "principal axis"),
    Expectation(_STEADY, {"energy"}, _ALL, EXACT, "steady spin"),
    Expectation(_STEADY, {"attitude"}, {"ours explicit_euler"}, 2.0, "arc tangent"),
    Expectation(_STEADY, {"attitude"}, _ALL - _ADDING, EXACT, "one rotation"),
    Expectation(_SYMMETRIC, _TURNING, _SPLITTING, EXACT, "commuting"),
    Expectation(_SYMMETRIC, {"energy"}, _RK4, 5.0, "no drift"),
    Expectation(_SYMMETRIC, {"energy"}, {"ours buss2"}, 3.0, "no drift"),
)
"""Every case in which an error does not fall by the method's order."""
