"""Replays of format 1 become replays of this one, if that is certain; no file does harm."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.replay import Replay, ReplayError, load_replay, save_replay, verify
from roller_env.replay.conversion import Format1, load_any, record_anew
from roller_env.replay.file import encode
from roller_env.simulation import Simulation
from tests.replay.recording import pushed_otherwise, same, straight_on, wandered

PLAYED = straight_on("gate", 12, physics="fast")


def of_format_1(
    played: Replay,
    force_n: npt.NDArray[np.float64] | None = None,
    change: Callable[[dict[str, Any]], object] = lambda _: None,
) -> bytes:
    """Return a game as the file that Roller wrote of it before: forces, and (here no) checksums."""
    line, _, body = gzip.decompress(encode(played)).partition(b"\n")
    header = json.loads(line)
    force_n = played.force_n if force_n is None else force_n
    level = body[: header["level_bytes"]]
    for name in ("encoding", "check_every", "quantities"):
        del header[name]
    for name in ("rules", "engine", "physics"):
        del header["versions"][name]
    header |= {"format": 1, "steps": len(force_n)}
    change(header)
    numbers = force_n.astype("<f8").tobytes() + bytes(4 * (len(force_n) + 1))
    return gzip.compress(json.dumps(header).encode() + b"\n" + level + b"\n" + numbers)


def written(content: bytes, directory: Path) -> Path:
    file = directory / "old.replay"
    file.write_bytes(content)
    return file


@pytest.mark.parametrize("action", ["directions", "keys", "force"])
@pytest.mark.parametrize("intro", [False, True])
def test_a_game_of_format_1_becomes_the_same_game(tmp_path: Path, action: str, intro: bool) -> None:
    played = wandered("flat", seed=3, intro=intro, action=action, max_episode_steps=150)
    file = written(of_format_1(played), tmp_path)
    old = load_any(file)
    assert isinstance(old, Format1)
    again = record_anew(old)
    assert same(again, played)
    assert verify(again).is_exact


def test_a_file_of_format_1_is_refused_in_one_line_that_says_what_to_do(tmp_path: Path) -> None:
    file = written(of_format_1(PLAYED), tmp_path)
    with pytest.raises(ReplayError, match=r"found format 1; .* --convert NEW makes") as refused:
        load_replay(file)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("newtons", [200.0, 1e308, np.nan, np.inf, 2.0])
def test_a_force_that_no_key_can_give_is_refused_before_anything_is_played(
    tmp_path: Path, newtons: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    force_n = PLAYED.force_n.copy()
    force_n[7, 1] = newtons
    old = load_any(written(of_format_1(PLAYED, force_n), tmp_path))
    monkeypatch.setattr(Simulation, "step", None)
    with pytest.raises(ReplayError, match=r"the force of step 7, .* is no action of mode"):
        record_anew(old)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h: h.update(steps=2**20), "longer or shorter"),
        (lambda h: h.update(steps=2**62), "steps"),
        (lambda h: h.update(start=[1e308, 0.0, 0.0]), "the ball starts at"),
        (lambda h: h["options"].update(action="x"), "action"),
        (lambda h: h.update(format=0), "found format 0; this version of Roller plays format 2"),
        (lambda h: h.update(more=1), "more"),
    ],
)
def test_a_header_of_format_1_that_lies_is_refused(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], message: str
) -> None:
    with pytest.raises(ReplayError, match=message) as refused:
        load_any(written(of_format_1(PLAYED, change=change), tmp_path))
    assert "old.replay: " in str(refused.value)


@given(st.integers(0, 5000), st.integers(0, 7))
def test_a_flipped_bit_is_refused_or_read(
    tmp_path_factory: pytest.TempPathFactory, place: int, bit: int
) -> None:
    content = bytearray(of_format_1(PLAYED))
    content[place % len(content)] ^= 1 << bit
    file = written(bytes(content), tmp_path_factory.getbasetemp())
    try:
        steps, why = len(load_any(file).force_n), ""
    except ReplayError as error:
        steps, why = 0, str(error)
    assert steps == 12 or why
    assert "\n" not in why


def test_a_game_that_ends_otherwise_here_is_not_passed_off_as_the_one_on_record(
    tmp_path: Path,
) -> None:
    played = wandered("flat", seed=3)
    result = replace(played.result, coins=played.result.coins + 1)
    old = load_any(written(of_format_1(replace(played, result=result)), tmp_path))
    with pytest.raises(ReplayError, match=r"ended in .* 1 coins .* it ends in .* 0 coins"):
        record_anew(old)


def test_a_replay_is_recorded_anew_on_a_level_or_preset_that_was_changed(tmp_path: Path) -> None:
    played = load_any(save_replay(straight_on("flat", 40, physics="fast"), tmp_path / "a.replay"))
    assert isinstance(played, Replay)
    assert same(record_anew(played), played)
    again = record_anew(played, replace(played.options, physics="default"))
    assert again.options.preset.name == "default"
    assert np.array_equal(again.force_n, played.force_n)
    assert verify(again).is_exact
    # It went by another way to the same end.
    assert not np.array_equal(again.checksums.table, played.checksums.table)


def test_a_replay_whose_checksums_were_made_up_is_recorded_anew_with_those_of_its_game() -> None:
    made_up = pushed_otherwise(PLAYED, 3)
    again = record_anew(made_up)
    assert not verify(made_up).is_exact
    assert verify(again).is_exact
