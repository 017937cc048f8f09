"""Whatever a person plays is kept, game by game."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roller_env.play.session import GameSession, Phase, play_config
from roller_env.replay import ReplayError, load_replay, verify
from roller_env.replay import keeper as keeper_module
from roller_env.replay.keeper import SAVE_EVERY_S, ReplayKeeper
from roller_env.replay.recorder import place_at_starts
from roller_env.simulation import Simulation


def play(session: GameSession, seconds: float, held: str) -> None:
    for _ in range(round(seconds / 0.05)):
        session.advance(0.05, held)


def test_every_game_of_a_session_is_kept_and_is_exact(tmp_path: Path) -> None:
    keeper = ReplayKeeper(tmp_path, player="a test")
    session = GameSession(play_config("flat", "fast"), skip_intro=True, seed=5, observers=[keeper])
    session.start()
    play(session, 1.0, "w")
    session.pause()
    play(session, 1.0, "w")
    session.resume()
    play(session, 0.5, "wa")
    session.restart()
    play(session, 12.0, "s")
    assert session.falls == 2
    session.close()
    outcomes = [replay.result.outcome for replay in keeper.replays]
    assert outcomes == ["not ended", "fall", "fall", "not ended"]
    assert [file.name for file in keeper.files] == [f"flat-000{i}.replay" for i in range(4)]
    assert [replay.seed for replay in keeper.replays] == [5, 6, 7, 8]
    assert len(keeper.replays[0]) == 180
    assert keeper.replays[0].player == "a test"
    for replay, file in zip(keeper.replays, keeper.files, strict=True):
        assert verify(load_replay(file)).is_exact
        assert replay.options.control_dt_s == pytest.approx(1 / 120)


def test_the_intro_is_kept_with_the_game(tmp_path: Path) -> None:
    keeper = ReplayKeeper(player="a test")
    session = GameSession(play_config("flat", "fast"), seed=0, observers=[keeper])
    session.start()
    play(session, 7.0, "w")
    assert session.phase is Phase.PLAYING
    session.close()
    assert keeper.replays[0].intro
    assert verify(keeper.replays[0]).is_exact
    assert keeper.files == []
    assert list(tmp_path.iterdir()) == []


def test_a_game_that_was_not_begun_is_not_kept_and_no_file_is_overwritten(tmp_path: Path) -> None:
    for number in range(2):
        keeper = ReplayKeeper(tmp_path)
        session = GameSession(play_config("gate", "fast"), skip_intro=True, observers=[keeper])
        session.start()
        play(session, 0.2, "w")
        session.restart()
        session.close()
        assert [file.name for file in keeper.files] == [f"gate-000{number}.replay"]


def test_a_game_under_way_is_on_disk_so_that_whoever_is_killed_loses_seconds(
    tmp_path: Path,
) -> None:
    keeper = ReplayKeeper(tmp_path)
    session = GameSession(play_config("flat", "fast"), skip_intro=True, seed=5, observers=[keeper])
    session.start()
    play(session, SAVE_EVERY_S - 0.1, "")
    assert keeper.files == []
    play(session, 1.0, "")
    (file,) = keeper.files
    # What a process that is killed here would leave.
    left = load_replay(file)
    assert verify(left).is_exact
    assert left.result.outcome == "not ended"
    assert len(left) == round(SAVE_EVERY_S * 120)
    play(session, SAVE_EVERY_S, "")
    assert len(load_replay(file)) == 2 * len(left)
    session.close()
    assert keeper.files == [file]
    assert list(tmp_path.iterdir()) == [file]
    assert len(load_replay(file)) > 2 * len(left)


def test_a_game_that_cannot_be_written_is_told_of_and_played_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    keeper = ReplayKeeper(tmp_path)
    session = GameSession(play_config("flat", "fast"), skip_intro=True, seed=5, observers=[keeper])
    session.start()
    with monkeypatch.context() as patched:
        patched.setattr(keeper_module, "save_replay", full)
        play(session, 0.5, "w")
        session.restart()
    assert "replay not written: [Errno 28] No space left on device" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    play(session, 0.5, "w")
    session.close()
    assert len(keeper.replays) == 2
    assert [file.name for file in keeper.files] == ["flat-0000.replay"]


@pytest.mark.parametrize("place", ["file", "file/in/it"])
def test_where_nothing_can_be_kept_is_told_before_anything_is_played(
    tmp_path: Path, place: str
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ReplayError, match="replays cannot be kept there"):
        ReplayKeeper(tmp_path / place)


def test_two_processes_that_keep_games_in_one_directory_overwrite_none(tmp_path: Path) -> None:
    keepers = [ReplayKeeper(tmp_path) for _ in range(2)]
    sessions = [
        GameSession(play_config("flat", "fast"), skip_intro=True, seed=5, observers=[keeper])
        for keeper in keepers
    ]
    for session in sessions:
        session.start()
        play(session, 0.2, "w")
    for session in sessions:
        session.close()
    assert [keeper.files[0].name for keeper in keepers] == ["flat-0000.replay", "flat-0001.replay"]


def test_a_start_is_put_back_to_the_bit() -> None:
    simulation = Simulation(play_config("gate", "fast"), 3)
    starts = np.array([[0.1, 0.2, 2.4384], [-0.1, 1 / 3, 2.4384], [0.0, 0.0, 2.4384]])
    place_at_starts(simulation, starts, intro=False)
    assert simulation.ball_position.tobytes() == starts.tobytes()
