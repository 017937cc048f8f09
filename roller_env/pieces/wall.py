"""An upright slab."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.pieces.fields import (
    MIN_LENGTH_M,
    Height,
    MaterialName,
    OptionalName,
    PlanePoint,
    PositiveLength,
)
from roller_env.pieces.piece import UNTURNED, Piece, Solid, rotation_matrix
from roller_env.units import quants


class Wall(Piece):
    """An upright slab over the line from ``start`` to ``end``."""

    start: PlanePoint = Field(description="`[x, y]` of one end of its middle line.")
    end: PlanePoint = Field(description="`[x, y]` of the other end.")
    bottom: Height = Field(description="Height of its lower edge.")
    height: PositiveLength = Field(description="Upwards from there.")
    thickness: PositiveLength = Field(
        quants(8.0), description="Half of it to either side of the line."
    )
    material: MaterialName = "default"
    name: OptionalName = None

    @model_validator(mode="after")
    def _has_length(self) -> Wall:
        if math.dist(self.start, self.end) < MIN_LENGTH_M:
            raise PydanticCustomError("wall_without_length", "start and end must differ")
        return self

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield the slab."""
        (x0, y0), (x1, y1) = self.start, self.end
        dx, dy = x1 - x0, y1 - y0
        half_length, z = math.hypot(dx, dy) / 2, self.bottom + self.height / 2
        centre = ((x0 + x1) / 2, (y0 + y1) / 2, z)
        half, rotation = (half_length, self.thickness / 2, self.height / 2), UNTURNED
        if dx == 0.0:
            half = (half[1], half[0], half[2])
        elif dy != 0.0:
            rotation = rotation_matrix(math.degrees(math.atan2(dy, dx)))
        yield Solid(centre, half, rotation, self.material, source)
