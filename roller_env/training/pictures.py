"""What a run shows: the one place from which training calls `roller_env.drawing`."""

from __future__ import annotations

from pathlib import Path

from roller_env.drawing import topdown
from roller_env.drawing.opengl import missing_opengl
from roller_env.drawing.video import record_episode
from roller_env.training.config import TrainingConfig
from roller_env.training.evaluate import Evaluation
from roller_env.training.policy import Policy


def draw_paths(evaluation: Evaluation, file: Path) -> None:
    """Draw the level from above with the path of every episode."""
    paths = [episode.path for episode in evaluation.episodes]
    outcomes = [episode.outcome for episode in evaluation.episodes]
    topdown.draw_paths(evaluation.level, paths, outcomes, file)


def record_video(policy: Policy, config: TrainingConfig, file: Path) -> None:
    """Film one episode; says so and does nothing where no OpenGL library is found."""
    missing = missing_opengl()
    if missing is not None:
        print(f"video skipped: {missing}")
        return
    record_episode(policy, config, file)
