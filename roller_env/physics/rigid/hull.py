"""The convex hull of points: its faces, edges and corners, each with where it is the nearest.

A feature's Voronoi region, the points outside a convex solid to which it is the nearest part, is
bounded by planes: over a face by those through its edges at right angles to it; beyond an edge by
those through its ends and those of its two faces; beyond a corner by those at right angles to its
edges (B. Mirtich, *V-Clip: fast and robust polyhedral collision detection*, 1998).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Float64, Int64

COPLANAR: Final = 1e-9
"""Triangles whose unit normals differ by less, and whose planes by less of the size, are one."""


@dataclass(frozen=True, slots=True)
class Feature:
    """A face, an edge or a corner of a hull.

    Attributes:
        point: (3,) a point of it, metres: of an edge its first end.
        direction: (3,) of a face its outward normal, of an edge along it, of a corner 0: unit.
        length: of an edge, metres.
        ends: of an edge the numbers of its corners.
        bounds: (k, 4) its region is where ``bounds[:, :3] @ p <= bounds[:, 3]``.
    """

    point: Float64
    direction: Float64
    length: float
    ends: tuple[int, int]
    bounds: Float64


@dataclass(frozen=True, slots=True)
class Hull:
    """A convex polyhedron, relative to ``centre``.

    Attributes:
        centre: (3,) mean of the corners, metres.
        faces: outward.
        edges: each once.
        corners: in the order of `Feature.ends`.
    """

    centre: Float64
    faces: Sequence[Feature]
    edges: Sequence[Feature]
    corners: Sequence[Feature]


def hull_of(points: npt.ArrayLike) -> Hull:
    """Return the convex hull of points, (n, 3) metres; triangles in one plane are one face.

    Raises:
        ValueError: the points do not span a volume.
    """
    from scipy.spatial import ConvexHull, QhullError

    given = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    try:
        found = ConvexHull(given)
    except (QhullError, ValueError) as error:
        raise ValueError(
            f"points: found {len(given)} that span no volume; at least 4 that do not lie in a plane"
        ) from error
    corners = given[found.vertices]
    centre = corners.mean(axis=0)
    corners = corners - centre
    renumbered = np.full(len(given), -1)
    renumbered[found.vertices] = np.arange(len(corners))
    triangles, normals = renumbered[found.simplices], found.equations[:, :3]
    face_of = _coplanar(corners, triangles, normals, found.neighbors)
    sides = _sides(triangles, face_of)
    planes = np.array([normals[np.flatnonzero(face_of == f)[0]] for f in range(face_of.max() + 1)])
    return _assembled(centre, corners, planes, sides)


def _coplanar(corners: Float64, triangles: Int64, normals: Float64, neighbours: Int64) -> Int64:
    """Return the number of the face that each triangle is part of."""
    size = float(np.abs(corners).max())
    face = np.full(len(triangles), -1)
    faces = 0
    for first in range(len(triangles)):
        if face[first] >= 0:
            continue
        face[first], waiting = faces, [first]
        offset = float((corners[triangles[first]] @ normals[first]).max())
        while waiting:
            for other in neighbours[waiting.pop()]:
                flat = np.abs(normals[other] - normals[first]).max() < COPLANAR
                off = np.abs(corners[triangles[other]] @ normals[first] - offset).max()
                if face[other] < 0 and flat and off < COPLANAR * size:
                    face[other] = faces
                    waiting.append(other)
        faces += 1
    return face


def _sides(triangles: Int64, face_of: Int64) -> dict[tuple[int, int], list[int]]:
    """Return the edges between faces: their two corners, and the two faces."""
    sides: dict[tuple[int, int], list[int]] = {}
    for triangle, face in zip(triangles.tolist(), face_of.tolist(), strict=True):
        for a, b in ((0, 1), (1, 2), (2, 0)):
            ends = triangle[a], triangle[b]
            sides.setdefault((min(ends), max(ends)), []).append(face)
    return {ends: both for ends, both in sides.items() if both[0] != both[1]}


def _assembled(
    centre: Float64, corners: Float64, planes: Float64, sides: dict[tuple[int, int], list[int]]
) -> Hull:
    of_face: list[list[Float64]] = [[] for _ in planes]
    of_corner: list[list[Float64]] = [[] for _ in corners]
    inner = [
        corners[[c for ends, both in sides.items() if f in both for c in ends]].mean(axis=0)
        for f in range(len(planes))
    ]
    edges = []
    for (first, second), both in sides.items():
        a, b = corners[first], corners[second]
        along = (b - a) / np.linalg.norm(b - a)
        of_edge = [_half_space(-along, a), _half_space(along, b)]
        for face in both:
            out = np.cross(along, planes[face])
            out *= -np.sign(out @ (inner[face] - a)) / np.linalg.norm(out)
            of_face[face].append(_half_space(out, a))
            of_edge.append(_half_space(-out, a))
        of_corner[first].append(_half_space(along, a))
        of_corner[second].append(_half_space(-along, b))
        length = float(np.linalg.norm(b - a))
        edges.append(Feature(a, along, length, (first, second), np.array(of_edge)))
    # The farthest corner, so that no rounding leaves a part of the solid before its own face.
    faces = [
        Feature(corners[np.argmax(corners @ n)], n, 0.0, (-1, -1), np.array(bounds))
        for n, bounds in zip(planes, of_face, strict=True)
    ]
    points = [
        Feature(corner, np.zeros(3), 0.0, (-1, -1), np.array(bounds).reshape(-1, 4))
        for corner, bounds in zip(corners, of_corner, strict=True)
    ]
    return Hull(centre, faces, edges, points)


def _half_space(normal: Float64, point: Float64) -> Float64:
    """Return the half-space behind a plane through a point, as a row of `Feature.bounds`."""
    return np.append(normal, normal @ point)
