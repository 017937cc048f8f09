"""What a run shows: the one place from which training calls `roller_env.drawing`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

from roller_env.config import make_config
from roller_env.drawing import topdown
from roller_env.drawing.opengl import missing_opengl
from roller_env.drawing.video import record_episode
from roller_env.envs.spaces import shape_observation
from roller_env.game.actions import forces
from roller_env.simulation import Simulation
from roller_env.training.config import TrainingConfig
from roller_env.training.evaluate import Evaluation
from roller_env.training.policy import Policy

MAX_PATHS: Final = 100
"""Paths on one map; more would hide one another."""


def draw_paths(evaluation: Evaluation, file: Path) -> None:
    """Draw the level from above with the paths of the evaluation's first episodes."""
    shown = evaluation.episodes[:MAX_PATHS]
    topdown.draw_paths(
        evaluation.level,
        [episode.path for episode in shown],
        [episode.outcome for episode in shown],
        file,
    )


def record_video(policy: Policy, config: TrainingConfig, seed: int, file: Path) -> Path | None:
    """Film one episode, or say in one line what drawing lacks on this machine.

    Args:
        policy: what plays.
        config: of the training; its evaluation environment is what is filmed.
        seed: of the game; with an evaluation's seed it is that evaluation's first episode.
        file: where to; see `roller_env.drawing.video.write_video`.

    Returns:
        The path written; None if nothing could be drawn.
    """
    missing = missing_opengl()
    if missing is not None:
        print(f"no video: {missing}", flush=True)
        return None
    options = make_config(level=config.level, **config.evaluation_options)
    simulation = Simulation(options)
    simulation.seed([seeding.np_random(seed)[0]])
    simulation.reset()

    def act(games: Simulation) -> npt.NDArray[np.float64]:
        return forces(options.action, policy(shape_observation(options, games.observe())))

    return record_episode(simulation, act, file)
