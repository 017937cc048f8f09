"""GameRenderer: pictures of the games of a simulation, as its cameras see them."""

from __future__ import annotations

import math
from typing import Any, Final, Literal

import mujoco
import numpy as np

from roller_env.arrays import Float64
from roller_env.drawing.canvas import Canvas, Picture
from roller_env.drawing.opengl import DrawingUnavailable, drawing
from roller_env.drawing.stage import Stage
from roller_env.game.cameras import (
    MODE_BEHIND,
    MODE_RETREAT,
    camera_position,
    camera_target,
)
from roller_env.simulation import Simulation

__all__ = ["DrawingUnavailable", "GameRenderer"]

FIELD_OF_VIEW_DEG: Final = 65.0
"""Vertical: at 2.5 m behind and 2 m above the ball it shows the way ahead and what is beside it."""

SMALL_PICTURE_PIXELS: Final = 200
"""Pictures with a shorter edge than this are for agents, which ask for many: they are drawn three
times as fast, without smooth edges and with coarser shadows."""

SAMPLES_PER_PIXEL: Final = 4

SHADOW_REACH_M: Final = 11.0
SHADOW_REACH_SMALL_M: Final = 8.0
"""Half the edge of the square round the ball in which shadows are drawn."""

SHADOW_PIXELS: Final = 2048
SHADOW_PIXELS_SMALL: Final = 1024
"""Edge of the picture that shadows are made from."""


class GameRenderer:
    """Draws games of one simulation. Making one is cheap: OpenGL is asked for at the first picture.

    It reads the simulation and changes nothing in it. Any thread may ask for a picture, as long as
    none is stepping the simulation.
    """

    def __init__(self, simulation: Simulation, width: int, height: int):
        """Make a renderer of pictures of ``width`` by ``height`` pixels."""
        self._simulation = simulation
        self._size = (width, height)
        self._slots = simulation.table.slots(simulation.levels)
        self._level = 0
        self._stage: Stage | None = None
        self._canvas: Canvas | None = None

    def __getstate__(self) -> dict[str, Any]:
        """A copy draws the copied simulation, with an OpenGL context that it makes for itself."""
        return {**self.__dict__, "_stage": None, "_canvas": None}

    def render(self, row: int, camera: int | Literal["game"] = "game") -> Picture:
        """Return a picture of the game in ``row``, (height, width, 3) uint8.

        Args:
            row: which game.
            camera: a camera mode, or "game" for the one that the game has set.

        Raises:
            DrawingUnavailable: there is no OpenGL here.
        """
        with drawing():
            return self._draw(row, camera)

    def _draw(self, row: int, camera: int | Literal["game"]) -> Picture:
        simulation = self._simulation
        level = int(simulation.level_of[row])
        stage, canvas = self._open(level)
        state = simulation.state
        game_mode = int(state.camera.mode[row])
        mode = game_mode if camera == "game" else int(camera)
        if mode == MODE_RETREAT != game_mode:
            # Nothing retreats: this is where the camera is when it has.
            mode = MODE_BEHIND
        ball = simulation.ball_position[row : row + 1]
        # The stage has the level's own slabs, the simulation those of all levels.
        own = [*range(7), *(7 + slot for slot in self._slots[level])]
        stage.show(simulation.qpos[row, own], state, row, float(simulation.time_s[row]))
        stage.clear_view(mode)
        stage.light_from(ball[0])
        modes = np.array([mode])
        position = camera_position(modes, ball, state.camera.x[row : row + 1])
        target = camera_target(modes, ball)
        return canvas.draw(stage.data, look(position[0], target[0]))

    def close(self) -> None:
        """Free what drawing has taken; the next picture would take it anew."""
        if self._canvas is not None:
            self._canvas.close()
        self._canvas = self._stage = None

    def _open(self, level: int) -> tuple[Stage, Canvas]:
        """Return the stage of a level, and what it is drawn on."""
        if level != self._level:
            self.close()
        if self._canvas is None or self._stage is None:
            self._level = level
            stage = Stage(self._simulation.levels[level], self._simulation.preset)
            visual, small = stage.model.vis, min(self._size) < SMALL_PICTURE_PIXELS
            visual.global_.fovy = FIELD_OF_VIEW_DEG
            visual.map.shadowclip = SHADOW_REACH_SMALL_M if small else SHADOW_REACH_M
            visual.quality.shadowsize = SHADOW_PIXELS_SMALL if small else SHADOW_PIXELS
            visual.quality.offsamples = 0 if small else SAMPLES_PER_PIXEL
            self._canvas = Canvas(stage.model, *self._size)
            self._stage = stage
        return self._stage, self._canvas


def look(position: Float64, target: Float64) -> mujoco.MjvCamera:
    """Return a camera at ``position`` that looks at ``target``, both (3,) metres, z up."""
    forward = np.asarray(target) - np.asarray(position)
    distance = float(np.linalg.norm(forward))
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = target
    camera.distance = distance
    camera.azimuth = math.degrees(math.atan2(forward[1], forward[0]))
    camera.elevation = math.degrees(math.asin(np.clip(forward[2] / distance, -1.0, 1.0)))
    return camera
