"""Unit quaternions (w, x, y, z) as rotations, over any leading axes.

Conventions, the same everywhere in the package:

* Hamilton's product (ij = k), scalar first, as MuJoCo and the report write it.
* An orientation q takes body coordinates to world coordinates: ``v_world = q v_body q*``.
* q and -q are the same rotation.
* Angular velocity is in the **world** frame, so the rate of change has it on the left:
  ``dq/dt = spin = 1/2 (0, omega) q`` (Baraff 1997, "Rigid Body Simulation I", eq. 4-2).

All functions take and return float64 arrays of shape (..., 4) or (..., 3); the leading axes
broadcast. Angles are radians. Only the functions which say so check their input.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.rigid_body.arrays import (
    Float64,
    cross,
    direction,
    length,
    numbers,
    plain_squares,
    scale_exponent,
)

UNIT_TOLERANCE: Final = 1e-3
"""How far from 1 the norm of a quaternion written by a person may be (0.7071 is 1e-5 off)."""


def _left_products() -> Float64:
    """Return L, (4, 16), such that (a @ L) as a 4x4 matrix times b is the product a b."""
    column = np.array([[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]])
    sign = np.array([[1, -1, -1, -1], [1, 1, -1, 1], [1, 1, 1, -1], [1, -1, 1, 1]])
    tensor = np.zeros((4, 4, 4))
    for i in range(4):
        for k in range(4):
            tensor[column[i, k], i, k] = sign[i, k]
    flat: Float64 = tensor.reshape(4, 16)
    return flat


_LEFT: Final[Float64] = _left_products()
_CONJUGATE: Final[Float64] = np.array([1.0, -1.0, -1.0, -1.0])


def identity(count: int) -> Float64:
    """Return ``count`` rotations that turn nothing, (count, 4)."""
    q = np.zeros((count, 4))
    q[:, 0] = 1.0
    return q


def multiply(a: Float64, b: Float64) -> Float64:
    """Return Hamilton's product a b: the rotation b followed by the rotation a."""
    left = (a @ _LEFT).reshape(*a.shape[:-1], 4, 4)
    product: Float64 = np.einsum("...ij,...j->...i", left, b)
    return product


def conjugate(q: Float64) -> Float64:
    """Return the conjugate, which for a unit quaternion is the inverse rotation."""
    return q * _CONJUGATE


def norm(q: Float64) -> Float64:
    """Return the norms, (...), of quaternions or vectors of any magnitude."""
    return length(q)


def normalise(q: Float64) -> Float64:
    """Return q scaled to norm 1. A zero or non-finite quaternion gives NaN, never an error."""
    size = norm(q)
    if plain_squares(size):
        return q / size[..., None]
    with np.errstate(invalid="ignore"):
        scaled = np.ldexp(q, -scale_exponent(q)[..., None])
        unit: Float64 = scaled / norm(scaled)[..., None]
        return unit


def checked_unit(name: str, value: npt.ArrayLike) -> Float64:
    """Return ``value`` as unit quaternions, renormalised.

    Raises:
        ValueError: when the last axis is not 4, a component is NaN, or a norm is further than
            `UNIT_TOLERANCE` from 1: that is no rounding but a mistake.
    """
    q = numbers(name, value)
    if q.ndim == 0 or q.shape[-1] != 4:
        raise ValueError(f"{name} must end in an axis of 4 (w, x, y, z), got shape {q.shape}")
    off = np.abs(norm(q) - 1.0)
    if (off > UNIT_TOLERANCE).any():
        worst = q.reshape(-1, 4)[int(off.argmax())]
        raise ValueError(
            f"{name} must be unit quaternions (w, x, y, z), norm within {UNIT_TOLERANCE} of 1; "
            f"got {worst.tolist()} of norm {float(norm(worst)):.6g}"
        )
    return normalise(q)


def from_axis_angle(axis: npt.ArrayLike, angle_rad: npt.ArrayLike) -> Float64:
    """Return the rotation by ``angle_rad`` (...) about ``axis`` (..., 3) of any length but 0.

    Raises:
        ValueError: on an axis of length 0, of another width than 3, or on NaN.
    """
    about, angle = numbers("axis", axis), numbers("angle_rad", angle_rad)
    if about.ndim == 0 or about.shape[-1] != 3:
        raise ValueError(f"axis must end in an axis of 3, got shape {about.shape}")
    try:
        shape = np.broadcast_shapes(about.shape[:-1], angle.shape)
    except ValueError as error:
        raise ValueError(f"axis {about.shape} and angle_rad {angle.shape}: {error}") from error
    half = np.broadcast_to(0.5 * angle, shape)
    q = np.empty((*shape, 4))
    q[..., 0] = np.cos(half)
    q[..., 1:] = np.sin(half)[..., None] * direction("axis", about)
    return q


def from_rotation_vector(vector: npt.ArrayLike) -> Float64:
    """Return the rotation about ``vector`` (..., 3) by its length: the exponential map.

    A body turning at constant omega (world frame) for t seconds goes from q to
    ``multiply(from_rotation_vector(omega * t), q)``, exactly.
    """
    vector = np.asarray(vector, dtype=np.float64)
    half = 0.5 * norm(vector)
    ratio = np.divide(np.sin(half), half, out=np.ones_like(half), where=half > 0.0)
    q = np.empty((*vector.shape[:-1], 4))
    q[..., 0] = np.cos(half)
    q[..., 1:] = (0.5 * ratio)[..., None] * vector
    return q


def to_rotation_vector(q: Float64) -> Float64:
    """Return the shortest rotation vector of unit q, (..., 3), length in [0, pi]: the logarithm."""
    short = np.where(q[..., :1] < 0.0, -q, q)
    sine, cosine = norm(short[..., 1:]), short[..., 0]
    angle = 2.0 * np.arctan2(sine, cosine)
    ratio = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0.0)
    return ratio[..., None] * short[..., 1:]


def angle_between(a: Float64, b: Float64) -> Float64:
    """Return the angle between two orientations, (...), radians in [0, pi]: the attitude error.

    2 atan2(|v|, |w|) of the relative quaternion. The arc cosine of w would lose every angle under
    1e-8, because cos is flat at 0.
    """
    relative = multiply(conjugate(a), b)
    angle: Float64 = 2.0 * np.arctan2(norm(relative[..., 1:]), np.abs(relative[..., 0]))
    return angle


def slerp(a: npt.ArrayLike, b: npt.ArrayLike, fraction: npt.ArrayLike) -> Float64:
    """Return the orientation ``fraction`` (...) of the way from a to b, at constant speed.

    The short way round: b and -b give the same result. Source: Shoemake 1985, "Animating Rotation
    with Quaternion Curves", written with the logarithm, which needs no special case for close
    orientations.
    """
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    way = to_rotation_vector(multiply(conjugate(a), b))
    return multiply(
        a, from_rotation_vector(way * np.asarray(fraction, dtype=np.float64)[..., None])
    )


def spin(angular_velocity: Float64, q: Float64) -> Float64:
    """Return dq/dt = 1/2 (0, omega) q, 1/s, for omega in the world frame, rad/s."""
    half = np.zeros((*angular_velocity.shape[:-1], 4))
    half[..., 1:] = 0.5 * angular_velocity
    return multiply(half, q)


def to_matrix(q: Float64) -> Float64:
    """Return the rotation matrices of unit q, (..., 3, 3), body to world."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    x2, y2, z2 = x + x, y + y, z + z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    matrix = np.empty((*q.shape[:-1], 3, 3))
    matrix[..., 0, 0] = 1.0 - (yy + zz)
    matrix[..., 0, 1] = xy - wz
    matrix[..., 0, 2] = xz + wy
    matrix[..., 1, 0] = xy + wz
    matrix[..., 1, 1] = 1.0 - (xx + zz)
    matrix[..., 1, 2] = yz - wx
    matrix[..., 2, 0] = xz - wy
    matrix[..., 2, 1] = yz + wx
    matrix[..., 2, 2] = 1.0 - (xx + yy)
    return matrix


def rotate(q: Float64, vector: Float64) -> Float64:
    """Return ``vector`` (..., 3) turned by unit q: from body to world coordinates."""
    return _turn(q[..., :1], q[..., 1:], vector)


def rotate_inverse(q: Float64, vector: Float64) -> Float64:
    """Return ``vector`` (..., 3) turned back by unit q: from world to body coordinates."""
    return _turn(-q[..., :1], q[..., 1:], vector)


def _turn(w: Float64, u: Float64, vector: Float64) -> Float64:
    """Return v + 2w (u x v) + 2u x (u x v), which is q v q* without the two products."""
    twice = 2.0 * cross(u, vector)
    return vector + w * twice + cross(u, twice)
