"""A pressure plate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Bool, Float64
from roller_env.pieces.fields import Height, Name, Names, Point, PositiveLength, Size
from roller_env.pieces.ground import Ground, settled
from roller_env.pieces.look import ACTIVE, DONE, IDLE, Shape, part, states
from roller_env.pieces.piece import (
    TOUCHING_M,
    UNTURNED,
    ExpandedLevel,
    Mover,
    Piece,
    Region,
    Solid,
    Vector,
    half_of,
)
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
from roller_env.pieces.signals import unknown_receivers, votes_of
from roller_env.pieces.space import burying
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

PLATE_HIT_HEIGHT_M: Final = quants(25.0)
"""A plate counts a hit only while the ball's centre is higher than this over its ``at``: the
original's guard against hits from the side."""

SINKS_TO_M: Final = quants(67.0)
"""Where the original's plate stops, whose deck has its upper face at 80 quants."""

SUNK_M: Final = quants(80.0 - 67.0)
"""How far under the face of what it stands on its centre is then."""

_PAINT: Final = states("plate", ("#ffb02e", 0.25), ("#ff6a3d", 0.7), ("#35c46f", 0.3))


class Plate(Piece):
    """A pressure plate: struck from above it sinks, and once down it opens its gates.

    It counts as struck when the ball touches it while the ball's centre is more than 25 quants
    above ``at``; with the original's ball of 16 quants, build it thicker than 18 quants.
    """

    name: Name = Field(description="No two pieces share one.")
    at: Point = Field(description="Its centre before it sinks.")
    size: Size = Field(description="Full edge lengths.")
    opens: Names = Field(
        description="The names of its gates, or of platforms and fans that it starts; at least one."
    )
    sinks_to: Height | None = Field(
        None,
        description="Height of its centre when it is down. If left out, 13 quants under the upper "
        "face of what it stands on, as in the original; if it stands on nothing, 67 quants.",
    )
    speed: PositiveLength = Field(quants(1.6), description="Length per second, downwards.")

    def settled(self, ground: Ground) -> Plate:
        """Return it with the height at which it is down."""
        return settled(self, "sinks_to", ground, self._solid(""), SUNK_M, SINKS_TO_M)

    def mover(self, source: str) -> Mover:
        """Return the plate, which a `Level` has settled."""
        assert self.sinks_to is not None, "a Level settles it when it is built"
        return Mover.down(self.name, self._solid(source), self.sinks_to, self.speed)

    def _solid(self, source: str) -> Solid:
        return Solid(self.at, half_of(self.size), UNTURNED, "", source)

    def region(self, touch: float) -> Region:
        """Return where the ball touches it from above."""
        return Region(self.at, half_of(self.size), touch, PLATE_HIT_HEIGHT_M)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield a cap whose colour tells its phase."""
        x, y, z = half_of(self.size)
        margin = min(quants(8.0), 0.2 * min(x, y))
        size, at = (x - margin, y - margin, quants(0.5)), (0.0, 0.0, z)
        yield Shape(part("plate") + self.name, "box", _PAINT, size, at, carrier=self.name)

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it sinks or is down."""
        if state.of(PLATE).down[row, number]:
            return DONE
        return ACTIVE if state.of(PLATE).struck[row, number] else IDLE

    def label(self) -> tuple[str, Vector]:
        """Return its name."""
        return self.name, self.at

    def signals(self) -> tuple[str, ...]:
        """Return its gates, and whatever else it sets going."""
        return self.opens

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield gates that are not there, and why it cannot be struck or go down."""
        yield from unknown_receivers((*path, "opens"), "plate", self.opens, around.receivers())
        radius, length = around.ball_radius, around.in_unit.length
        struck_at = radius + self.size[2] / 2
        if struck_at < PLATE_HIT_HEIGHT_M + TOUCHING_M:
            least = 2 * (PLATE_HIT_HEIGHT_M + TOUCHING_M - radius)
            yield Problem(
                (*path, "size", 2),
                f"a ball on the plate is {length(struck_at)} over its centre, and only "
                f"hits from more than {length(PLATE_HIT_HEIGHT_M)} count; "
                f"wanted a plate at least {around.in_unit.rounded_up(least)} high",
            )
        yield from around.rises(self, (*path, "sinks_to"), self.mover(""))

    def doubts(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield what wholly hides it."""
        hiding = burying(around.solids, self.at, self.size, around.ball_radius)
        if hiding:
            message = f"the plate is wholly inside {', '.join(hiding)}, where nothing can strike it"
            yield Problem((*path, "at"), message)


# Rules --------------------------------------------------------------------------------------------


class PlateTable(NamedTuple):
    """Numbers of P plates.

    Attributes:
        stop: (L, P) displacement at which each is down, metres, <= 0.
        speed: (L, P) m/s, downwards.
        votes: (L, P, S) whom each tells to go on.
    """

    stop: Float64
    speed: Float64
    votes: Bool


class PlateState(NamedTuple):
    """What varies of P plates.

    Attributes:
        struck: (N, P) which are sinking or down.
        down: (N, P) which have arrived.
    """

    struck: Bool
    down: Bool


def _table(levels: Sequence[ExpandedLevel]) -> PlateTable:
    movers = [level.movers_of(Plate) for level in levels]
    return PlateTable(
        stop=padded([[mover.stop for mover in row] for row in movers]),
        speed=padded([[mover.speed for mover in row] for row in movers]),
        votes=votes_of(Plate, levels),
    )


def _state(table: PlateTable, num_envs: int) -> PlateState:
    shape = (num_envs, table.stop.shape[1])
    return PlateState(np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool))


def _act(now: Before, table: PlateTable, state: PlateState, own: Own) -> None:
    for plate in range(own.movers):
        if state.struck[now.env, plate]:
            now.pull[own.mover + plate] = -table.speed[now.level, plate]


def _notice(now: Noticed, table: PlateTable, state: PlateState, own: Own) -> None:
    for plate in range(own.regions):
        now.live[own.region + plate] &= not state.struck[now.env, plate]


def _react(now: After, table: PlateTable, state: PlateState, own: Own) -> None:
    """Start the plates that were struck, and give the votes of those that have arrived."""
    for plate in range(own.regions):
        state.struck[now.env, plate] |= now.entry[own.region + plate] < np.inf
        fallen = now.displacement[own.mover + plate] <= table.stop[now.level, plate]
        if state.struck[now.env, plate] and fallen:
            state.down[now.env, plate] = True
        if state.down[now.env, plate]:
            for signal in range(len(now.votes)):
                now.votes[signal] += table.votes[now.level, plate, signal]


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
    deeds=("struck", "down"),
    is_basic=True,
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
