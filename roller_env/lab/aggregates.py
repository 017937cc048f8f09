"""What many trainings come to: the interquartile mean and its stratified bootstrap interval.

As R. Agarwal et al., *Deep Reinforcement Learning at the Edge of the Statistical Precipice*, 2021,
have it, whose library is rliable: levels are not drawn by chance, seeds are, so each level's seeds
are drawn anew among themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.stats import trim_mean

from roller_env.arrays import Float64
from roller_env.training.evaluate import CONFIDENCE, Estimate

RESAMPLES: Final = 10_000


def interquartile_mean(values: npt.ArrayLike) -> Any:
    """Return the mean of what is left without a quarter at each end, rounded down, last axis."""
    return trim_mean(np.asarray(values, np.float64), 0.25, axis=-1)


def stratified(strata: Sequence[Sequence[float]]) -> Estimate:
    """Return the interquartile mean of all values and its percentile bootstrap interval.

    By hand, since `scipy.stats.bootstrap`, which would draw the same, refuses a stratum of one
    value. One does not vary here, so that an interval with such strata is too narrow. Seeded.

    Args:
        strata: of each level the scores of its trainings, at least one.
    """
    rng = np.random.default_rng(0)
    values: list[Float64] = [np.asarray(stratum, np.float64) for stratum in strata]
    drawn = np.concatenate([rng.choice(own, (RESAMPLES, own.size)) for own in values], axis=1)
    tails = (0.5 - CONFIDENCE / 2.0, 0.5 + CONFIDENCE / 2.0)
    low, high = np.quantile(interquartile_mean(drawn), tails)
    return Estimate(float(interquartile_mean(np.concatenate(values))), float(low), float(high))
