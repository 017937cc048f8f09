"""What the recipe trains in, as Gymnasium's vectors: start-state curriculum, everything scaled."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from roller_env.arrays import Bool, Float32
from roller_env.envs.sb3 import TRUNCATED
from roller_env.training.checkpoint import Tree, curriculum_of, curriculum_tree
from roller_env.training.config import TrainingConfig
from roller_env.training.curriculum import StartStateCurriculum
from roller_env.training.normalisation import running_moments, set_running_moments
from roller_env.training.ppo import make_environments, new_normaliser


def part_of(config: TrainingConfig, number: int) -> TrainingConfig:
    """Return what one of the runners plays, with seeds of its own.

    Args:
        config: of the whole training.
        number: of the runner, from 0 on.
    """
    rows = config.num_envs // config.cluster.runners
    # A runner has one CPU. Its rows and its explorers take the seeds after those of the runner
    # before; there are no more explorers than rows.
    alone = replace(config.environment, num_threads=1)
    changes = {"num_envs": rows, "seed": config.seed + 2 * rows * number, "environment": alone}
    return config.model_copy(update=changes)


class RecipeVectorEnv(gym.vector.VectorEnv[Any, Any, Any]):
    """The environments of a training's configuration, autoreset SAME_STEP.

    Practice, explorers and normalisation are inside, so that any learner that takes vectors takes
    the recipe with them. ``infos`` has Gymnasium's ``final_obs``, scaled like all observations.

    Attributes:
        observations: (num_envs, ...) of now, scaled.
        ended: the last infos of the episodes that have ended; whoever reads them empties the list.
    """

    def __init__(self, config: TrainingConfig) -> None:
        """Make a configuration's ``num_envs`` environments, and their explorers."""
        self.config = config
        self.ended: list[dict[str, Any]] = []
        self.curriculum: StartStateCurriculum = make_environments(config)
        self.normaliser = new_normaliser(config, self.curriculum)
        self.num_envs = config.num_envs
        self.single_observation_space = self.normaliser.observation_space
        self.single_action_space = self.normaliser.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}
        self.observations: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin every episode at the start.

        Args:
            seed: of the environments, row i is seeded with ``seed + i``; by default the
                configuration's the first time, and what follows from it after that.
            options: none are known.

        Raises:
            ValueError: there is an option.
        """
        if options:
            raise ValueError(f"options: found {options!r}; there are none")
        if seed is not None:
            self.curriculum.environments.seed(seed)
        self.observations = self.normaliser.reset()
        return self.observations, {}

    def step(self, actions: npt.NDArray[Any]) -> tuple[Any, Float32, Bool, Bool, dict[str, Any]]:
        """Step every row; see `RollerVectorEnv.step`. Rewards are scaled."""
        observations, rewards, dones, infos = self.normaliser.step(actions)
        self.observations = observations
        truncated = np.zeros(self.num_envs, dtype=bool)
        told: dict[str, Any] = {}
        rows = np.flatnonzero(dones)
        if len(rows):
            told = {"final_obs": np.full(self.num_envs, None, dtype=object), "_final_obs": dones}
            for row in rows.tolist():
                info = infos[row]
                truncated[row] = info[TRUNCATED]
                told["final_obs"][row] = info.pop("terminal_observation")
                self.ended.append(info)
        return observations, rewards.astype(np.float32), dones & ~truncated, truncated, told

    def snapshot(self) -> Tree:
        """Return all that the future depends on, as arrays and JSON's values."""
        return {
            "environments": curriculum_tree(self.curriculum.snapshot()),
            "normaliser": {
                **running_moments(self.normaliser),
                "returns": self.normaliser.returns,
            },
            "observations": self.observations,
        }

    def restore(self, tree: Tree) -> None:
        """Put everything back; the same actions then give the same bits.

        Raises:
            ValueError: it is of another level, or of another number of rows.
        """
        self.reset()
        own = self.curriculum.snapshot()
        self.curriculum.restore(curriculum_of(tree["environments"], own))
        set_running_moments(self.normaliser, tree["normaliser"])
        self.normaliser.returns = tree["normaliser"]["returns"].copy()
        self.observations = tree["observations"]
