"""A pressure plate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Bool, Float64
from roller_env.pieces.fields import Length, Name, Point, PositiveLength, Size
from roller_env.pieces.gate import Gate
from roller_env.pieces.piece import UNTURNED, ExpandedLevel, Mover, Piece, Region, Solid, half_of
from roller_env.pieces.rules import (
    After,
    Before,
    Noticed,
    Own,
    Rules,
    Seen,
    distance2,
    fraction_entry,
    padded,
    place_entry,
    show_place,
)
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


# Rules --------------------------------------------------------------------------------------------


class PlateTable(NamedTuple):
    """Numbers of P plates.

    Attributes:
        stop: (L, P) displacement at which each is down, metres, <= 0.
        opens: (L, P, G) which gates each opens.
    """

    stop: Float64
    opens: Bool


class PlateState(NamedTuple):
    """What varies of P plates.

    Attributes:
        struck: (N, P) which are sinking or down.
        down: (N, P) which have arrived.
    """

    struck: Bool
    down: Bool


def _table(levels: Sequence[ExpandedLevel]) -> PlateTable:
    gates = [[gate.name for gate in level.of(Gate)] for level in levels]
    width = max(map(len, gates))
    opens = [
        [
            [name in plate.opens for name in names] + [False] * (width - len(names))
            for plate in level.of(Plate)
        ]
        for level, names in zip(levels, gates, strict=True)
    ]
    stops = [[plate.sinks_to - plate.at[2] for plate in level.of(Plate)] for level in levels]
    return PlateTable(stop=padded(stops), opens=padded(opens, (width,)) > 0.0)


def _state(table: PlateTable, num_envs: int) -> PlateState:
    shape = (num_envs, table.stop.shape[1])
    return PlateState(np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool))


def _act(now: Before, table: PlateTable, state: PlateState, own: Own) -> None:
    for plate in range(own.movers):
        now.moving[own.mover + plate] = state.struck[now.env, plate]


def _notice(now: Noticed, table: PlateTable, state: PlateState, own: Own) -> None:
    for plate in range(own.regions):
        now.live[own.region + plate] &= not state.struck[now.env, plate]


def _react(now: After, table: PlateTable, state: PlateState, own: Own) -> None:
    """Start the plates that were struck, see which have arrived, and open their gates."""
    for plate in range(own.regions):
        state.struck[now.env, plate] |= now.entry[own.region + plate] < np.inf
        fallen = now.displacement[own.mover + plate] <= table.stop[now.level, plate]
        if state.struck[now.env, plate] and fallen:
            state.down[now.env, plate] = True
        if state.down[now.env, plate]:
            for gate in range(len(now.signals)):
                now.signals[gate] |= table.opens[now.level, plate, gate]


def _show(now: Seen, table: PlateTable, state: PlateState, own: Own) -> None:
    """Write the nearest plate not yet struck, and whether any is sinking."""
    best, best2 = -1, np.inf
    for plate in range(own.regions):
        struck, region = state.struck[now.env, plate], own.region + plate
        if struck and not state.down[now.env, plate]:
            now.out[own.entry + 4] = 1.0
        new2 = distance2(now.centre[region], now.ball)
        if now.real[region] and not struck and new2 < best2:
            best, best2 = region, new2
    if best >= 0:
        show_place(now.out, own.entry, now.centre[best], now.ball)
        now.out[own.entry + 3] = 1.0


PLATE: Final = Rules(
    name="plate",
    table=_table,
    state=_state,
    entries=(
        place_entry("plate", "centre of the nearest plate not yet struck; 0 if none"),
        fraction_entry("plate_present", "1 where `plate` shows a plate"),
        fraction_entry("plate_sinking", "1 while a struck plate is still sinking"),
    ),
    act=_act,
    notice=_notice,
    react=_react,
    show=_show,
)
Plate.rules = PLATE
