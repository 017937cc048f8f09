"""What a trained agent does to observations before it sees them, without its training's wrapper."""

from __future__ import annotations

from dataclasses import dataclass

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
