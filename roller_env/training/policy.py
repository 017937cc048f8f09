"""A trained agent as a function from observations to actions."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.files import RunError, RunFiles

Observations = npt.NDArray[np.float32] | dict[str, npt.NDArray[np.float32]]


class Policy(Protocol):
    """Anything that plays: a trained agent, or a function a person wrote."""

    def __call__(self, observations: Observations, /) -> npt.NDArray[Any]:
        """Return one action a row.

        Args:
            observations: as the environment gives them, leading axis of environments.
        """


class TrainedPolicy:
    """The deterministic agent of a run: normalises what it sees and takes its best action.

    Attributes:
        config: the training's, which says what environment it plays.
        network: its policy and value networks.
    """

    def __init__(self, model: PPO, normaliser: VecNormalize, config: TrainingConfig) -> None:
        self.config = config
        self.network: ActorCriticPolicy = model.policy
        self._normaliser = normaliser

    def __call__(self, observations: Observations, /) -> npt.NDArray[Any]:
        """Return one action a row; see `Policy`."""
        seen = self._normaliser.normalize_obs(observations)
        actions, _ = self.network.predict(seen, deterministic=True)
        return actions


def save_policy(model: PPO, files: RunFiles) -> None:
    """Write what `load_policy` and Stable-Baselines3 itself read."""
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    model.save(files.policy)
    normaliser.save(str(files.normaliser))


def load_policy(run: Path) -> TrainedPolicy:
    """Return the agent a run left behind.

    The files hold pickles, as Stable-Baselines3's do: load only runs you trust.

    Args:
        run: its directory, such as ``runs/ppo_classic-seed0``.

    Raises:
        RunError: not a run, or its training has not ended yet.
    """
    files = RunFiles(run)
    for file in (files.config, files.policy, files.normaliser):
        if not file.is_file():
            message = f"{run} has no {file.name}; 'scripts/train.py --resume' finishes a run"
            raise RunError(message)
    normaliser: VecNormalize = pickle.loads(files.normaliser.read_bytes())
    normaliser.training = False
    model = PPO.load(files.policy, device="cpu")
    return TrainedPolicy(model, normaliser, load_config(files.config))
