"""Finding the value at which something begins to fail."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

Holds = Callable[[float], bool]
"""Whether all is well at a value."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """Where something begins to fail.

    Attributes:
        holds: largest value at which it was seen to hold.
        fails: smallest value at which it was seen to fail; infinite if none was.
        runs: how many values were tried.
    """

    holds: float
    fails: float
    runs: int

    @property
    def value(self) -> float:
        """The threshold: the geometric middle of the two, or infinity."""
        return math.sqrt(self.holds * self.fails) if math.isfinite(self.fails) else math.inf


def bisect(holds: Holds, low: float, high: float, tolerance: float) -> Threshold:
    """Narrow down the threshold between ``low``, which must hold, and ``high``, which must not.

    Args:
        holds: must hold below one threshold and fail above it.
        low: positive.
        high: more than ``low``.
        tolerance: relative; when the bracket is narrower it is done.

    Raises:
        ValueError: a bracket or tolerance that makes no sense, or ends of which ``low`` fails
            or ``high`` holds: then the threshold is not between them.
    """
    if not 0.0 < low < high < math.inf:
        raise ValueError(f"bisect needs 0 < low < high, found low {low:g} and high {high:g}")
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"tolerance: found {tolerance:g}; must be between 0 and 1")
    if not holds(low):
        raise ValueError(f"the threshold is not between {low:g} and {high:g}: {low:g} fails")
    if holds(high):
        raise ValueError(f"the threshold is not between {low:g} and {high:g}: {high:g} holds")
    runs = 2
    while high / low - 1.0 > tolerance:
        middle = math.sqrt(low * high)
        runs += 1
        low, high = (middle, high) if holds(middle) else (low, middle)
    return Threshold(low, high, runs)


REACH: Final = 1.3
"""How far on either side of a guess the threshold is looked for first."""

FARTHEST: Final = 1e4
"""How far off a guess may be."""


def locate(holds: Holds, guess: float, tolerance: float) -> Threshold:
    """Find the threshold near ``guess``, and far from it if the guess was wrong.

    Raises:
        ValueError: the threshold is more than `FARTHEST` times as large or small as the guess.
    """
    low, high, runs = guess / REACH, guess * REACH, 0
    while low > guess / FARTHEST and not holds(low):
        low, high, runs = low / 2.0, low, runs + 1
    while high < guess * FARTHEST and holds(high):
        low, high, runs = high, 2.0 * high, runs + 1
    found = bisect(holds, low, high, tolerance)
    return Threshold(found.holds, found.fails, found.runs + runs)


def first_failure(holds: Holds, values: Iterable[float]) -> Threshold:
    """Try rising values until one fails: for what is expected to hold at all of them.

    Raises:
        ValueError: the values do not rise, or there are none.
    """
    last, runs = 0.0, 0
    for value in values:
        if not value > last:
            raise ValueError(f"values must be positive and rise, found {value:g} after {last:g}")
        runs += 1
        if not holds(value):
            return Threshold(last, value, runs)
        last = value
    if not runs:
        raise ValueError("first_failure needs at least one value")
    return Threshold(last, math.inf, runs)
