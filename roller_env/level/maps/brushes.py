"""Planes -> bodies: the corners of a brush, and whether it is exactly a box.

Lengths are in map units, in the map's frame: x forward, y left, z up.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.level.maps.parse import Brush
from roller_env.pieces.piece import Matrix, Vector, rotation_matrix

MAX_CORNERS: Final = 64
"""Points that a hull of a level may have."""

RIGHT_ANGLE: Final = 1e-6
"""Radians by which the faces of a box may be off."""

TOLERANCE: Final = 0.005
"""Map units, 0.13 mm: corners that are nearer to each other are one. Editors write coordinates to
some decimals, so more than three planes hardly meet in a point."""

_PARALLEL: Final = 1e-9
_DECIMALS: Final = 9
"""What is written of numbers of map units and degrees: more is noise of their last bits."""


class BrushError(Exception):
    """A brush that is no body; the text says why."""


@dataclass(frozen=True, slots=True)
class Block:
    """A box, turned by a roll, then a pitch, then a yaw about its centre.

    Attributes:
        at: its centre, map units.
        size: full edge lengths, map units.
        angles: yaw, pitch and roll, degrees, as those of `roller_env.pieces.box.Box`.
    """

    at: Vector
    size: Vector
    angles: Vector

    @property
    def corners(self) -> Float64:
        """(8, 3), map units."""
        return corners_of(self.at, self.size, rotation_matrix(*self.angles))


@dataclass(frozen=True, slots=True)
class Hull:
    """A convex body that is no box.

    Attributes:
        corners: (4 to `MAX_CORNERS`, 3), map units.
    """

    corners: Float64


def corners_of(at: Vector, size: Vector, rotation: Matrix) -> Float64:
    """Return the (8, 3) corners of a box, in the unit of its centre and its full edge lengths."""
    signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    corners: Float64 = np.array(at) + (signs * size) @ np.array(rotation).T
    return corners


def body_of(brush: Brush) -> Block | Hull:
    """Return the body that a brush is: a box if it is exactly one, else the hull of its corners.

    Raises:
        BrushError: its faces enclose nothing, have no end, or have more than `MAX_CORNERS` corners.
    """
    points = np.array([face.points for face in brush.faces])
    # Near the origin, where numbers are finest.
    origin = np.round(points.reshape(-1, 3).mean(axis=0))
    normals, offsets = _half_spaces(points - origin, brush)
    block = _block(normals, offsets, origin)
    if block is not None:
        return block
    corners = _corners(normals, offsets)
    on = np.abs(corners @ normals.T - offsets) <= TOLERANCE
    sides = on.sum(axis=0) >= 3
    block = _block(normals[sides], offsets[sides], origin)
    return block or Hull(np.round(corners + origin, _DECIMALS) + 0.0)


def _half_spaces(points: Float64, brush: Brush) -> tuple[Float64, Float64]:
    """Return unit normals (P, 3), outwards, and the distances (P,) of the planes from the origin.

    Args:
        points: (P, 3, 3), three of each plane.
        brush: whose they are.
    """
    first, second = points[:, 0] - points[:, 1], points[:, 2] - points[:, 1]
    normals = np.cross(first, second)
    lengths = np.linalg.norm(normals, axis=1)
    flat = lengths <= 1e-9 * np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    if flat.any():
        line = brush.faces[int(np.argmax(flat))].line
        raise BrushError(f"the three points of the face in line {line} lie on one line")
    normals /= lengths[:, None]
    offsets = np.einsum("ij,ij->i", normals, points[:, 1])
    _, kept = np.unique(np.round(np.column_stack([normals, offsets]), 9), axis=0, return_index=True)
    kept.sort()
    return normals[kept], offsets[kept]


def _block(normals: Float64, offsets: Float64, origin: Float64) -> Block | None:
    """Return the box between six planes if all of them are at right angles or parallel."""
    if len(normals) != 6:
        return None
    opposite = np.linalg.norm(normals[:, None] + normals[None], axis=2) <= RIGHT_ANGLE
    pairs = [(i, j) for i, j in np.argwhere(opposite).tolist() if i < j]
    if len(pairs) != 3 or len({*itertools.chain.from_iterable(pairs)}) != 6:
        return None
    axes = np.array([normals[i] - normals[j] for i, j in pairs]) / 2.0
    if np.abs(axes @ axes.T - np.eye(3)).max() > RIGHT_ANGLE:
        return None
    size = np.array([offsets[i] + offsets[j] for i, j in pairs])
    if (size <= TOLERANCE).any():
        return None
    middle = np.array([offsets[i] - offsets[j] for i, j in pairs]) / 2.0
    centre = np.linalg.solve(axes, middle) + origin
    rotation, order = _nearest_rotation(axes)
    yaw = math.degrees(math.atan2(rotation[1, 0], rotation[0, 0]))
    pitch = math.degrees(math.asin(min(max(-rotation[2, 0], -1.0), 1.0)))
    roll = math.degrees(math.atan2(rotation[2, 1], rotation[2, 2]))
    return Block(_vector(centre), _vector(size[order]), _vector([yaw, pitch, roll]))


def _nearest_rotation(axes: Float64) -> tuple[Float64, list[int]]:
    """Return the axes as columns of the rotation that turns least, and which of them is which.

    A box is the same under 24 of them.
    """
    best: tuple[float, Float64, list[int]] | None = None
    for order in itertools.permutations(range(3)):
        columns = axes[list(order)].T
        signs = np.where(np.diagonal(columns) < 0.0, -1.0, 1.0)
        if np.linalg.det(columns * signs) < 0.0:
            weakest = int(np.argmin(np.abs(np.diagonal(columns))))
            signs[weakest] = -signs[weakest]
        turned = columns * signs
        if best is None or np.trace(turned) > best[0] + RIGHT_ANGLE:
            best = float(np.trace(turned)), turned, list(order)
    assert best is not None, "there are six orders"
    return best[1], best[2]


def _corners(normals: Float64, offsets: Float64) -> Float64:
    """Return the corners (V, 3) of what is behind all planes.

    Where two planes meet is a line. As much of it as no other plane cuts off is an edge.
    """
    corners = _distinct(_edges(normals, offsets).reshape(-1, 3))
    if len(corners) < 4:
        raise BrushError("the faces of the brush enclose nothing; wanted their outsides outwards")
    spread = np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False)
    if spread[2] <= TOLERANCE:
        raise BrushError("the brush is flat; wanted a body")
    return corners


def _edges(normals: Float64, offsets: Float64) -> Float64:
    """Return the ends (E, 2, 3) of the edges of what is behind all planes."""
    one, other = np.triu_indices(len(normals), 1)
    along = np.cross(normals[one], normals[other])
    sines = np.linalg.norm(along, axis=1)
    meets = sines > RIGHT_ANGLE
    one, other, sines = one[meets], other[meets], sines[meets, None]
    along = along[meets] / sines
    base = offsets[one, None] * np.cross(normals[other], along)
    base -= offsets[other, None] * np.cross(normals[one], along)
    base /= sines
    slope = along @ normals.T
    room = offsets - base @ normals.T
    lies = np.abs(slope) < _PARALLEL
    cut = room / np.where(lies, 1.0, slope)
    last = np.where(slope >= _PARALLEL, cut, np.inf).min(axis=1)
    first = np.where(slope <= -_PARALLEL, cut, -np.inf).max(axis=1)
    cut_off = (lies & (room < -0.1 * TOLERANCE)).any(axis=1)
    is_edge = ~cut_off & (last - first > TOLERANCE)
    reach = np.stack([first[is_edge], last[is_edge]], axis=1)
    if not np.isfinite(reach).all():
        raise BrushError("the faces of the brush do not close it; wanted one on every side")
    ends: Float64 = base[is_edge, None] + reach[..., None] * along[is_edge, None]
    return ends


def _distinct(points: Float64) -> Float64:
    """Return points (n, 3) without those that are one with another."""
    kept: list[Float64] = []
    left = points
    while len(left):
        if len(kept) == MAX_CORNERS:
            raise BrushError(f"the brush has more than {MAX_CORNERS} corners; split it")
        near = np.linalg.norm(left - left[0], axis=1) <= TOLERANCE
        kept.append(left[near].mean(axis=0))
        left = left[~near]
    return np.array(kept).reshape(-1, 3)


def _vector(values: Float64 | list[float]) -> Vector:
    x, y, z = (round(float(value), _DECIMALS) + 0.0 for value in values)
    return (x, y, z)
