"""A pressure plate."""

from __future__ import annotations

from typing import Final

from pydantic import Field

from roller_env.pieces.fields import Length, Name, Point, PositiveLength, Size
from roller_env.pieces.piece import UNTURNED, Mover, Piece, Region, Solid, half_of
from roller_env.units import quants

PLATE_HIT_HEIGHT_M: Final = quants(25.0)
"""A plate counts a hit only while the ball's centre is higher than this over its ``at``: the
original's guard against hits from the side."""


class Plate(Piece):
    """A pressure plate: struck from above it sinks, and once down it opens its gates.

    It counts as struck when the ball touches it while the ball's centre is more than 25 quants
    above ``at``; with the original's ball of 16 quants, build it thicker than 18 quants.
    """

    name: Name
    at: Point = Field(description="Centre of the plate before it sinks.")
    size: Size
    opens: tuple[str, ...] = Field(description="Names of the gates it opens.")
    sinks_to: Length = Field(quants(67.0), description="Height of its centre when it is down.")
    speed: PositiveLength = Field(quants(1.6), description="Length per second, downwards.")

    def mover(self, source: str) -> Mover:
        """Return the plate."""
        solid = Solid(self.at, half_of(self.size), UNTURNED, "", source)
        return Mover(self.name, solid, self.sinks_to, self.speed)

    def region(self, touch: float) -> Region:
        """Return where the ball touches it from above."""
        return Region(self.at, half_of(self.size), touch, PLATE_HIT_HEIGHT_M)
