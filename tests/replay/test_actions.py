"""A replay holds what a player could have done: actions of the action space, to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.game.actions import DIRECTIONS, KEY_FORCE_N, ActionMode, forces
from roller_env.replay import ReplayError
from roller_env.replay.actions import (
    ACTION_BYTES,
    checked_actions,
    decode_actions,
    encode_actions,
    encoding_of,
    recorded_actions,
)

single = st.floats(-1.0, 1.0, width=32)
double = st.floats(-1.0, 1.0)


def pairs(numbers: st.SearchStrategy[float]) -> st.SearchStrategy[list[tuple[float, float]]]:
    return st.lists(st.tuples(numbers, numbers), max_size=20)


def kept(mode: ActionMode, actions: Any) -> Any:
    """Return actions written and read again."""
    checked = checked_actions(mode, actions)
    content = encode_actions(checked)
    assert len(content) == len(checked) * ACTION_BYTES[encoding_of(checked)]
    again = decode_actions(mode, encoding_of(checked), content)
    assert again.dtype == checked.dtype
    return again


@given(st.lists(st.integers(0, len(DIRECTIONS) - 1), max_size=20))
def test_directions_follow_from_forces(actions: list[int]) -> None:
    directions = np.array(actions, dtype=np.int64)
    pushed = forces("directions", directions)
    assert recorded_actions("directions", pushed).tolist() == actions
    for mode in ("keys", "force"):
        assert np.array_equal(forces(mode, recorded_actions(mode, pushed)), pushed)
    assert kept("directions", directions).tolist() == actions


@given(pairs(single))
def test_forces_follow_from_forces(pushes: list[tuple[float, float]]) -> None:
    actions = np.array(pushes, dtype=np.float32).reshape(-1, 2)
    pushed = forces("force", actions)
    assert recorded_actions("force", pushed).dtype == np.float32
    assert np.array_equal(recorded_actions("force", pushed), actions)
    assert np.array_equal(kept("force", actions), actions)


@given(pairs(double))
def test_a_player_whose_pushes_are_finer_than_float32_is_kept_to_the_bit(
    pushes: list[tuple[float, float]],
) -> None:
    pushed = forces("force", np.array(pushes, dtype=np.float64).reshape(-1, 2))
    actions = kept("force", recorded_actions("force", pushed))
    assert np.array_equal(forces("force", actions), pushed)


@given(st.lists(st.lists(st.integers(0, 1), min_size=4, max_size=4), max_size=20))
def test_keys_are_kept_as_they_were_held(held: list[list[int]]) -> None:
    keys = np.array(held, dtype=np.int8).reshape(-1, 4)
    assert kept("keys", keys).tolist() == held
    assert np.array_equal(
        forces("keys", recorded_actions("keys", forces("keys", keys))), forces("keys", keys)
    )


HARD = st.sampled_from([np.nan, np.inf, -np.inf, 1e308, 200.0, 5e-324, -0.0, KEY_FORCE_N])


@given(pairs(st.floats() | HARD))
def test_any_forces_are_refused_or_made_by_some_action(newtons: list[tuple[float, float]]) -> None:
    pushed = np.array(newtons, dtype=np.float64).reshape(-1, 2)
    for mode in ("directions", "keys", "force"):
        try:
            actions = recorded_actions(mode, pushed)
        except ReplayError:
            continue
        assert np.array_equal(forces(mode, actions), pushed)


@pytest.mark.parametrize(
    ("mode", "actions"),
    [
        ("directions", [9]),
        ("directions", [-1]),
        ("directions", [1.0]),
        ("directions", [True]),
        ("directions", ["w"]),
        ("directions", 3),
        ("directions", [[1, 0, 0, 0]]),
        ("keys", [[2, 0, 0, 0]]),
        ("keys", [[1, 0, 0]]),
        ("keys", [1]),
        ("keys", [[np.nan, 0.0, 0.0, 1.0]]),
        ("force", [[1.5, 0.0]]),
        ("force", [[np.nan, 0.0]]),
        ("force", [[0.0, 1e308]]),
        ("force", [[1j, 0.0]]),
        ("force", [[0.0, 0.0, 0.0]]),
        ("force", [[None, 0.0]]),
    ],
)
def test_what_is_outside_the_action_space_is_no_action(mode: ActionMode, actions: Any) -> None:
    with pytest.raises(ReplayError, match=f"none of '{mode}'"):
        checked_actions(mode, actions)


@given(st.binary(max_size=64), st.sampled_from(["u1", "f4", "f8"]))
def test_any_bytes_are_actions_of_the_space_or_refused(content: bytes, encoding: Any) -> None:
    content = content[: len(content) // ACTION_BYTES[encoding] * ACTION_BYTES[encoding]]
    for mode in ("directions", "keys", "force"):
        try:
            actions = decode_actions(mode, encoding, content)
        except ReplayError:
            continue
        assert np.array_equal(checked_actions(mode, actions), actions)
        assert np.abs(forces(mode, actions)).max(initial=0.0) <= KEY_FORCE_N


def test_a_step_and_its_code_are_named() -> None:
    with pytest.raises(
        ReplayError, match="step 1, 16, is none of 'keys', which has key codes 0 to 15"
    ):
        decode_actions("keys", "u1", bytes([15, 16]))
    with pytest.raises(ReplayError, match="step 2, 9, is none of 'directions', which has 0 to 8"):
        decode_actions("directions", "u1", bytes([0, 8, 9]))
    with pytest.raises(ReplayError, match="in which no action of 'keys' is written"):
        decode_actions("keys", "f8", bytes(16))
