"""The end of a level."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Int64
from roller_env.pieces.fields import Point, Size
from roller_env.pieces.look import Fly, Paint, Shape, part
from roller_env.pieces.piece import UNTURNED, ExpandedLevel, Piece, Region, Solid, Vector, half_of
from roller_env.pieces.rules import Noticed, Own, Rules, Seen, no_state, place_entry, show_place
from roller_env.pieces.space import burying
from roller_env.pieces.surfaces import box_surfaces
from roller_env.problems import FieldPath, Problem
from roller_env.units import frames, quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

FRAME_S: Final = frames(1.0)
SPARK_COLOUR: Final = "#01ff64"
"""`fire1`: red, green and blue of the particles that fly out of the finish, one every frame."""
SPARK_SPEED_M_S: Final = quants(5.0 * 16.0)
"""`fire1`: up to 5 quants a tick of 1/16 s along each axis."""
SPARK_WIDTH_M: Final = quants(20.0)
"""`fire1`: the size of a particle when it is born."""
SPARK_FADING_PER_S: Final = 160.0
SPARK_LIFE_S: Final = 100.0 / SPARK_FADING_PER_S
"""`smoke_property`: alpha falls from 100 by 160 a second, and the size from 20 quants by 32: both
are nought at the same time."""
SPARKS: Final = 38
"""Particles alive at once: one a frame of 1/60 s, 0.625 s long."""

_BEAM: Final = (Paint("beam/", "#4fe39a", emission=0.35),)
_CHEQUERS: Final = (Paint("chequers/", emission=0.3, texture="chequers"),)
_SPARK: Final = (Paint("spark/", SPARK_COLOUR, emission=1.0),)


class Finish(Piece):
    """The end of the level: a box without substance. Who touches it has won."""

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths.")
    needs_coins: Annotated[int, Field(ge=0, strict=True)] = Field(
        0, description="How many coins have to be collected before it is open."
    )

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that it is too low, wholly hidden, or never open."""
        coins = sum(piece.count().coins for piece in around.pieces)
        if self.needs_coins > coins:
            found = f"found {self.needs_coins}, and the level has {coins} coins"
            yield Problem((*path, "needs_coins"), f"{found}; wanted at most as many")
        yield from around.too_low((*path, "at"), "the finish is", self.at[2])
        hiding = burying(around.solids, self.at, self.size, around.ball_radius)
        if hiding:
            where = ", ".join(hiding)
            message = f"the finish is wholly inside {where}, where no ball can reach it"
            yield Problem((*path, "at"), message)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield an arch over its longer side, with a chequered beam, and sparks."""
        x, y, z = half_of(self.size)
        post = quants(4.0)
        span = np.array([0.0, 1.0, 0.0]) if y >= x else np.array([1.0, 0.0, 0.0])
        width = max(x, y)
        base = np.array(self.at) - [0.0, 0.0, z]
        top = max(2.0 * z, quants(72.0))
        for side, sign in enumerate((-1.0, 1.0)):
            place = base + sign * width * span + [0.0, 0.0, top / 2]
            at = (float(place[0]), float(place[1]), float(place[2]))
            yield Shape(part("pillar", side), "box", _BEAM, (post, post, top / 2), at)
        half = (width + 2 * post) * span + quants(5.0) * (1.0 - span)
        size = (float(half[0]), float(half[1]), quants(10.0))
        middle = (self.at[0], self.at[1], float(base[2]) + top)
        beam, _ = box_surfaces(Solid(middle, size, UNTURNED, "", ""))
        yield Shape(part("beam"), beam, _CHEQUERS)
        for spark in range(SPARKS):
            fly = Fly(spark, FRAME_S, SPARK_SPEED_M_S, SPARK_WIDTH_M, SPARK_LIFE_S)
            size = (quants(1.0), 0.0, 0.0)
            yield Shape(part("spark", spark), "sphere", _SPARK, size, self.at, motion=fly)

    def label(self) -> tuple[str, Vector]:
        """Return what it is."""
        return "finish", self.at


# Rules: that it ends the game is said in `roller_env.game.step` -----------------------------------


class FinishTable(NamedTuple):
    """Numbers of the finish.

    Attributes:
        coins: (L,) how many have to be collected before it is open.
    """

    coins: Int64


def _table(levels: Sequence[ExpandedLevel]) -> FinishTable:
    return FinishTable(
        np.array([level.of(Finish)[0].needs_coins for level in levels], dtype=np.int64)
    )


def _notice(now: Noticed, table: FinishTable, state: None, own: Own) -> None:
    for region in range(own.region, own.region + own.regions):
        now.live[region] &= now.coins >= table.coins[now.level]


def _show(now: Seen, table: FinishTable, state: None, own: Own) -> None:
    show_place(now.out, own.entry, now.centre[own.region], now.ball)


FINISH: Final = Rules(
    name="finish",
    table=_table,
    state=no_state,
    is_basic=True,
    entries=(place_entry("finish", "centre of the finish"),),
    notice=_notice,
    show=_show,
)
Finish.rules = FINISH
