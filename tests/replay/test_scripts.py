"""The command line says in one line what is wrong, and its status whether a replay is exact."""

from __future__ import annotations

import contextlib
import io
import runpy
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roller_env.cli.replay import about
from roller_env.replay import load_replay, save_replay, shipped_replays, verify
from tests.replay.recording import pushed_otherwise, same, wandered
from tests.replay.test_conversion import of_format_1

ROOT = Path(__file__).parents[2]


def run(*arguments: object, script: str = "replay.py") -> tuple[int, str, str]:
    """Run a script as from the command line; return its status and what it wrote."""
    output, error = io.StringIO(), io.StringIO()
    command = [script, *map(str, arguments)]
    with (
        pytest.MonkeyPatch.context() as patched,
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(error),
    ):
        patched.setattr(sys, "argv", command)
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(str(ROOT / "scripts" / script), run_name="__main__")
    status = ended.value.code
    if isinstance(status, str):
        # What Python does with such a one.
        return 1, output.getvalue(), f"{error.getvalue()}{status}\n"
    return int(status or 0), output.getvalue(), error.getvalue()


def test_a_replay_is_verified_unless_something_else_is_asked_for(tmp_path: Path) -> None:
    played = wandered("flat")
    status, output, _ = run(save_replay(played, tmp_path / "exact.replay"))
    assert status == 0
    assert f"the same bit for bit over {len(played)} steps" in output
    status, output, _ = run(save_replay(pushed_otherwise(played, 8), tmp_path / "other.replay"))
    assert status == 1
    assert "another game at step 10 of" in output


def test_a_level_or_preset_that_only_has_the_name_of_one_is_told_of() -> None:
    played = wandered("flat")
    assert about(played).count("\n") == 0
    nearer = played.level.model_copy(update={"title": "Another floor"})
    assert "note: its level is not the 'flat' of this version" in about(
        replace(played, options=replace(played.options, level=nearer))
    )
    weak = replace(played.options.preset, iterations=1)
    options = replace(played.options, physics=weak)
    assert "note: its physics is not a preset of this" in about(replace(played, options=options))


def test_an_old_replay_is_converted_and_nothing_is_overwritten(tmp_path: Path) -> None:
    played = wandered("flat")
    old, new = tmp_path / "old.replay", tmp_path / "new.replay"
    old.write_bytes(of_format_1(played))
    status, output, _ = run(old, "--convert", new)
    assert status == 0
    assert f"written to {new}" in output
    assert same(load_replay(new), played)
    status, _, error = run(old, "--convert", new)
    assert status == 1
    assert "is not overwritten" in error


def test_replays_that_outlived_a_kill_become_data_sets_though_one_is_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    minari = pytest.importorskip("minari", reason="the extra 'demos' is not installed")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "sets"))
    games = tmp_path / "games"
    save_replay(wandered("flat"), games / "flat-0000.replay")
    save_replay(wandered("flat", seed=1), games / "flat-0001.replay")
    (games / "flat-0002.replay").write_bytes(b"half of a replay")
    status, output, error = run(games, "--record", "roller/human")
    assert status == 1
    assert output == "data set: roller/human/flat-v0\n"
    assert "flat-0002.replay: not a replay" in error
    assert minari.load_dataset("roller/human/flat-v0").total_episodes == 2


def test_demonstrations_are_recorded_anew_from_their_actions(tmp_path: Path) -> None:
    shipped = load_replay(shipped_replays()["flat"])
    (tmp_path / "flat.replay").write_bytes(of_format_1(shipped))
    command = ("flat", "--rerecord", "--output", tmp_path)
    status, output, _ = run(*command, script="make_demonstrations.py")
    assert status == 0
    assert "finish, 12 coins" in output
    again = load_replay(tmp_path / "flat.replay")
    assert np.array_equal(again.actions, shipped.actions)
    assert again.result == shipped.result
    assert verify(again).is_exact


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("clasic",), "there is no such file"),
        ((ROOT / "README.md",), "not a replay"),
        (("flat", "--video", "film.avi"), "must end in .mp4 or .gif"),
        (("flat", "--size", "33", "20"), "must be even numbers"),
        (("flat", "--show", "--port", "99999"), "port: found 99999; must be a whole number from 0"),
        (("flat", "--show", "--port", "-1"), "port: found -1; must be"),
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
