"""When does a ball on a parabola first meet a solid?

Conservative advancement (B. Mirtich, *Impulse-based dynamic simulation of rigid body systems*,
1996) as Newton's iteration on supporting planes: the plane through the nearest point of a convex
solid has all of the solid behind it, so the ball cannot meet the solid before that plane, and the
time at which a parabola meets a plane is the root of a quadratic. Each iterate is a lower bound of
the time of impact; they grow towards it, and nothing is jumped over at any speed.
"""

from __future__ import annotations

import math
from typing import Final

from roller_env.physics.rigid.closest import FACE, closest
from roller_env.physics.rigid.kernels import (
    Record,
    Vector,
    dot,
    first_root,
    kernel,
    position_at,
)
from roller_env.physics.rigid.scene import Solids

CONTACT_GAP_M: Final = 1e-9
"""A ball this near to a solid touches it. Held balls are kept at half of it."""

_MOST_PLANES: Final = 64
_MOST_HALVINGS: Final = 48


@kernel
def impact_time(
    solids: Solids,
    solid: Record,
    radius: float,
    from_centre: Vector,
    velocity: Vector,
    acceleration: Vector,
    gap: float,
    normal: Vector,
    kind: int,
    before: float,
) -> float:
    """Return the first time in [0, ``before``) at which the ball touches a solid, or ``inf``.

    Args:
        solids: all.
        solid: one of them.
        radius: of the ball, metres.
        from_centre: the ball's centre relative to the solid's, world axes, metres.
        velocity: relative to the solid, m/s.
        acceleration: likewise, m/s^2.
        gap: between ball and solid at the start, metres. A ball that touches counts as just free.
        normal: from the nearest feature to the ball, at the start.
        kind: of that feature.
        before: how far to look, seconds.
    """
    time = 0.0
    gap = max(gap, 0.5 * CONTACT_GAP_M)
    if gap <= CONTACT_GAP_M and kind != FACE:
        # A round feature's plane is met again at once by a ball that rolls off it, the feature
        # itself is not: begin where the ball is seen to be free.
        time = _time_when_free(solids, solid, radius, from_centre, velocity, acceleration, before)
        if time >= before:
            return math.inf
        there = position_at(from_centre, velocity, acceleration, time)
        distance, normal, _, _ = closest(solids, solid, there)
        gap = max(distance - radius, 0.5 * CONTACT_GAP_M)
    for _ in range(_MOST_PLANES):
        approach = dot(normal, velocity) + time * dot(normal, acceleration)
        curve = 0.5 * dot(normal, acceleration)
        time += first_root(gap - 0.25 * CONTACT_GAP_M, approach, curve)
        if time >= before:
            return math.inf
        there = position_at(from_centre, velocity, acceleration, time)
        distance, normal, _, _ = closest(solids, solid, there)
        gap = distance - radius
        if gap <= 0.5 * CONTACT_GAP_M:
            return time
    return time


@kernel
def _time_when_free(
    solids: Solids,
    solid: Record,
    radius: float,
    from_centre: Vector,
    velocity: Vector,
    acceleration: Vector,
    before: float,
) -> float:
    """Return a time, at most ``before``, at which a ball that leaves a solid is free of it."""
    time = before
    for _ in range(_MOST_HALVINGS):
        there = position_at(from_centre, velocity, acceleration, time)
        distance, _, _, _ = closest(solids, solid, there)
        if distance - radius >= 0.0:
            break
        time *= 0.5
    return time
