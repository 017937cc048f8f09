"""Coins, one by one or in rows."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Final

import numpy as np
from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.pieces.fields import Degrees, Part, PlanePoint, Point, PositiveLength
from roller_env.pieces.look import Paint, Shape, Spin, part
from roller_env.pieces.piece import Count, Float64, Piece
from roller_env.pieces.surfaces import Surface, full_turn, lathe
from roller_env.units import quants

COIN_REACH_M: Final = quants(30.0)
"""A coin is collected when the ball's centre is this near to it (`collect`)."""

MAX_COINS: Final = 10_000

TURNS_PER_S: Final = 0.5
BOB_M: Final = quants(2.0)
BOBS_PER_S: Final = 0.6

_RADIUS_M: Final = quants(11.0)
_HALF_THICKNESS_M: Final = quants(2.0)
_DETAILED: Final = 500
"""More coins than this are plainer, or drawing would take seconds."""

_GOLD: Final = (Paint("gold/", "#ffc928", emission=0.28, specular=0.9, shininess=0.6),)


class CoinLine(Part):
    """Coins at equal distances on a straight line, both ends included."""

    start: Point = Field(description="The first coin.")
    end: Point = Field(description="The last one.")
    count: Annotated[int, Field(strict=True, ge=2, le=MAX_COINS)] = Field(description="How many.")


class CoinArc(Part):
    """Coins at equal angles on a level arc, both ends included."""

    centre: Point = Field(description="Of the circle.")
    radius: PositiveLength = Field(description="Of the circle.")
    from_deg: Degrees = Field(description="Angle of the first coin: 0 is +x, 90 is +y.")
    to_deg: Degrees = Field(description="Angle of the last coin.")
    count: Annotated[int, Field(strict=True, ge=2, le=MAX_COINS)] = Field(description="How many.")


class CoinGrid(Part):
    """Coins in level rows and columns round a centre."""

    centre: Point = Field(description="Of the grid.")
    spacing: PlanePoint = Field(description="Distance between neighbours along x and y.")
    count: tuple[
        Annotated[int, Field(strict=True, ge=1, le=MAX_COINS)],
        Annotated[int, Field(strict=True, ge=1, le=MAX_COINS)],
    ] = Field(description="Coins along x and along y.")

    @model_validator(mode="after")
    def _is_bounded(self) -> CoinGrid:
        if self.count[0] * self.count[1] > MAX_COINS:
            raise PydanticCustomError(
                "too_many_coins", "a grid may hold at most {limit} coins", {"limit": MAX_COINS}
            )
        return self


class Coins(Piece):
    """One coin (``at``), or a ``line``, ``arc`` or ``grid`` of them: exactly one of the four."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    at: Point | None = Field(None, description="Centre of one coin.")
    line: CoinLine | None = None
    arc: CoinArc | None = None
    grid: CoinGrid | None = None

    @model_validator(mode="after")
    def _exactly_one(self) -> Coins:
        given = [key for key in ("at", "line", "arc", "grid") if getattr(self, key) is not None]
        if len(given) != 1:
            raise PydanticCustomError(
                "coins_ambiguous",
                "give exactly one of at, line, arc, grid; found {given}",
                {"given": ", ".join(given) or "none"},
            )
        return self

    def count(self) -> Count:
        """Return how many they are."""
        if self.grid is not None:
            return Count(0, self.grid.count[0] * self.grid.count[1])
        row = self.line or self.arc
        return Count(0, row.count if row is not None else 1)

    def coins(self) -> Float64:
        """Return them in their order."""
        if self.at is not None:
            return np.array([self.at])
        if self.line is not None:
            line: Float64 = np.linspace(self.line.start, self.line.end, self.line.count)
            return line
        if self.arc is not None:
            arc = self.arc
            angles = np.radians(np.linspace(arc.from_deg, arc.to_deg, arc.count))
            ring = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
            circle: Float64 = np.array(arc.centre) + arc.radius * ring
            return circle
        assert self.grid is not None, "Coins holds exactly one of its four shapes"
        grid = self.grid
        along = [
            (np.arange(n) - (n - 1) / 2) * gap
            for n, gap in zip(grid.count, grid.spacing, strict=True)
        ]
        xs, ys = np.meshgrid(*along, indexing="ij")
        offsets = np.stack([xs, ys, np.zeros_like(xs)], -1).reshape(-1, 3)
        rows: Float64 = np.array(grid.centre) + offsets
        return rows


def coin_shapes(positions: Float64) -> Iterator[Shape]:
    """Yield all coins of a level, at ``positions``, (K, 3); each turns a little later."""
    surface = _surface(24 if len(positions) <= _DETAILED else 8)
    for number, (x, y, z) in enumerate(positions.tolist()):
        spin = Spin(TURNS_PER_S, BOB_M, BOBS_PER_S, 0.15 * number)
        name = part("coin", number)
        yield Shape(name, surface, _GOLD, at=(x, y, z), motion=spin)


def _surface(segments: int) -> Surface:
    """Return a coin with a raised rim, standing upright, its axis along x."""
    radius, rim, face = _RADIUS_M, _HALF_THICKNESS_M, 0.5 * _HALF_THICKNESS_M
    half = [(radius, 0.0), (radius, 0.7 * rim), (0.94 * radius, rim), (0.76 * radius, rim)]
    half += [(0.70 * radius, face), (0.0, face)]
    profile = [(r, -h) for r, h in reversed(half)] + half[1:]
    upright = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    return lathe(profile, full_turn(segments)).moved(upright, np.zeros(3))
