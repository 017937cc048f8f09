"""MuJoCo's renderer, as far as Roller uses it."""

import numpy as np
import numpy.typing as npt
from mujoco._structs import MjModel, MjrRect, MjvScene

class MjrContext:
    def __init__(self, model: MjModel, fontscale: int) -> None: ...
    def free(self) -> None: ...

def mjr_readPixels(
    rgb: npt.NDArray[np.uint8] | None,
    depth: npt.NDArray[np.float32] | None,
    viewport: MjrRect,
    con: MjrContext,
) -> None: ...
def mjr_render(viewport: MjrRect, scn: MjvScene, con: MjrContext) -> None: ...
def mjr_setBuffer(framebuffer: int, con: MjrContext) -> None: ...
