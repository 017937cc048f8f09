"""The end of a level."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from roller_env.pieces.fields import Point, Size
from roller_env.pieces.piece import Piece, Region, half_of
from roller_env.pieces.space import burying
from roller_env.problems import FieldPath, Problem

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings


class Finish(Piece):
    """The end of the level: a box without substance."""

    at: Point
    size: Size

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that it is too low, or wholly hidden."""
        yield from around.too_low((*path, "at"), "the finish is", self.at[2])
        hiding = burying(around.solids, self.at, self.size, around.ball_radius)
        if hiding:
            where = ", ".join(hiding)
            message = f"the finish is wholly inside {where}, where no ball can reach it"
            yield Problem((*path, "at"), message)
