"""Keeping everything that a person plays, or an agent before a person's eyes."""

from __future__ import annotations

import contextlib
import itertools
import os
import sys
from pathlib import Path
from typing import Final

from roller_env.arrays import Float64
from roller_env.replay.contents import Replay
from roller_env.replay.errors import ReplayError
from roller_env.replay.file import SUFFIX, save_replay
from roller_env.replay.recorder import Recorder
from roller_env.simulation import Simulation, Transition

SAVE_EVERY_S: Final = 10.0
"""Game time after which a game under way is written once more: a process that is killed loses no
more than that."""


class ReplayKeeper:
    """Records one game after the other, and writes each to a file, now and then and at its end.

    It is an observer as `roller_env.play.session.GameSession` takes them.

    Attributes:
        replays: what was played so far, episodes without a step left out.
        files: where it is.
        directory: for the files; None if none are written.
    """

    def __init__(self, directory: Path | None = None, player: str = "human"):
        """Keep what is played from now on.

        Args:
            directory: for the files, ``classic-0000.replay`` and so on, of which none is
                overwritten; None writes none.
            player: who plays, in words.

        Raises:
            ReplayError: nothing can be written there.
        """
        if directory is not None:
            _check_directory(directory)
        self.replays: list[Replay] = []
        self.files: list[Path] = []
        self.directory = directory
        self._player = player
        self._recorder: Recorder | None = None
        self._file: Path | None = None
        self._saved_s = 0.0

    def on_reset(self, simulation: Simulation, seed: int) -> None:
        """Begin a recording: an episode has begun."""
        self._recorder = Recorder(simulation, self._player)
        self._recorder.begin(seed=seed)
        self._file = None
        self._saved_s = 0.0

    def on_step(self, simulation: Simulation, force_n: Float64, transition: Transition) -> None:
        """Record a step."""
        if self._recorder is None:
            return
        self._recorder.record(force_n)
        now_s = float(simulation.time_s[0])
        if self.directory is not None and now_s >= self._saved_s + SAVE_EVERY_S:
            self._saved_s = now_s
            self._keep(self._recorder)

    def on_rewind(self, simulation: Simulation) -> None:
        """Forget what came after the step to which the game went back."""
        if self._recorder is not None:
            self._recorder.rewind()
            self._saved_s = min(self._saved_s, float(simulation.time_s[0]))

    def on_end(self, *_: object) -> None:
        """Keep the recording: the episode is over, or was left."""
        if self._recorder is not None:
            replay = self._keep(self._recorder)
            self._recorder = None
            if replay is not None:
                self.replays.append(replay)

    def _keep(self, recorder: Recorder) -> Replay | None:
        """Write the game as far as it has come, and return it if there is anything to keep.

        Who plays is told what is wrong and plays on: a game that was not written is still in
        memory.
        """
        try:
            replay = recorder.replay()
        except ReplayError as error:
            print(f"replay not kept: {error}", file=sys.stderr, flush=True)
            return None
        if len(replay) == 0:
            return None
        if self.directory is not None:
            try:
                self._write(replay, self.directory)
            except OSError as error:
                print(f"replay not written: {error}", file=sys.stderr, flush=True)
        return replay

    def _write(self, replay: Replay, directory: Path) -> None:
        if self._file is not None:
            save_replay(replay, self._file)
            return
        file = _new_file(directory, replay.level.name)
        try:
            save_replay(replay, file)
        except OSError:
            file.unlink(missing_ok=True)
            raise
        self._file = file
        self.files.append(file)


def _check_directory(directory: Path) -> None:
    """Make the directory, so that who plays is told before that nothing can be kept there."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ReplayError(f"{directory}: {error.strerror}; replays cannot be kept there") from None
    if not os.access(directory, os.W_OK):
        raise ReplayError(f"{directory}: not writable; replays cannot be kept there")


def _new_file(directory: Path, level: str) -> Path:
    """Make and return the first file of that level's name that there is none of yet."""
    for number in itertools.count():
        file = directory / f"{level}-{number:04d}{SUFFIX}"
        # Another process may be looking for one too.
        with contextlib.suppress(FileExistsError):
            file.touch(exist_ok=False)
            break
    return file
