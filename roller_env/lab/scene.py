"""What a scene, which knows an answer, promises, and the points that methods make on it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, Protocol, runtime_checkable

import numpy as np

from roller_env.lab.methods import Method, without_warnings
from roller_env.lab.runner import cpu_seconds, spread
from roller_env.lab.table import Frame

ErrorKind = Literal["discretisation", "model"]


@dataclass(frozen=True, slots=True)
class Measure:
    """One error that a scene measures."""

    name: str  # its key in `SteadyTrial.errors`
    label: str  # of an axis, with the unit: ``position error after 10 s, m``
    kind: ErrorKind  # against the same model with a vanishing step, or the rigid closed form


@runtime_checkable
class SteadyTrial(Protocol):
    """One simulation of a scene with one method and one time step; can be run again.

    Its steps all cost the same, so that timing a part of them tells the whole's price: a long run
    of a slow method would otherwise have to be repeated in full for its median.
    """

    @property
    def part_s(self) -> float:
        """Simulated time of the part, seconds."""

    def run(self) -> None:
        """Simulate from the start to the scene's horizon."""

    def run_part(self) -> None:
        """Simulate the part. This is what is timed, and `run` is not."""

    def errors(self) -> Mapping[str, float]:
        """Return the last run's errors by their `Measure`; not finite, or huge, where it failed."""


class Scene(Protocol):
    """A motion with a known answer; it also has a ``title`` and a ``horizon_s``, seconds."""

    @property
    def name(self) -> str:
        """Its key on the command line and in files."""

    @property
    def measures(self) -> Sequence[Measure]:
        """Its errors; a chart shows the first of each kind."""

    @property
    def failure(self) -> float:
        """Value of the first measure above which the method counts as failed."""

    def trial(self, method: Method, dt_s: float) -> SteadyTrial:
        """Return a simulation of the scene, ready to run."""


def measure(scene: Scene, method: Method, dt_s: float, repeats: int) -> list[dict[str, Any]]:
    """Run one method with one time step, and return a point for each of the scene's measures.

    Returns:
        Rows of ``scene``, ``method``, ``measure``, ``kind``, ``dt_s``, ``error``, ``failed``,
        ``cpu_s_per_s`` and ``evaluations_per_s`` (median CPU seconds, and evaluations of the
        forces, for a simulated second) and ``cpu_spread``.
    """
    trial = scene.trial(method, dt_s)
    with without_warnings():
        trial.run()
        errors = trial.errors()
        seconds = cpu_seconds(trial.run_part, repeats)
    failed = not errors[scene.measures[0].name] < scene.failure
    return [
        {
            "scene": scene.name,
            "method": method.name,
            "measure": one.name,
            "kind": one.kind,
            "dt_s": dt_s,
            "error": errors[one.name],
            "failed": failed,
            "cpu_s_per_s": float(np.median(seconds)) / trial.part_s,
            "cpu_spread": spread(seconds),
            "evaluations_per_s": method.evaluations / dt_s,
        }
        for one in scene.measures
    ]


ERROR: Final = ["scene", "measure"]
CURVE: Final = [*ERROR, "method"]

ROUNDING: Final = 1e-13
"""Errors below it are rounding of float64: the answer is exact."""


def sound(points: Frame, tolerance: float = math.inf) -> Frame:
    """Return each curve's points before the first that fails or errs more as time steps grow.

    Later ones are luck: a larger step that happens to land near the answer is no method that has
    the error.
    """
    points = points.sort_values("dt_s", kind="stable")
    bad = _failed(points) | (points.error > tolerance)
    return points[bad.astype(int).groupby([points[key] for key in CURVE]).cummax() == 0]


def failures(points: Frame) -> Frame:
    """Return each curve's point with the smallest step that failed, or gave no number."""
    points = points.sort_values("dt_s", kind="stable")
    return points[_failed(points)].drop_duplicates(CURVE)


def _failed(points: Frame) -> Any:
    return points.failed | ~np.isfinite(points.error)


def pareto(points: Frame, cost: str) -> Frame:
    """Return the points of one error that no other beats in error and cost, cheapest first.

    All errors under `ROUNDING` are alike: none is better than exact.
    """
    candidates = sound(points).sort_values([cost, "error"])
    least = candidates.error.cummin().shift(fill_value=math.inf)
    return candidates[candidates.error.clip(lower=ROUNDING) < least]
