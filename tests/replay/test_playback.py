"""A replay can be put to any moment, and says where it is no longer the game that was recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.replay import Playback, frames, verify
from tests.replay.recording import pushed_otherwise, wandered
from tests.simulation.driving import bits, wandering

LONG = wandered("gate", max_episode_steps=120)


@pytest.fixture(scope="module")
def states() -> list[list[bytes]]:
    """Return the game's state at every moment of `LONG`, played from start to end."""
    playback = Playback(LONG)
    result = [bits(playback.simulation)]
    while playback.step < len(playback):
        playback.advance()
        result.append(bits(playback.simulation))
    return result


@settings(max_examples=20)
@given(moves=st.lists(st.integers(-20, len(LONG) + 20), min_size=1, max_size=6))
def test_wherever_one_goes_the_game_is_as_it_was_then(
    states: list[list[bytes]], moves: list[int]
) -> None:
    playback = Playback(LONG)
    for step in moves:
        playback.seek(step)
        assert playback.step == min(max(step, 0), len(LONG))
        assert _but_generators(bits(playback.simulation)) == _but_generators(states[playback.step])


def _but_generators(rows: list[bytes]) -> list[bytes]:
    return [row.partition(b"{'bit_generator'")[0] for row in rows]


def test_a_moment_is_found_by_its_time() -> None:
    playback = Playback(LONG)
    for step in range(0, len(LONG), 37):
        playback.seek_time(step * playback.simulation.duration_s)
        assert playback.step == step
        playback.seek_time((step + 0.9) * playback.simulation.duration_s)
        assert playback.step == step
    assert playback.duration_s == pytest.approx(len(LONG) * 0.05)


def test_the_end_is_the_end() -> None:
    playback = Playback(LONG)
    playback.seek(len(LONG))
    with pytest.raises(IndexError, match="ends there"):
        playback.advance()


def test_there_is_a_frame_for_every_moment_with_what_is_drawn_in_it() -> None:
    played = wandered("flat")
    shown = list(frames(played))
    assert [frame.step for frame in shown] == list(range(len(played) + 1))
    assert shown[0].qpos[:3].tolist() == list(played.start)
    assert np.array_equal([frame.force_n for frame in shown[:-1]], played.force_n)
    assert shown[-1].state.points[0] == played.result.coins
    assert shown[-1].state.fallen[0] == played.result.fall
    assert shown[-1].time_s == pytest.approx(played.result.time_s)
    # What is in a frame is its own.
    assert shown[0].state.steps[0] == 0


@settings(max_examples=12)
@given(step=st.integers(0, len(LONG) - 1))
def test_the_step_at_which_a_replay_parts_is_named(step: int) -> None:
    verification = verify(pushed_otherwise(LONG, step))
    assert verification.parted_at == step + 1
    assert not verification.is_exact
    assert f"parts at step {step + 1} of {len(LONG)}" in str(verification)
    assert "no version differs" in str(verification)


def test_another_start_parts_at_step_0() -> None:
    x, y, z = LONG.start
    assert verify(replace(LONG, start=(x + 1e-9, y, z))).parted_at == 0


def test_what_is_of_another_version_is_named() -> None:
    older = LONG.versions.model_copy(update={"mujoco": "3.9.9", "machine": "aarch64"})
    verification = verify(replace(pushed_otherwise(LONG, 7), versions=older))
    assert len(verification.differences) == 2
    assert "recorded with mujoco 3.9.9, not " in str(verification)
    assert "machine aarch64, not " in str(verification)
    exact = verify(replace(LONG, versions=older))
    assert exact.is_exact
    assert "though recorded with mujoco 3.9.9" in str(exact)


def test_a_result_that_is_not_the_games_is_noticed() -> None:
    richer = LONG.result.model_copy(update={"coins": LONG.result.coins + 1})
    verification = verify(replace(LONG, result=richer))
    assert verification.parted_at is None
    assert not verification.is_exact
    assert "another result" in str(verification)


def test_more_forces_than_the_game_has_steps_change_nothing_and_are_noticed() -> None:
    played = wandered("flat")
    pushes = wandering(1, 9)
    longer = np.concatenate([played.force_n, *(next(pushes) for _ in range(5))])
    checksums = np.concatenate([played.checksums, np.zeros(5, dtype=np.uint32)])
    verification = verify(replace(played, force_n=longer, checksums=checksums))
    assert verification.parted_at == len(played) + 1
    assert verification.result == played.result
