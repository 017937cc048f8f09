"""A sloping slab."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.pieces.fields import MIN_LENGTH_M, MaterialName, OptionalName, Point, PositiveLength
from roller_env.pieces.piece import Piece, Solid, rotation_matrix
from roller_env.units import quants


class Ramp(Piece):
    """A sloping slab: ``start`` and ``end`` are the ends of its upper face's centre line."""

    start: Point = Field(
        description="One end of the middle line of its upper face, where the ball rolls."
    )
    end: Point = Field(description="The other end.")
    width: PositiveLength = Field(description="Across that line.")
    thickness: PositiveLength = Field(
        quants(16.0), description="At right angles to the upper face, downwards."
    )
    material: MaterialName = "default"
    name: OptionalName = None

    @model_validator(mode="after")
    def _has_run(self) -> Ramp:
        if math.dist(self.start[:2], self.end[:2]) < MIN_LENGTH_M:
            raise PydanticCustomError(
                "ramp_without_run", "start and end must differ in x or y; use a wall or a tube"
            )
        return self

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield the slab."""
        (x0, y0, z0), (x1, y1, z1) = self.start, self.end
        run = math.hypot(x1 - x0, y1 - y0)
        yaw, slope = math.atan2(y1 - y0, x1 - x0), math.atan2(z1 - z0, run)
        rotation = rotation_matrix(math.degrees(yaw), -math.degrees(slope))
        upward = [row[2] for row in rotation]
        middle = ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2)
        x, y, z = (m - u * self.thickness / 2 for m, u in zip(middle, upward, strict=True))
        half = (math.hypot(run, z1 - z0) / 2, self.width / 2, self.thickness / 2)
        yield Solid((x, y, z), half, rotation, self.material, source)
