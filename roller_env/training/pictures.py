"""What a run shows: the one place from which training calls `roller_env.drawing`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from roller_env.drawing import topdown
from roller_env.drawing.opengl import missing_opengl
from roller_env.replay.pictures import film
from roller_env.replay.playback import paths
from roller_env.training.evaluate import Evaluation

MAX_PATHS: Final = 100
"""Paths on one map; more would hide one another."""


def draw_paths(evaluation: Evaluation, file: Path) -> None:
    """Draw the level from above with the paths of the evaluation's first episodes."""
    shown = evaluation.replays[:MAX_PATHS]
    outcomes = [replay.result.outcome for replay in shown]
    topdown.draw_paths(evaluation.level, paths(shown), outcomes, file)


def film_episode(evaluation: Evaluation, file: Path) -> Path | None:
    """Film the evaluation's first episode, or say in one line what drawing lacks on this machine.

    Args:
        evaluation: what was played.
        file: where to; see `roller_env.drawing.video.write_video`.

    Returns:
        The path written; None if nothing could be drawn.
    """
    missing = missing_opengl()
    if missing is not None:
        print(f"no video: {missing}", flush=True)
        return None
    return film(evaluation.replays[0], file)
