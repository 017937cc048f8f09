"""What is promised, and how a measurement stands to it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

from roller_env.lab.benchmark.race import Median

Sense = Literal["at least", "at most"]
Verdict = Literal["met", "missed", "not measured"]

NOT_MEASURED: Final = Median(math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class GoalRow:
    """One goal, and what was measured.

    Attributes:
        comparison: what is compared.
        sense: on which side of the goal it should be.
        goal: the bound.
        measured: median over the rounds; NaN if it was not measured.
        smallest: of any round.
        largest: of any round.
        rounds: how many.
        verdict: ``met``, ``missed`` or ``not measured``.
    """

    comparison: str
    sense: Sense
    goal: float
    measured: float
    smallest: float
    largest: float
    rounds: int
    verdict: Verdict


def judge(comparison: str, sense: Sense, goal: float, measured: Median, rounds: int = 1) -> GoalRow:
    """Return the row of a measurement; `NOT_MEASURED` is no failure, but no success either."""
    value = measured.value
    verdict: Verdict
    if math.isnan(value):
        verdict, rounds = "not measured", 0
    else:
        verdict = "met" if (value >= goal if sense == "at least" else value <= goal) else "missed"
    return GoalRow(comparison, sense, goal, value, measured.low, measured.high, rounds, verdict)
