"""Curved floors: half-pipe, bowl and spiral ramp, of flat faces that meet in shared edges.

Behind each face is a convex solid, and neighbours share their corners to the last bit, so that a
ball finds no gap and no step between them. What it does find is the angle between two faces. A ball
that rolls into a face which rises by d keeps (5 cos(d) + 2) / 7 of its speed when the impact is
plastic: what points into the face is lost, and friction makes rolling again of what is left.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated

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

Segments = Annotated[int, Field(strict=True, ge=2, le=180)]


class HalfPipe(Piece):
    """A trough round a straight axis, open at the top: the ball swings from side to side in it."""

    start: Point = Field(description="Lowest point of its surface at one end.")
    end: Point = Field(description="That at the other end.")
    radius: PositiveLength = Field(description="From its axis to the edges between its faces.")
    arc_deg: Annotated[Number, Field(ge=10.0, le=300.0)] = Field(
        180.0, description="From rim to rim, as seen from the axis."
    )
    segments: Segments = Field(36, description="How many faces there are from rim to rim.")
    thickness: PositiveLength = Field(quants(8.0), description="Outwards from the surface.")
    material: MaterialName = "default"
    name: OptionalName = None

    @model_validator(mode="after")
    def _lies(self) -> HalfPipe:
        if math.dist(self.start[:2], self.end[:2]) < MIN_LENGTH_M:
            raise PydanticCustomError(
                "upright_half_pipe", "start and end must differ in x or y; use a tube"
            )
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
    """A piece of a hollow sphere, open at the top."""

    at: Point = Field(description="Lowest point of the sphere.")
    radius: PositiveLength = Field(description="From the sphere's middle to the faces' corners.")
    arc_deg: Annotated[Number, Field(ge=10.0, le=180.0)] = Field(
        120.0, description="From rim to rim, as seen from the sphere's middle."
    )
    segments: Annotated[int, Field(strict=True, ge=3, le=61)] = Field(
        17, description="How many faces there are from rim to rim; an even number has one less."
    )
    thickness: PositiveLength = Field(quants(8.0), description="Outwards from the surface.")
    material: MaterialName = "default"
    name: OptionalName = None

    @property
    def _rings(self) -> int:
        """How many rings of faces lie round the level one at the bottom."""
        return (self.segments - 1) // 2

    @property
    def _step(self) -> float:
        """Angle of a face from ring to ring, radians; the face at the bottom is as wide."""
        return math.radians(self.arc_deg) / 2 / (self._rings + 0.5)

    @property
    def _around(self) -> int:
        """How many faces make a ring: so many that those at the rim are about square."""
        rim = math.sin(math.radians(self.arc_deg) / 2)
        return max(6, math.ceil(2.0 * math.pi * rim / self._step))

    def count(self) -> Count:
        """Return the number of its faces."""
        return Count(1 + self._rings * self._around)

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield what is behind each face, from the bottom upwards."""
        polar = (np.arange(self._rings + 1) + 0.5) * self._step
        turn = np.arange(self._around) * (2.0 * math.pi / self._around)
        flat = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
        down = np.array([0.0, 0.0, -1.0])
        outwards = np.sin(polar)[:, None, None] * flat + np.cos(polar)[:, None, None] * down
        radii = np.array([self.radius, self.radius + self.thickness])
        middle = np.array(self.at) - self.radius * down
        # (ring, turn, layer, xyz)
        corners = middle + radii[:, None] * outwards[:, :, None]
        yield _solid(corners[0], self.material, source)
        for ring in range(self._rings):
            for face in range(self._around):
                turns = [face, (face + 1) % self._around]
                yield _solid(corners[ring : ring + 2, turns], self.material, source)


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
    segments: Segments = Field(72, description="How many pairs of faces a whole turn has.")
    thickness: PositiveLength = Field(quants(8.0), description="Downwards from the surface.")
    material: MaterialName = "default"
    name: OptionalName = None

    @model_validator(mode="after")
    def _leaves_the_axis_free(self) -> Spiral:
        if self.radius - self.width / 2 < MIN_LENGTH_M:
            raise PydanticCustomError(
                "spiral_too_wide", "the width must be less than twice the radius"
            )
        if self.turn_deg == 0.0:
            raise PydanticCustomError("spiral_without_turn", "turn_deg must not be 0; use a ramp")
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


def _solid(corners: Float64, material: str, source: str) -> ConvexSolid:
    """Return the hull of corners, (..., 3) metres."""
    return ConvexSolid.of(
        [(x, y, z) for x, y, z in corners.reshape(-1, 3).tolist()], material, source
    )
