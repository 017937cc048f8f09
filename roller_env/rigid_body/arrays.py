"""Small array helpers of the rigid body: shapes made right or refused, products of 3-vectors.

Every public entry of the package sends what a caller wrote through here, so that wrong input is
one `ValueError` that names the quantity, and never a NaN found a thousand steps later.
"""

from __future__ import annotations

import math
import operator
from typing import Final, SupportsFloat, SupportsIndex

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]

_EXACT_SQUARES: Final = (1e-140, 1e140)
"""Lengths between which no square that matters leaves float64's range."""


def floats(name: str, value: npt.ArrayLike) -> Float64:
    """Return ``value`` as a new float64 array, whose numbers may be NaN or infinite.

    Raises:
        ValueError: when it is no array of real numbers. Words, truth values, dates and complex
            numbers are none, though NumPy would turn them into some.
    """
    try:
        given = np.asarray(value)
        if isinstance(value, list | tuple) and _has_truth_values(value):
            raise TypeError("there are truth values among them")
        if given.dtype.kind not in "iufO":
            raise TypeError(f"they are of type {given.dtype}")
        return np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} must be numbers, got {value!r}: {error}") from error


def _has_truth_values(value: object) -> bool:
    """Say whether a nested list holds True or False, which beside numbers NumPy makes 1 and 0."""
    if isinstance(value, list | tuple):
        return any(map(_has_truth_values, value))
    return isinstance(value, bool | np.bool_)


def numbers(name: str, value: npt.ArrayLike) -> Float64:
    """Return ``value`` as a new float64 array.

    Raises:
        ValueError: when it is no array of numbers, or any of them is NaN or infinite.
    """
    array = floats(name, value)
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


def row_or_rows(name: str, value: npt.ArrayLike, width: int) -> Float64:
    """Return ``value`` as a new array of (width,) or (N, width), N being known only later.

    Raises:
        ValueError: on another shape, or NaN.
    """
    array = numbers(name, value)
    if array.ndim not in {1, 2} or array.shape[-1] != width:
        raise ValueError(f"{name} must have shape ({width},) or (N, {width}), got {array.shape}")
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


def number(name: str, value: SupportsFloat) -> float:
    """Return one number, which may be NaN or infinite.

    Raises:
        ValueError: when it is none: a word, a truth value or an array.
    """
    if isinstance(value, (str, bytes, bool, np.bool_)) or np.ndim(value) != 0:  # type: ignore[arg-type]
        raise ValueError(f"{name} must be one number, got {value!r}")
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} must be one number, got {value!r}: {error}") from error


def finite_number(name: str, value: SupportsFloat) -> float:
    """Return one finite number.

    Raises:
        ValueError: when it is none: NaN, infinite, a word or an array.
    """
    one = number(name, value)
    if not math.isfinite(one):
        raise ValueError(f"{name} must be finite, got {one}")
    return one


def positive_time(name: str, value: float) -> float:
    """Return a duration in seconds that is finite and above zero.

    Raises:
        ValueError: otherwise. Written for the inner loop: a float takes the short way.
    """
    time = value if isinstance(value, float) else number(name, value)
    if not (math.isfinite(time) and time > 0.0):
        raise ValueError(f"{name} must be a positive number of seconds, got {time}")
    return float(time)


def whole(name: str, value: SupportsIndex, least: int) -> int:
    """Return a whole number, at least ``least``; NumPy's are whole numbers, too.

    Raises:
        ValueError: on a fraction, a truth value, anything else, or a number that is too small.
    """
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError("a truth value is no number")
        count = operator.index(value)
    except TypeError as error:
        raise ValueError(f"{name} must be a whole number, got {value!r}: {error}") from error
    if count < least:
        bound = "must not be negative" if least == 0 else f"must be at least {least}"
        raise ValueError(f"{name} {bound}, got {count}")
    return count


def chosen(name: str, value: npt.ArrayLike, count: int) -> npt.NDArray[np.intp]:
    """Return which of ``count`` rows are meant, (K,): by a mask or by their indices.

    Args:
        name: what to call it in an error.
        value: truth values (count,), which keep the rows that are True, or whole numbers (K,),
            which may repeat and, being negative, count from the end.
        count: number of rows there are.

    Raises:
        ValueError: on a mask of another length, fractions, a row that is not there, or no row.
    """
    given = np.asarray(value)
    if given.dtype.kind != "b" and _has_truth_values(value):
        raise ValueError(f"{name} must be a mask or whole numbers, not some of both, got {value!r}")
    if given.dtype.kind == "b":
        if given.shape != (count,):
            raise ValueError(f"{name}: a mask must have shape ({count},), got {given.shape}")
        given = np.flatnonzero(given)
    elif given.ndim != 1 or (given.size and given.dtype.kind not in "iu"):
        raise ValueError(f"{name} must be a mask or whole numbers of shape (K,), got {value!r}")
    if given.size == 0:
        raise ValueError(f"{name} must choose at least one of {count} bodies, got none")
    outside = (given < -count) | (given >= count)
    if outside.any():
        raise ValueError(f"{name} must be rows of {count} bodies, got {given[outside][0]}")
    return given.astype(np.intp)


def read_only(array: Float64) -> Float64:
    """Return ``array`` itself, closed to writing."""
    array.flags.writeable = False
    return array


def dot(a: Float64, b: Float64) -> Float64:
    """Return the scalar products of the last axes, (..., k) x (..., k) -> (...)."""
    product: Float64 = np.einsum("...i,...i->...", a, b)
    return product


def length(vector: Float64) -> Float64:
    """Return the Euclidean lengths of the last axis, (..., k) -> (...), of any magnitude.

    Where a square would overflow, or underflow and be lost, the vector is scaled by a power of two
    first, which rounds nothing: lengths in between come out as the plain formula gives them.
    """
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        plain: Float64 = np.sqrt(dot(vector, vector))
        if plain_squares(plain):
            return plain
        exponent = scale_exponent(vector)
        scaled = np.ldexp(vector, -exponent[..., None])
        return np.ldexp(np.sqrt(dot(scaled, scaled)), exponent)


def plain_squares(size: Float64) -> bool:
    """Say whether no length is so large or small (or 0, or NaN) that its square may be wrong."""
    low, high = _EXACT_SQUARES
    return bool(((size > low) & (size < high)).all())


def scale_exponent(vector: Float64) -> npt.NDArray[np.intc]:
    """Return e, (...), such that the largest component of ``vector`` over 2^e is in [1/2, 1).

    0 for a vector that is zero or not finite.
    """
    largest = np.max(np.abs(vector), axis=-1)
    return np.frexp(np.where(np.isfinite(largest), largest, 0.0))[1]


def direction(name: str, vector: Float64) -> Float64:
    """Return ``vector`` (..., k) scaled to length 1, whatever its magnitude.

    Raises:
        ValueError: when a vector is zero.
    """
    # Scaled before it is divided, since dividing by a subnormal length loses digits.
    scaled = np.ldexp(vector, -scale_exponent(vector)[..., None])
    size = length(scaled)
    if (size == 0.0).any():
        raise ValueError(f"{name} must not be the zero vector: it has no direction")
    unit: Float64 = scaled / size[..., None]
    return unit


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
