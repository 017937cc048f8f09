"""The nearest feature of a convex solid, and for how long it stays the nearest.

A box's Voronoi regions are told by its own coordinates: beyond how many of its three pairs of faces
a point lies is the kind of the feature (a face, an edge, a corner).
"""

from __future__ import annotations

import math
from typing import Final

from roller_env.physics.rigid.kernels import (
    Record,
    Vector,
    dot,
    first_root,
    kernel,
    norm,
    row,
    sub,
    vector,
)

FACE: Final = 1
EDGE: Final = 2
CORNER: Final = 3

SLACK_M: Final = 2e-9
"""How far beyond its end a feature is followed, so that it is left for good."""


@kernel
def local(solid: Record, point: Vector) -> Vector:
    """Return a vector of the world in the box's own axes."""
    if solid.aligned:
        return point
    axes = solid.axes
    return dot(row(axes, 0), point), dot(row(axes, 1), point), dot(row(axes, 2), point)


@kernel
def world(solid: Record, point: Vector) -> Vector:
    """Return a vector of the box's own axes in the world's."""
    if solid.aligned:
        return point
    axes = solid.axes
    return (
        axes[0, 0] * point[0] + axes[1, 0] * point[1] + axes[2, 0] * point[2],
        axes[0, 1] * point[0] + axes[1, 1] * point[1] + axes[2, 1] * point[2],
        axes[0, 2] * point[0] + axes[1, 2] * point[1] + axes[2, 2] * point[2],
    )


@kernel
def from_centre(solid: Record, shift: float, point: Vector) -> Vector:
    """Return a point relative to the centre of a box that has moved by ``shift`` along z."""
    relative = sub(point, vector(solid.centre))
    return relative[0], relative[1], relative[2] - shift


@kernel
def closest(solid: Record, from_centre: Vector) -> tuple[float, Vector, int, int]:
    """Return how far a point is from a box, and along what.

    Args:
        solid: the box.
        from_centre: the point relative to the box's centre, world axes.

    Returns:
        distance: to the surface, metres; negative inside.
        normal: unit vector from the nearest feature to the point, world axes.
        kind: `FACE`, `EDGE` or `CORNER`.
        axis: of a face its normal's axis of the box, of an edge its own, of a corner -1.
    """
    at = local(solid, from_centre)
    half = vector(solid.half)
    out = (
        at[0] - min(max(at[0], -half[0]), half[0]),
        at[1] - min(max(at[1], -half[1]), half[1]),
        at[2] - min(max(at[2], -half[2]), half[2]),
    )
    beyond = int(out[0] != 0.0) + int(out[1] != 0.0) + int(out[2] != 0.0)
    if beyond == 0:
        return _inside(solid, at, half)
    distance = norm(out)
    normal = world(solid, (out[0] / distance, out[1] / distance, out[2] / distance))
    axis = -1
    for k in range(3):
        # The one axis beyond which it lies (face), or does not (edge).
        if (beyond == 1 and out[k] != 0.0) or (beyond == 2 and out[k] == 0.0):
            axis = k
    return distance, normal, beyond, axis


@kernel
def _inside(solid: Record, at: Vector, half: Vector) -> tuple[float, Vector, int, int]:
    """Return the way out of a box, by the nearest face."""
    axis, depth = 0, half[0] - abs(at[0])
    for k in range(1, 3):
        if half[k] - abs(at[k]) < depth:
            axis, depth = k, half[k] - abs(at[k])
    sign = 1.0 if at[axis] > 0.0 else -1.0
    out = (
        sign if axis == 0 else 0.0,
        sign if axis == 1 else 0.0,
        sign if axis == 2 else 0.0,
    )
    return -depth, world(solid, out), FACE, axis


@kernel
def is_beyond(kind: int, axis: int, k: int) -> bool:
    """Say whether a feature lies beyond the box's faces of axis ``k``."""
    return kind == CORNER or (kind == FACE) == (k == axis)


@kernel
def time_on_feature(
    solid: Record,
    kind: int,
    axis: int,
    from_centre: Vector,
    velocity: Vector,
    acceleration: Vector,
) -> float:
    """Return for how long a point on a parabola has the same nearest feature, seconds or ``inf``.

    Args:
        solid: the box.
        kind: of the feature, as `closest` returns it.
        axis: likewise.
        from_centre: the point relative to the box's centre, world axes, metres.
        velocity: relative to the box, m/s.
        acceleration: likewise, m/s^2.
    """
    at = local(solid, from_centre)
    v = local(solid, velocity)
    a = local(solid, acceleration)
    time = math.inf
    for k in range(3):
        half = solid.half[k]
        if is_beyond(kind, axis, k):
            if kind != FACE:
                sign = 1.0 if at[k] > 0.0 else -1.0
                out = sign * at[k] - half + SLACK_M
                time = min(time, first_root(out, sign * v[k], 0.5 * sign * a[k]))
        else:
            time = min(time, first_root(half - at[k] + SLACK_M, -v[k], -0.5 * a[k]))
            time = min(time, first_root(half + at[k] + SLACK_M, v[k], 0.5 * a[k]))
    return time


@kernel
def feature_margin(solid: Record, kind: int, axis: int, from_centre: Vector) -> float:
    """Return how far inside a feature's Voronoi region a point lies, negative outside, metres."""
    at = local(solid, from_centre)
    margin = math.inf
    for k in range(3):
        half = solid.half[k]
        if not is_beyond(kind, axis, k):
            margin = min(margin, half - abs(at[k]))
        elif kind != FACE:
            margin = min(margin, abs(at[k]) - half)
    return margin + SLACK_M


@kernel
def extent(solid: Record, direction: Vector) -> float:
    """Return how far a box reaches from its centre along a unit vector, metres."""
    along = local(solid, direction)
    half = vector(solid.half)
    return abs(along[0]) * half[0] + abs(along[1]) * half[1] + abs(along[2]) * half[2]
