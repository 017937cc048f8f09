"""What a player did in every control step: actions of the action space, and nothing wider.

An action mode says what a player's hands are: which of nine directions, which of four keys, or a
push along each axis. A replay holds actions and no forces, so that it cannot hold a force that
nobody could have made.
"""

from __future__ import annotations

from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64
from roller_env.game.actions import (
    COMBINATIONS,
    DIRECTIONS,
    KEY_CODES,
    KEYS,
    ActionMode,
    actions_of,
)
from roller_env.replay.errors import ReplayError

Actions = npt.NDArray[Any]

Encoding = Literal["u1", "f4", "f8"]
"""How actions are written, in NumPy's words: one byte (the direction's number, or the held keys'
bits: W 1, A 2, S 4, D 8), or two little-endian numbers."""

ACTION_BYTES: Final[dict[Encoding, int]] = {"u1": 1, "f4": 8, "f8": 16}

_SHAPES: Final[dict[ActionMode, tuple[int, ...]]] = {
    "directions": (),
    "keys": (len(KEYS),),
    "force": (2,),
}
_RANGES: Final[dict[ActionMode, tuple[int, int]]] = {
    "directions": (0, len(DIRECTIONS) - 1),
    "keys": (0, 1),
    "force": (-1, 1),
}


def checked_actions(mode: ActionMode, actions: npt.ArrayLike) -> Actions:
    """Return actions in the one type in which a replay holds them.

    Args:
        mode: whose actions they are.
        actions: (T,) integers 0 to 8 of ``directions``, (T, 4) of 0 and 1 of ``keys``, (T, 2)
            numbers from -1 to 1 of ``force``.

    Returns:
        (T,) int64, (T, 4) int8, or (T, 2) float32, which is what the action space has; float64 for
        a player whose pushes are finer than that.

    Raises:
        ReplayError: an action is none of the mode's.
    """
    array = np.asarray(actions)
    kinds = "iuf" if mode == "force" else "iu"
    if array.ndim == 0 or array.shape[1:] != _SHAPES[mode] or array.dtype.kind not in kinds:
        raise ReplayError(
            f"found actions {array.shape} of {array.dtype}, which are none of {mode!r}"
        )
    low, high = _RANGES[mode]
    # NaN is outside too.
    inside = (array >= low) & (array <= high)
    outside = np.logical_not(inside.all(axis=tuple(range(1, array.ndim))))
    _refuse(mode, outside, array, f"{low} to {high}")
    if mode != "force":
        return array.astype(np.int64 if mode == "directions" else np.int8)
    single = array.astype(np.float32)
    return single if (single == array).all() else array.astype(np.float64)


def recorded_actions(mode: ActionMode, force_n: Float64) -> Actions:
    """Return the actions that push with ``force_n``, (T, 2) newtons, as a replay holds them.

    Raises:
        ReplayError: no action of that mode does.
    """
    try:
        return checked_actions(mode, actions_of(mode, force_n))
    except ValueError as error:
        raise ReplayError(str(error)) from None


def encoding_of(actions: Actions) -> Encoding:
    """Return how `checked_actions` are written."""
    if actions.dtype == np.float32:
        return "f4"
    return "f8" if actions.dtype == np.float64 else "u1"


def encode_actions(actions: Actions) -> bytes:
    """Return `checked_actions` as bytes."""
    encoding = encoding_of(actions)
    if encoding != "u1":
        return actions.astype("<" + encoding).tobytes()
    codes = actions @ KEY_CODES if actions.ndim == 2 else actions
    return codes.astype(np.uint8).tobytes()


def decode_actions(mode: ActionMode, encoding: Encoding, content: bytes) -> Actions:
    """Return the actions that bytes stand for.

    Raises:
        ReplayError: an action is none of the mode's, or none of them is written so.
    """
    if (encoding == "u1") == (mode == "force"):
        raise ReplayError(
            f"encoding: found {encoding!r}, in which no action of {mode!r} is written"
        )
    if mode == "force":
        return checked_actions(mode, np.frombuffer(content, "<" + encoding).reshape(-1, 2))
    codes = np.frombuffer(content, np.uint8)
    if mode == "directions":
        return checked_actions(mode, codes)
    _refuse(mode, codes >= len(COMBINATIONS), codes, f"key codes 0 to {len(COMBINATIONS) - 1}")
    return checked_actions(mode, ((codes[:, None] & KEY_CODES) > 0).astype(np.int8))


def _refuse(mode: ActionMode, wrong: Bool, actions: Actions, allowed: str) -> None:
    if wrong.any():
        step = int(wrong.argmax())
        raise ReplayError(
            f"the action of step {step}, {actions[step].tolist()}, is none of {mode!r}, which has "
            f"{allowed}"
        )
