"""The episodes of an evaluation as replays."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from roller_env.config import make_config
from roller_env.replay import replays_of, save_replay
from roller_env.replay.file import SUFFIX
from roller_env.training.config import TrainingConfig
from roller_env.training.evaluate import Evaluation
from roller_env.training.files import RunError


def save_replays(
    evaluation: Evaluation, config: TrainingConfig, directory: Path, player: str
) -> list[Path]:
    """Write every episode of an evaluation as a replay, in its order.

    Evaluation keeps starts and forces only, so the episodes are played again, together, to record
    them; that they end as they did is checked.

    Args:
        evaluation: whose episodes.
        config: that it was played with.
        directory: for the files, ``episode-0000.replay`` and so on.
        player: who played, in words.

    Returns:
        The files.

    Raises:
        RunError: an episode ended otherwise when it was played again; the others are written.
    """
    options = make_config(level=evaluation.level, **config.evaluation_options)
    replays = replays_of(
        options,
        np.array([episode.path[0] for episode in evaluation.episodes]),
        [episode.force_n for episode in evaluation.episodes],
        player=player,
    )
    files, others = [], []
    for number, (episode, replay) in enumerate(zip(evaluation.episodes, replays, strict=True)):
        ended, again = (
            (game.success, game.fall, game.coins, game.time_s) for game in (episode, replay.result)
        )
        if ended != again:
            others.append(f"episode {number}: found {again} played again; it had been {ended}")
            continue
        files.append(save_replay(replay, directory / f"episode-{number:04d}{SUFFIX}"))
    if others:
        raise RunError("; ".join(others))
    return files
