"""A post that throws the ball back."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import ClassVar, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Float64
from roller_env.pieces.fields import OptionalName, Point, PositiveLength, Size
from roller_env.pieces.look import Paint, Shape, part
from roller_env.pieces.piece import (
    UNTURNED,
    ExpandedLevel,
    Piece,
    Region,
    Solid,
    Vector,
    half_of,
)
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
)
from roller_env.units import quants

_BAND: Final = (Paint("bumper/", "#ff3f8e", emission=0.6),)


class Bumper(Piece):
    """A solid box that throws the ball away from its middle, each time that the ball touches it.

    In the plane, away from the upright line through the bumper's middle, the ball is then at least
    as fast as ``speed`` says; its other motion does not change. It happens at the end of the
    control step.
    """

    is_searched: ClassVar[bool] = False

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths.")
    speed: PositiveLength = Field(quants(160.0), description="Length per second, at least.")
    name: OptionalName = None

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield itself."""
        yield Solid(self.at, half_of(self.size), UNTURNED, "", source)

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield a glowing band round it."""
        x, y, z = half_of(self.size)
        proud = quants(0.5)
        size = (x + proud, y + proud, 0.25 * z)
        yield Shape(part("bumper", number), "box", _BAND, size, self.at)

    def label(self) -> tuple[str, Vector]:
        """Return what it is."""
        return self.name or "bumper", self.at


# Rules --------------------------------------------------------------------------------------------


class BumperTable(NamedTuple):
    """Numbers of B bumpers.

    Attributes:
        speed: (L, B) m/s.
        at: (L, B, 2) their middles, metres.
    """

    speed: Float64
    at: Float64


def _table(levels: Sequence[ExpandedLevel]) -> BumperTable:
    rows = [level.of(Bumper) for level in levels]
    return BumperTable(
        speed=padded([[bumper.speed for bumper in row] for row in rows]),
        at=padded([[bumper.at[:2] for bumper in row] for row in rows], (2,)),
    )


def _react(now: After, table: BumperTable, state: None, own: Own) -> None:
    """Throw the ball from each bumper that was touched."""
    for bumper in range(own.regions):
        if now.entry[own.region + bumper] < np.inf:
            x = now.place[0] - table.at[now.level, bumper, 0]
            y = now.place[1] - table.at[now.level, bumper, 1]
            away = math.hypot(x, y)
            if away > 0.0:
                x, y = x / away, y / away
                speed = table.speed[now.level, bumper]
                gain = max(speed - x * now.velocity[0] - y * now.velocity[1], 0.0)
                now.velocity[0] += gain * x
                now.velocity[1] += gain * y


def _show(now: Seen, table: BumperTable, state: None, own: Own) -> None:
    show_nearest(now, own)


BUMPER: Final = Rules(
    name="bumper",
    table=_table,
    state=no_state,
    entries=(
        place_entry("bumper", "centre of the nearest bumper; 0 if none"),
        fraction_entry("bumper_present", "1 where `bumper` shows one"),
    ),
    react=_react,
    show=_show,
)
Bumper.rules = BUMPER
