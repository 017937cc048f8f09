"""What is kept of a training while it goes on: rows in the logs, the display, how far it is."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from stable_baselines3.common.logger import Logger

from roller_env.envs.infos import TERMS
from roller_env.game.result import REWARD_TERMS
from roller_env.training.checkpoint import Progress
from roller_env.training.config import TrainingConfig
from roller_env.training.curriculum import FROM_START
from roller_env.training.display import ProgressDisplay
from roller_env.training.files import RunFiles
from roller_env.training.logs import STEPS, ContinuingCSV, ContinuingTensorBoard
from roller_env.training.schedule import is_complete, last_step

_MEMORY: Final = 0.01
"""Share that an episode has of the running mean of mastery."""


def new_logger(files: RunFiles, progress: Progress) -> Logger:
    """Return a logger that goes on in a run's files from where its training is."""
    outputs = [
        ContinuingCSV(files.progress, progress.steps),
        ContinuingTensorBoard(files.tensorboard, progress.steps),
    ]
    return Logger(str(files.directory), outputs)


@dataclass(slots=True)
class Episodes:
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


class Recording:
    """Counts and shows a training's steps and episodes, whoever makes them.

    Attributes:
        progress: after the last update that was told.
    """

    def __init__(self, config: TrainingConfig, progress: Progress) -> None:
        """Go on from where a training is."""
        self.progress = progress
        self._display = ProgressDisplay(config.total_steps, progress.steps)
        self._config = config
        self._wall_s_before = progress.wall_s
        self._start_s = self._checkpoint_s = time.monotonic()
        self._episodes = Episodes()

    def add(self, infos: Iterable[dict[str, Any]]) -> None:
        """Take up the last infos of episodes that have ended; those from the start count."""
        self._episodes.infos += [info for info in infos if info[FROM_START]]

    def update(self, steps: int, logger: Logger) -> None:
        """Log and show that an update has been made after so many steps in all."""
        before = self.progress
        wall_s = self._wall_s_before + time.monotonic() - self._start_s
        mastery = self._episodes.mastery(before.mastery)
        final_from = before.final_from
        if final_from is None and self._config.mastery and mastery >= self._config.mastery:
            final_from = steps
        self.progress = Progress(steps, wall_s, mastery, final_from)
        speed = (steps - before.steps) / max(wall_s - before.wall_s, 1e-9)
        statistics = self._episodes.statistics()
        self._episodes = Episodes()
        for key, value in statistics.items():
            logger.record(key, value)
        logger.record(STEPS, steps, exclude="tensorboard")
        logger.record("time/fps", round(speed))
        logger.record("time/wall_s", round(wall_s, 3), exclude="tensorboard")
        logger.dump(steps)
        self._display.update(steps, last_step(self._config, self.progress), _achieved(statistics))

    def checkpoint_is_due(self) -> bool:
        """Return whether the last checkpoint is old, or the training at its end."""
        age_s = time.monotonic() - self._checkpoint_s
        is_old = age_s >= self._config.checkpoint_interval_s
        return is_old or is_complete(self._config, self.progress)

    def checkpoint_written(self) -> None:
        """Count a checkpoint's age from now."""
        self._checkpoint_s = time.monotonic()

    def close(self) -> None:
        """End the display."""
        self._display.close()


def _achieved(statistics: dict[str, float]) -> str:
    if not statistics["rollout/episodes"]:
        return "no episode ended yet"
    terms = ", ".join(f"{term} {statistics[f'reward/{term}']:.0f}" for term in REWARD_TERMS)
    return (
        f"finish {statistics['rollout/success_rate']:.0%}, "
        f"coins {statistics['rollout/coins']:.1f}, falls {statistics['rollout/fall_rate']:.0%}; "
        f"reward {statistics['rollout/ep_rew_mean']:.0f} ({terms})"
    )
