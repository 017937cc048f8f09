"""PlayerCamera: the camera of the game, of which a person can choose the mode.

The choice is the picture's, not the simulation's: it lasts until the game itself changes the mode.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from roller_env.arrays import Float64
from roller_env.game.cameras import (
    MODE_BEHIND,
    MODE_BELOW,
    MODE_FIRST_PERSON,
    MODE_FRONT,
    MODE_OVERHEAD,
    MODE_RETREAT,
    CameraState,
    camera_position,
    camera_target,
    retreat,
)

ORDER: Final = (
    MODE_BEHIND,
    MODE_OVERHEAD,
    MODE_BELOW,
    MODE_FIRST_PERSON,
    MODE_FRONT,
    MODE_RETREAT,
)
"""In which a person goes through the modes. The retreat comes last: it glides from the front to
behind the ball, where the first mode is; from there it would have nowhere to glide."""


class View(NamedTuple):
    """Where the camera is and what it looks at, (3,) metres each, world frame."""

    position: Float64
    target: Float64


class PlayerCamera:
    """The camera of one player.

    Attributes:
        mode: 0 to 5, see `roller_env.game.cameras.MODES`.
    """

    def __init__(self) -> None:
        self.mode = MODE_BEHIND
        self._game_mode = MODE_BEHIND
        self._x = np.zeros(1)
        self._ball = np.zeros((1, 3))

    def reset(self) -> None:
        """Go back behind the ball, as when the level is loaded."""
        self.mode = self._game_mode = MODE_BEHIND

    def next(self) -> None:
        """Take the next mode of `ORDER`; after the last comes the first."""
        self._enter(ORDER[(ORDER.index(self.mode) + 1) % len(ORDER)])

    def follow(self, game_mode: int, ball: Float64, duration_s: float) -> View:
        """Move on for a time and return the view.

        Args:
            game_mode: the mode that the game has set.
            ball: (3,) centre of the ball as drawn.
            duration_s: since the last call.
        """
        if game_mode != self._game_mode:
            ends_by_itself = self._game_mode == MODE_RETREAT and game_mode == MODE_BEHIND
            self._game_mode = game_mode
            if not ends_by_itself:
                self._enter(game_mode)
        self._ball = np.array([ball])
        mode = np.array([self.mode])
        if self.mode == MODE_RETREAT:
            retreat(0, duration_s, float(ball[0]), CameraState(mode, self._x))
            self.mode = int(mode[0])
        position = camera_position(mode, self._ball, self._x)
        return View(position[0], camera_target(mode, self._ball)[0])

    def _enter(self, mode: int) -> None:
        """Change the mode; a retreat begins where the camera is."""
        if mode == MODE_RETREAT:
            self._x = camera_position(np.array([self.mode]), self._ball, self._x)[:, 0]
        self.mode = mode
