"""Held keys, and environments that take them for actions. Nothing here knows of any window."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import RecordConstructorArgs

from roller_env.game.actions import KEYS, action_of_keys, held_letters

ARROWS: Final = {"up": "w", "left": "a", "down": "s", "right": "d"}
"""The arrow keys, and the letter that each of them stands for."""

NO_KEYS: Final = ""


class Keyboard:
    """Which of the keys that steer are down.

    W A S D and the arrows are eight keys: letting go of one leaves its twin as it is.
    """

    def __init__(self) -> None:
        self._down: set[str] = set()

    def press(self, key: str) -> None:
        """Put a key down; what steers nothing, or is down already, changes nothing."""
        if key.lower() in KEYS or key.lower() in ARROWS:
            self._down.add(key.lower())

    def release(self, key: str) -> None:
        """Let go of a key."""
        self._down.discard(key.lower())

    def release_all(self) -> None:
        """Let go of all, as when the window loses the focus."""
        self._down.clear()

    @property
    def held(self) -> str:
        """The letters of "wasd" that are held, by either key, in that order."""
        return letters(self._down)


def letters(keys: Iterable[str]) -> str:
    """Return the letters of "wasd" that the names of keys or arrows stand for, in that order."""
    stand_for = {ARROWS.get(key, key) for key in keys}
    return "".join(key for key in KEYS if key in stand_for)


class KeyboardWrapper(gym.ActionWrapper[Any, Any, Any], RecordConstructorArgs):
    """Held keys go in as W, A, S, D; the environment's own actions come out, whatever their mode.

    Observations, rewards and infos are not touched. ``action_space`` is MultiBinary(4). It is part
    of the wrapped environment's ``spec``, so that ``gym.make(env.spec)`` wraps again.
    """

    def __init__(self, env: gym.Env[Any, Any]):
        """Wrap an environment of this package.

        Raises:
            ValueError: it has no W, A, S, D.
        """
        RecordConstructorArgs.__init__(self)
        gym.ActionWrapper.__init__(self, env)
        config = getattr(env.unwrapped, "config", None)
        if config is None or not hasattr(config, "action"):
            raise ValueError(
                f"KeyboardWrapper: found {env}; must be one of the Roller environments"
            )
        self._mode = config.action
        self.action_space = gym.spaces.MultiBinary(len(KEYS))

    def action(self, action: npt.ArrayLike) -> Any:
        """Return the action that held keys stand for.

        Args:
            action: (4,) of 0 and 1, W A S D; or their letters, such as ``Keyboard.held``.

        Raises:
            ValueError: neither of the two.
        """
        if isinstance(action, str):
            unknown = set(action) - set(KEYS)
            if unknown:
                raise ValueError(f"keys: found {action!r}; must be letters of 'wasd'")
            return action_of_keys(self._mode, action)
        held = np.asarray(action)
        if held.shape != (len(KEYS),) or not np.isin(held, (0, 1)).all():
            raise ValueError(f"keys: found {action!r}; must be four of 0 and 1: W A S D")
        return action_of_keys(self._mode, held_letters(held))
