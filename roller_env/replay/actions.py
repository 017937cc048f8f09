"""What a player did in every control step: actions of the action space, and nothing wider.

An action mode says what a player's hands are: which of nine directions, which of four keys, or a
push along each axis. A replay holds actions and no forces, so that it cannot hold a force that
nobody could have made.
"""

from __future__ import annotations

from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from roller_env.envs.spaces import action_of_keys
from roller_env.game.actions import DIRECTIONS, KEY_AXES, KEY_FORCE_N, KEYS, ActionMode, forces
from roller_env.replay.errors import ReplayError

Float64 = npt.NDArray[np.float64]
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
_BITS: Final = 2 ** np.arange(len(KEYS))
_DIRECTION_OF_KEYS: Final = np.array(
    [
        action_of_keys("directions", "".join(k for i, k in enumerate(KEYS) if bits >> i & 1))
        for bits in range(2 ** len(KEYS))
    ]
)
"""Number among `DIRECTIONS` of every combination of held keys, by its bits."""

assert len(DIRECTIONS) == _DIRECTION_OF_KEYS.max() + 1, "every direction is a combination of keys"


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


def actions_of(mode: ActionMode, force_n: Float64) -> Actions:
    """Return the actions that push with ``force_n``, (T, 2) newtons: `forces` the other way round.

    Raises:
        ReplayError: no action of that mode does.
    """
    # Nothing is computed with what no key gives, or is no number at all.
    push = np.where(np.abs(force_n) <= KEY_FORCE_N, force_n, 0.0) / KEY_FORCE_N
    if mode == "force":
        actions = _pushes(push, force_n)
    else:
        along = np.clip(np.round(push @ KEY_AXES.T), 0.0, 1.0).astype(np.int8)
        actions = along if mode == "keys" else _DIRECTION_OF_KEYS[along @ _BITS]
    wrong = np.flatnonzero((forces(mode, actions) != force_n).any(axis=1))
    if len(wrong):
        raise ReplayError(
            f"the force of step {wrong[0]}, {force_n[wrong[0]].tolist()} N, is no action of mode "
            f"{mode!r}; choose another with the option 'action'"
        )
    return checked_actions(mode, actions)


def _pushes(push: Float64, force_n: Float64) -> Float64:
    """Return the pushes of mode ``force`` that give these forces, where there are any.

    A force is a rounded product, so its push is the quotient or a neighbour of it. Agents push in
    float32: that comes first.
    """
    found = push.astype(np.float32).astype(np.float64)
    for other in (push, np.nextafter(push, -1.0), np.nextafter(push, 1.0)):
        found = np.where(KEY_FORCE_N * found == force_n, found, other)
    return found


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
    codes = actions @ _BITS if actions.ndim == 2 else actions
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
    _refuse(mode, codes >= 2 ** len(KEYS), codes, f"key codes 0 to {2 ** len(KEYS) - 1}")
    return checked_actions(mode, ((codes[:, None] & _BITS) > 0).astype(np.int8))


def _refuse(mode: ActionMode, wrong: npt.NDArray[np.bool_], actions: Actions, allowed: str) -> None:
    if wrong.any():
        step = int(wrong.argmax())
        raise ReplayError(
            f"the action of step {step}, {actions[step].tolist()}, is none of {mode!r}, which has "
            f"{allowed}"
        )
