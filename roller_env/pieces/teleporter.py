"""A place that takes the ball to another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, ClassVar, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Float64
from roller_env.pieces.fields import OptionalName, Point, Size
from roller_env.pieces.look import Paint, Shape, part
from roller_env.pieces.piece import TOUCHING_M, ExpandedLevel, Piece, Region, Vector, half_of
from roller_env.pieces.rules import (
    After,
    Own,
    Rules,
    Seen,
    fraction_entry,
    no_state,
    padded,
    place_entry,
    show_nearest,
    show_place,
)
from roller_env.pieces.space import inside
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

_PORTAL: Final = (Paint("portal/", "#a06bff70", emission=0.7),)
_EXIT: Final = (Paint("exit/", "#d7c4ff80", emission=0.6),)


class Teleporter(Piece):
    """A box without substance: whose centre comes into it goes on elsewhere, as fast as before.

    The ball is there at the end of the control step, with the velocity and the spin that it then
    has.
    """

    is_searched: ClassVar[bool] = False

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths.")
    to: Point = Field(description="Where the **ball's centre** goes on.")
    name: OptionalName = None

    def region(self, touch: float) -> Region:
        """Return where the ball's centre is in it."""
        return Region(self.at, half_of(self.size), 0.0)

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that the ball cannot go on there, or would come back at once."""
        yield from around.too_low((*path, "to"), "the ball goes on", self.to[2])
        hit = inside(around.solids, np.array([self.to]), max(around.ball_radius - TOUCHING_M, 0.0))
        sources = dict.fromkeys(solid.source for solid, _ in hit)
        if sources:
            where = ", ".join(sources)
            message = f"the ball would go on inside {where}; wanted free space around it"
            yield Problem((*path, "to"), message)
        for other in around.pieces:
            if isinstance(other, Teleporter) and all(
                abs(here - there) <= edge / 2
                for here, there, edge in zip(self.to, other.at, other.size, strict=True)
            ):
                message = "that is in a teleporter, so the ball would not stay; wanted outside"
                yield Problem((*path, "to"), message)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield the box, a ring round it, and a disc where it leads."""
        x, y, z = half_of(self.size)
        yield Shape(part("portal", number), "box", _PORTAL, (x, y, z), self.at)
        at = (self.to[0], self.to[1], self.to[2] - quants(15.0))
        yield Shape(part("exit", number), "cylinder", _EXIT, (quants(18.0), quants(0.4), 0.0), at)

    def label(self) -> tuple[str, Vector]:
        """Return what it is."""
        return self.name or "teleporter", self.at


# Rules --------------------------------------------------------------------------------------------


class TeleporterTable(NamedTuple):
    """Numbers of T teleporters.

    Attributes:
        to: (L, T, 3) where the ball's centre goes on, metres, world frame.
    """

    to: Float64


def _table(levels: Sequence[ExpandedLevel]) -> TeleporterTable:
    rows = [[teleporter.to for teleporter in level.of(Teleporter)] for level in levels]
    return TeleporterTable(padded(rows, (3,)))


def _react(now: After, table: TeleporterTable, state: None, own: Own) -> None:
    """Put the ball where the first one entered leads."""
    first = np.inf
    for teleporter in range(own.regions):
        entry = now.entry[own.region + teleporter]
        if entry < first:
            first = entry
            for axis in range(3):
                now.place[axis] = table.to[now.level, teleporter, axis]


def _show(now: Seen, table: TeleporterTable, state: None, own: Own) -> None:
    """Write the nearest teleporter, and where it leads."""
    nearest = show_nearest(now, own)
    if nearest >= 0:
        show_place(now.out, own.entry + 4, table.to[now.level, nearest], now.ball)


TELEPORTER: Final = Rules(
    name="teleporter",
    table=_table,
    state=no_state,
    entries=(
        place_entry("teleporter", "centre of the nearest teleporter; 0 if none"),
        fraction_entry("teleporter_present", "1 where `teleporter` shows one"),
        place_entry("teleporter_exit", "where that one leads; 0 if none"),
    ),
    react=_react,
    show=_show,
)
Teleporter.rules = TELEPORTER
