"""Other learners than PPO on the same games, to see that they are not shaped for one algorithm.

SAC, off-policy, with continuous forces, and QR-DQN, off-policy, with nine directions, as
Stable-Baselines3 and sb3-contrib have them, on a level from its start: no curriculum, no early end.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import torch
from stable_baselines3 import SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.actions import ActionMode
from roller_env.lab.trainings import shares
from roller_env.training.config import TrainingConfig
from roller_env.training.evaluate import evaluate
from roller_env.training.run import EVALUATION_SEED_OFFSET

ENVS: Final = 64


def _sac(envs: VecNormalize, config: TrainingConfig) -> BaseAlgorithm:
    return SAC(
        "MlpPolicy",
        envs,
        gamma=config.ppo.gamma,
        train_freq=1,
        gradient_steps=8,
        learning_starts=10_000,
        buffer_size=500_000,
        policy_kwargs={"net_arch": [128, 128]},
        seed=config.seed,
        device="cpu",
    )


def _qr_dqn(envs: VecNormalize, config: TrainingConfig) -> BaseAlgorithm:
    # Not among Roller's dependencies.
    from sb3_contrib import QRDQN  # type: ignore[import-not-found]

    learner: BaseAlgorithm = QRDQN(
        "MlpPolicy",
        envs,
        gamma=config.ppo.gamma,
        train_freq=1,
        gradient_steps=4,
        batch_size=128,
        learning_starts=10_000,
        buffer_size=500_000,
        target_update_interval=5_000,
        exploration_fraction=0.3,
        exploration_final_eps=0.02,
        policy_kwargs={"net_arch": [128, 128], "n_quantiles": 32},
        seed=config.seed,
        device="cpu",
    )
    return learner


LEARNERS: Final[
    dict[str, tuple[ActionMode, Callable[[VecNormalize, TrainingConfig], BaseAlgorithm]]]
] = {
    "SAC": ("force", _sac),
    "QR-DQN": ("directions", _qr_dqn),
}
"""Of each learner its actions, and what makes it."""


def row(learner: str, level: str, seed: int, steps: int, config: TrainingConfig) -> dict[str, Any]:
    """Train one learner on a level, and judge its likeliest actions in the evaluation's games.

    Args:
        learner: of `LEARNERS`.
        level: which.
        seed: of the learner and its games.
        steps: environment steps.
        config: the recipe, of which it takes the games, the rewards and the discount.
    """
    torch.set_num_threads(1)
    action, make = LEARNERS[learner]
    config = config.on_level(level).model_copy(update={"seed": seed})
    learnt = replace(config.environment, action=action)
    judged = replace(config.evaluation_environment, action=action)
    begun = time.process_time()
    envs = VecNormalize(
        RollerVecEnv(num_envs=ENVS, seed=seed, **learnt.keywords()), gamma=config.ppo.gamma
    )
    model = make(envs, config)
    model.learn(steps)
    spent = time.process_time() - begun
    games = RollerVectorEnv(config.evaluation_episodes, **judged.keywords())

    def player(observations: Any) -> Any:
        return model.predict(envs.normalize_obs(observations), deterministic=True)[0]

    finish, coins = shares(evaluate(player, games, seed=EVALUATION_SEED_OFFSET + seed).results)
    return {
        "learner": learner,
        "level": level,
        "seed": seed,
        "steps": model.num_timesteps,
        "finish": finish,
        "coins": coins,
        "train_cpu_s": round(spent, 1),
    }
