"""Convex solids: the hull of any points, and the wedge."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.pieces.convex import ConvexSolid, sides_of
from roller_env.pieces.fields import MaterialName, OptionalName, Point, Size, Yaw
from roller_env.pieces.piece import Piece, Solid, half_of, rotation_matrix


class Hull(Piece):
    """The convex hull of points: the smallest solid without dents that holds all of them."""

    points: Annotated[tuple[Point, ...], Field(min_length=4, max_length=64)] = Field(
        description="What it is the hull of, in any order; no plane may hold all of them."
    )
    material: MaterialName = "default"
    name: OptionalName = None

    @model_validator(mode="after")
    def _has_volume(self) -> Hull:
        try:
            sides_of(self.points)
        except ValueError as error:
            raise PydanticCustomError(
                "hull_without_volume",
                "{found}; wanted at least 4 that span a volume, half a millimetre thick or more",
                {"found": str(error)},
            ) from error
        return self

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield itself."""
        yield ConvexSolid.of(self.points, self.material, source)


class Wedge(Piece):
    """The lower half of a box, cut along the diagonal: its upper face rises from -x to +x.

    It is turned about the box's centre.
    """

    at: Point = Field(description="Centre of the box.")
    size: Size = Field(description="Full edge lengths of the box along its own x, y and z.")
    yaw_deg: Yaw = Field(
        0.0, description="Positive turns it to the left; 90 makes it rise towards +y."
    )
    material: MaterialName = "default"
    name: OptionalName = None

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield itself."""
        lower = [(-1, -1, -1), (-1, 1, -1), (1, -1, -1), (1, 1, -1), (1, -1, 1), (1, 1, 1)]
        own = np.array(lower) * half_of(self.size)
        points = own @ np.array(rotation_matrix(self.yaw_deg)).T + self.at
        yield ConvexSolid.of([(x, y, z) for x, y, z in points.tolist()], self.material, source)
