"""The learning itself: Stable-Baselines3's PPO, kept on record and able to go on after a kill."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import ConstantSchedule, LinearSchedule
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.envs.infos import TERMS
from roller_env.envs.sb3 import RollerVecEnv
from roller_env.game.result import REWARD_TERMS
from roller_env.training.checkpoint import Progress, load_checkpoint, save_checkpoint
from roller_env.training.config import TrainingConfig
from roller_env.training.curriculum import FROM_START, StartStateCurriculum
from roller_env.training.display import ProgressDisplay
from roller_env.training.files import RunFiles
from roller_env.training.logs import STEPS, ContinuingCSV, ContinuingTensorBoard
from roller_env.training.network import network_class, network_options

_MEMORY: Final = 0.01
"""Share that an episode has of the running mean of mastery."""

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
    outputs = [
        ContinuingCSV(files.progress, progress.steps),
        ContinuingTensorBoard(files.tensorboard, progress.steps),
    ]
    model.set_logger(Logger(str(files.directory), outputs))
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
        recorder.display.close()
        model.logger.close()
    return model, recorder.progress


def is_complete(config: TrainingConfig, progress: Progress) -> bool:
    """Return whether a training wants no more steps."""
    return progress.steps >= last_step(config, progress) or has_spent_all(config, progress)


def has_spent_all(config: TrainingConfig, progress: Progress) -> bool:
    """Return whether a training may not go on, whatever it has reached."""
    budget_s = config.wall_clock_budget_s
    out_of_time = budget_s is not None and progress.wall_s >= budget_s
    return progress.steps >= config.total_steps or out_of_time


def last_step(config: TrainingConfig, progress: Progress) -> int:
    """Return after how many steps a training ends, as far as that is known."""
    if progress.final_from is None:
        return config.total_steps
    return min(progress.final_from + config.final_steps, config.total_steps)


def finality(config: TrainingConfig, progress: Progress) -> float:
    """Return how far the last values of what changes are reached, 0 to 1.

    Without a mastery to reach they are so evenly from the first step to the last.
    """
    if config.mastery is None:
        return progress.steps / config.total_steps
    begins, length = progress.final_from, min(config.final_steps, config.total_steps)
    if begins is None:
        begins = config.total_steps - length
    return min(max((progress.steps - begins) / length, 0.0), 1.0)


def make_environments(config: TrainingConfig) -> StartStateCurriculum:
    """Return the environments that a configuration trains in."""
    fraction = config.start_state_curriculum
    explorers = -(-config.num_envs // _ROWS_PER_EXPLORER) if fraction > 0.0 else 0
    environments = RollerVecEnv(
        num_envs=config.num_envs + explorers, seed=config.seed, **config.environment.keywords()
    )
    return StartStateCurriculum(environments, fraction, config.seed, explorers)


def _learning_rate(config: TrainingConfig) -> LinearSchedule:
    """Return the learning rate by how much is left of what changes it, 1 to 0."""
    end = 0.0 if config.ppo.learning_rate_decay == "linear" else config.ppo.learning_rate
    return LinearSchedule(config.ppo.learning_rate, end, end_fraction=1.0)


def new_model(config: TrainingConfig, environments: StartStateCurriculum) -> PPO:
    """Return a learner that knows nothing yet."""
    normaliser = VecNormalize(
        environments,
        norm_obs=config.normalise_observations,
        norm_reward=config.normalise_rewards,
        gamma=config.ppo.gamma,
    )
    ppo = config.ppo
    return PPO(
        network_class(config),
        normaliser,
        learning_rate=_learning_rate(config),
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


@dataclass(slots=True)
class _Episodes:
    """The whole episodes, from the level's start, that ended during one rollout."""

    infos: list[dict[str, Any]] = field(default_factory=list)

    def statistics(self) -> dict[str, float]:
        """Return means; NaN where no episode ended."""
        return {
            "rollout/episodes": len(self.infos),
            "rollout/ep_rew_mean": self._mean([info["episode"]["r"] for info in self.infos]),
            "rollout/ep_len_mean": self._mean([info["episode"]["l"] for info in self.infos]),
            "rollout/success_rate": self._mean([info["success"] for info in self.infos]),
            "rollout/score_percent": self._mean([info["score_percent"] for info in self.infos]),
            "rollout/coins": self._mean([info["coins"] for info in self.infos]),
            "rollout/fall_rate": self._mean([info["fall"] for info in self.infos]),
            "rollout/diverged": sum(info["diverged"] for info in self.infos),
            **{
                f"reward/{term}": self._mean([info[TERMS][term] for info in self.infos])
                for term in REWARD_TERMS
            },
        }

    def mastery(self, before: float) -> float:
        """Return the running mean of `Progress.mastery` after these episodes."""
        for info in self.infos:
            achieved = info["success"] * info["score_percent"] / 100.0
            before += _MEMORY * (achieved - before)
        return before

    @staticmethod
    def _mean(values: list[float]) -> float:
        return float(np.mean(values)) if values else float("nan")


class _Recorder(BaseCallback):
    """Between two updates: a row in the logs, the display, and a checkpoint when one is due."""

    def __init__(self, config: TrainingConfig, files: RunFiles, progress: Progress) -> None:
        super().__init__()
        self.progress = progress
        self.display = ProgressDisplay(config.total_steps, progress.steps)
        self._config = config
        self._files = files
        self._wall_s_before = progress.wall_s
        self._start_s = self._checkpoint_s = time.monotonic()
        self._episodes = _Episodes()

    def _on_step(self) -> bool:
        ended = (self.locals["infos"][row] for row in np.flatnonzero(self.locals["dones"]))
        self._episodes.infos += [info for info in ended if info[FROM_START]]
        return True

    def _on_rollout_start(self) -> None:
        # SB3 has no event for the end of an update; the next rollout's start is the same moment.
        self._between_updates()
        if is_complete(self._config, self.progress):
            raise _BudgetSpent
        assert isinstance(self.model, PPO)
        begin, end = (
            self._config.ppo.entropy_coefficient,
            self._config.ppo.final_entropy_coefficient,
        )
        if self._config.mastery is not None:
            begin *= 1.0 - self.progress.mastery
            # SB3 knows how far a training is only of those that end at a known step.
            left = 1.0 - finality(self._config, self.progress)
            self.model.lr_schedule = ConstantSchedule(_learning_rate(self._config)(left))
        if end is not None:
            done = finality(self._config, self.progress)
            self.model.ent_coef = begin + (end - begin) * done

    def _on_training_end(self) -> None:
        self._between_updates()

    def _between_updates(self) -> None:
        steps = self.model.num_timesteps
        if steps == self.progress.steps:
            return
        before = self.progress
        wall_s = self._wall_s_before + time.monotonic() - self._start_s
        mastery = self._episodes.mastery(before.mastery)
        final_from = before.final_from
        if final_from is None and self._config.mastery and mastery >= self._config.mastery:
            final_from = steps
        self.progress = Progress(steps, wall_s, mastery, final_from)
        speed = (steps - before.steps) / max(wall_s - before.wall_s, 1e-9)
        statistics = self._episodes.statistics()
        self._episodes = _Episodes()
        for key, value in statistics.items():
            self.logger.record(key, value)
        self.logger.record(STEPS, steps, exclude="tensorboard")
        self.logger.record("time/fps", round(speed))
        self.logger.record("time/wall_s", round(wall_s, 3), exclude="tensorboard")
        self.logger.dump(steps)
        self.display.update(steps, last_step(self._config, self.progress), _achieved(statistics))
        self._checkpoint_if_due()

    def _checkpoint_if_due(self) -> None:
        age_s = time.monotonic() - self._checkpoint_s
        if age_s >= self._config.checkpoint_interval_s or is_complete(self._config, self.progress):
            assert isinstance(self.model, PPO)
            save_checkpoint(self._files.checkpoint, self.model, self._config, self.progress)
            self._checkpoint_s = time.monotonic()


def _achieved(statistics: dict[str, float]) -> str:
    if not statistics["rollout/episodes"]:
        return "no episode ended yet"
    terms = ", ".join(f"{term} {statistics[f'reward/{term}']:.0f}" for term in REWARD_TERMS)
    return (
        f"finish {statistics['rollout/success_rate']:.0%}, "
        f"coins {statistics['rollout/coins']:.1f}, falls {statistics['rollout/fall_rate']:.0%}; "
        f"reward {statistics['rollout/ep_rew_mean']:.0f} ({terms})"
    )
