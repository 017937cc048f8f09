"""Solids with flat faces of any shape that is convex."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64
from roller_env.pieces.fields import MIN_LENGTH_M
from roller_env.pieces.piece import UNTURNED, Face, Solid, Vector

THINNEST_M: Final = MIN_LENGTH_M / 2.0
"""No hull may be thinner. The thinnest wedge that a level may have is 0.7 of `MIN_LENGTH_M`."""

COPLANAR: Final = 1e-9
"""Triangles whose unit normals differ by less, and whose planes by less of the size, are one face:
as `roller_env.physics.rigid.hull` has it."""

_UPRIGHT: Final = 1e-9
"""Upward part of the unit normal below which a face stands upright."""


@dataclass(frozen=True, slots=True)
class Side:
    """A face of a convex solid.

    Attributes:
        normal: unit vector, out of the solid, world frame.
        offset: of its plane along the normal, metres.
        corners: metres, world frame, counterclockwise as seen from outside.
    """

    normal: Vector
    offset: float
    corners: tuple[Vector, ...]


@dataclass(frozen=True, slots=True)
class ConvexSolid(Solid):
    """The convex hull of points, which stands still.

    Its ``centre`` and ``half_size`` are those of the box around it, whose edges lie along the
    world's axes; `of` makes one.

    Attributes:
        sides: its faces.
    """

    sides: tuple[Side, ...]

    @staticmethod
    def of(points: Sequence[Vector], material: str, source: str) -> ConvexSolid:
        """Return the hull of points, (n, 3) metres, world frame; some may lie inside.

        Raises:
            ValueError: they span no volume.
        """
        sides = sides_of(points)
        corners = np.array([corner for side in sides for corner in side.corners])
        low, high = corners.min(axis=0), corners.max(axis=0)
        return ConvexSolid(
            _vector((low + high) / 2), _vector((high - low) / 2), UNTURNED, material, source, sides
        )

    @property
    def axis_aligned(self) -> bool:
        """Whether it is a box whose edges lie along the world's axes: as far as is known, not."""
        return False

    def corners(self) -> Float64:
        """Return its corners, (n, 3) metres, world frame."""
        corners = dict.fromkeys(corner for side in self.sides for corner in side.corners)
        return np.array(list(corners))

    def faces(self) -> Iterator[Face]:
        """Yield its faces."""
        for side in self.sides:
            yield Face(np.array(side.normal), np.array(side.corners))

    def contains(self, points: Float64, margin: float = 0.0) -> npt.NDArray[np.bool_]:
        """Say which of ``points``, (n, 3) in metres, lie inside or within ``margin`` of it.

        With a ``margin`` below zero, which lie inside and that deep under each face.
        """
        normals, offsets = self._planes()
        beyond: Float64 = points @ normals.T - offsets
        highest: Float64 = beyond.max(axis=-1)
        inside: Bool = highest <= min(margin, 0.0)
        near = np.flatnonzero(~inside & (highest <= margin))
        inside[near] = self._distance(points[near], beyond[near]) <= margin
        return inside

    def upright(self, places: Float64) -> tuple[Float64, Float64]:
        """Return from where to where upright lines run inside it.

        Args:
            places: (..., 2) x and y of the lines, metres, world frame.

        Returns:
            Lower and upper ends, (...) heights in metres; inf and -inf where a line misses it.
        """
        bottom, top = np.full(places.shape[:-1], -np.inf), np.full(places.shape[:-1], np.inf)
        for normal, offset in zip(*self._planes(), strict=True):
            room = offset - places @ normal[:2]
            if abs(normal[2]) < _UPRIGHT:
                top = np.where(room >= 0.0, top, -np.inf)
            elif normal[2] > 0.0:
                top = np.minimum(top, room / normal[2])
            else:
                bottom = np.maximum(bottom, room / normal[2])
        missed = bottom > top
        return np.where(missed, np.inf, bottom), np.where(missed, -np.inf, top)

    def _planes(self) -> tuple[Float64, Float64]:
        """Return the normals of its faces, (k, 3), and their planes' offsets along them, (k,)."""
        normals = np.array([side.normal for side in self.sides])
        return normals, np.array([side.offset for side in self.sides])

    def _distance(self, points: Float64, beyond: Float64) -> Float64:
        """Return how far points outside are from it, metres.

        What is nearest is a face that a point lies over, or else an edge or its end.

        Args:
            points: (n, 3) metres.
            beyond: (n, faces) how far each is beyond the plane of each face, metres.
        """
        nearest = np.full(len(points), np.inf)
        for side, height in zip(self.sides, beyond.T, strict=True):
            corners = np.array(side.corners)
            along = np.roll(corners, -1, axis=0) - corners
            from_corner = points[:, None, :] - corners
            inwards = np.cross(side.normal, along)
            over = (height >= 0.0) & (np.einsum("nkj,kj->nk", from_corner, inwards) >= 0.0).all(1)
            nearest = np.where(over, np.minimum(nearest, height), nearest)
            fraction = np.einsum("nkj,kj->nk", from_corner, along) / (along**2).sum(axis=1)
            away = from_corner - np.clip(fraction, 0.0, 1.0)[..., None] * along
            nearest = np.minimum(nearest, np.linalg.norm(away, axis=-1).min(axis=1))
        return nearest


def sides_of(points: Sequence[Vector]) -> tuple[Side, ...]:
    """Return the faces of the convex hull of points, (n, 3) metres, world frame.

    Raises:
        ValueError: they span no volume, or one that is thinner than `THINNEST_M`.
    """
    from scipy.spatial import ConvexHull, QhullError

    given = np.array(points, dtype=np.float64)
    try:
        # About their middle, so that far from the origin no digits are lost.
        middle = (given.min(axis=0) + given.max(axis=0)) / 2
        found = ConvexHull(given - middle)
    except (QhullError, ValueError) as error:
        raise ValueError("the points lie in one plane") from error
    corners = given[found.vertices] - middle
    size, planes = float(np.abs(corners).max()), list[Float64]()
    for plane in found.equations:
        gaps = [np.abs(plane - known) for known in planes]
        if not any((g[:3] < COPLANAR).all() and g[3] < COPLANAR * size for g in gaps):
            planes.append(plane)
    heights = [corners @ plane[:3] for plane in planes]
    if min(float(np.ptp(height)) for height in heights) < THINNEST_M:
        raise ValueError("the points are nearly in one plane")
    vertices = given[found.vertices]
    return tuple(
        _side(plane[:3], vertices[height > height.max() - 2.0 * COPLANAR * size])
        for plane, height in zip(planes, heights, strict=True)
    )


def _side(normal: Float64, corners: Float64) -> Side:
    """Return the face with corners, (n, 3) metres, that come in any order."""
    out = corners - corners.mean(axis=0)
    right = out[0] / np.linalg.norm(out[0])
    turned = np.argsort(np.arctan2(out @ np.cross(normal, right), out @ right), kind="stable")
    around = corners[turned]
    # The farthest corner, so that none is beyond the face.
    offset = float((around @ normal).max())
    return Side(_vector(normal), offset, tuple(_vector(corner) for corner in around))


def _vector(values: Float64) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
