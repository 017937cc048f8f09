"""How slabs go down: at their speed, and never into the ball.

The original moves them through whatever is there. Here a slab that comes down on the ball stops on
it, without pressing, and goes on when the ball is gone. That is decided from where both are when a
control step begins, so that it does not depend on how an engine's contacts yield.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.compiled import device_function
from roller_env.game.tables import Movers
from roller_env.physics.protocol import Columns

BRAKING_M_S2: Final = 5.0
"""How hard a slab brakes for a ball under it: a twentieth of what its servo can do, so that it
stops where it should. The original's, at 0.8 m/s, brake on the last 7 cm."""


GAP_M: Final = 0.001
"""Where a slab stops over the ball: it counts as touching, and does not brake a ball that rolls."""


@device_function
def lowering(
    duration_s: float,
    level: int,
    mover: int,
    movers: Movers,
    body: Float64,
    at: Columns,
    speed: float,
) -> float:
    """Return the velocity at which a slab that goes down is pulled in the next step, m/s.

    Below zero is down. Above zero an aim is taken back that lies within the ball, which is then
    touched and not pressed.
    """
    half, centre = movers.half[level, mover], movers.centre[level, mover]
    slab = body[at.displacement + mover]
    down = speed
    now, soon = _room_under(
        duration_s,
        centre,
        half,
        movers.heading[level, mover],
        centre[2] + slab - half[2],
        body[at.position : at.position + 3],
        body[at.velocity : at.velocity + 3],
        movers.ball_radius[level],
    )
    if soon < np.inf:
        room = now if now < 0.0 else max(soon - GAP_M, 0.0)
        down = min(down, math.sqrt(2.0 * BRAKING_M_S2 * max(room, 0.0)))
        left = room - (slab - body[at.aim + mover])
        # Half of what is left in a step, so that the last ones are slow; an aim within the ball is
        # taken back at once.
        down = min(down, left / (2.0 * duration_s) if left > 0.0 else left / duration_s)
    velocity: float = -down
    return velocity


@device_function
def _room_under(
    duration_s: float,
    centre: Float64,
    half: Float64,
    heading: Float64,
    bottom: float,
    ball: Float64,
    velocity: Float64,
    radius: float,
) -> tuple[float, float]:
    """Return how far a slab can go down until it meets the ball, ``inf`` where it does not.

    Now, and with the ball anywhere between where it is and where its velocity takes it within the
    step; below zero they overlap.
    """
    if bottom < ball[2]:  # beside the slab, or on it
        return np.inf, np.inf
    x, y = ball[0] - centre[0], ball[1] - centre[1]
    way_x, way_y = velocity[0] * duration_s, velocity[1] * duration_s
    cos, sin = heading[0], heading[1]
    x, y = cos * x + sin * y, cos * y - sin * x
    way_x, way_y = cos * way_x + sin * way_y, cos * way_y - sin * way_x
    over = bottom - ball[2]
    now = over - _height(_beyond(x, 0.0, half[0]), _beyond(y, 0.0, half[1]), radius)
    soon = over - _height(_beyond(x, way_x, half[0]), _beyond(y, way_y, half[1]), radius)
    return now, soon


@device_function
def _beyond(start: float, way: float, half: float) -> float:
    """Return how far beyond +- ``half`` all of an interval of ``way`` from ``start`` lies."""
    low, high = min(start, start + way), max(start, start + way)
    return max(low - half, -half - high, 0.0)


@device_function
def _height(across_x: float, across_y: float, radius: float) -> float:
    """Return a ball's height over its centre at a distance from it, ``-inf`` beyond the radius."""
    left2 = radius * radius - across_x * across_x - across_y * across_y
    return math.sqrt(left2) if left2 > 0.0 else -np.inf
