"""How long a training goes on, and what changes while it does."""

from __future__ import annotations

from stable_baselines3.common.utils import LinearSchedule

from roller_env.training.checkpoint import Progress
from roller_env.training.config import TrainingConfig


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


def learning_rate(config: TrainingConfig) -> LinearSchedule:
    """Return the learning rate by how much is left of what changes it, 1 to 0."""
    end = 0.0 if config.ppo.learning_rate_decay == "linear" else config.ppo.learning_rate
    return LinearSchedule(config.ppo.learning_rate, end, end_fraction=1.0)


def entropy_coefficient(config: TrainingConfig, progress: Progress) -> float:
    """Return the weight of the entropy bonus in the next update."""
    begin, end = config.ppo.entropy_coefficient, config.ppo.final_entropy_coefficient
    if end is None:
        return begin
    if config.mastery is not None:
        begin *= 1.0 - progress.mastery
    return begin + (end - begin) * finality(config, progress)
