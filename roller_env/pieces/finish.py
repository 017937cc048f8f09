"""The end of a level."""

from __future__ import annotations

from roller_env.pieces.fields import Point, Size
from roller_env.pieces.piece import Piece, Region, half_of


class Finish(Piece):
    """The end of the level: a box without substance."""

    at: Point
    size: Size

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)
