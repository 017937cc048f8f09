"""Triangle surfaces for pictures: solids with texture in world scale, and bodies of revolution.

The physics makes do with MuJoCo's primitives. Pictures do not: a texture on a primitive starts
anew on each one, so a floor of several boxes would show its seams.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from roller_env.arrays import Float64, Int64
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.piece import Face, Solid
from roller_env.units import quants

TILE_M: Final = quants(64.0)
"""Edge of the square of the world that one repetition of a texture covers."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of n vertices; those that share a vertex are smooth there.

    Attributes:
        vertices: (n, 3) metres.
        normals: (n, 3) unit vectors, out of the body.
        texture: (n, 2) texture coordinates, in repetitions.
        faces: (m, 3) indices of vertices, counterclockwise as seen from outside.
    """

    vertices: Float64
    normals: Float64
    texture: Float64
    faces: Int64

    @staticmethod
    def joined(surfaces: Sequence[Surface]) -> Surface:
        """Return all the surfaces as one."""
        counts = [len(surface.vertices) for surface in surfaces]
        offsets = np.cumsum([0, *counts[:-1]])
        return Surface(
            np.concatenate([surface.vertices for surface in surfaces]),
            np.concatenate([surface.normals for surface in surfaces]),
            np.concatenate([surface.texture for surface in surfaces]),
            np.concatenate([s.faces + offset for s, offset in zip(surfaces, offsets, strict=True)]),
        )

    def moved(self, rotation: Float64, translation: Float64) -> Surface:
        """Return the surface rotated by ``rotation``, (3, 3), and then moved."""
        return Surface(
            self.vertices @ rotation.T + translation,
            self.normals @ rotation.T,
            self.texture,
            self.faces,
        )


def solid_surfaces(solid: Solid) -> tuple[Surface, Surface | None]:
    """Return a solid's faces, and apart from them its edge if it is a box that is a slab."""
    if isinstance(solid, ConvexSolid):
        return Surface.joined([_flat_face(face) for face in solid.faces()]), None
    return box_surfaces(solid)


def _flat_face(face: Face) -> Surface:
    """Return a face of a convex solid.

    The texture of one that looks along an axis of the world goes on unbroken from that of the
    boxes beside it.
    """
    count = len(face.corners)
    right, up = ((1, 2), (0, 2), (0, 1))[int(np.abs(face.normal).argmax())]
    along = np.eye(3)[right] - face.normal[right] * face.normal
    along /= np.linalg.norm(along)
    across = np.cross(face.normal, along)
    across *= math.copysign(1.0, across[up])
    texture = np.stack([face.corners @ along, face.corners @ across], axis=1) / TILE_M
    second = np.arange(1, count - 1)
    fan = np.stack([np.zeros_like(second), second, second + 1], axis=1)
    return Surface(face.corners, np.tile(face.normal, (count, 1)), texture, fan)


def box_surfaces(solid: Solid) -> tuple[Surface, Surface | None]:
    """Return a box's faces, and apart from them its edge if it is a slab.

    A slab is wider than it is high both ways. The texture of its edge begins at the upper rim.
    The textures of coplanar upright boxes go on unbroken from one to the next.
    """
    half, rotation = np.array(solid.half_size), np.array(solid.rotation)
    # A tilted box has no better origin for its texture than its own middle.
    origin = np.array(solid.centre) if solid.axis_aligned else np.zeros(3)
    sides = [_box_face(half, origin, axis, sign) for axis in (0, 1) for sign in (-1.0, 1.0)]
    flats = [_box_face(half, origin, 2, sign) for sign in (-1.0, 1.0)]
    middle = np.array(solid.centre)
    if half[2] >= half[:2].min():
        return Surface.joined(sides + flats).moved(rotation, middle), None
    edge = Surface.joined(sides)
    edge.texture[:, 1] = (half[2] - edge.vertices[:, 2]) / TILE_M
    return Surface.joined(flats).moved(rotation, middle), edge.moved(rotation, middle)


def _box_face(half: Float64, origin: Float64, axis: int, sign: float) -> Surface:
    """Return the face of a box in its own frame that looks along ``axis`` times ``sign``."""
    right, up = ((1, 2), (0, 2), (0, 1))[axis]
    corners = np.zeros((4, 3))
    corners[:, axis] = sign
    corners[:, right] = (-1.0, 1.0, 1.0, -1.0)
    corners[:, up] = (-1.0, -1.0, 1.0, 1.0)
    corners *= half
    normals = np.zeros((4, 3))
    normals[:, axis] = sign
    texture = (corners + origin)[:, [right, up]] / TILE_M
    # x cross y is z and y cross z is x, but x cross z is -y.
    turned = (sign < 0.0) != (axis == 1)
    faces = np.array([[0, 2, 1], [0, 3, 2]] if turned else [[0, 1, 2], [0, 2, 3]])
    return Surface(corners, normals, texture, faces)


def lathe(profile: Sequence[tuple[float, float]], angles: Float64) -> Surface:
    """Turn a profile about z.

    Args:
        profile: (radius, height) of its corners, metres; the body lies on the left of the way
            from one to the next, so an outer side goes upwards.
        angles: radians at which there are edges, rising.
    """
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    bands = []
    length = 0.0
    for (radius, height), (next_radius, next_height) in pairwise(profile):
        along = math.hypot(next_radius - radius, next_height - height)
        out, up = (next_height - height) / along, (radius - next_radius) / along
        vertices = np.concatenate(
            [
                np.column_stack([ring * r, np.full(len(ring), h)])
                for r, h in ((radius, height), (next_radius, next_height))
            ]
        )
        normals = np.tile(np.column_stack([ring * out, np.full(len(ring), up)]), (2, 1))
        around = angles * max(radius, next_radius)
        texture = np.column_stack(
            [np.tile(around, 2), np.repeat([length, length + along], len(ring))]
        )
        first = np.arange(len(ring) - 1)
        above = first + len(ring)
        lower = np.stack([first, first + 1, above + 1], axis=1)
        upper = np.stack([first, above + 1, above], axis=1)
        bands.append(Surface(vertices, normals, texture / TILE_M, np.concatenate([lower, upper])))
        length += along
    return Surface.joined(bands)


def full_turn(segments: int) -> Float64:
    """Return the angles of a closed ring, radians."""
    return np.linspace(0.0, 2.0 * math.pi, segments + 1)
