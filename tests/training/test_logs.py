"""Logs read as one training, however often it was stopped."""

from __future__ import annotations

import math
import threading
from pathlib import Path

import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from roller_env.training.logs import STEPS, ContinuingCSV, ContinuingTensorBoard, read_progress
from tests.training.disk import largest_file


def log(writer: ContinuingCSV, *steps: int) -> None:
    for step in steps:
        writer.write({STEPS: step, "value": step / 10}, {})


def test_a_resumed_log_has_one_header_and_every_row_once(tmp_path: Path) -> None:
    file = tmp_path / "progress.csv"
    first = ContinuingCSV(file, 0)
    log(first, 10, 20, 30)
    first.close()
    second = ContinuingCSV(file, 20)
    log(second, 30, 40)
    second.close()
    assert file.read_text().splitlines() == [
        f"{STEPS},value",
        "10,1.0",
        "20,2.0",
        "30,3.0",
        "40,4.0",
    ]


def test_a_row_that_a_dying_process_left_unfinished_is_dropped(tmp_path: Path) -> None:
    file = tmp_path / "progress.csv"
    file.write_text(f"{STEPS},value\n10,1.0\n20,2")
    writer = ContinuingCSV(file, 20)
    log(writer, 20)
    writer.close()
    assert [row["value"] for row in read_progress(file)] == ["1.0", "2.0"]


def test_a_log_of_an_earlier_version_goes_on_with_the_columns_it_has(tmp_path: Path) -> None:
    file = tmp_path / "progress.csv"
    file.write_text(f"{STEPS}\n10\n")
    writer = ContinuingCSV(file, 10)
    log(writer, 20)
    writer.close()
    assert file.read_text() == f"{STEPS}\n10\n20\n"


def test_a_training_that_starts_over_starts_its_log_over(tmp_path: Path) -> None:
    file = tmp_path / "progress.csv"
    file.write_text(f"{STEPS},value\n10,1.0\n")
    writer = ContinuingCSV(file, 0)
    log(writer, 5)
    writer.close()
    assert file.read_text() == f"{STEPS},value\n5,0.5\n"


def test_a_log_that_is_not_there_has_no_rows(tmp_path: Path) -> None:
    assert read_progress(tmp_path / "progress.csv") == []


def test_rows_are_on_file_before_the_process_ends(tmp_path: Path) -> None:
    file = tmp_path / "progress.csv"
    log(ContinuingCSV(file, 0), 10)
    assert len(read_progress(file)) == 1


def test_tensorboard_shows_every_step_once_and_nothing_where_nothing_was_measured(
    tmp_path: Path,
) -> None:
    for known, steps in ((0, (10, 20, 30)), (20, (30, 40))):
        writer = ContinuingTensorBoard(tmp_path, known)
        for step in steps:
            values = {"speed": float(step), "success": math.nan if step == 10 else 1.0}
            writer.write(values, {"speed": ("",), "success": ("",)}, step)
        writer.close()
    events = EventAccumulator(str(tmp_path))
    events.Reload()
    assert [event.step for event in events.Scalars("speed")] == [10, 20, 30, 40]
    assert [event.step for event in events.Scalars("success")] == [20, 30, 40]


def test_a_full_disk_is_an_error_where_a_row_is_written(tmp_path: Path) -> None:
    before = threading.active_count()
    board = ContinuingTensorBoard(tmp_path, 0)
    table = ContinuingCSV(tmp_path / "progress.csv", 0)
    log(table, 10)
    with largest_file(40):
        with pytest.raises(OSError, match="File too large"):
            board.write({"speed": 1.0}, {"speed": ("",)}, 20)
        with pytest.raises(OSError, match="File too large"):
            log(table, *range(20, 100, 10))
    assert threading.active_count() == before
    board.close()
    table.close()
