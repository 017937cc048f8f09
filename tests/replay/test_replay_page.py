"""On the page a replay plays, stands still, and goes where it is dragged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from roller_env.pieces.coin import COIN
from roller_env.play.replay_page import ReplaySession
from roller_env.play.session import Phase
from roller_env.replay import Playback
from tests.replay.recording import wandered

PLAYED = wandered("gate", max_episode_steps=120)
STEP_S = PLAYED.options.control_dt_s


@pytest.fixture
def session() -> ReplaySession:
    return ReplaySession(PLAYED)


@pytest.mark.parametrize("step", [0, 119, 3, 60, 1])
def test_between_two_steps_lies_what_is_between_their_states(
    session: ReplaySession, step: int
) -> None:
    session.seek((step + 0.25) * STEP_S)
    frame = session.frame()
    playback = Playback(PLAYED)
    before, after = playback.frame(step), playback.frame(step + 1)
    assert np.array_equal(frame.before, before.qpos)
    assert np.array_equal(frame.after, after.qpos)
    assert np.array_equal(frame.state.of(COIN).taken, after.state.of(COIN).taken)
    assert frame.fraction == pytest.approx(0.25)
    assert frame.result.coins == after.state.coins[0]


def test_time_passes_while_it_plays_and_ends_at_the_end(session: ReplaySession) -> None:
    assert session.advance(1.0) == round(1.0 / STEP_S)
    assert session.frame().fraction == pytest.approx(0.0, abs=1e-6)
    session.toggle_pause()
    assert session.advance(1.0) == 0
    assert session.time_s == pytest.approx(1.0)
    session.toggle_pause()
    session.advance(100.0)
    assert session.time_s == session.duration_s == pytest.approx(120 * STEP_S)
    assert session.frame().fraction == 1.0
    assert session.frame().result.truncated
    assert session.phase is Phase.PAUSED
    session.toggle_pause()
    assert (session.time_s, session.phase) == (0.0, Phase.PLAYING)


def test_going_back_begins_a_new_picture_so_that_nothing_flies_through_it(
    session: ReplaySession,
) -> None:
    session.seek(3.0)
    ahead = session.frame()
    session.seek(1.0)
    assert session.frame().episode == ahead.episode + 1
    session.seek(2.0)
    assert session.frame().episode == ahead.episode + 1
    assert session.frame().clock_s >= ahead.clock_s


def test_beyond_the_ends_are_the_ends(session: ReplaySession) -> None:
    session.seek(-5.0)
    assert session.time_s == 0.0
    session.seek(1e9)
    assert session.time_s == session.duration_s


def test_a_replay_without_a_step_can_be_looked_at() -> None:
    sums = replace(PLAYED.checksums, table=PLAYED.checksums.table[:1])
    nothing = replace(PLAYED, actions=PLAYED.actions[:0], checksums=sums)
    frame = ReplaySession(nothing).frame()
    assert np.array_equal(frame.before, frame.after)
