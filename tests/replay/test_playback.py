"""A replay can be put to any moment, and says where it is no longer the game that was recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.game.version import RULES_VERSION
from roller_env.physics.version import PHYSICS_VERSION
from roller_env.replay import Playback, frames, verify
from roller_env.replay.checksums import row_count
from roller_env.replay.playback import paths
from tests.replay.recording import pushed_otherwise, wandered
from tests.simulation.driving import bits

LONG = wandered("gate", max_episode_steps=120)
CHECKED = wandered("gate", max_episode_steps=120, check_every=1)


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
    assert shown[-1].state.coins[0] == played.result.coins
    assert shown[-1].state.fallen[0] == played.result.fall
    assert shown[-1].time_s == pytest.approx(played.result.time_s)
    # What is in a frame is its own.
    assert shown[0].state.steps[0] == 0


@settings(max_examples=12)
@given(step=st.integers(0, len(LONG) - 1))
def test_the_first_checksum_that_is_not_the_games_is_named(step: int) -> None:
    every = LONG.checksums.every
    assert every == 10
    verification = verify(pushed_otherwise(LONG, step))
    assert verification.last_match_step == step // every * every
    assert verification.first_mismatch_step == step // every * every + every
    assert not verification.is_exact
    assert f"another game at step {verification.first_mismatch_step} of {len(LONG)}" in str(
        verification
    )
    assert "no version differs" in str(verification)


@settings(max_examples=12)
@given(step=st.integers(0, len(CHECKED) - 1))
def test_with_a_checksum_of_every_step_the_very_step_and_what_was_other_in_it_are_named(
    step: int,
) -> None:
    verification = verify(pushed_otherwise(CHECKED, step))
    assert verification.first_mismatch_step == step + 1
    assert verification.last_match_step == step
    assert "ball_velocity" in verification.mismatches
    assert "coins_collected" not in verification.mismatches
    assert f"not yet at step {step}, in " in str(verification)
    assert "ball_velocity" in str(verification)


def test_another_start_is_named_as_the_balls_position_at_step_0() -> None:
    x, y, z = LONG.start
    verification = verify(replace(LONG, start=(x + 1e-9, y, z)))
    assert verification.first_mismatch_step == 0
    assert verification.last_match_step is None
    assert verification.mismatches == ("ball_position",)


def test_a_quantity_alone_that_is_not_the_games_is_named() -> None:
    table = LONG.checksums.table.copy()
    table[3, LONG.checksums.quantities.index("gates_opening")] ^= 1
    verification = verify(replace(LONG, checksums=replace(LONG.checksums, table=table)))
    assert verification.mismatches == ("gates_opening",)
    assert verification.first_mismatch_step == 30


def test_a_replay_of_before_a_quantity_was_added_is_compared_in_those_it_has() -> None:
    sums = LONG.checksums
    fewer = replace(sums, quantities=sums.quantities[:3], table=sums.table[:, :3])
    assert verify(replace(LONG, checksums=fewer)).is_exact
    assert not verify(pushed_otherwise(replace(LONG, checksums=fewer), 3)).is_exact


def test_what_is_of_another_version_is_named() -> None:
    older = LONG.versions.model_copy(update={"mujoco": "3.9.9", "machine": "aarch64"})
    verification = verify(replace(pushed_otherwise(LONG, 7), versions=older))
    assert len(verification.differences) == 2
    assert "the rules" not in str(verification)
    assert "recorded with mujoco 3.9.9, not " in str(verification)
    assert "machine aarch64, not " in str(verification)
    exact = verify(replace(LONG, versions=older))
    assert exact.is_exact
    assert "though recorded with mujoco 3.9.9" in str(exact)


def test_a_replay_of_other_rules_or_physics_says_so() -> None:
    older = LONG.versions.model_copy(update={"rules": 0, "physics": 0})
    verification = verify(replace(pushed_otherwise(LONG, 7), versions=older))
    assert verification.differences == (
        f"rules 0, not {RULES_VERSION}",
        f"physics 0, not {PHYSICS_VERSION['mujoco']}",
    )
    assert f"recorded with rules 0, not {RULES_VERSION}" in str(verification)


def test_paths_of_replays_played_together_are_those_of_each_played_alone() -> None:
    played = [wandered("bridge", seed=seed) for seed in range(3)]
    assert len({len(one) for one in played}) > 1
    for one, path in zip(played, paths(played), strict=True):
        alone = Playback(one)
        assert path.shape == (len(one), 3)
        for centre in path:
            assert np.array_equal(centre, alone.simulation.ball_position[0])
            alone.advance()
    assert paths([]) == []


def test_a_result_that_is_not_the_games_is_noticed() -> None:
    richer = replace(LONG.result, coins=LONG.result.coins + 1)
    verification = verify(replace(LONG, result=richer))
    assert verification.first_mismatch_step is None
    assert not verification.is_exact
    assert "another result" in str(verification)


def test_actions_after_the_end_of_the_game_are_no_game() -> None:
    played = wandered("flat")
    sums = played.checksums
    # As somebody writes it who knows that nothing moves any more.
    rows = row_count(len(played) + 25, sums.every)
    still = np.repeat(sums.table[-1:], rows - len(sums.table), axis=0)
    table = np.concatenate([sums.table, still])
    longer = replace(
        played,
        actions=np.concatenate([played.actions, np.ones(25, dtype=np.int64)]),
        checksums=replace(sums, table=table),
    )
    verification = verify(longer)
    assert not verification.is_exact
    assert verification.first_mismatch_step == len(played) + 1
    assert "the game is over before it" in str(verification)
    assert verification.result == played.result
