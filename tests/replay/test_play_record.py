"""When a game is left, what was played is written, whatever else fails then."""

from __future__ import annotations

import asyncio
import io
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from roller_env.cli import play
from roller_env.play.room import Room
from roller_env.replay import load_replay, verify
from roller_env.replay.keeper import ReplayKeeper
from tests.play.test_room import Somebody, apart, push, started
from tests.replay.recording import pushed_otherwise, wandered

minari = pytest.importorskip("minari", reason="the extra 'demos' is not installed")

pytestmark = pytest.mark.filterwarnings("ignore:Package roller-env is not installed:UserWarning")


@pytest.fixture(autouse=True)
def _here_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Keep data sets in the test's own directory, and signals as they were."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


def kept(*levels: str) -> ReplayKeeper:
    keeper = ReplayKeeper()
    keeper.replays = [wandered(level, max_episode_steps=20) for level in levels]
    return keeper


def test_what_one_level_lacks_is_said_and_the_others_are_written(
    capsys: pytest.CaptureFixture[str],
) -> None:
    keeper = kept("flat", "bridge")
    keeper.replays[0] = pushed_otherwise(keeper.replays[0], 3)
    assert play.write_record(keeper, "roller/human") == 1
    output, error = capsys.readouterr()
    assert output == "data set: roller/human/bridge-v0\n"
    assert error.startswith("error: data set roller/human/flat-v0 not written: ")


def test_when_the_terminal_is_gone_the_data_sets_are_written_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Gone(io.StringIO):
        def write(self, _: str) -> int:
            raise OSError(5, "Input/output error")

    monkeypatch.setattr(sys, "stdout", Gone())
    with pytest.raises(OSError, match="Input/output error"):
        play.write_record(kept("flat"), "roller/human")
    assert minari.load_dataset("roller/human/flat-v0").total_episodes == 1


def test_that_nothing_was_played_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert play.write_record(ReplayKeeper(), "roller/human") == 0
    assert "no data set: nothing was played" in capsys.readouterr().out
    assert play.write_record(ReplayKeeper(), None) == 0
    assert capsys.readouterr().out.strip() == ""


def test_what_fails_while_it_is_played_costs_nothing_of_what_was_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    def serve(room: Room, *_: object) -> None:
        async def lost() -> None:
            running = asyncio.create_task(room.run())
            player = Somebody(room)
            await started(player)
            begun = player.x
            await push(player, lambda: player.x > begun + 0.1)
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)
            room.close()
            raise RuntimeError("the page is gone")

        apart(lost)

    monkeypatch.setattr(play, "serve", serve)
    records = tmp_path / "records.sqlite3"
    with pytest.raises(RuntimeError, match="the page is gone"):
        play.play(
            play.Arguments(
                level="flat", skip_intro=True, record="roller/human", port=0, records=records
            )
        )
    assert minari.load_dataset("roller/human/flat-v0").total_episodes == 1
    # Without --replays, games that become data sets are kept in a directory of their own.
    (file,) = (tmp_path / "replays").iterdir()
    assert verify(load_replay(file)).is_exact
