"""A gate that plates open."""

from __future__ import annotations

from typing import Final

import numpy as np
from pydantic import Field

from roller_env.pieces.fields import Degrees, Length, Name, Point, PositiveLength, Size
from roller_env.pieces.piece import Mover, Piece, Solid, half_of, rotation_matrix
from roller_env.pieces.rules import (
    Before,
    Own,
    Rules,
    Seen,
    fraction_entry,
    no_state,
    no_table,
    place_entry,
)
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


# Rules --------------------------------------------------------------------------------------------


def _act(now: Before, table: None, state: None, own: Own) -> None:
    for gate in range(own.movers):
        now.moving[own.mover + gate] = now.signals[gate]


def _show(now: Seen, table: None, state: None, own: Own) -> None:
    """Write the nearest gate not yet open, where it is now, and how far it has gone."""
    best2 = np.inf
    for gate in range(own.mover, own.mover + own.movers):
        moved, stop = now.displacement[gate], now.mover_stop[gate]
        x, y, z = (
            now.mover_centre[gate, 0] - now.ball[0],
            now.mover_centre[gate, 1] - now.ball[1],
            now.mover_centre[gate, 2] + moved - now.ball[2],
        )
        new2 = x * x + y * y + z * z
        # Padding has no way to go: its stop is 0.
        if stop < 0.0 and moved > stop and new2 < best2:
            best2 = new2
            now.out[own.entry], now.out[own.entry + 1], now.out[own.entry + 2] = x, y, z
            now.out[own.entry + 3] = 1.0
            now.out[own.entry + 4] = min(max(moved / stop, 0.0), 1.0)


GATE: Final = Rules(
    name="gate",
    table=no_table,
    state=no_state,
    entries=(
        place_entry("gate", "centre of the nearest gate not yet open; 0 if none"),
        fraction_entry("gate_present", "1 where `gate` shows a gate"),
        fraction_entry("gate_lowered", "share of its way down that this gate has gone"),
    ),
    act=_act,
    show=_show,
)
Gate.rules = GATE
