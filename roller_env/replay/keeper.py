"""Keeping everything that a person plays, or an agent before a person's eyes."""

from __future__ import annotations

from pathlib import Path

from roller_env.replay.contents import Replay
from roller_env.replay.file import SUFFIX, save_replay
from roller_env.replay.recorder import Float64, Recorder
from roller_env.simulation import Simulation, Transition


class ReplayKeeper:
    """Records one game after the other, and writes each to a file when it is over.

    It is an observer as `roller_env.play.session.GameSession` takes them.

    Attributes:
        replays: what was played so far, episodes without a step left out.
        files: where it is.
    """

    def __init__(self, directory: Path | None = None, player: str = "human"):
        """Keep what is played from now on.

        Args:
            directory: for the files, ``classic-0000.replay`` and so on, of which none is
                overwritten; None writes none.
            player: who plays, in words.
        """
        self.replays: list[Replay] = []
        self.files: list[Path] = []
        self._directory = directory
        self._player = player
        self._recorder: Recorder | None = None

    def on_reset(self, simulation: Simulation, seed: int) -> None:
        """Begin a recording: an episode has begun."""
        self._recorder = Recorder(simulation, self._player)
        self._recorder.begin(seed=seed)

    def on_step(self, _: Simulation, force_n: Float64, transition: Transition) -> None:
        """Record a step."""
        if self._recorder is not None:
            self._recorder.record(force_n, transition.reward)

    def on_end(self, *_: object) -> None:
        """Keep the recording: the episode is over, or was left."""
        if self._recorder is None:
            return
        replay, self._recorder = self._recorder.replay(), None
        if len(replay) == 0:
            return
        self.replays.append(replay)
        if self._directory is not None:
            self.files.append(save_replay(replay, self._free_name(replay.level.name)))

    def _free_name(self, level: str) -> Path:
        assert self._directory is not None
        number = 0
        while (file := self._directory / f"{level}-{number:04d}{SUFFIX}").exists():
            number += 1
        return file
