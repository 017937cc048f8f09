"""A gate that plates open."""

from __future__ import annotations

from pydantic import Field

from roller_env.pieces.fields import Degrees, Length, Name, Point, PositiveLength, Size
from roller_env.pieces.piece import Mover, Piece, Solid, half_of, rotation_matrix
from roller_env.units import quants


class Gate(Piece):
    """A slab that sinks out of the way when one of its plates is down."""

    name: Name
    at: Point = Field(description="Centre of the closed gate.")
    size: Size
    yaw_deg: Degrees = 0.0
    lowers_to: Length = Field(quants(-32.0), description="Height of its centre when it is open.")
    speed: PositiveLength = Field(quants(32.0), description="Length per second, downwards.")

    def mover(self, source: str) -> Mover:
        """Return the gate."""
        solid = Solid(self.at, half_of(self.size), rotation_matrix(self.yaw_deg), "", source)
        return Mover(self.name, solid, self.lowers_to, self.speed)
