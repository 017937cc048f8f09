"""Held keys, the actions of each mode, and the force on the ball: every way from one to another.

Each key pushes with the same force along a world axis; keys add, so two neighbouring keys push
with 1.41 times the force along the diagonal, and opposite keys cancel.
"""

from __future__ import annotations

import math
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Float64
from roller_env.level.reach import Play
from roller_env.physics.presets import PhysicsPreset
from roller_env.units import quants

ActionMode = Literal["directions", "keys", "force"]

KEY_FORCE_N: Final = quants(200.0)
"""Force of one key on the ball of 1 kg: the original's 200 quant/s^2 of central force."""

KEYS: Final = ("w", "a", "s", "d")

KEY_AXES: Final = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
"""World x and y direction of each of `KEYS`: W forward +x, A left +y, S back, D right."""

DIRECTIONS: Final = ("", "w", "wa", "a", "as", "s", "sd", "d", "wd")
"""Keys held in each of the nine discrete actions: none, then round the compass from forward to
the left."""

_DIRECTION_FORCES_N: Final = KEY_FORCE_N * (
    np.array([[key in held for key in KEYS] for held in DIRECTIONS]) @ KEY_AXES
)


def held_keys(held: str) -> npt.NDArray[np.int8]:
    """Return which of `KEYS` the letters in ``held`` name, (4,) of 0 and 1."""
    return np.array([key in held for key in KEYS], dtype=np.int8)


def held_letters(keys: npt.NDArray[Any]) -> str:
    """Return the letters of the keys in ``keys``, (4,) of 0 and 1, or of flags."""
    return "".join(key for key, down in zip(KEYS, keys, strict=True) if down)


def action_of_keys(mode: ActionMode, held: str) -> Any:
    """Return the action that holding the keys in ``held``, letters of "wasd", stands for.

    Opposite keys cancel.
    """
    keys = held_keys(held)
    if mode == "keys":
        return keys
    push = keys @ KEY_AXES
    if mode == "force":
        return push.astype(np.float32)
    pushes = np.array([held_keys(name) @ KEY_AXES for name in DIRECTIONS])
    return int(np.flatnonzero((pushes == push).all(axis=1))[0])


KEY_CODES: Final = 2 ** np.arange(len(KEYS))
"""What each key adds to the code of held keys: W 1, A 2, S 4, D 8."""

COMBINATIONS: Final = tuple(held_letters(code & KEY_CODES) for code in range(2 ** len(KEYS)))
"""The keys held, by their code."""

_DIRECTION_OF_CODE: Final = np.array([action_of_keys("directions", held) for held in COMBINATIONS])

assert len(DIRECTIONS) == _DIRECTION_OF_CODE.max() + 1, "every direction is a combination of keys"


def forces(mode: ActionMode, actions: npt.ArrayLike) -> Float64:
    """Return the force that actions ask for.

    Args:
        mode: ``directions``: (N,) integers 0 to 8, indices of `DIRECTIONS`; ``keys``: (N, 4) of 0
            and 1, one for each of `KEYS`; ``force``: (N, 2) from -1 to 1, in key forces along
            world x and y.
        actions: actions of that mode.

    Returns:
        (N, 2) float64 newtons along world x and y.

    Raises:
        ValueError: the actions' shape, type or range is not that of the mode.
    """
    array = np.asarray(actions)
    if mode == "directions":
        if array.ndim != 1 or array.dtype.kind not in "iu":
            raise _refused(array, "'directions' takes (N,) integers")
        if len(array) and not (array.min() >= 0 and array.max() < len(DIRECTIONS)):
            raise ValueError(
                f"actions: found {array.min()} to {array.max()}; 'directions' takes 0 to 8"
            )
        direction: Float64 = _DIRECTION_FORCES_N[array]
        return direction
    if mode == "keys":
        if array.ndim != 2 or array.shape[1] != len(KEYS) or array.dtype.kind not in "biuf":
            raise _refused(array, "'keys' takes (N, 4) of 0 and 1")
        held = array != 0
        strange = held & (array != 1)
        if strange.any():
            raise ValueError(f"actions: found {array[strange][0]}; 'keys' takes 0 and 1")
        pushed: Float64 = KEY_FORCE_N * (held @ KEY_AXES)
        return pushed
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iuf":
        raise _refused(array, "'force' takes (N, 2) numbers")
    # Written so that what is not a number is not inside either.
    inside = np.abs(array) <= 1.0
    if not inside.all():
        raise ValueError(f"actions: found {array[~inside][0]}; 'force' takes -1 to 1")
    return KEY_FORCE_N * array.astype(np.float64)


def actions_of(mode: ActionMode, force_n: Float64) -> npt.NDArray[Any]:
    """Return the actions that push with ``force_n``, (T, 2) newtons: `forces` the other way round.

    Returns:
        (T,) int64, (T, 4) int8 or (T, 2) float64, as the mode has them.

    Raises:
        ValueError: no action of that mode does.
    """
    # Nothing is computed with what no key gives, or is no number at all.
    push = np.where(np.abs(force_n) <= KEY_FORCE_N, force_n, 0.0) / KEY_FORCE_N
    actions: npt.NDArray[Any]
    if mode == "force":
        actions = _pushes(push, force_n)
    else:
        along = np.clip(np.round(push @ KEY_AXES.T), 0.0, 1.0).astype(np.int8)
        actions = along if mode == "keys" else _DIRECTION_OF_CODE[along @ KEY_CODES]
    wrong = np.flatnonzero((forces(mode, actions) != force_n).any(axis=1))
    if len(wrong):
        raise ValueError(
            f"the force of step {wrong[0]}, {force_n[wrong[0]].tolist()} N, is no action of mode "
            f"{mode!r}; choose another with the option 'action'"
        )
    return actions


def _pushes(push: Float64, force_n: Float64) -> Float64:
    """Return the pushes of mode ``force`` that give these forces, where there are any.

    A force is a rounded product, so its push is the quotient or a neighbour of it. Agents push in
    float32: that comes first.
    """
    found = push.astype(np.float32).astype(np.float64)
    for other in (push, np.nextafter(push, -1.0), np.nextafter(push, 1.0)):
        found = np.where(KEY_FORCE_N * found == force_n, found, other)
    return found


def _refused(actions: npt.NDArray[Any], takes: str) -> ValueError:
    return ValueError(f"actions: found shape {actions.shape} of {actions.dtype}; {takes}")


def hardest_play(preset: PhysicsPreset) -> Play:
    """Return how a level is played where whoever plays pushes as hard as the keys can."""
    return Play(
        dt_s=preset.dt_s if preset.engine == "mujoco" else 0.0,
        # The hardest push is that of two keys.
        push_n=math.hypot(KEY_FORCE_N, KEY_FORCE_N),
    )
