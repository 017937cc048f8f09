"""Vectors for compiled code: tuples of three numbers, which live in registers."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from roller_env.compiled import compiled_with_package as entry
from roller_env.compiled import inlined
from roller_env.compiled import part as kernel

__all__ = ["entry", "inlined", "kernel"]

Vector = tuple[float, float, float]

Record = Any
"""One record of a structured array; compiled code sees a pointer."""

Records = npt.NDArray[np.void]
"""A structured array. Its fields are attributes, also in plain Python if it is a `np.recarray`."""


class Twist(NamedTuple):
    """How a rigid body moves, or how that changes: velocities, or accelerations. World frame."""

    linear: Vector  # of the centre
    angular: Vector


class Ball(NamedTuple):
    """A ball as kernels carry it along, but for its orientation. SI units, world frame."""

    position: Vector
    velocity: Vector
    spin: Vector  # angular velocity


@kernel
def none_of(count: int) -> int:
    """Return 0. What is called with the literal and then with numbers Numba compiles twice."""
    return count - count


@kernel
def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@kernel
def norm(a: Vector) -> float:
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@kernel
def add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel
def sub(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def alike(a: Vector, b: Vector) -> bool:
    return a[0] == b[0] and a[1] == b[1] and a[2] == b[2]


@kernel
def scaled(factor: float, a: Vector) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]


@kernel
def plus(a: Vector, factor: float, b: Vector) -> Vector:
    """Return ``a + factor b``."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@kernel
def tangential(a: Vector, normal: Vector) -> Vector:
    """Return the part of ``a`` at right angles to the unit vector ``normal``."""
    return plus(a, -dot(a, normal), normal)


@kernel
def position_at(start: Vector, velocity: Vector, acceleration: Vector, time: float) -> Vector:
    """Return where a parabola is at ``time``."""
    return plus(plus(start, time, velocity), 0.5 * time * time, acceleration)


@kernel
def vector(field: Any) -> Vector:
    """Return an array of three numbers."""
    return field[0], field[1], field[2]


@kernel
def store(field: Any, a: Vector) -> None:
    """Write a vector into an array of three numbers."""
    field[0] = a[0]
    field[1] = a[1]
    field[2] = a[2]


@kernel
def row(array: Any, index: int) -> Vector:
    """Return the first three numbers of a row of a matrix."""
    return array[index, 0], array[index, 1], array[index, 2]


@kernel
def put(array: Any, index: int, a: Vector) -> None:
    """Write a vector into the first three places of a row of a matrix."""
    array[index, 0] = a[0]
    array[index, 1] = a[1]
    array[index, 2] = a[2]


@kernel
def first_root(c: float, b: float, a: float) -> float:
    """Return the smallest s >= 0 at which ``c + b s + a s^2`` falls to 0; ``inf`` if it never does.

    ``c`` below 0 counts as 0: what is there already leaves at once unless it rises.
    """
    if c <= 0.0:
        if b < 0.0 or (b == 0.0 and a < 0.0):
            return 0.0
        return -b / a if a < 0.0 else math.inf
    if a == 0.0:
        return -c / b if b < 0.0 else math.inf
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return math.inf
    root = math.sqrt(discriminant)
    # Neither form subtracts numbers that are nearly equal.
    if b < 0.0:
        return 2.0 * c / (root - b)
    return (b + root) / (-2.0 * a) if a < 0.0 else math.inf
