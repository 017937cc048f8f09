"""Wind: a force on the ball wherever its centre is in a box."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Bool, Float64, Int64
from roller_env.pieces.fields import Number, OptionalName, Point, Role, Size
from roller_env.pieces.look import ACTIVE, IDLE, Paint, Run, Shape, part
from roller_env.pieces.piece import ExpandedLevel, Piece, Region, Vector, half_of
from roller_env.pieces.rules import (
    After,
    Before,
    Entry,
    Own,
    Rules,
    Seen,
    fraction_entry,
    padded,
    place_entry,
    show_nearest,
)
from roller_env.pieces.signals import Needs, needed_by
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

STREAKS: Final = 12
STREAK_SPEED_M_S: Final = 4.0

_AIR: Final = (Paint("air/", "#bfe6ff26", emission=0.3),)
_STREAK: Final = (Paint("streak/", "#eaf7ffb0", emission=0.7),)

Force = Annotated[Number, Field(ge=-1e6, le=1e6)]


class Fan(Piece):
    """A box full of wind: it pushes the ball while the ball's centre is in it.

    The force acts from the control step after the centre has come in to the end of the one in which
    it leaves.
    """

    receives: ClassVar[bool] = True
    is_searched: ClassVar[bool] = False

    at: Point = Field(description="Centre of the box.")
    size: Size = Field(description="Full edge lengths.")
    force_n: Annotated[tuple[Force, Force, Force], Role.DIRECTION] = Field(
        description="Newtons along x, y and z."
    )
    blows: bool = Field(
        True, description="Whether it does at the start; plates and switches make it the contrary."
    )
    needs: Needs = Field(
        "any", description="Whether one of its plates and switches is enough, or only `all`."
    )
    name: OptionalName = None

    def region(self, touch: float) -> Region:
        """Return where the ball's centre is in it."""
        return Region(self.at, half_of(self.size), 0.0)

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that it never blows."""
        if not any(self.force_n):
            yield Problem((*path, "force_n"), "found no force at all; wanted one that is not 0")
        elif not self.blows and self.name not in around.told:
            message = "nothing switches it on; name it in a switch's 'sets', or let it blow"
            yield Problem((*path, "blows"), message)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield the air, and streaks that run with the wind."""
        half = half_of(self.size)
        yield Shape(part("air", number), "box", _AIR, half, self.at, seen_in=(ACTIVE,))
        force = np.array(self.force_n)
        axis = int(np.argmax(np.abs(force)))
        way = np.zeros(3)
        way[axis] = math.copysign(self.size[axis], force[axis])
        size = np.full(3, quants(0.6))
        size[axis] = quants(6.0)
        # Where they are is of no matter, but always the same.
        places = np.random.default_rng(number).uniform(-0.9, 0.9, (STREAKS, 3)) * half
        for streak, place in enumerate(places):
            place[axis] = -way[axis] / 2
            ahead = abs(way[axis]) * streak / STREAKS
            run = Run((way[0], way[1], way[2]), STREAK_SPEED_M_S, ahead)
            at = np.array(self.at) + place
            yield Shape(
                part("streak", number, streak),
                "box",
                _STREAK,
                (size[0], size[1], size[2]),
                (float(at[0]), float(at[1]), float(at[2])),
                seen_in=(ACTIVE,),
                motion=run,
            )

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it blows."""
        return ACTIVE if self.blows != bool(state.of(FAN).turned[row, number]) else IDLE

    def label(self) -> tuple[str, Vector]:
        """Return what it is."""
        return self.name or "fan", self.at


# Rules --------------------------------------------------------------------------------------------


class FanTable(NamedTuple):
    """Numbers of F fans.

    Attributes:
        force_n: (L, F, 3) newtons, world frame.
        on: (L, F) whether each blows at the start.
        needed: (L, F) how many votes turn each to the contrary.
    """

    force_n: Float64
    on: Bool
    needed: Int64


class FanState(NamedTuple):
    """What varies of F fans.

    Attributes:
        turned: (N, F) which are to the contrary of how they start.
    """

    turned: Bool


def _table(levels: Sequence[ExpandedLevel]) -> FanTable:
    fans = [level.of(Fan) for level in levels]
    return FanTable(
        force_n=padded([[fan.force_n for fan in row] for row in fans], (3,)),
        on=padded([[fan.blows for fan in row] for row in fans]) > 0.0,
        needed=needed_by(Fan, levels),
    )


def _state(table: FanTable, num_envs: int) -> FanState:
    return FanState(np.zeros((num_envs, table.on.shape[1]), dtype=bool))


def _act(now: Before, table: FanTable, state: FanState, own: Own) -> None:
    for fan in range(own.regions):
        blows = table.on[now.level, fan] != state.turned[now.env, fan]
        if blows and now.touching[own.region + fan]:
            for axis in range(3):
                share = now.moving_s / now.duration_s
                now.force_n[axis] += share * table.force_n[now.level, fan, axis]


def _react(now: After, table: FanTable, state: FanState, own: Own) -> None:
    """Count the votes."""
    for fan in range(own.regions):
        signal = own.signal + fan
        state.turned[now.env, fan] = now.votes[signal] >= table.needed[now.level, fan]
        now.signals[signal] = state.turned[now.env, fan]


def _show(now: Seen, table: FanTable, state: FanState, own: Own) -> None:
    """Write the nearest fan, and the force of its wind."""
    nearest = show_nearest(now, own)
    if nearest >= 0 and table.on[now.level, nearest] != state.turned[now.env, nearest]:
        for axis in range(3):
            now.out[own.entry + 4 + axis] = table.force_n[now.level, nearest, axis]


FAN: Final = Rules(
    name="fan",
    table=_table,
    state=_state,
    entries=(
        place_entry("fan", "centre of the nearest fan; 0 if none"),
        fraction_entry("fan_present", "1 where `fan` shows one"),
        Entry("wind", 3, "N", "world", -np.inf, np.inf, "force of that fan, if it blows"),
    ),
    act=_act,
    react=_react,
    show=_show,
)
Fan.rules = FAN
