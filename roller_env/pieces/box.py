"""A solid box."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from roller_env.pieces.fields import Degrees, MaterialName, OptionalName, Point, Size, Yaw
from roller_env.pieces.piece import Piece, Solid, half_of, rotation_matrix


class Box(Piece):
    """A solid box. Rotated about its centre: first roll (about x), then pitch (y), then yaw (z)."""

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths along its own x, y and z.")
    yaw_deg: Yaw = Field(0.0, description="Positive turns it to the left (+x towards +y).")
    pitch_deg: Degrees = Field(
        0.0, description="Positive tips its far (+x) end down. Pitch comes first, then yaw."
    )
    roll_deg: Degrees = Field(
        0.0, description="Positive tips its left (+y) side up. Roll comes first of all."
    )
    material: MaterialName = "default"
    name: OptionalName = None

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield itself."""
        rotation = rotation_matrix(self.yaw_deg, self.pitch_deg, self.roll_deg)
        yield Solid(self.at, half_of(self.size), rotation, self.material, source)
