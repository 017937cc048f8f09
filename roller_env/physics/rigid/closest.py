"""The nearest feature of a convex solid, and for how long it stays the nearest.

A box's Voronoi regions are told by its own coordinates: beyond how many of its three pairs of faces
a point lies is the kind of the feature (a face, an edge, a corner). A hull's are bounded by planes
(`roller_env.physics.rigid.hull`); a box is the fast case of one.
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
    plus,
    row,
    scaled,
    sub,
    vector,
)
from roller_env.physics.rigid.scene import Solids

FACE: Final = 1
EDGE: Final = 2
CORNER: Final = 3

_ROUNDING: Final = 1e-14

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
    """Return a point relative to the centre of a solid that has moved by ``shift``."""
    relative = sub(point, vector(solid.centre))
    if shift == 0.0:
        return relative
    return plus(relative, -shift, vector(solid.along))


@kernel
def is_hull(solid: Record) -> bool:
    """Say whether a solid is a hull, not a box."""
    hull: bool = solid.end > 0
    return hull


@kernel
def closest(solids: Solids, solid: Record, from_centre: Vector) -> tuple[float, Vector, int, int]:
    """Return how far a point is from a solid, and along what.

    Args:
        solids: all.
        solid: one of them.
        from_centre: the point relative to its centre, world axes.

    Returns:
        distance: to the surface, metres; negative inside.
        normal: unit vector from the nearest feature to the point, world axes.
        kind: `FACE`, `EDGE` or `CORNER`.
        axis: of a box, of a face its normal's axis, of an edge its own, of a corner -1; of a hull
            the number of the feature.
    """
    if is_hull(solid):
        return _closest_of_hull(solids, solid, from_centre)
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
def _closest_of_hull(solids: Solids, solid: Record, at: Vector) -> tuple[float, Vector, int, int]:
    """Return what `closest` does of a hull: the face over which a point is, or the nearest edge."""
    most, outermost = -math.inf, solid.faces
    for number in range(solid.faces, solid.edges):
        face = solids.feature[number]
        normal = vector(face.direction)
        height = dot(normal, at) - face.offset
        if height > 0.0 and _room(solids, number, at) >= 0.0:
            return height, normal, FACE, number
        if height > most:
            most, outermost = height, number
    if most <= 0.0:
        return most, vector(solids.feature[outermost].direction), FACE, outermost
    nearest, kind, feature, out = math.inf, EDGE, solid.edges, at
    for number in range(solid.edges, solid.corners):
        edge = solids.feature[number]
        from_end = sub(at, vector(edge.point))
        along = dot(vector(edge.direction), from_end)
        way = min(max(along, 0.0), edge.length)
        away = plus(from_end, -way, vector(edge.direction))
        square, within = dot(away, away), along == way
        # Just beyond a corner rounding makes edge and corner as near: there it is the edge.
        same = abs(square - nearest) <= _ROUNDING * square
        if (square < nearest and not same) or (same and within and kind == CORNER):
            nearest, out = square, away
            kind, feature = EDGE, number
            if not within:
                kind, feature = CORNER, edge.ends[0] if along < 0.0 else edge.ends[1]
    distance = math.sqrt(nearest)
    return distance, scaled(1.0 / distance, out), kind, feature


@kernel
def _room(solids: Solids, number: int, at: Vector) -> float:
    """Return how far inside a hull's feature's region a point lies, negative outside, metres."""
    room = math.inf
    feature = solids.feature[number]
    for k in range(feature.bounds, feature.end):
        room = min(room, solids.bound[k, 3] - dot(row(solids.bound, k), at))
    return room


@kernel
def edge_direction(solids: Solids, solid: Record, axis: int) -> Vector:
    """Return along what an edge goes, of which `closest` returned ``axis``: a unit vector."""
    if is_hull(solid):
        return vector(solids.feature[axis].direction)
    return row(solid.axes, axis)


@kernel
def is_beyond(kind: int, axis: int, k: int) -> bool:
    """Say whether a feature lies beyond the box's faces of axis ``k``."""
    return kind == CORNER or (kind == FACE) == (k == axis)


@kernel
def time_on_feature(
    solids: Solids,
    solid: Record,
    kind: int,
    axis: int,
    from_centre: Vector,
    velocity: Vector,
    acceleration: Vector,
) -> float:
    """Return for how long a point on a parabola has the same nearest feature, seconds or ``inf``.

    Args:
        solids: all.
        solid: one of them.
        kind: of the feature, as `closest` returns it.
        axis: likewise.
        from_centre: the point relative to the solid's centre, world axes, metres.
        velocity: relative to the solid, m/s.
        acceleration: likewise, m/s^2.
    """
    if is_hull(solid):
        return _time_in_region(solids, axis, from_centre, velocity, acceleration)
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
def _time_in_region(
    solids: Solids, number: int, at: Vector, velocity: Vector, acceleration: Vector
) -> float:
    """Return what `time_on_feature` does, of a hull."""
    time = math.inf
    feature = solids.feature[number]
    for k in range(feature.bounds, feature.end):
        out = row(solids.bound, k)
        room = solids.bound[k, 3] - dot(out, at) + SLACK_M
        time = min(time, first_root(room, -dot(out, velocity), -0.5 * dot(out, acceleration)))
    return time


@kernel
def feature_margin(
    solids: Solids, solid: Record, kind: int, axis: int, from_centre: Vector
) -> float:
    """Return how far inside a feature's Voronoi region a point lies, negative outside, metres."""
    if is_hull(solid):
        return _room(solids, axis, from_centre) + SLACK_M
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
def extent(solids: Solids, solid: Record, direction: Vector) -> float:
    """Return how far a solid reaches from its centre along a unit vector, metres."""
    if is_hull(solid):
        most = -math.inf
        for number in range(solid.corners, solid.end):
            most = max(most, dot(vector(solids.feature[number].point), direction))
        return most
    along = local(solid, direction)
    half = vector(solid.half)
    return abs(along[0]) * half[0] + abs(along[1]) * half[1] + abs(along[2]) * half[2]
