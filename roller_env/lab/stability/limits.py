"""A limit: what is predicted, how it is found by bisection, and how the two are judged."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

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
"""Of every limit its ``group`` and the ``quantity`` predicted; the ``method`` that moves the
bodies; the ``formula`` as people write it (h is the time step, tau ``solref[0]``, d the impedance,
z a damping ratio) and its ``source``; the ``criterion`` by which a run is judged; the allowed
measured / predicted, ``low`` to ``high``; the largest value ``searched_to`` where none is expected
to fail; whether ``--quick`` runs it too; and a ``note`` where a band is wider than `EXACT`, or the
measured value is not the predicted one."""

EXACT: Final = (0.99, 1.01)
"""Band of measured / predicted where the formula is exact."""

REACH: Final = 1.3
FARTHEST: Final = 1e4
"""How far on either side of a guess the threshold is looked for, first and at most."""


def locate(holds: Callable[[float], bool], guess: float, tolerance: float) -> float:
    """Return the threshold near ``guess``, or far from it, above which ``holds`` no longer does.

    It is the geometric middle of a bracket whose relative width is the ``tolerance``.

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


class Effort(NamedTuple):
    """How hard a measurement tries."""

    tolerance: float  # Relative width of the bracket at which bisection stops.
    steps: int  # Of a smooth motion, after which growth is judged.
    phases: int  # Moments within a step at which a ball arrives.
    starts: int  # Of each of the game's hard cases.
    repeats: int  # Interleaved runs of which the median time is taken.


FULL: Final = Effort(tolerance=1e-4, steps=20_000, phases=32, starts=12, repeats=9)
QUICK: Final = Effort(tolerance=2e-3, steps=6_000, phases=8, starts=2, repeats=1)


class Quantity(NamedTuple):
    """A quantity that is predicted, and what measures it; both infinite where nothing fails."""

    predicted: float
    value: Callable[[Effort], float]

    def measure(self, effort: Effort, _searched_to: float) -> float:
        """Return the quantity."""
        return self.value(effort)


class Limit(NamedTuple):
    """A limit that is predicted, infinite where none is expected, and what says if all is well.

    ``tolerance`` is of the bisection, where that of the effort would take too long.
    """

    predicted: float
    holds: Callable[[Effort, float], bool]
    tolerance: float = 0.0

    def measure(self, effort: Effort, searched_to: float) -> float:
        """Return the value at which it begins to fail, or infinity."""
        holds = partial(self.holds, effort)
        if math.isfinite(self.predicted):
            return locate(holds, self.predicted, max(effort.tolerance, self.tolerance))
        values = np.geomspace(searched_to / 200.0, searched_to, 60).tolist()
        return next((value for value in values if not holds(value)), math.inf)


Case = Quantity | Limit


def judged(name: str, case: Case, effort: Effort) -> dict[str, Any]:
    """Measure a case and return a row: its `WORDS`, ``predicted``, ``measured``, their ``ratio``.

    And the ``verdict``: it holds; it departs, as the ``note`` says, where the band is one that the
    prediction is not in; or it differs. And whether that is ``good``; and whether the value was
    ``bisected``, or is what one measurement says.
    """
    row = WORDS[name] | {"case": name, "predicted": case.predicted, "tolerance": effort.tolerance}
    row["measured"] = measured = case.measure(effort, row["searched_to"])
    limited = math.isfinite(case.predicted)
    row["ratio"] = ratio = measured / case.predicted if limited else math.nan
    row["good"] = row["low"] <= ratio <= row["high"] if limited else math.isinf(measured)
    row["bisected"] = isinstance(case, Limit)
    departs = limited and not row["low"] <= 1.0 <= row["high"]
    return row | {"verdict": "differs" if not row["good"] else "departs" if departs else "holds"}
