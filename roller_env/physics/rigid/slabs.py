"""Slabs: solids that move along a line at a given speed, between its end and where they began."""

from __future__ import annotations

import math
from typing import Any

from roller_env.physics.rigid.kernels import Records, inlined
from roller_env.physics.rigid.scene import Scenes
from roller_env.physics.rigid.states import SLAB


@inlined
def set_going(scenes: Scenes, level: int, body: Any, slabs: Records) -> None:
    """Write where the slabs of a ball's level are, and how fast they move, by its packed state."""
    for k in range(len(slabs)):
        slab = slabs[k]
        slab.shift, slab.stop = body[SLAB + k], scenes.slab_stop[level, k]
        speed = body[SLAB + scenes.slab_stop.shape[1] + k]
        ended = slab.shift <= slab.stop if speed < 0.0 else slab.shift >= 0.0
        slab.speed = 0.0 if ended else speed


@inlined
def time_to_stop(slabs: Records) -> float:
    """Return when the first slab is at an end of its way; ``inf`` if none moves."""
    time = math.inf
    for k in range(len(slabs)):
        slab = slabs[k]
        if slab.speed != 0.0:
            end = slab.stop if slab.speed < 0.0 else 0.0
            until = (end - slab.shift) / slab.speed
            if until > 1e-12:
                time = min(time, until)
    return time


@inlined
def move_slabs(slabs: Records, time: float) -> None:
    """Let the slabs move for ``time``; those at an end of their way stop there."""
    for k in range(len(slabs)):
        slab = slabs[k]
        slab.shift += time * slab.speed
        if slab.speed < 0.0 and slab.shift <= slab.stop + 1e-12:
            slab.shift, slab.speed = slab.stop, 0.0
        elif slab.speed > 0.0 and slab.shift >= -1e-12:
            slab.shift, slab.speed = 0.0, 0.0
