"""Training logs that go on where they were, in CSV and for TensorBoard.

Stable-Baselines3's CSV writer empties the file it opens, and TensorBoard would show what a killed
run logged after its last checkpoint twice.
"""

from __future__ import annotations

import csv
import io
import math
import os
import socket
import time
from pathlib import Path
from typing import Any, Final

from stable_baselines3.common.logger import KVWriter
from tensorboard.compat.proto.event_pb2 import Event, SessionLog
from tensorboard.summary.writer.record_writer import RecordWriter
from torch.utils.tensorboard.summary import scalar

from roller_env.problems import shown
from roller_env.training.files import RunError, read_whole, write_atomically

MAX_BYTES: Final = 2**30

STEPS: Final = "time/total_timesteps"
"""The column by which rows are ordered; Stable-Baselines3's name for it."""


class ContinuingCSV(KVWriter):
    """A CSV file with one header and one row an update, whatever happened in between.

    Columns are those of the first row, so every row must bring the same ones. A file that an
    earlier version began goes on with the columns that it has.
    """

    def __init__(self, file: Path, steps: int) -> None:
        """Open the file, and forget the rows that the training is about to repeat.

        Args:
            file: made if it does not exist.
            steps: the training's step count now.
        """
        kept = [row for row in read_progress(file) if int(row[STEPS]) <= steps]
        self._columns = list(kept[0]) if kept else []
        text = io.StringIO()
        if kept:
            writer = csv.DictWriter(text, self._columns, lineterminator="\n")
            writer.writeheader()
            writer.writerows(kept)
        write_atomically(file, text.getvalue())
        self._stream = file.open("a", encoding="utf-8", newline="")

    def write(
        self,
        key_values: dict[str, Any],
        key_excluded: dict[str, tuple[str, ...]],
        step: int = 0,
    ) -> None:
        """Append one row; flushed, so that it survives the process."""
        del key_excluded, step
        if not self._columns:
            self._columns = sorted(key_values)
            self._writer().writeheader()
        self._writer().writerow(key_values)
        self._stream.flush()

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def _writer(self) -> csv.DictWriter[str]:
        columns = self._columns
        return csv.DictWriter(self._stream, columns, lineterminator="\n", extrasaction="ignore")


class ContinuingTensorBoard(KVWriter):
    """Event files in one directory, which TensorBoard shows as one curve without repeats.

    Written at once and in the caller's thread: a full disk is then an error where it can be told,
    and not one in a thread that nobody hears of.
    """

    def __init__(self, directory: Path, steps: int) -> None:
        """Start an event file.

        Args:
            directory: made if it does not exist.
            steps: the training's step count now; TensorBoard drops what older files say of
                later steps.
        """
        directory.mkdir(parents=True, exist_ok=True)
        # TensorBoard reads files in the order of their names, and these by their first word.
        moment = f"{int(time.time()):010d}.{socket.gethostname()}.{os.getpid()}.{time.time_ns()}"
        self._stream = (directory / f"events.out.tfevents.{moment}").open("xb")
        self._records = RecordWriter(self._stream)
        start = SessionLog(status=SessionLog.START)
        self._append(Event(step=steps + 1, file_version="brain.Event:2"))
        self._append(Event(step=steps + 1, session_log=start))

    def write(
        self,
        key_values: dict[str, Any],
        key_excluded: dict[str, tuple[str, ...]],
        step: int = 0,
    ) -> None:
        """Append one point a curve; none where there was nothing to measure (NaN)."""
        for key, value in sorted(key_values.items()):
            if "tensorboard" not in key_excluded[key] and not _is_nan(value):
                summary = scalar(key, value)  # type: ignore[no-untyped-call]
                self._append(Event(step=step, summary=summary))
        self._stream.flush()

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def _append(self, event: Any) -> None:
        event.wall_time = time.time()
        self._records.write(event.SerializeToString())


def read_progress(file: Path) -> list[dict[str, str]]:
    """Return the complete rows of a progress file, none if there is no file.

    A last row that a dying process did not finish is left out.

    Raises:
        RunError: what is there is no progress file.
    """
    if not file.exists():
        return []
    try:
        text = read_whole(file, MAX_BYTES).decode("utf-8")
        reader = csv.DictReader(io.StringIO(text[: text.rfind("\n") + 1]))
        rows = list(reader)
        if reader.fieldnames is not None and STEPS not in reader.fieldnames:
            raise LookupError(STEPS)
        _ = [int(row[STEPS]) for row in rows]
    except (csv.Error, LookupError, TypeError, ValueError):
        message = f"{shown(file)}: not a training's progress; move it away to write it anew"
        raise RunError(message) from None
    return rows


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)
