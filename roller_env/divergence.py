"""Reports of games that the physics could not go on with: where they are kept, and what is in them.

A report is written only where somebody wants it: a training keeps them in its run's directory
(`reports_in`), anybody else names a directory in the environment variable ``ROLLER_REPORTS``, which
processes that are started meanwhile inherit. No directory gets more than `MOST_REPORTS`, by however
many processes: a level that diverges does so in every episode. A replay needs no report, since it
repeats what happened.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.level.schema import Level
from roller_env.physics.presets import PhysicsPreset

REPORTS_VARIABLE: Final = "ROLLER_REPORTS"
"""Environment variable that names the directory for reports."""

MOST_REPORTS: Final = 10
"""How many reports one directory gets."""


@contextmanager
def reports_in(directory: Path) -> Iterator[None]:
    """Keep the reports of what diverges meanwhile, here or in processes that are started, there."""
    before = os.environ.get(REPORTS_VARIABLE)
    os.environ[REPORTS_VARIABLE] = str(directory.resolve())
    try:
        yield
    finally:
        if before is None:
            del os.environ[REPORTS_VARIABLE]
        else:
            os.environ[REPORTS_VARIABLE] = before


def report(level: Level, preset: PhysicsPreset, state: Float64) -> str:
    """Keep what is needed to repeat steps that failed, if it is wanted, and say where it is.

    The file, ``diverged-<number>.npz``, has an array ``state``, and ``level`` (JSON) and ``preset``
    as text. Never raises: a game that diverged is to end, whatever the disk does.

    Args:
        level: that was played.
        preset: the settings of the physics.
        state: (n, width) the engine's states before the step, its controls among them.

    Returns:
        Where the report is, or why there is none; the end of a sentence.
    """
    directory = os.environ.get(REPORTS_VARIABLE, "")
    if not directory:
        return f"{REPORTS_VARIABLE}=DIRECTORY would keep the state before"
    content = io.BytesIO()
    np.savez_compressed(
        content,
        state=state,
        level=np.array(level.model_dump_json()),
        preset=np.array(repr(preset)),
    )
    try:
        file = _write(Path(directory), content.getvalue())
    except OSError as error:
        return f"the state before could not be kept: {error}"
    if file is None:
        return f"{directory} has its {MOST_REPORTS} reports already"
    return f"the state before is in {file}"


def _write(directory: Path, content: bytes) -> Path | None:
    """Write the next report, unless the directory has all that it gets."""
    directory.mkdir(parents=True, exist_ok=True)
    for number in range(1, MOST_REPORTS + 1):
        file = directory / f"diverged-{number}.npz"
        try:
            # Exclusive, so that processes that report at the same time do not meet in one file.
            stream = file.open("xb")
        except FileExistsError:
            continue
        try:
            with stream:
                stream.write(content)
        except OSError:
            file.unlink()
            raise
        return file
    return None
