"""Games of before, played again and recorded anew: of an older file, or after a change."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from roller_env.arrays import Float64
from roller_env.config import EnvConfig
from roller_env.game.result import EpisodeResult
from roller_env.replay.actions import recorded_actions
from roller_env.replay.contents import Replay, check_game, recorded_options
from roller_env.replay.errors import ReplayError
from roller_env.replay.file import Header, Header2, read_whole, replay_of, unpack
from roller_env.replay.recorder import Recorder, place_at_starts
from roller_env.simulation import Simulation

_FORCE: Final = np.dtype(("<f8", 2))
_CHECKSUM_BYTES: Final = 4


@dataclass(frozen=True, eq=False)
class Format1:
    """What remains of a replay of format 1; its attributes are those of `Replay`.

    Its forces could be any, so they are yet to be seen to be actions. Its checksums are left out:
    they are of how the game was kept in memory then.
    """

    options: EnvConfig
    start: tuple[float, float, float]
    intro: bool
    force_n: Float64
    result: EpisodeResult
    player: str
    seed: int | None


class _Header1(Header):
    format: Literal[1] = 1
    versions: dict[str, Any]

    @property
    def numbers_bytes(self) -> int:
        """Bytes after the level's line."""
        return self.steps * _FORCE.itemsize + (self.steps + 1) * _CHECKSUM_BYTES


def load_any(file: str | os.PathLike[str]) -> Replay | Format1:
    """Read a replay of any format there has been.

    Raises:
        ReplayError: it is none; one line, with its name.
    """
    path = Path(file)
    try:
        header, level, numbers = unpack(read_whole(path), (Header2, _Header1))
        if isinstance(header, Header2):
            return replay_of(header, level, numbers)
        options = recorded_options(header.options, level)
        check_game(options, header.start, header.steps)
    except ReplayError as error:
        raise ReplayError(f"{path}: {error}") from None
    forces = numbers[: header.steps * _FORCE.itemsize]
    return Format1(
        options=options,
        start=header.start,
        intro=header.intro,
        force_n=np.frombuffer(forces, "<f8").astype(np.float64).reshape(-1, 2),
        result=header.result,
        player=header.player,
        seed=header.seed,
    )


def record_anew(played: Replay | Format1, config: EnvConfig | None = None) -> Replay:
    """Play a recording's actions again here and return the replay of that, if it ends the same.

    The same end is the same outcome, coins, score, time and reward. That the same states lead to
    it is known only of a replay that `verify` finds exact.

    Args:
        played: what was recorded.
        config: to play it in; by default as it was recorded.

    Raises:
        ReplayError: a force is none of an action of the configured mode, which is found before
            anything is played; or the game ends otherwise.
    """
    config = played.options if config is None else config
    recorded_actions(config.action, played.force_n)
    simulation = Simulation(config)
    place_at_starts(simulation, np.array([played.start]), played.intro)
    recorder = Recorder(simulation, played.player)
    recorder.begin(seed=played.seed)
    for force in played.force_n[:, None]:
        simulation.step(force)
        recorder.record(force)
    replay = recorder.replay()
    if replay.result != played.result:
        raise ReplayError(
            f"the game on record ended in {_told(played.result)}; played again here, it ends in "
            f"{_told(replay.result)}"
        )
    return replay


def _told(result: EpisodeResult) -> str:
    return (
        f"{result.outcome!r} after {result.time_s:.2f} s with {result.coins} coins and a reward of "
        f"{result.total_reward:g}"
    )
