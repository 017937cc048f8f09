"""The command line says in one line what is wrong, and its status whether a replay is exact."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from roller_env.replay import save_replay
from tests.replay.recording import pushed_otherwise, wandered

ROOT = Path(__file__).parents[2]


def run(*arguments: object) -> tuple[int, str, str]:
    """Run scripts/replay.py; return its status and what it wrote."""
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "replay.py"), *map(str, arguments)],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


def test_a_replay_is_verified_unless_something_else_is_asked_for(tmp_path: Path) -> None:
    played = wandered("flat")
    status, output, _ = run(save_replay(played, tmp_path / "exact.replay"))
    assert status == 0
    assert f"the same bit for bit over {len(played)} steps" in output
    status, output, _ = run(save_replay(pushed_otherwise(played, 8), tmp_path / "other.replay"))
    assert status == 1
    assert "another game at step 10 of" in output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("clasic",), "there is no such file"),
        ((ROOT / "README.md",), "not a replay"),
        (("flat", "--video", "film.avi"), "must end in .mp4 or .gif"),
        (("flat", "--size", "33", "20"), "must be even numbers"),
        (("flat", "--camera", "6"), "allowed are game and 0 to 5"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(arguments: tuple[object, ...], message: str) -> None:
    status, output, error = run(*arguments)
    assert status == 1
    assert error.startswith("error: ")
    assert message in error
    assert error.count("\n") == 1
    assert output == ""
