"""Gymnasium spaces of one game, and the shapes that actions and observations have there."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from roller_env.config import EnvConfig
from roller_env.game import actions, observations
from roller_env.game.actions import DIRECTIONS, KEYS, ActionMode

Space = gym.Space[Any]


def action_space(config: EnvConfig) -> Space:
    """Return the action space of one game."""
    if config.action == "directions":
        return gym.spaces.Discrete(len(DIRECTIONS))
    if config.action == "keys":
        return gym.spaces.MultiBinary(len(KEYS))
    return gym.spaces.Box(-1.0, 1.0, (2,), np.float32)


def observation_space(config: EnvConfig) -> Space:
    """Return the observation space of one game."""
    if config.observation == "pixels":
        return gym.spaces.Box(0, 255, (config.height, config.width, 3), np.uint8)
    parts = observations.entries(config.observation)
    boxes: dict[str, Space] = {
        entry.name: gym.spaces.Box(
            np.float32(entry.low), np.float32(entry.high), (entry.size,), np.float32
        )
        for entry in parts
    }
    if config.observation == "dict":
        return gym.spaces.Dict(boxes)
    return gym.spaces.flatten_space(gym.spaces.Tuple(list(boxes.values())))


def shape_observation(config: EnvConfig, vectors: npt.NDArray[np.float32]) -> Any:
    """Return observation vectors, (..., size), in the shape of the configured mode."""
    if config.observation == "dict":
        return observations.split(vectors, observations.entries("dict"))
    return vectors


def row_of(observation: Any, row: int) -> Any:
    """Return a copy of one row of a batched observation."""
    if isinstance(observation, dict):
        return {name: values[row].copy() for name, values in observation.items()}
    return observation[row].copy()


def action_of_keys(mode: ActionMode, held: str) -> Any:
    """Return the action that holding the keys in ``held``, letters of "wasd", stands for.

    Opposite keys cancel.
    """
    keys = actions.held_keys(held)
    if mode == "keys":
        return keys
    push = keys @ actions.KEY_AXES
    if mode == "force":
        return push.astype(np.float32)
    pushes = np.array([actions.held_keys(name) @ actions.KEY_AXES for name in DIRECTIONS])
    return int(np.flatnonzero((pushes == push).all(axis=1))[0])


def keys_to_action(mode: ActionMode) -> dict[tuple[str, ...], Any]:
    """Return every combination of held keys with its action, as `gymnasium.utils.play` takes it.

    It refuses a combination of no keys, and takes that action as its ``noop``.
    """
    combinations: dict[tuple[str, ...], Any] = {}
    for bits in range(1, 2 ** len(KEYS)):
        held = [key for index, key in enumerate(KEYS) if bits >> index & 1]
        combinations[tuple(held)] = action_of_keys(mode, "".join(held))
    return combinations
