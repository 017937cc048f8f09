"""The map between the report's axes and the game's.

| | x | y | z |
|---|---|---|---|
| the report, as it names them | right | up | forward |
| the report, as OpenGL has them | right | up | backward |
| the game, MuJoCo | forward | left | up |

The report contradicts itself. It lists x as left and right, y as up and down, z as forward and
back, and says that its axes are right-handed "which is standard when using OpenGL". But right, up
and forward in this order are **left-handed**; the right-handed reading has z pointing backward.
Both maps are here, and `REPORT_TO_GAME` is the first. Its determinant is -1: a mirror. Positions,
velocities and forces (polar vectors) go through it as they are; angular velocities, angular momenta
and torques (axial vectors) and the vector part of a quaternion change sign as well, because the
hand that the report says to use for the rotation changes too.

The equations themselves are the same in either system: only what a number means to somebody looking
at the screen depends on the map.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.rigid_body.arrays import Float64, numbers

Rows = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class AxesMap:
    """A change of axes: each new axis is an old one, perhaps reversed.

    Arguments are (..., 3) or (..., 4) and so are results. Wrong shapes and NaN raise `ValueError`.

    Attributes:
        rows: the new axes in old coordinates, a signed permutation.
    """

    rows: Rows

    def __post_init__(self) -> None:
        matrix = self.matrix
        good = matrix.shape == (3, 3) and np.isin(matrix, (-1.0, 0.0, 1.0)).all()
        if not good or not np.array_equal(matrix @ matrix.T, np.eye(3)):
            raise ValueError(f"rows must be a signed permutation of the axes, got {self.rows}")

    @property
    def matrix(self) -> Float64:
        """The map as a matrix, (3, 3)."""
        return numbers("rows", self.rows)

    @property
    def handedness(self) -> float:
        """1.0 when both systems have the same hand, -1.0 when the map is a mirror."""
        return float(np.sign(np.linalg.det(self.matrix)))

    @property
    def inverse(self) -> AxesMap:
        """The map back."""
        return AxesMap(tuple((float(a), float(b), float(c)) for a, b, c in self.matrix.T))

    def vector(self, value: npt.ArrayLike) -> Float64:
        """Return a position, velocity, momentum or force in the new axes."""
        return _last_axis("vector", value, 3) @ self.matrix.T

    def axial(self, value: npt.ArrayLike) -> Float64:
        """Return an angular velocity, angular momentum or torque in the new axes."""
        return self.handedness * (_last_axis("axial vector", value, 3) @ self.matrix.T)

    def quaternion(self, value: npt.ArrayLike) -> Float64:
        """Return an orientation in the new axes, body and world both renamed."""
        q = _last_axis("quaternion", value, 4).copy()
        q[..., 1:] = self.axial(q[..., 1:])
        return q

    def extent(self, value: npt.ArrayLike) -> Float64:
        """Return what has an axis but no direction along it, such as a box's size or inertia."""
        return _last_axis("extent", value, 3) @ np.abs(self.matrix.T)


def _last_axis(name: str, value: npt.ArrayLike, width: int) -> Float64:
    array = numbers(name, value)
    if array.ndim == 0 or array.shape[-1] != width:
        raise ValueError(f"{name} must end in an axis of {width}, got shape {array.shape}")
    return array


REPORT_TO_GAME: Final = AxesMap(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
"""From x right, y up, z forward (left-handed) to x forward, y left, z up."""

OPENGL_TO_GAME: Final = AxesMap(((0.0, 0.0, -1.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
"""From x right, y up, z backward (right-handed) to x forward, y left, z up."""
