"""What a trained agent does to observations before it sees them, without its training's wrapper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.arrays import Float32, Float64
from roller_env.envs.spaces import Observations

WHOLE = ""
"""Name of the observation where it is one array and not a dict of them."""


@dataclass(frozen=True, eq=False)
class Normalisation:
    """Scales observations to mean 0 and variance 1, with the bits of `VecNormalize`.

    Attributes:
        mean: float64 of each entry's shape, by its name, `WHOLE` if the observation is one array.
        variance: likewise.
        epsilon: added to the variance.
        clip: largest magnitude of what comes out.
    """

    mean: dict[str, Float64]
    variance: dict[str, Float64]
    epsilon: float
    clip: float

    @staticmethod
    def of(normaliser: VecNormalize) -> Normalisation | None:
        """Return what a wrapper does now, as copies; None if it leaves observations alone."""
        if not normaliser.norm_obs:
            return None
        found = statistics(normaliser)
        return Normalisation(
            mean={name: np.array(entry.mean) for name, entry in found.items()},
            variance={name: np.array(entry.var) for name, entry in found.items()},
            epsilon=normaliser.epsilon,
            clip=normaliser.clip_obs,
        )

    def __call__(self, observations: Observations) -> Observations:
        """Return observations, leading axis of environments, as the agent's network takes them."""
        if isinstance(observations, dict):
            return {name: self._entry(name, values) for name, values in observations.items()}
        return self._entry(WHOLE, observations)

    def _entry(self, name: str, values: Float32) -> Float32:
        scaled = (values - self.mean[name]) / np.sqrt(self.variance[name] + self.epsilon)
        return np.clip(scaled, -self.clip, self.clip).astype(np.float32)


def statistics(normaliser: VecNormalize) -> dict[str, RunningMeanStd]:
    """Return a wrapper's running statistics of the observations by name; none if it has none."""
    if not normaliser.norm_obs:
        return {}
    found = normaliser.obs_rms
    return dict(found) if isinstance(found, dict) else {WHOLE: found}


Moments = Mapping[str, Any]
"""``mean`` and ``variance``, float64 arrays of one shape, and ``count``, of what was seen."""


def running_moments(normaliser: VecNormalize) -> dict[str, Any]:
    """Return a wrapper's `Moments`: ``observations``, a mapping by name, and ``rewards``."""
    seen = {name: _moments(entry) for name, entry in statistics(normaliser).items()}
    return {"observations": seen, "rewards": _moments(normaliser.ret_rms)}


def set_running_moments(normaliser: VecNormalize, moments: Mapping[str, Any]) -> None:
    """Give a wrapper what `running_moments` returned."""
    for name, entry in statistics(normaliser).items():
        _set(entry, moments["observations"][name])
    _set(normaliser.ret_rms, moments["rewards"])


def merged(base: Moments, others: Sequence[Moments]) -> Moments:
    """Return the moments of what went on from one base in several places.

    Each of ``others`` has seen all of the base and something more. What more is found by taking
    the base out again (Chan, Golub & LeVeque 1979), and put to the base.

    Args:
        base: where all began.
        others: where each has come to.
    """
    whole = RunningMeanStd(shape=np.shape(base["mean"]))
    _set(whole, base)
    for other in others:
        count = other["count"] - base["count"]
        if count <= 0.0:
            continue
        mean = (other["count"] * other["mean"] - base["count"] * base["mean"]) / count
        between = (mean - base["mean"]) ** 2 * base["count"] * count / other["count"]
        squares = other["count"] * other["variance"] - base["count"] * base["variance"] - between
        whole.update_from_moments(mean, np.maximum(squares / count, 0.0), count)
    return _moments(whole)


def _moments(entry: RunningMeanStd) -> Moments:
    return {
        "mean": np.asarray(entry.mean),
        "variance": np.asarray(entry.var),
        "count": float(entry.count),
    }


def _set(entry: RunningMeanStd, moments: Moments) -> None:
    entry.mean, entry.var = moments["mean"], moments["variance"]
    entry.count = float(moments["count"])
