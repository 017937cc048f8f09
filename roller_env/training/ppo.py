"""The learning itself: Stable-Baselines3's PPO, kept on record and able to go on after a kill."""

from __future__ import annotations

import sys
from typing import Final

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import ConstantSchedule
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.training.checkpoint import Progress, load_checkpoint, save_checkpoint
from roller_env.training.config import TrainingConfig
from roller_env.training.curriculum import StartStateCurriculum
from roller_env.training.files import RunFiles
from roller_env.training.network import network_class, network_options
from roller_env.training.recording import Recording, new_logger
from roller_env.training.schedule import (
    entropy_coefficient,
    finality,
    is_complete,
    learning_rate,
)

_ROWS_PER_EXPLORER: Final = 4
"""Environments that are learnt from for each that only explores."""


def learn(config: TrainingConfig, files: RunFiles) -> tuple[PPO, Progress]:
    """Train to the end of the configuration, from the checkpoint if there is one.

    Args:
        config: of the training.
        files: where checkpoint and logs are or go.

    Returns:
        The learner, its environments inside, and how far it came.
    """
    files.directory.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(config.torch_threads)
    # In every call torch would else see whether a network's probabilities sum to 1, 2 % of it all;
    # what is not a number is refused when actions are drawn.
    torch.distributions.Distribution.set_default_validate_args(False)
    environments = make_environments(config)
    model, progress = new_model(config, environments), Progress()
    if files.checkpoint.exists():
        checkpoint = load_checkpoint(files.checkpoint)
        checkpoint.restore(model)
        progress = checkpoint.progress
    if is_complete(config, progress):
        return model, progress
    model.set_logger(new_logger(files, progress))
    recorder = _Recorder(config, files, progress)
    try:
        model.learn(
            total_timesteps=config.total_steps - progress.steps,
            callback=recorder,
            reset_num_timesteps=False,
            # The recorder writes a row when its update is done, not before as SB3 would.
            log_interval=sys.maxsize,
        )
    except _BudgetSpent:
        pass
    finally:
        recorder.recording.close()
        model.logger.close()
    return model, recorder.recording.progress


def make_environments(config: TrainingConfig) -> StartStateCurriculum:
    """Return the environments that a configuration trains in."""
    fraction = config.start_state_curriculum
    explorers = -(-config.num_envs // _ROWS_PER_EXPLORER) if fraction > 0.0 else 0
    environments = RollerVecEnv(
        num_envs=config.num_envs + explorers, seed=config.seed, **config.environment.keywords()
    )
    return StartStateCurriculum(environments, fraction, config.seed, explorers)


def new_normaliser(config: TrainingConfig, environments: StartStateCurriculum) -> VecNormalize:
    """Return environments with observations and rewards scaled as the configuration says."""
    return VecNormalize(
        environments,
        norm_obs=config.normalise_observations,
        norm_reward=config.normalise_rewards,
        gamma=config.ppo.gamma,
    )


def new_model(config: TrainingConfig, environments: StartStateCurriculum) -> PPO:
    """Return a learner that knows nothing yet."""
    ppo = config.ppo
    return PPO(
        network_class(config),
        new_normaliser(config, environments),
        learning_rate=learning_rate(config),
        n_steps=ppo.rollout_steps,
        batch_size=ppo.batch_size,
        n_epochs=ppo.epochs,
        gamma=ppo.gamma,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip_range,
        ent_coef=ppo.entropy_coefficient,
        vf_coef=ppo.value_coefficient,
        max_grad_norm=ppo.max_grad_norm,
        target_kl=ppo.target_kl,
        policy_kwargs=network_options(config),
        seed=config.seed,
        device="cpu",
    )


class _BudgetSpent(Exception):
    """Leaves SB3's loop between two updates, which a callback's False cannot."""


class _Recorder(BaseCallback):
    """Between two updates: a row in the logs, the display, and a checkpoint when one is due."""

    def __init__(self, config: TrainingConfig, files: RunFiles, progress: Progress) -> None:
        super().__init__()
        self.recording = Recording(config, progress)
        self._config = config
        self._files = files

    def _on_step(self) -> bool:
        ended = (self.locals["infos"][row] for row in np.flatnonzero(self.locals["dones"]))
        self.recording.add(ended)
        return True

    def _on_rollout_start(self) -> None:
        # SB3 has no event for the end of an update; the next rollout's start is the same moment.
        self._between_updates()
        progress = self.recording.progress
        if is_complete(self._config, progress):
            raise _BudgetSpent
        assert isinstance(self.model, PPO)
        if self._config.mastery is not None:
            # SB3 knows how far a training is only of those that end at a known step.
            left = 1.0 - finality(self._config, progress)
            self.model.lr_schedule = ConstantSchedule(learning_rate(self._config)(left))
        self.model.ent_coef = entropy_coefficient(self._config, progress)

    def _on_training_end(self) -> None:
        self._between_updates()

    def _between_updates(self) -> None:
        if self.model.num_timesteps == self.recording.progress.steps:
            return
        self.recording.update(self.model.num_timesteps, self.logger)
        if self.recording.checkpoint_is_due():
            assert isinstance(self.model, PPO)
            progress = self.recording.progress
            save_checkpoint(self._files.checkpoint, self.model, self._config, progress)
            self.recording.checkpoint_written()
