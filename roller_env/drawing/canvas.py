"""Canvas: a MuJoCo model's pictures of one size, off screen."""

from __future__ import annotations

import weakref

import mujoco
import numpy as np

from roller_env.arrays import UInt8
from roller_env.drawing.opengl import current, free, new_context

Picture = UInt8


class Canvas:
    """An OpenGL context with a model's meshes and textures in it.

    It does what `mujoco.Renderer` does, in a context that `roller_env.drawing.opengl` chose. Any
    thread may draw on it and close it; one that nobody closed is freed with its last reference.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int):
        """Load the model's meshes and textures into a new context.

        Raises:
            DrawingUnavailable: there is no OpenGL here.
        """
        model.vis.global_.offwidth = width
        model.vis.global_.offheight = height
        self._model = model
        self._context = new_context(width, height)
        with current(self._context):
            self._resources = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._resources)
        self._free = weakref.finalize(self, free, self._context, self._resources)
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 1)
        self._option = mujoco.MjvOption()
        self._rectangle = mujoco.MjrRect(0, 0, width, height)

    def draw(self, data: mujoco.MjData, camera: mujoco.MjvCamera) -> Picture:
        """Return a picture of ``data``, whose kinematics are up to date, (H, W, 3) uint8."""
        mujoco.mjv_updateScene(
            self._model,
            data,
            self._option,
            None,
            camera,
            mujoco.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        picture = np.empty((self._rectangle.height, self._rectangle.width, 3), dtype=np.uint8)
        with current(self._context):
            mujoco.mjr_render(self._rectangle, self._scene, self._resources)
            mujoco.mjr_readPixels(picture, None, self._rectangle, self._resources)
        return np.ascontiguousarray(picture[::-1])

    def close(self) -> None:
        """Free the context; the canvas cannot draw any more."""
        self._free()
