"""Where a run keeps what, and how a file is written so that no reader ever meets half of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from roller_env.platforms import flush_directory, lock
from roller_env.problems import quoted, shown

MAX_NAME_BYTES: Final = 150
"""Of a run's name; the agent's replays carry it with them."""


class RunError(RuntimeError):
    """A run directory that cannot be used as asked; the message says what would be right."""


@dataclass(frozen=True, slots=True)
class RunFiles:
    """The files of one run, ``runs/<name>/``.

    Attributes:
        directory: of the run.
    """

    directory: Path

    @property
    def config(self) -> Path:
        """The configuration the run was started with."""
        return self.directory / "config.yaml"

    @property
    def checkpoint(self) -> Path:
        """All that is needed to go on; see `roller_env.training.checkpoint`."""
        return self.directory / "checkpoint.zip"

    @property
    def policy(self) -> Path:
        """What the trained agent is; see `roller_env.training.policy`."""
        return self.directory / "policy.json"

    @property
    def weights(self) -> Path:
        """The trained agent's weights."""
        return self.directory / "policy.safetensors"

    @property
    def sb3_policy(self) -> Path:
        """The trained agent as Stable-Baselines3 saves it, for use there."""
        return self.directory / "policy.zip"

    @property
    def sb3_normaliser(self) -> Path:
        """Statistics of the observations, as Stable-Baselines3's VecNormalize saves them."""
        return self.directory / "vecnormalize.pkl"

    @property
    def progress(self) -> Path:
        """One row an update."""
        return self.directory / "progress.csv"

    @property
    def tensorboard(self) -> Path:
        """Event files: ``tensorboard --logdir runs``."""
        return self.directory / "tb"

    @property
    def learning_curve(self) -> Path:
        """Picture of `progress`."""
        return self.directory / "learning_curve.png"

    @property
    def evaluation(self) -> Path:
        """The evaluation table, for machines."""
        return self.directory / "evaluation.json"

    @property
    def evaluation_table(self) -> Path:
        """The evaluation table, for people."""
        return self.directory / "evaluation.md"

    @property
    def episodes(self) -> Path:
        """The evaluation's episodes, one row each."""
        return self.directory / "evaluation.csv"

    @property
    def paths(self) -> Path:
        """The level from above with the evaluation's paths."""
        return self.directory / "paths.png"

    @property
    def video(self) -> Path:
        """One episode."""
        return self.directory / "episode.mp4"

    @property
    def summary(self) -> Path:
        """What ran, on what, for how long; written last: a run that has it is finished."""
        return self.directory / "run.json"

    @property
    def has_begun(self) -> bool:
        """Whether there is something of a training that another could destroy."""
        kept = (self.checkpoint, self.policy, self.sb3_policy, self.summary)
        return any(file.exists() for file in kept) or (
            self.progress.exists() and self.progress.stat().st_size > 0
        )


def read_whole(file: Path, max_bytes: int) -> bytes:
    """Return a file's content; what is no plain file is not opened, since a pipe never ends.

    Raises:
        RunError: there is no such file, or it cannot be read, or is larger than allowed.
    """
    try:
        if not file.is_file():
            raise RunError(f"{shown(file)}: {'not a file' if file.exists() else 'there is none'}")
        with file.open("rb") as stream:
            content = stream.read(max_bytes + 1)
    except OSError as error:
        raise RunError(f"{shown(file)}: {error.strerror}") from None
    if len(content) > max_bytes:
        raise RunError(f"{shown(file)}: too large; allowed are at most {max_bytes} bytes")
    return content


def write_atomically(file: Path, content: bytes | str) -> None:
    """Write a file so that, whenever the process dies, it holds the old content or the new.

    The half-written copy of a process that died is overwritten by the next call.

    Raises:
        OSError: the disk is full or not writable; the old content is still there.
    """
    data = content.encode() if isinstance(content, str) else content
    temporary = file.with_name(file.name + ".tmp")
    try:
        # Not written through: it may be the half copy of a dead process, or a link to elsewhere.
        temporary.unlink(missing_ok=True)
        with temporary.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(file)
        # The new name is in the directory, which reaches the disk in its own time unless told.
        flush_directory(file.parent)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        # A write that fails does not say itself in which file.
        raise OSError(error.errno, error.strerror, str(file)) from error


def run_directory(runs: Path, name: str) -> Path:
    """Return the directory of a run.

    Args:
        runs: directory of all runs.
        name: the run's; one name, not a way to somewhere else.

    Raises:
        RunError: no file can be called that, or it would be outside ``runs``.
    """
    is_one_name = name != "" and Path(name).name == name and not name.startswith(".")
    if not (is_one_name and name.isprintable() and len(os.fsencode(name)) <= MAX_NAME_BYTES):
        raise RunError(
            f"name: found {quoted(name)}; must be a name for a directory inside {shown(runs)}: "
            f"at most {MAX_NAME_BYTES} bytes that can be printed, no '/', no '.' at the beginning"
        )
    return runs / name


@contextmanager
def only_one_process(directory: Path) -> Iterator[None]:
    """Hold a run for this process; the operating system lets go of it however the process ends.

    Raises:
        RunError: another process is training this run.
    """
    directory.mkdir(parents=True, exist_ok=True)
    with (directory / ".lock").open("a", encoding="utf-8") as held:
        try:
            lock(held)
        except BlockingIOError as error:
            message = (
                f"{shown(directory)} is being trained by another process; choose another --name"
            )
            raise RunError(message) from error
        yield
