"""What does a moving ball meet, and when? Decided on the whole path, so nothing is jumped over.

A path is S + 1 knots, and between each two a piece that is run through evenly in time. Its rows
hold 3 numbers, the knot, where pieces are straight. They hold 6 where pieces are parabolas: a piece
from p to q has the bend b, the next three numbers in the row of p, and goes through
``p + s (q - p - b) + s^2 b`` for s from 0 to 1. Times count pieces: 2.5 is half-way through the
third.

A region is a rounded box: all points within a radius of a box, and higher than a floor. Along a
straight piece of path the squared distance to the box is a convex and piecewise quadratic function
of time, whose pieces meet where the path crosses the planes of the box's faces. So the time of
entry is the root of one quadratic, and nothing has to be searched for. On a parabola it is searched
for by conservative advancement (B. Mirtich, *Impulse-based dynamic simulation of rigid body
systems*, 1996): the plane through the nearest point of a convex region has all of the region behind
it, so the time at which the parabola meets the plane is not after that of entry, and such times
grow towards it.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.compiled import device_function

Vector = tuple[float, float, float]
POINT: Final[Vector] = (0.0, 0.0, 0.0)

ANYWHERE: Final = -math.inf
"""The floor of a region without one."""

WITHIN_M: Final = 1e-12
"""On a parabola, what is this near to a region is in it."""

_MOST_PLANES: Final = 64


@device_function
def time_of_fall(path: Float64, kill_height: float) -> float:
    """Return the time at which the ball first is at or below the kill height, or ``inf``."""
    if path[0, 2] <= kill_height:
        return 0.0
    for piece in range(len(path) - 1):
        before, after = path[piece, 2], path[piece + 1, 2]
        if path.shape[1] > 3:
            bend = path[piece, 5]
            share = _first_root(before - kill_height, after - before - bend, bend)
            # A piece that ends there by less than rounding falls at its end.
            if share <= 1.0 or after <= kill_height:
                return piece + min(share, 1.0)
        elif after <= kill_height:
            time: float = piece + (before - kill_height) / (before - after)
            return time
    return np.inf


@device_function
def _first_root(c: float, b: float, a: float) -> float:
    """Return the first s >= 0 at which ``c + b s + a s^2``, at first above 0, is 0, or ``inf``."""
    if a == 0.0:
        share: float = -c / b if b < 0.0 else np.inf
        return share
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return np.inf
    root = math.sqrt(discriminant)
    # Neither form subtracts numbers that are nearly equal.
    if b < 0.0:
        return 2.0 * c / (root - b)
    return (b + root) / (-2.0 * a) if a < 0.0 else np.inf


@device_function
def vector(array: Float64) -> Vector:
    """Return three numbers as what the functions here take."""
    return array[0], array[1], array[2]


@device_function
def bounds(path: Float64) -> tuple[Vector, Vector]:
    """Return the lowest and the highest corner of a box around a path.

    A parabola lies within its ends and its control point as a quadratic Bezier curve.
    """
    x0 = x1 = path[0, 0]
    y0 = y1 = path[0, 1]
    z0 = z1 = path[0, 2]
    for step in range(1, len(path)):
        x, y, z = path[step, 0], path[step, 1], path[step, 2]
        x0, x1 = min(x0, x), max(x1, x)
        y0, y1 = min(y0, y), max(y1, y)
        z0, z1 = min(z0, z), max(z1, z)
    if path.shape[1] > 3:
        for piece in range(len(path) - 1):
            x = 0.5 * (path[piece, 0] + path[piece + 1, 0] - path[piece, 3])
            y = 0.5 * (path[piece, 1] + path[piece + 1, 1] - path[piece, 4])
            z = 0.5 * (path[piece, 2] + path[piece + 1, 2] - path[piece, 5])
            x0, x1 = min(x0, x), max(x1, x)
            y0, y1 = min(y0, y), max(y1, y)
            z0, z1 = min(z0, z), max(z1, z)
    return (x0, y0, z0), (x1, y1, z1)


@device_function
def meets(low: Vector, high: Vector, at: Vector, half: Vector, reach: float) -> bool:
    """Say whether a region's bounding box meets a path's."""
    for axis in range(3):
        if at[axis] - half[axis] - reach > high[axis] or at[axis] + half[axis] + reach < low[axis]:
            return False
    return True


@device_function
def visit(
    path: Float64, centre: Vector, half: Vector, radius: float, floor: float, touching: bool
) -> tuple[float, bool]:
    """Return the time of the first entry, and whether the path ends inside."""
    time = np.inf
    start = _relative(path[0], centre)
    before = _depth(start, half, radius, floor)
    if before <= 0.0 and not touching:
        time = 0.0
    for piece in range(len(path) - 1):
        stop = _relative(path[piece + 1], centre)
        after = _depth(stop, half, radius, floor)
        if before > 0.0 and time == np.inf:
            way = (stop[0] - start[0], stop[1] - start[1], stop[2] - start[2])
            length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
            bend = POINT
            if path.shape[1] > 3:
                bend = (path[piece, 3], path[piece, 4], path[piece, 5])
                # The control points' way is the longer one.
                length += math.sqrt(bend[0] * bend[0] + bend[1] * bend[1] + bend[2] * bend[2])
            # The depth changes by at most a metre for each metre of way.
            if after <= 0.0 or before + after <= length:
                if path.shape[1] > 3:
                    share = _advanced(start, way, bend, half, radius, floor)
                else:
                    share = _crossing(start, way, half, radius, floor)
                # A piece that ends inside by less than rounding enters at its end.
                time = piece + (min(share, 1.0) if after <= 0.0 else share)
        start, before = stop, after
    return time, before <= 0.0


@device_function
def _relative(point: Float64, centre: Vector) -> Vector:
    return point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]


@device_function
def _depth(at: Vector, half: Vector, radius: float, floor: float) -> float:
    """Return how far outside its region a point lies, negative or zero inside.

    Args:
        at: relative to the region's centre, metres.
        half: half edges of the box, metres.
        radius: of the rounding, metres.
        floor: lowest height over the centre, metres.

    Returns:
        The distance to the rounded box, or to the floor if that is more.
    """
    return max(math.sqrt(_squared(at, POINT, half, 0.0)) - radius, floor - at[2])


@device_function
def _crossing(start: Vector, way: Vector, half: Vector, radius: float, floor: float) -> float:
    """Return the share, 0 to 1, of a straight piece at which it enters; ``inf`` for a miss.

    Args:
        start: outside the region, relative to its centre.
        way: from there to the end of the piece.
        half: half edges of the box.
        radius: of the rounding.
        floor: lowest height over the centre.
    """
    reach2 = radius * radius
    near = _first_within(start, way, half, reach2)
    height = start[2] - floor
    over_floor = 0.0
    if height < 0.0:
        over_floor = -height / way[2] if way[2] > 0.0 else np.inf
    share = max(near, over_floor)
    # Both sets are convex, so the later of the two entries is in both, or nothing is.
    if share > 1.0:
        return np.inf
    if near < over_floor and _squared(start, way, half, share) > reach2:
        return np.inf
    if over_floor < near and height + share * way[2] < 0.0:
        return np.inf
    return share


@device_function
def _advanced(
    start: Vector, way: Vector, bend: Vector, half: Vector, radius: float, floor: float
) -> float:
    """Return the share, 0 to 1, of a bent piece at which it enters; ``inf`` for a miss.

    Args:
        start: outside the region, relative to its centre.
        way: from there to the end of the piece.
        bend: of the piece.
        half: half edges of the box.
        radius: of the rounding.
        floor: lowest height over the centre.
    """
    share = 0.0
    for _ in range(_MOST_PLANES):
        x = start[0] + share * (way[0] - bend[0] + share * bend[0])
        y = start[1] + share * (way[1] - bend[1] + share * bend[1])
        z = start[2] + share * (way[2] - bend[2] + share * bend[2])
        velocity = (
            way[0] + (2.0 * share - 1.0) * bend[0],
            way[1] + (2.0 * share - 1.0) * bend[1],
            way[2] + (2.0 * share - 1.0) * bend[2],
        )
        out = (
            x - min(max(x, -half[0]), half[0]),
            y - min(max(y, -half[1]), half[1]),
            z - min(max(z, -half[2]), half[2]),
        )
        distance = math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
        beyond, under = distance - radius, floor - z
        if max(beyond, under) <= WITHIN_M:
            break
        if beyond >= under:
            approach = out[0] * velocity[0] + out[1] * velocity[1] + out[2] * velocity[2]
            curve = out[0] * bend[0] + out[1] * bend[1] + out[2] * bend[2]
            share += _first_root(beyond, approach / distance, curve / distance)
        else:
            share += _first_root(under, -velocity[2], -bend[2])
        if share > 1.0:
            return np.inf
    return share


@device_function
def _first_within(start: Vector, way: Vector, half: Vector, reach2: float) -> float:
    """Return the share at which the squared distance to the box falls to ``reach2``, or ``inf``."""
    if _squared(start, way, half, 0.0) <= reach2:
        return 0.0
    left, right = 0.0, 0.0
    while right < 1.0:
        left, right = right, _next_node(start, way, half, right)
        fall, rise = -_half_slope(start, way, half, left), _half_slope(start, way, half, right)
        if fall <= 0.0:
            break  # Convex: from here on it only grows.
        nearest = left + (right - left) * (fall / (fall + rise)) if rise > 0.0 else right
        if _squared(start, way, half, nearest) <= reach2:
            # excess - 2 fall s + curvature s^2 = 0, the smaller root, without cancellation.
            excess = _squared(start, way, half, left) - reach2
            curvature = (rise + fall) / (right - left)
            root = math.sqrt(max(fall * fall - curvature * excess, 0.0))
            share: float = min(left + excess / (fall + root), nearest)
            return share
    return np.inf


@device_function
def _next_node(start: Vector, way: Vector, half: Vector, after: float) -> float:
    """Return the next share, at most 1, up to which the squared distance is one quadratic."""
    node = 1.0
    for axis in range(3):
        # Along an axis on which nothing moves no plane is crossed.
        if way[axis] != 0.0:
            for side in (-half[axis], half[axis]):
                share = (side - start[axis]) / way[axis]
                if after < share < node:
                    node = share
    return node


@device_function
def _squared(start: Vector, way: Vector, half: Vector, share: float) -> float:
    """Return the squared distance to the box at a share of the piece."""
    total = 0.0
    for axis in range(3):
        beyond = max(abs(start[axis] + way[axis] * share) - half[axis], 0.0)
        total += beyond * beyond
    return total


@device_function
def _half_slope(start: Vector, way: Vector, half: Vector, share: float) -> float:
    """Return half the squared distance's derivative: never falling, linear between nodes."""
    total = 0.0
    for axis in range(3):
        at = start[axis] + way[axis] * share
        total += (at - min(max(at, -half[axis]), half[axis])) * way[axis]
    return total
