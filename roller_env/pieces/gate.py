"""A gate that plates and switches open."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Bool, Float64, Int64
from roller_env.pieces.fields import Height, Name, Point, PositiveLength, Size, Yaw
from roller_env.pieces.ground import Ground, settled
from roller_env.pieces.look import ACTIVE, DONE, IDLE, Shape, part, states
from roller_env.pieces.piece import (
    ExpandedLevel,
    Mover,
    Piece,
    Solid,
    Vector,
    half_of,
    rotation_matrix,
)
from roller_env.pieces.rules import (
    After,
    Before,
    Own,
    Rules,
    Seen,
    fraction_entry,
    no_state,
    padded,
    place_entry,
)
from roller_env.pieces.signals import Needs, needed_by
from roller_env.pieces.spans import EDGE, free_spans
from roller_env.problems import FieldPath, Problem, quoted
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

LOWERS_TO_M: Final = quants(-32.0)
"""Where the original's gate stops: its upper face is then level with its deck's, at 80 quants."""

_BARS: Final = 7
_PAINT: Final = states("gate", ("#ff4d4d", 0.5), ("#ffb02e", 0.7), ("#35c46f", 0.3))


class Gate(Piece):
    """A slab that sinks out of the way when one of its plates is down, or switches on."""

    receives: ClassVar[bool] = True

    name: Name = Field(description="For its plates and switches; no two pieces share one.")
    at: Point = Field(description="Its centre while it is closed.")
    size: Size = Field(description="Full edge lengths.")
    yaw_deg: Yaw = Field(0.0, description="Positive turns it to the left, as a box.")
    lowers_to: Height | None = Field(
        None,
        description="Height of its centre when it is open. If left out, its upper face is then "
        "level with that of what it stands on; if it stands on nothing, -32 quants.",
    )
    speed: PositiveLength = Field(quants(32.0), description="Length per second.")
    needs: Needs = Field(
        "any", description="Whether one of its plates and switches opens it, or only `all` of them."
    )
    closes: bool = Field(
        False,
        description="Whether it goes up again when what opened it is off, as switches can be.",
    )

    def settled(self, ground: Ground) -> Gate:
        """Return it with the height at which it is open."""
        depth = self.size[2] / 2
        return settled(self, "lowers_to", ground, self._solid(""), depth, LOWERS_TO_M)

    def mover(self, source: str) -> Mover:
        """Return the gate, which a `Level` has settled."""
        assert self.lowers_to is not None, "a Level settles it when it is built"
        return Mover.down(self.name, self._solid(source), self.lowers_to, self.speed)

    def _solid(self, source: str) -> Solid:
        return Solid(self.at, half_of(self.size), rotation_matrix(self.yaw_deg), "", source)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield bars across it whose colour tells its phase."""
        x, y, z = half_of(self.size)
        thickness, inset = quants(1.0), min(quants(1.0), 0.1 * max(x, y))
        half = (x + thickness, y - inset) if x < y else (x - inset, y + thickness)
        size = (*half, min(quants(3.0), z / (_BARS + 1)))
        for bar in range(_BARS):
            at = (0.0, 0.0, z * (1.0 - (2 * bar + 1) / (_BARS + 1)))
            name = part("gate", bar) + self.name
            yield Shape(name, "box", _PAINT, size, at, carrier=self.name)

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it opens or is open."""
        if not state.signals[row, number]:
            return IDLE
        return DONE if arrived else ACTIVE

    def label(self) -> tuple[str, Vector]:
        """Return its name."""
        return self.name, self.at

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that nothing opens it, and why it cannot go down."""
        if self.name not in around.told:
            message = (
                f"nothing opens the gate {quoted(self.name)}; name it in a plate's 'opens' or a "
                "switch's 'sets'"
            )
            yield Problem((*path, "name"), message)
        yield from around.rises(self, (*path, "lowers_to"), self.mover(""))

    def slow_doubts(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that it stands in the way of a ball on the ground also when it is open."""
        radius, half, length = around.ball_radius, self.size[2] / 2, around.in_unit.length
        wide = math.hypot(self.size[0], self.size[1]) / 2 + 2.0 * radius
        near = [
            solid
            for solid in around.solids
            if math.dist(solid.centre[:2], self.at[:2]) <= wide + math.hypot(*solid.half_size)
        ]
        spans = free_spans(near, radius, np.array([self.at[:2]]))
        if spans is None:
            return
        low, high = ([self.at[k] + sign * wide for k in (0, 1)] for sign in (-1, 1))
        beside = spans.window(low, high)
        beside = beside[spans.is_support[beside] & (spans.kind[beside] != EDGE)]
        ground = spans.floor[beside] - radius
        in_the_way = (ground < self.at[2] + half) & (ground + 2 * radius > self.at[2] - half)
        if not in_the_way.any():
            return
        # The ground on which most of it stands out.
        level_of_it = float(np.median(ground[in_the_way]))
        stop = self.mover("").end.centre[2]
        left = stop + half - level_of_it
        if left < radius or stop - half > level_of_it + 2 * radius:
            return
        found = "found" if "lowers_to" in self.model_fields_set else "not given, so it is found"
        yield Problem(
            (*path, "lowers_to"),
            f"{found} {length(stop)}, where the open gate still stands "
            f"{length(left)} over the ground; wanted at most "
            f"{length(level_of_it - half)}, which leaves the way free",
        )


# Rules --------------------------------------------------------------------------------------------


class GateTable(NamedTuple):
    """Numbers of G gates.

    Attributes:
        speed: (L, G) m/s.
        needed: (L, G) how many votes open each.
        closes: (L, G) whether it closes again.
    """

    speed: Float64
    needed: Int64
    closes: Bool


def _table(levels: Sequence[ExpandedLevel]) -> GateTable:
    gates = [level.of(Gate) for level in levels]
    return GateTable(
        speed=padded([[gate.speed for gate in row] for row in gates]),
        needed=needed_by(Gate, levels),
        closes=padded([[gate.closes for gate in row] for row in gates]) > 0.0,
    )


def _act(now: Before, table: GateTable, state: None, own: Own) -> None:
    for gate in range(own.movers):
        speed = table.speed[now.level, gate]
        if now.signals[own.signal + gate]:
            now.pull[own.mover + gate] = -speed
        elif table.closes[now.level, gate] and now.aim[own.mover + gate] < 0.0:
            now.pull[own.mover + gate] = speed


def _react(now: After, table: GateTable, state: None, own: Own) -> None:
    """Count the votes."""
    for gate in range(own.movers):
        signal = own.signal + gate
        told = now.votes[signal] >= table.needed[now.level, gate]
        stays = now.signals[signal] and not table.closes[now.level, gate]
        now.signals[signal] = told or stays


def _show(now: Seen, table: GateTable, state: None, own: Own) -> None:
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
    table=_table,
    state=no_state,
    is_basic=True,
    entries=(
        place_entry("gate", "centre of the nearest gate not yet open; 0 if none"),
        fraction_entry("gate_present", "1 where `gate` shows a gate"),
        fraction_entry("gate_lowered", "share of its way down that this gate has gone"),
    ),
    act=_act,
    react=_react,
    show=_show,
)
Gate.rules = GATE
