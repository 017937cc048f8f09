"""A limit: what is predicted, how it is found by bisection, and how the two are judged."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from pandas import read_csv


def words(table: str, **missing: float) -> dict[str, dict[str, Any]]:
    """Return what people read of the cases of a table, by name, in its order: a CSV file here.

    What is ``missing`` in a column of numbers is taken for the value named.
    """
    frame = read_csv(Path(__file__).with_name(f"{table}.csv"), index_col="case")
    rows: dict[str, dict[str, Any]] = frame.fillna({"note": "", **missing}).to_dict("index")
    return rows


WORDS: Final = words("limits", searched_to=math.inf)
"""Of every limit.

``group``: what it is about, a name on the command line too. ``quantity``: what is predicted, with
its unit. ``method``: what moves the bodies, and its setting. ``formula``: the prediction as people
write it, h being the time step, tau ``solref[0]``, d the impedance, z a damping ratio. ``source``:
where the formula comes from. ``criterion``: how one run is judged, or how the quantity is read off.
``low`` and ``high``: the allowed measured / predicted. ``searched_to``: the largest value tried,
where none is expected to fail. ``quick``: whether ``--quick`` runs it too. ``note``: why a band is
wider than `EXACT`, or why the measured value is not the predicted one.
"""

EXACT: Final = (0.99, 1.01)
"""Band of measured / predicted where the formula is exact."""

REACH: Final = 1.3
"""How far on either side of a guess the threshold is looked for first."""

FARTHEST: Final = 1e4
"""How far off a guess may be."""


def locate(holds: Callable[[float], bool], guess: float, tolerance: float) -> float:
    """Return the value near ``guess``, or far from it, above which ``holds`` no longer does.

    Args:
        holds: must hold below one threshold and fail above it.
        guess: positive.
        tolerance: relative width of the bracket, of which the geometric middle is returned.

    Raises:
        ValueError: a guess or tolerance that makes no sense, or a threshold that is more than
            `FARTHEST` times as large or small as the guess.
    """
    if not (0.0 < guess < math.inf and 0.0 < tolerance < 1.0):
        raise ValueError(
            f"locate needs 0 < guess and 0 < tolerance < 1, found {guess:g} and {tolerance:g}"
        )
    least, most = guess / FARTHEST, guess * FARTHEST
    low, high = guess / REACH, guess * REACH
    while low > least and not holds(low):
        low, high = low / 2.0, low
    while high < most and holds(high):
        low, high = high, 2.0 * high
    if not least < low < high < most:
        raise ValueError(f"the threshold is not between {least:g} and {most:g}")
    while high / low - 1.0 > tolerance:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return math.sqrt(low * high)


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
class Case:
    """A prediction and how to measure it: one of ``value`` and ``holds``.

    Attributes:
        predicted: infinite where no limit is expected.
        value: measures a quantity; infinite where nothing failed.
        holds: whether all is well at a value: a limit, which is searched for.
        tolerance: of the bisection, where that of the effort would take too long.
    """

    predicted: float
    value: Callable[[Effort], float] | None = None
    holds: Callable[[Effort, float], bool] | None = None
    tolerance: float = 0.0

    def measure(self, effort: Effort, searched_to: float) -> float:
        """Return the quantity, or the limit: infinite where nothing fails."""
        if self.value is not None:
            return self.value(effort)
        assert self.holds is not None
        holds = partial(self.holds, effort)
        if math.isfinite(self.predicted):
            return locate(holds, self.predicted, max(effort.tolerance, self.tolerance))
        values = np.geomspace(searched_to / 200.0, searched_to, 60).tolist()
        return next((value for value in values if not holds(value)), math.inf)


def judged(name: str, case: Case, effort: Effort) -> dict[str, Any]:
    """Measure a case and hold it against its prediction.

    Returns:
        A row of the table: the case's `WORDS`, what was ``predicted`` and ``measured``, the
        ``ratio`` of the two, and the ``verdict``: holds or differs.
    """
    words = WORDS[name]
    measured = case.measure(effort, words["searched_to"])
    limited = math.isfinite(case.predicted)
    ratio = measured / case.predicted if limited else math.nan
    holds = words["low"] <= ratio <= words["high"] if limited else math.isinf(measured)
    return {
        "case": name,
        **words,
        "predicted": case.predicted,
        "measured": measured,
        "ratio": ratio,
        "verdict": "holds" if holds else "differs",
        "good": holds,
        "tolerance": effort.tolerance,
    }
