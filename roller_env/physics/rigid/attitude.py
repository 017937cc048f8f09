"""The attitude of a ball whose angular velocity changes linearly in time.

The quaternion's equation ``dq/dt = 1/2 (0, w) q`` with ``w = w0 + t alpha`` is turned by one
rotation vector over a step, of which Magnus's series gives the first terms (W. Magnus, 1954; S.
Blanes et al., *The Magnus expansion and some of its applications*, 2009). They are exact where the
axis stands.
"""

from __future__ import annotations

import math
from typing import Any, Final

from roller_env.physics.rigid.kernels import (
    Vector,
    add,
    cross,
    dot,
    kernel,
    norm,
    plus,
    scaled,
    sub,
)

LARGEST_TURN: Final = 0.1
"""Radians by which the angular velocity may swing its axis in one step of the series."""


MOST_TURNS: Final = 1000.0
"""Steps of the series at most; what turns faster has no attitude to speak of."""

_SERIES: Final = 0.25
"""Square of half an angle of rotation, rad^2, up to which series are cheaper than functions."""

_COSINE: Final = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(8))
_SINE: Final = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(8))
"""Taylor's series of cos(x) and sin(x)/x in the square of x, to rounding up to `_SERIES`."""


@kernel
def _polynomial(c: tuple[float, ...], x: float) -> float:
    low = (c[0] + x * c[1]) + x * x * (c[2] + x * c[3])
    return low + (x * x) * (x * x) * ((c[4] + x * c[5]) + x * x * (c[6] + x * c[7]))


@kernel
def turn(quaternion: Any, start: Vector, stop: Vector, time: float) -> None:
    """Turn a unit quaternion (w, x, y, z), in place, over ``time`` seconds.

    Args:
        quaternion: (4,) ball frame to world frame.
        start: angular velocity at the start, rad/s, world frame.
        stop: at the end; linear between.
        time: seconds.
    """
    change = sub(stop, start)
    swing = norm(cross(start, stop)) * time * time
    if swing <= LARGEST_TURN * LARGEST_TURN:
        _rotate(quaternion, _rotation_vector(start, stop, time))
        return
    steps = 1 + int(min(math.sqrt(swing) / LARGEST_TURN, MOST_TURNS))
    step = time / steps
    for index in range(steps):
        before = plus(start, index / steps, change)
        after = plus(start, (index + 1) / steps, change)
        _rotate(quaternion, _rotation_vector(before, after, step))


@kernel
def turned(quaternion: Any, v: Vector) -> Vector:
    """Return a vector of the ball's frame in the world's."""
    axis = (quaternion[1], quaternion[2], quaternion[3])
    twice = scaled(2.0, cross(axis, v))
    return add(plus(v, quaternion[0], twice), cross(axis, twice))


@kernel
def turned_back(quaternion: Any, v: Vector) -> Vector:
    """Return a vector of the world's frame in the ball's."""
    axis = (-quaternion[1], -quaternion[2], -quaternion[3])
    twice = scaled(2.0, cross(axis, v))
    return add(plus(v, quaternion[0], twice), cross(axis, twice))


@kernel
def _rotation_vector(start: Vector, stop: Vector, time: float) -> Vector:
    """Return the rotation vector of a step, to the sixth power of its length.

    Blanes et al.'s method of sixth order for a linear coefficient. The commutator of the matrices
    of two vectors is the matrix of their cross product.
    """
    mean = scaled(0.5 * time, add(start, stop))
    change = scaled(time, sub(stop, start))
    first = cross(mean, change)
    left = plus(first, -20.0, mean)
    right = plus(change, -1.0 / 60.0, cross(mean, first))
    return plus(mean, 1.0 / 240.0, cross(left, right))


@kernel
def _rotate(quaternion: Any, rotation: Vector) -> None:
    """Multiply a quaternion from the left by that of a rotation vector, in place."""
    square = 0.25 * dot(rotation, rotation)
    if square < _SERIES:
        sine, c = 0.5 * _polynomial(_SINE, square), _polynomial(_COSINE, square)
    else:
        half = math.sqrt(square)
        sine, c = 0.5 * math.sin(half) / half, math.cos(half)
    x, y, z = sine * rotation[0], sine * rotation[1], sine * rotation[2]
    q0, q1, q2, q3 = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    w = c * q0 - x * q1 - y * q2 - z * q3
    i = c * q1 + x * q0 + y * q3 - z * q2
    j = c * q2 + y * q0 + z * q1 - x * q3
    k = c * q3 + z * q0 + x * q2 - y * q1
    # One step of Newton's iteration for 1 / |q|, which is 1 but for rounding.
    unit = 1.5 - 0.5 * (w * w + i * i + j * j + k * k)
    quaternion[0], quaternion[1] = unit * w, unit * i
    quaternion[2], quaternion[3] = unit * j, unit * k
