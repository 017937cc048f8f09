"""Curved floors: half-pipe, bowl and spiral ramp, of flat faces that meet in shared edges.

Behind each face is a convex solid, and neighbours share their corners to the last bit, so that a
ball finds no gap and no step between them. What it does find is the angle between two faces. A ball
that rolls into a face which rises by d keeps (5 cos(d) + 2) / 7 of its speed when the impact is
plastic: what points into the face is lost, and friction makes rolling again of what is left.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Final

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.arrays import Float64
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.fields import (
    MIN_LENGTH_M,
    Length,
    MaterialName,
    Number,
    OptionalName,
    Point,
    PositiveLength,
    Yaw,
)
from roller_env.pieces.piece import Count, Piece, Solid
from roller_env.units import quants

_SECTORS: Final = 6
"""Faces of a bowl's lowest ring; each further ring has two in each sector more, so that all faces
are about as large: six nearly equilateral triangles meet at a corner."""

_SHORTEST_M: Final = 2.0 * MIN_LENGTH_M
"""No face may have a shorter edge: so none is thinner than a solid may be."""

_STEEPEST_DEG: Final = 60.0


class HalfPipe(Piece):
    """A trough round a straight axis, open at the top: the ball swings from side to side in it."""

    start: Point = Field(description="Lowest point of its surface at one end.")
    end: Point = Field(description="That at the other end.")
    radius: PositiveLength = Field(description="From its axis to the edges between its faces.")
    arc_deg: Annotated[Number, Field(ge=10.0, le=300.0)] = Field(
        180.0, description="From rim to rim, as seen from the axis."
    )
    segments: Annotated[int, Field(strict=True, ge=2, le=180)] = Field(
        36, description="How many faces there are from rim to rim."
    )
    thickness: PositiveLength = Field(quants(8.0), description="Outwards from the surface.")
    material: MaterialName = "default"
    name: OptionalName = None

    @model_validator(mode="after")
    def _lies(self) -> HalfPipe:
        if math.dist(self.start[:2], self.end[:2]) < MIN_LENGTH_M:
            raise PydanticCustomError(
                "upright_half_pipe", "start and end must differ in x or y; use a tube"
            )
        bend = math.radians(self.arc_deg) / self.segments
        _check_edge(2.0 * self.radius * math.sin(bend / 2.0))
        return self

    def count(self) -> Count:
        """Return the number of its faces."""
        return Count(self.segments)

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield what is behind each face."""
        ends = np.array([self.start, self.end])
        along = ends[1] - ends[0]
        along /= np.linalg.norm(along)
        up = np.array([0.0, 0.0, 1.0]) - along * along[2]
        up /= np.linalg.norm(up)
        left = np.cross(up, along)
        half = math.radians(self.arc_deg) / 2
        angles = np.linspace(-half, half, self.segments + 1)
        outwards = np.outer(np.sin(angles), left) - np.outer(np.cos(angles), up)
        # (end, layer, angle, xyz)
        radii = np.array([self.radius, self.radius + self.thickness])
        axis = ends + self.radius * up
        corners = axis[:, None, None] + radii[:, None, None] * outwards
        for face in range(self.segments):
            yield _solid(corners[:, :, face : face + 2], self.material, source)


class Bowl(Piece):
    """A piece of a hollow sphere, open at the top, in faces of three corners."""

    at: Point = Field(description="Its lowest point.")
    radius: PositiveLength = Field(description="From the sphere's middle to the faces' corners.")
    arc_deg: Annotated[Number, Field(ge=10.0, le=180.0)] = Field(
        120.0, description="From rim to rim, as seen from the sphere's middle."
    )
    rings: Annotated[int, Field(strict=True, ge=1, le=9)] = Field(
        8, description="How many rings of faces there are from the bottom to the rim."
    )
    thickness: PositiveLength = Field(quants(8.0), description="Outwards from the surface.")
    material: MaterialName = "default"
    name: OptionalName = None

    @model_validator(mode="after")
    def _has_room_for_its_faces(self) -> Bowl:
        _check_edge(self.radius * math.radians(self.arc_deg) / 2.0 / self.rings)
        return self

    def count(self) -> Count:
        """Return the number of its faces."""
        return Count(_SECTORS * self.rings**2)

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield what is behind each face, from the bottom upwards."""
        radii = np.array([self.radius, self.radius + self.thickness])
        middle = np.array(self.at) + np.array([0.0, 0.0, self.radius])
        inner = np.array([[0.0, 0.0, -1.0]])
        for ring in range(1, self.rings + 1):
            outer = self._outwards(ring)
            for face in _strip(inner, outer, ring):
                yield _solid(middle + radii[:, None, None] * face, self.material, source)
            inner = outer

    def _outwards(self, ring: int) -> Float64:
        """Return the directions of the corners on the upper edge of a ring, (6 ring, 3)."""
        polar = math.radians(self.arc_deg) / 2 * ring / self.rings
        turn = np.arange(_SECTORS * ring) * (2.0 * math.pi / (_SECTORS * ring))
        flat = math.sin(polar) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return np.column_stack([flat, np.full(len(turn), -math.cos(polar))])


class Spiral(Piece):
    """A ramp that winds round an upright axis, in faces of three corners."""

    centre: Point = Field(description="On the axis, as high as the ramp begins.")
    radius: PositiveLength = Field(description="From the axis to the middle of the ramp.")
    width: PositiveLength = Field(description="Of the ramp; less than twice the radius.")
    rise: Length = Field(description="How much higher than its beginning it ends.")
    from_deg: Yaw = Field(0.0, description="Where it begins: 0 is at +x of the axis, 90 at +y.")
    turn_deg: Annotated[Number, Field(ge=-3_600.0, le=3_600.0)] = Field(
        360.0, description="How far it winds; positive to the left (+x towards +y)."
    )
    bank_deg: Annotated[Number, Field(ge=0.0, le=60.0)] = Field(
        0.0, description="By how much it leans inwards, so that the ball stays on it."
    )
    segments: Annotated[int, Field(strict=True, ge=6, le=180)] = Field(
        72, description="How many pairs of faces a whole turn has."
    )
    thickness: PositiveLength = Field(quants(8.0), description="Downwards from the surface.")
    material: MaterialName = "default"
    name: OptionalName = None

    @model_validator(mode="after")
    def _can_be_rolled_on(self) -> Spiral:
        if self.turn_deg == 0.0:
            raise PydanticCustomError("spiral_without_turn", "turn_deg must not be 0; use a ramp")
        inner, turn = self.radius - self.width / 2, math.radians(abs(self.turn_deg))
        if inner < MIN_LENGTH_M:
            raise PydanticCustomError(
                "spiral_too_wide", "the width must be less than twice the radius"
            )
        slope = math.degrees(math.atan2(abs(self.rise), turn * inner))
        if slope > _STEEPEST_DEG:
            raise PydanticCustomError(
                "spiral_too_steep",
                "its inner edge rises by {found} degrees; wanted at most {most}: turn it farther, "
                "or make the radius larger",
                {"found": f"{slope:.3g}", "most": f"{_STEEPEST_DEG:g}"},
            )
        _check_edge(turn * inner / self._pairs)
        upright = math.cos(math.radians(slope)) * math.cos(math.radians(self.bank_deg))
        if self.thickness * upright < MIN_LENGTH_M:
            raise PydanticCustomError(
                "spiral_too_thin",
                "where it is so steep it must be thicker than {least} mm",
                {"least": f"{1000.0 * MIN_LENGTH_M / upright:.2g}"},
            )
        return self

    @property
    def _pairs(self) -> int:
        return max(1, math.ceil(self.segments * abs(self.turn_deg) / 360.0 - 1e-9))

    def count(self) -> Count:
        """Return the number of its faces."""
        return Count(2 * self._pairs)

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield what is under each face, from the beginning on."""
        fraction = np.linspace(0.0, 1.0, self._pairs + 1)
        angle = np.radians(self.from_deg + self.turn_deg * fraction)
        out = np.array([-self.width / 2, self.width / 2])
        radii, bank = self.radius + out, out * math.tan(math.radians(self.bank_deg))
        # (edge, along, layer, xyz), the inner edge first
        corners = np.empty((2, len(angle), 2, 3))
        corners[..., 0] = (radii[:, None] * np.cos(angle))[..., None]
        corners[..., 1] = (radii[:, None] * np.sin(angle))[..., None]
        corners[..., 2] = (self.rise * fraction + bank[:, None])[..., None]
        corners[:, :, 1, 2] -= self.thickness
        corners += self.centre
        for pair in range(self._pairs):
            inner, outer = corners[0, pair : pair + 2], corners[1, pair : pair + 2]
            for face in ([inner[0], outer[0], outer[1]], [inner[0], outer[1], inner[1]]):
                yield _solid(np.array(face), self.material, source)


def _check_edge(length: float) -> None:
    """Refuse faces with an edge of so little length, metres."""
    if length < _SHORTEST_M:
        raise PydanticCustomError(
            "curve_too_fine",
            "its faces would be only {found} mm long; wanted fewer or larger ones",
            {"found": f"{1000.0 * length:.2g}"},
        )


def _strip(inner: Float64, outer: Float64, ring: int) -> Iterator[Float64]:
    """Yield the triangles, (3, 3), between the edges of a ring of a bowl.

    Args:
        inner: its lower corners, (6 (ring - 1), 3), or the one at the bottom.
        outer: its upper corners, (6 ring, 3).
        ring: its number, from 1.
    """
    for sector in range(_SECTORS):
        low, high = sector * (ring - 1), sector * ring
        for step in range(ring):
            near, far = low + step, high + step
            yield np.stack([inner[near % len(inner)], outer[far], outer[(far + 1) % len(outer)]])
            if step < ring - 1:
                following = inner[(near + 1) % len(inner)]
                yield np.stack([inner[near], outer[(far + 1) % len(outer)], following])


def _solid(corners: Float64, material: str, source: str) -> ConvexSolid:
    """Return the hull of corners, (..., 3) metres."""
    points = [(x, y, z) for x, y, z in corners.reshape(-1, 3).tolist()]
    return ConvexSolid.of(points, material, source)
