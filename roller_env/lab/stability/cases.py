"""What a prediction is, what came of it, and how the two are judged."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from roller_env.lab.stability.bisection import Threshold

EXACT: Final = (0.99, 1.01)
"""Band of measured / predicted where the formula is exact."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How hard a measurement tries.

    Attributes:
        tolerance: relative width of the bracket at which bisection stops.
        steps: steps of a smooth motion after which growth is judged.
        phases: moments within a step at which a ball arrives.
        starts: of each of the game's hard cases.
        repeats: interleaved runs of which the median time is taken.
    """

    tolerance: float
    steps: int
    phases: int
    starts: int
    repeats: int


FULL: Final = Effort(tolerance=1e-4, steps=20_000, phases=32, starts=12, repeats=9)
QUICK: Final = Effort(tolerance=2e-3, steps=6_000, phases=8, starts=2, repeats=1)


@dataclass(frozen=True, slots=True)
class Finding:
    """What a measurement gave.

    Attributes:
        value: the limit or the quantity; infinite where nothing failed.
        runs: simulations made for it.
    """

    value: float
    runs: int = 1

    @staticmethod
    def of(threshold: Threshold) -> Finding:
        """Return a threshold as a finding."""
        return Finding(threshold.value, threshold.runs)


@dataclass(frozen=True, slots=True)
class Case:
    """A prediction and how to measure it.

    Attributes:
        name: its key on the command line and in files.
        group: what it is about: ``servo``, ``drag``, ``oscillation``, ``spin``, ``contact``, ...
        quantity: what is predicted, for a column, with its unit.
        method: what moves the bodies, as `roller_env.lab.methods` calls it, and its setting.
        predicted: infinite where no limit is expected.
        formula: the prediction as people write it.
        source: where the formula comes from.
        criterion: how one run is judged, or how the quantity is read off.
        measure: does it.
        band: allowed measured / predicted.
        searched_to: largest value tried, where none is expected to fail.
        note: why a band is wider than 1 %, or why the measured value is not the predicted one.
        quick: whether ``--quick`` runs it too.
    """

    name: str
    group: str
    quantity: str
    method: str
    predicted: float
    formula: str
    source: str
    criterion: str
    measure: Callable[[Effort], Finding]
    band: tuple[float, float] = EXACT
    searched_to: float = math.inf
    note: str = ""
    quick: bool = True


def judged(case: Case, effort: Effort) -> dict[str, Any]:
    """Measure a case and hold it against its prediction.

    Returns:
        A row of the table: the case's words, what was ``measured`` in how many ``runs``, its
        ``ratio`` to what was ``predicted``, and the ``verdict``: holds or differs.
    """
    found = case.measure(effort)
    low, high = case.band
    limited = math.isfinite(case.predicted)
    ratio = found.value / case.predicted if limited else math.nan
    holds = low <= ratio <= high if limited else math.isinf(found.value)
    words = ("name", "group", "quantity", "method", "predicted", "formula", "source", "criterion")
    return {name: getattr(case, name) for name in (*words, "searched_to", "note")} | {
        "measured": found.value,
        "ratio": ratio,
        "band_low": low,
        "band_high": high,
        "verdict": "holds" if holds else "differs",
        "tolerance": effort.tolerance,
        "runs": found.runs,
    }
