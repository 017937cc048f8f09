"""Random play that is the same in a single environment and in every kind of vector."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from roller_env.game.actions import DIRECTIONS, KEY_AXES, ActionMode, held_keys

FORCES = np.array([held_keys(held) @ KEY_AXES for held in DIRECTIONS], dtype=np.float32)
KEYS = np.array([held_keys(held) for held in DIRECTIONS])


def wandering_actions(
    num_envs: int, seed: int = 0, mode: ActionMode = "directions"
) -> Iterator[npt.NDArray[Any]]:
    """Yield batched actions that push in random directions for random times.

    Long pushes, so that balls leave the start and fall; row i's actions depend on seed + i alone.
    """
    generators = [np.random.default_rng(seed + row) for row in range(num_envs)]
    direction = np.zeros(num_envs, dtype=np.int64)
    left = np.zeros(num_envs, dtype=np.int64)
    while True:
        for row in np.flatnonzero(left == 0):
            direction[row] = generators[row].integers(len(DIRECTIONS))
            left[row] = generators[row].integers(5, 30)
        left -= 1
        yield {"directions": direction, "keys": KEYS[direction], "force": FORCES[direction]}[
            mode
        ].copy()


def bytes_of(observation: Any) -> bytes:
    """Return an observation's bits."""
    if isinstance(observation, dict):
        return b"".join(observation[name].tobytes() for name in sorted(observation))
    bits: bytes = observation.tobytes()
    return bits


def row_of(observation: Any, row: int) -> Any:
    """Return one row of a batched observation."""
    if isinstance(observation, dict):
        return {name: values[row] for name, values in observation.items()}
    return observation[row]
