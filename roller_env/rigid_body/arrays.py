"""Small array helpers of the rigid body: shapes made right or refused, products of 3-vectors.

Every public entry of the package sends what a caller wrote through here, so that wrong input is
one `ValueError` that names the quantity, and never a NaN found a thousand steps later.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]


def numbers(name: str, value: npt.ArrayLike) -> Float64:
    """Return ``value`` as a new float64 array.

    Raises:
        ValueError: when it is no array of numbers, or any of them is NaN or infinite.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers, got {value!r}: {error}") from error
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        at = f" at index {list(where)}" if where else ""
        raise ValueError(f"{name} must be finite, got {array[where]}{at}")
    return array


def rows(name: str, value: npt.ArrayLike, count: int, width: int) -> Float64:
    """Return ``value`` as a new (count, width) array; one row stands for all bodies.

    Raises:
        ValueError: on a shape other than (width,), (1, width) or (count, width), or NaN.
    """
    array = fitting_rows(name, numbers(name, value), count, width)
    return np.array(np.broadcast_to(array, (count, width)))


def fitting_rows(name: str, array: Float64, count: int, width: int) -> Float64:
    """Return ``array`` itself when it broadcasts to (count, width): the check of the inner loop.

    Raises:
        ValueError: on a shape other than (width,), (1, width) or (count, width).
    """
    if array.shape not in {(count, width), (width,), (1, width)}:
        raise ValueError(
            f"{name} must have shape ({width},) or ({count}, {width}) for {count} "
            f"{'body' if count == 1 else 'bodies'}, got {array.shape}"
        )
    return array


def scalars(name: str, value: npt.ArrayLike, count: int) -> Float64:
    """Return ``value`` as a new (count,) array; a single number stands for all bodies.

    Raises:
        ValueError: on a shape other than (), (1,) or (count,), or NaN.
    """
    array = fitting_column(name, numbers(name, value), count)
    return np.array(np.broadcast_to(array[..., 0], (count,)))


def fitting_column(name: str, array: Float64, count: int) -> Float64:
    """Return one number a body with a last axis of 1, so that it multiplies (count, width).

    Raises:
        ValueError: on a shape other than (), (1,) or (count,).
    """
    if array.shape not in {(count,), (), (1,)}:
        raise ValueError(f"{name} must be one number or have shape ({count},), got {array.shape}")
    return array[..., None]


def non_negative(name: str, value: npt.ArrayLike) -> Float64:
    """Return ``value`` as an array of numbers, all >= 0.

    Raises:
        ValueError: naming the first number that is below zero.
    """
    array = numbers(name, value)
    if (array < 0.0).any():
        raise ValueError(f"{name} must not be negative, got {float(array[array < 0.0][0])}")
    return array


def positive(name: str, value: npt.ArrayLike) -> Float64:
    """Return ``value`` as an array of numbers, all > 0.

    Raises:
        ValueError: naming the first number that is not above zero.
    """
    array = numbers(name, value)
    if (array <= 0.0).any():
        raise ValueError(f"{name} must be positive, got {float(array[array <= 0.0][0])}")
    return array


def positive_time(name: str, value: float) -> float:
    """Return a duration in seconds that is finite and above zero.

    Raises:
        ValueError: otherwise. Written for the inner loop: no arrays.
    """
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be a positive number of seconds, got {value}")
    return float(value)


def read_only(array: Float64) -> Float64:
    """Return ``array`` itself, closed to writing."""
    array.flags.writeable = False
    return array


def dot(a: Float64, b: Float64) -> Float64:
    """Return the scalar products of the last axes, (..., k) x (..., k) -> (...)."""
    product: Float64 = np.einsum("...i,...i->...", a, b)
    return product


def cross(a: Float64, b: Float64) -> Float64:
    """Return the vector products a x b, (..., 3).

    `numpy.cross` spends three times as long on a single pair, and this is the inner loop.
    """
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    out = np.empty(a.shape if a.shape == b.shape else np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = ay * bz - az * by
    out[..., 1] = az * bx - ax * bz
    out[..., 2] = ax * by - ay * bx
    return out
