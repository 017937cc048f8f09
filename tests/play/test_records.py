"""What people have reached outlives the program, and belongs to the level as it was played."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from roller_env.game.result import EpisodeResult
from roller_env.physics.presets import physics_preset
from roller_env.play.records import Improved, Record, Records, RecordsError, default_file
from roller_env.replay import Replay, load_replay, shipped_replays
from tests.play.lane import lane
from tests.play.test_room import ENDED, Somebody, among, played, push, started, until

LEVEL = lane(par_time_s=10.0)
DEFAULT = physics_preset("default")


def result(time_s: float, *, success: bool = True, coins: int = 1) -> EpisodeResult:
    return EpisodeResult(success, not success, False, False, coins, 100.0 * coins, time_s, 0.0)


def test_nobody_has_reached_anything_yet() -> None:
    assert Records().of(LEVEL, DEFAULT) == Record()


def test_the_best_of_each_is_kept_whichever_game_it_was_of() -> None:
    records = Records()
    assert records.add(LEVEL, DEFAULT, result(9.0, coins=0), None) == Improved(True, False)
    assert records.add(LEVEL, DEFAULT, result(12.0), None) == Improved(False, True)
    assert records.add(LEVEL, DEFAULT, result(3.0, success=False), None) == Improved(False, False)
    assert records.of(LEVEL, DEFAULT) == Record(3, 2, "silver", 9.0, 1)
    records.add(LEVEL, DEFAULT, result(9.5), None)
    assert records.of(LEVEL, DEFAULT).medal == "gold"


def test_another_level_or_another_physics_has_records_of_its_own() -> None:
    records = Records()
    records.add(LEVEL, DEFAULT, result(9.0), None)
    assert records.of(lane(par_time_s=11.0), DEFAULT) == Record()
    assert records.of(LEVEL, physics_preset("rigid")) == Record()


@pytest.fixture(scope="module")
def run() -> Replay:
    return load_replay(shipped_replays()["flat"])


def test_the_fastest_run_is_kept_whole(tmp_path: Path, run: Replay) -> None:
    file = tmp_path / "deep" / "records.sqlite3"
    records = Records(file)
    slower = replace(run, player="slower")
    records.add(run.level, DEFAULT, result(20.0), slower)
    records.add(run.level, DEFAULT, result(15.0), run)
    records.add(run.level, DEFAULT, result(18.0), slower)
    records.close()
    kept = Records(file).best_run(run.level, DEFAULT)
    assert kept is not None
    assert kept.player == run.player
    assert (kept.force_n == run.force_n).all()


def test_two_games_at_once_keep_theirs_in_one_file(tmp_path: Path) -> None:
    file = tmp_path / "records.sqlite3"
    one, other = Records(file), Records(file)
    one.add(LEVEL, DEFAULT, result(9.0), None)
    other.add(LEVEL, DEFAULT, result(8.0), None)
    assert one.of(LEVEL, DEFAULT) == other.of(LEVEL, DEFAULT) == Record(2, 2, "gold", 8.0, 1)


KILLED = """
import os, signal, sys
from pathlib import Path
from roller_env.play.records import Records
from tests.play.test_records import DEFAULT, LEVEL, result
records = Records(Path(sys.argv[1]))
for time_s in range(100, 0, -1):
    records.add(LEVEL, DEFAULT, result(float(time_s)), None)
    if time_s == 50:
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signal that kills")
def test_a_killed_program_loses_no_record(tmp_path: Path) -> None:
    file = tmp_path / "records.sqlite3"
    done = subprocess.run([sys.executable, "-c", KILLED, str(file)], check=False, timeout=120)
    assert done.returncode == -signal.SIGKILL
    record = Records(file).of(LEVEL, DEFAULT)
    assert (record.attempts, record.best_time_s) == (51, 50.0)


def test_a_file_that_is_no_records_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("not a database, but long enough to look like something " * 20)
    before = file.read_bytes()
    with pytest.raises(RecordsError, match="file is not a database; records cannot be kept there"):
        Records(file)
    assert file.read_bytes() == before


@pytest.mark.parametrize("platform", ["linux", "darwin", "win32"])
def test_records_are_where_programs_keep_their_data(
    platform: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_DATA_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(name, str(tmp_path / "data"))
    assert default_file().name == "records.sqlite3"
    assert tmp_path in default_file().parents


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("create table records (level text)", "no such column: attempts"),
        ("create table other (level text); begin exclusive", "database is locked"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_before_anything_is_played(
    tmp_path: Path, statement: str, message: str
) -> None:
    file = tmp_path / "records.sqlite3"
    other = sqlite3.connect(file, isolation_level=None)
    other.executescript(statement)
    with pytest.raises(RecordsError, match=message):
        Records(file)
    other.close()


def test_a_game_goes_on_when_its_records_are_lost(tmp_path: Path) -> None:
    records = Records(tmp_path / "records.sqlite3")
    room = played(records=records)

    async def scene() -> None:
        player = Somebody(room)
        await until(lambda: bool(player.frames))
        records.close()
        await started(player)
        await push(player, lambda: player.phase == ENDED)
        await until(lambda: any(told["type"] == "result" for told in player.told))
        assert "records cannot be kept there" in player.last("notice")["text"]
        assert player.last("result")["best_time"]

    among(room, scene)
