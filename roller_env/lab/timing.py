"""Wall time on machines that are shared and noisy: medians of several, and their spread."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

REPEATS = 7
"""Repetitions of which the median is taken."""


@dataclass(frozen=True, slots=True)
class WallTime:
    """How long something took.

    Attributes:
        median_s: median of the repetitions, seconds.
        spread: (largest - smallest) / median: how far the machine can be believed.
        repeats: how often it was done.
    """

    median_s: float
    spread: float
    repeats: int


def wall_time(work: Callable[[], object], repeats: int = REPEATS) -> WallTime:
    """Do ``work`` once to warm the caches and then ``repeats`` times against the clock."""
    if repeats < 1:
        raise ValueError(f"repeats: found {repeats}; at least 1")
    work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    median = statistics.median(seconds)
    return WallTime(median, (max(seconds) - min(seconds)) / median, repeats)
