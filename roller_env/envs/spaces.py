"""Gymnasium spaces of one game, and the shapes that actions and observations have there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast, get_args

import gymnasium as gym
import numpy as np

from roller_env.arrays import Float32
from roller_env.config import EnvConfig
from roller_env.game import observations
from roller_env.game.actions import (
    COMBINATIONS,
    DIRECTIONS,
    KEYS,
    ActionMode,
    action_of_keys,
)
from roller_env.level import load_level
from roller_env.level.expand import expand
from roller_env.pieces.rules import Entry

Space = gym.Space[Any]
Observations = Float32 | dict[str, Float32]
"""Of many envs, with a leading axis of them; a dict of entries with the ``dict`` observation."""


def action_space(config: EnvConfig) -> Space:
    """Return the action space of one game."""
    if config.action == "directions":
        return gym.spaces.Discrete(len(DIRECTIONS))
    if config.action == "keys":
        return gym.spaces.MultiBinary(len(KEYS))
    return gym.spaces.Box(-1.0, 1.0, (2,), np.float32)


def action_mode(space: Space) -> ActionMode | None:
    """Return the mode whose action space this is; None if it is none of this game's."""
    for mode in get_args(ActionMode):
        if space == action_space(EnvConfig(action=mode)):
            return cast("ActionMode", mode)
    return None


def entries_of(config: EnvConfig) -> tuple[Entry, ...]:
    """Return what is observed of one game on the level of the options.

    Raises:
        LevelError: the level is not valid.
    """
    if config.kinds == "all" or config.observation == "pixels":
        return observations.entries(config.observation, config.kinds)
    return observations.entries(config.observation, levels=[expand(load_level(config.level))])


def observation_space(config: EnvConfig, parts: Sequence[Entry]) -> Space:
    """Return the observation space of one game, which has these entries."""
    if config.observation == "pixels":
        return gym.spaces.Box(0, 255, (config.height, config.width, 3), np.uint8)
    boxes: dict[str, Space] = {
        entry.name: gym.spaces.Box(
            np.float32(entry.low), np.float32(entry.high), (entry.size,), np.float32
        )
        for entry in parts
    }
    if config.observation == "dict":
        return gym.spaces.Dict(boxes)
    return gym.spaces.flatten_space(gym.spaces.Tuple(list(boxes.values())))


def shape_observation(config: EnvConfig, parts: Sequence[Entry], vectors: Float32) -> Any:
    """Return observation vectors, (..., size), in the shape of the configured mode."""
    return observations.split(vectors, parts) if config.observation == "dict" else vectors


def row_of(observation: Any, row: int) -> Any:
    """Return a copy of one row of a batched observation."""
    if isinstance(observation, dict):
        return {name: values[row].copy() for name, values in observation.items()}
    return observation[row].copy()


def keys_to_action(mode: ActionMode) -> dict[tuple[str, ...], Any]:
    """Return every combination of held keys with its action, as `gymnasium.utils.play` takes it.

    It refuses a combination of no keys, and takes that action as its ``noop``.
    """
    return {tuple(held): action_of_keys(mode, held) for held in COMBINATIONS if held}
