"""A transparent pipe."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final

import numpy as np
from pydantic import BaseModel, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from roller_env.arrays import Float64
from roller_env.pieces.fields import (
    MIN_LENGTH_M,
    Degrees,
    MaterialName,
    Number,
    OptionalName,
    Part,
    Point,
    PositiveLength,
)
from roller_env.pieces.look import LIGHT, Paint, Run, Shape, part
from roller_env.pieces.piece import Count, Piece, Solid, Vector
from roller_env.pieces.placing import Frame
from roller_env.pieces.surfaces import Surface, full_turn, lathe
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings


RING_SPACING_M: Final = quants(96.0)
"""Distance between the bands that run along a tube."""

RING_SPEED_M_S: Final = quants(16.0)
"""`btube` scrolls its texture by 16 units a second."""

_COLLAR: Final = Paint("collar/", "#e9eef3", specular=0.7, shininess=0.7)


class Opening(Part):
    """A slot along the whole length of a tube."""

    toward_deg: Degrees = Field(
        description="Where its middle looks. For an upright tube the compass angle from +x to +y: "
        "0 is forward, 90 left, 180 back. For a lying one the angle from straight up."
    )
    width_deg: Annotated[Number, Field(gt=0.0, lt=360.0)] = Field(
        description="Panels whose middle lies within half of it are left out, so that it is as "
        "wide as whole panels."
    )


class Tube(Piece):
    """A transparent pipe of flat panels that the ball rolls or rises inside."""

    is_pipe: ClassVar[bool] = True

    start: Point = Field(description="Middle of one end of the pipe.")
    end: Point = Field(description="Middle of the other end.")
    inner_radius: PositiveLength = Field(description="From its axis to the middle of a panel.")
    thickness: PositiveLength = Field(quants(4.0), description="Of its wall, outwards.")
    sides: Annotated[int, Field(strict=True, ge=3, le=64)] = Field(
        16, description="How many flat panels it is made of."
    )
    opening: Opening | None = Field(None, description="A slot along its whole length.")
    material: MaterialName = "glass"
    name: OptionalName = None

    @model_validator(mode="after")
    def _has_length(self) -> Tube:
        if math.dist(self.start, self.end) < MIN_LENGTH_M:
            raise PydanticCustomError("tube_without_length", "start and end must differ")
        return self

    @classmethod
    def placed(cls, fields: Mapping[str, Any], frame: Frame) -> dict[str, Any]:
        """Return its fields in a frame: the opening of an upright one is turned as well."""
        found = super().placed(fields, frame)
        with suppress(ValidationError):  # which is told when the tube is read
            slot = _Slot.model_validate(fields)
            if _is_upright(_along(slot.start, slot.end)):
                toward_deg = math.remainder(slot.opening.toward_deg + frame.yaw_deg, 360.0)
                found["opening"] = {**fields["opening"], "toward_deg": toward_deg}
        return found

    @property
    def frame(self) -> Float64:
        """Its axes, (3, 3), columns: angle zero, angle 90 degrees, along the pipe.

        Angles count from +x towards +y for an upright tube, from straight up for a lying one.
        """
        axis = _along(self.start, self.end)
        upright = _is_upright(axis)
        reference = np.array([1.0, 0.0, 0.0]) if upright else np.array([0.0, 0.0, 1.0])
        zero = reference - axis * (axis @ reference)
        zero /= np.linalg.norm(zero)
        quarter = np.cross(axis, zero)
        if upright and axis[2] < 0.0:
            quarter = -quarter
        return np.stack([zero, quarter, axis], axis=1)

    def count(self) -> Count:
        """Return the number of its panels, with those that its opening leaves out."""
        return Count(self.sides)

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that there is nothing of it."""
        if not any(self.solids("")):
            message = "the opening leaves no panel of the tube; wanted a smaller one"
            yield Problem((*path, "opening"), message)

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield the panels that the opening leaves."""
        frame = self.frame
        middle = (np.array(self.start) + np.array(self.end)) / 2
        half_length = math.dist(self.start, self.end) / 2
        step = 2.0 * math.pi / self.sides
        outer = self.inner_radius + self.thickness
        half_width = outer * math.tan(step / 2)
        for side in range(self.sides):
            angle = side * step
            if self.opening is not None:
                away = (math.degrees(angle) - self.opening.toward_deg + 180.0) % 360.0 - 180.0
                if abs(away) < self.opening.width_deg / 2:
                    continue
            out = frame[:, 0] * math.cos(angle) + frame[:, 1] * math.sin(angle)
            along = np.cross(frame[:, 2], out)
            centre = middle + out * (self.inner_radius + self.thickness / 2)
            rotation = np.stack([out, along, frame[:, 2]], axis=1)
            yield Solid(
                (float(centre[0]), float(centre[1]), float(centre[2])),
                (self.thickness / 2, half_width, half_length),
                tuple((float(r[0]), float(r[1]), float(r[2])) for r in rotation),
                self.material,
                source,
            )

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield its wall, and of a closed tube the collars and bands of light that run along it."""
        start, length = np.array(self.start), math.dist(self.start, self.end)
        frame = self.frame
        frame[:, 1] = np.cross(frame[:, 2], frame[:, 0])
        wall = self._wall(frame, length).moved(frame, start)
        yield Shape(part("tube", number), wall, self.material)
        rings = int(length / RING_SPACING_M)
        if self.opening is not None or not rings:
            return
        outer = (self.inner_radius + self.thickness) / math.cos(math.pi / self.sides)
        band, collar, height = outer + quants(0.5), outer + quants(3.0), quants(5.0)
        turn = full_turn(4 * self.sides)
        ends = [(collar, 0.0), (collar, height), (self.inner_radius, height)]
        ends += [(self.inner_radius, 0.0), (collar, 0.0)]
        # Their rims stand out of the floors that the tube ends in, just enough to be seen.
        proud = quants(0.4)
        for end, base in enumerate((-proud, length - height + proud)):
            rim = lathe([(radius, base + z) for radius, z in ends], turn).moved(frame, start)
            yield Shape(part("collar", number, end), rim, (_COLLAR,))
        surface = lathe([(band, -height), (band, height)], turn)
        x, y, z = np.subtract(self.end, self.start).tolist()
        rotation = tuple((float(a), float(b), float(c)) for a, b, c in frame)
        for ring in range(rings):
            yield Shape(
                part("ring", number, ring),
                surface,
                (LIGHT,),
                at=self.start,
                rotation=rotation,
                motion=Run((x, y, z), RING_SPEED_M_S, ring * (length / rings)),
            )

    def _wall(self, frame: Float64, length: float) -> Surface:
        """Return its wall, from its start upwards, rounded where the physics has flat panels."""
        half_angle = math.pi / self.sides
        stretch = 1.0 / math.cos(half_angle)
        inner, outer = self.inner_radius * stretch, (self.inner_radius + self.thickness) * stretch
        profile = [(outer, 0.0), (outer, length), (inner, length), (inner, 0.0), (outer, 0.0)]
        arcs = []
        for panel in self.solids(""):
            out = np.array(panel.rotation)[:, 0]
            angle = math.atan2(out @ frame[:, 1], out @ frame[:, 0])
            arcs.append(lathe(profile, np.array([angle - half_angle, angle + half_angle])))
        return Surface.joined(arcs)


class _Slot(BaseModel):
    """What of a tube's fields says whether its opening is turned with it, in any unit."""

    start: tuple[Number, Number, Number]
    end: tuple[Number, Number, Number]
    opening: Opening


def _along(start: Vector, end: Vector) -> Float64:
    """Return the unit vector from one end to the other."""
    axis: Float64 = np.subtract(end, start)
    axis /= np.linalg.norm(axis)
    return axis


def _is_upright(axis: Float64) -> bool:
    """Say whether a tube is so steep that its angles count from +x, not from straight up."""
    return bool(abs(axis[2]) > 0.999)
