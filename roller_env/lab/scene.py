"""The interface between a scene, which knows an answer, and what measures methods on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, Protocol, runtime_checkable

import numpy as np

from roller_env.lab.methods import Method, without_warnings
from roller_env.lab.runner import cpu_seconds, spread

ErrorKind = Literal["discretisation", "model"]
ERROR_KINDS: Final[tuple[ErrorKind, ...]] = ("discretisation", "model")


@dataclass(frozen=True, slots=True)
class Measure:
    """One error that a scene measures.

    Attributes:
        name: its key in `SteadyTrial.errors`.
        label: what an axis or a column says, with the unit: ``position error after 10 s, m``.
        kind: against the same model with a vanishing step, or against the rigid closed form.
    """

    name: str
    label: str
    kind: ErrorKind


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
        """Return the errors of the last run by the name of their `Measure`.

        Not finite, or absurdly large, where the method failed.
        """


class Scene(Protocol):
    """A motion with a known answer."""

    @property
    def name(self) -> str:
        """Its key on the command line and in files."""

    @property
    def title(self) -> str:
        """What a chart's panel is called, for somebody who has never heard of it."""

    @property
    def horizon_s(self) -> float:
        """Simulated time, seconds."""

    @property
    def measures(self) -> Sequence[Measure]:
        """Its errors; the first is the one that the chart shows."""

    @property
    def methods(self) -> Sequence[Method]:
        """The methods that can simulate it."""

    @property
    def time_steps_s(self) -> Sequence[float]:
        """Time steps of a full run, largest first: {1, 2, 5} x 10^k."""

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
        seconds = cpu_seconds(trial.run_part, repeats)
    errors = trial.errors()
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
