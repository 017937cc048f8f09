"""Coins, one by one or in rows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Final, NamedTuple

import numpy as np
from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.arrays import Bool, Float64, Int64
from roller_env.compiled import device_function
from roller_env.pieces.fields import Part, Point, PositiveLength, Role, Spacing, Yaw
from roller_env.pieces.look import Paint, Shape, Spin, part
from roller_env.pieces.piece import Count, ExpandedLevel, Piece
from roller_env.pieces.rules import (
    FAR_M,
    After,
    Entry,
    Own,
    Rules,
    Seen,
    distance2,
    fraction_entry,
    padded,
    show_place,
)
from roller_env.pieces.surfaces import Surface, full_turn, lathe
from roller_env.pieces.sweep import ANYWHERE, POINT, bounds, meets, vector, visit
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
    from_deg: Yaw = Field(description="Angle of the first coin: 0 is +x, 90 is +y.")
    to_deg: Yaw = Field(description="Angle of the last coin.")
    count: Annotated[int, Field(strict=True, ge=2, le=MAX_COINS)] = Field(description="How many.")


class CoinGrid(Part):
    """Coins in level rows and columns round a centre."""

    centre: Point = Field(description="Of the grid.")
    spacing: Spacing = Field(description="Distance between neighbours along x and y.")
    count: Annotated[
        tuple[
            Annotated[int, Field(strict=True, ge=1, le=MAX_COINS)],
            Annotated[int, Field(strict=True, ge=1, le=MAX_COINS)],
        ],
        Role.EXTENT,
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


# Rules --------------------------------------------------------------------------------------------

NEAREST_COINS: Final = 4
"""Coins that an observation shows, nearest first."""


class CoinTable(NamedTuple):
    """The K coins of each level; padding lies infinitely far away, behind all others.

    Attributes:
        total: (L,) how many there are.
        at: (L, K, 3) their centres, metres, world frame.
        order: (L, K) their numbers in the order of their x.
        x: (L, K) their x in that order.
    """

    total: Int64
    at: Float64
    order: Int64
    x: Float64


class CoinState(NamedTuple):
    """Which coins are collected.

    Attributes:
        taken: (N, K) which.
        collected: (N,) how many.
    """

    taken: Bool
    collected: Int64


def _table(levels: Sequence[ExpandedLevel]) -> CoinTable:
    at = padded([level.coins for level in levels], (3,), FAR_M)
    # Stable: coins of one x stay in the order of their numbers, padding behind all.
    order = np.argsort(at[..., 0], axis=1, kind="stable")
    return CoinTable(
        total=np.array([len(level.coins) for level in levels]),
        at=at,
        order=order,
        x=np.take_along_axis(at[..., 0], order, axis=1),
    )


def _state(table: CoinTable, num_envs: int) -> CoinState:
    taken = np.zeros((num_envs, table.at.shape[1]), dtype=bool)
    return CoinState(taken, np.zeros(num_envs, dtype=np.int64))


def _react(now: After, table: CoinTable, state: CoinState, own: Own) -> None:
    """Collect the coins that the ball comes near before its game's end.

    They lie in the order of their x, so only those beside the path are looked at.
    """
    low, high = bounds(now.path)
    x, taken = table.x[now.level], state.taken[now.env]
    place = np.searchsorted(x, low[0] - COIN_REACH_M)
    while place < len(x) and x[place] <= high[0] + COIN_REACH_M:
        coin = table.order[now.level, place]
        place += 1
        at = vector(table.at[now.level, coin])
        if taken[coin] or not meets(low, high, at, POINT, COIN_REACH_M):
            continue
        time, _ = visit(now.path, at, POINT, COIN_REACH_M, ANYWHERE, False)
        if time < np.inf and time <= now.end:
            taken[coin] = True
            now.coins[0] += 1
    state.collected[now.env] += now.coins[0]


def _show(now: Seen, table: CoinTable, state: CoinState, own: Own) -> None:
    """Write the nearest coins left, nearest first; equal distances go by number.

    The search goes outwards from the ball, along x, and ends where x alone is further than the last
    of the nearest.
    """
    count, ball = table.total[now.level], now.ball
    if count == 0:
        return
    now.out[own.entry] = (count - state.collected[now.env]) / count
    if np.isnan(ball[0]):
        return  # No coin is near to nowhere, and the search would not end.
    nearest, near2 = now.work[:NEAREST_COINS], now.work[NEAREST_COINS : 2 * NEAREST_COINS]
    for place in range(NEAREST_COINS):
        nearest[place], near2[place] = count, np.inf
    x = table.x[now.level, :count]
    right = np.searchsorted(x, ball[0])
    left = right - 1
    while left >= 0 or right < count:
        back = ball[0] - x[left] if left >= 0 else np.inf
        ahead = x[right] - ball[0] if right < count else np.inf
        if min(back, ahead) ** 2 > near2[NEAREST_COINS - 1]:
            break
        place = left if back <= ahead else right
        left -= back <= ahead
        right += back > ahead
        coin = table.order[now.level, place]
        if not state.taken[now.env, coin]:
            _keep_nearest(coin, distance2(table.at[now.level, coin], ball), nearest, near2)
    first, present = own.entry + 1, own.entry + 1 + 3 * NEAREST_COINS
    for place in range(NEAREST_COINS):
        if nearest[place] < count:
            show_place(now.out, first + 3 * place, table.at[now.level, int(nearest[place])], ball)
            now.out[present + place] = 1.0


@device_function
def distance_to_next(
    table: CoinTable, state: CoinState, level: int, env: int, ball: Float64
) -> float:
    """Return the distance from the ball, (3,) metres, to the nearest coin left; ``inf`` for none.

    The search goes outwards along x, as that of what is shown does.
    """
    count, least2 = table.total[level], np.inf
    if np.isnan(ball[0]):
        return least2
    x = table.x[level, :count]
    right = np.searchsorted(x, ball[0])
    left = right - 1
    while left >= 0 or right < count:
        back = ball[0] - x[left] if left >= 0 else np.inf
        ahead = x[right] - ball[0] if right < count else np.inf
        if min(back, ahead) ** 2 > least2:
            break
        coin = table.order[level, left if back <= ahead else right]
        left -= back <= ahead
        right += back > ahead
        if not state.taken[env, coin]:
            least2 = min(least2, distance2(table.at[level, coin], ball))
    distance: float = math.sqrt(least2)
    return distance


@device_function
def _keep_nearest(coin: int, new2: float, nearest: Float64, near2: Float64) -> None:
    """Put a coin into its place among the nearest, if it is one of them."""
    place = NEAREST_COINS
    while place > 0 and (
        new2 < near2[place - 1] or (new2 == near2[place - 1] and coin < nearest[place - 1])
    ):
        place -= 1
        if place < NEAREST_COINS - 1:
            near2[place + 1], nearest[place + 1] = near2[place], nearest[place]
    if place < NEAREST_COINS:
        near2[place], nearest[place] = new2, coin


COIN: Final = Rules(
    name="coin",
    table=_table,
    state=_state,
    deeds=("taken",),
    is_basic=True,
    entries=(
        fraction_entry("coins_left", "share of the level's coins still to collect"),
        Entry(
            "coins",
            3 * NEAREST_COINS,
            "m",
            "ball",
            -np.inf,
            np.inf,
            f"x, y, z of the {NEAREST_COINS} nearest coins left, nearest first; else 0",
        ),
        fraction_entry("coins_present", "1 where `coins` shows a coin", NEAREST_COINS),
    ),
    react=_react,
    show=_show,
)
Coins.rules = COIN
