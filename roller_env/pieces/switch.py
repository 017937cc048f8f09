"""A field on the ground that switches things on and off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, NamedTuple, get_args

import numpy as np
from pydantic import Field

from roller_env.arrays import Bool, Float64, Int64
from roller_env.pieces.fields import Names, OptionalName, Point, Seconds, Size
from roller_env.pieces.look import ACTIVE, IDLE, Shape, part, states
from roller_env.pieces.piece import ExpandedLevel, Piece, Region, Vector, half_of
from roller_env.pieces.rules import (
    After,
    Own,
    Rules,
    Seen,
    fraction_entry,
    padded,
    place_entry,
    show_nearest,
)
from roller_env.pieces.signals import unknown_receivers, votes_of
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

Mode = Literal["once", "toggle", "hold", "timed"]
_ONCE, _TOGGLE, _HOLD, _TIMED = range(len(get_args(Mode)))

_PAINT: Final = states("switch", ("#5b8cff90", 0.35), ("#7dffb0c0", 0.7))


class Switch(Piece):
    """A box without substance: touching it switches gates, platforms and fans.

    On it is `once` touched for good; with `toggle` until it is touched again; with `hold` while the
    ball touches it; `timed` for a while since the ball came to touch it last.
    """

    is_searched: ClassVar[bool] = False

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths.")
    sets: Names = Field(description="The names of what it switches, at least one.")
    mode: Mode = Field("toggle", description="How long it is on.")
    duration_s: Seconds = Field(5.0, description="For `timed`: how long.")
    name: OptionalName = None

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)

    def signals(self) -> tuple[str, ...]:
        """Return what it switches."""
        return self.sets

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield what it names that is not there."""
        yield from unknown_receivers((*path, "sets"), "switch", self.sets, around.receivers())

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield a plate on the ground in a frame, lit while it is on."""
        x, y, z = half_of(self.size)
        yield Shape(part("switch", number), "box", _PAINT, (x, y, z), self.at)
        radius, thick = 0.5 * min(x, y), quants(0.6)
        at = (self.at[0], self.at[1], self.at[2] + z)
        yield Shape(part("knob", number), "cylinder", _PAINT, (radius, thick, 0.0), at)

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it is on."""
        return ACTIVE if state.of(SWITCH).on[row, number] else IDLE

    def label(self) -> tuple[str, Vector]:
        """Return what it is."""
        return self.name or "switch", self.at


# Rules --------------------------------------------------------------------------------------------


class SwitchTable(NamedTuple):
    """Numbers of W switches.

    Attributes:
        mode: (L, W) how long each is on: number of a `Mode`.
        duration_s: (L, W) of those that are timed.
        votes: (L, W, S) whom each tells to go on.
    """

    mode: Int64
    duration_s: Float64
    votes: Bool


class SwitchState(NamedTuple):
    """What varies of W switches.

    Attributes:
        on: (N, W) which are on.
        left_s: (N, W) how much longer those that are timed are.
    """

    on: Bool
    left_s: Float64


def _table(levels: Sequence[ExpandedLevel]) -> SwitchTable:
    rows = [level.of(Switch) for level in levels]
    modes = [[get_args(Mode).index(switch.mode) for switch in row] for row in rows]
    return SwitchTable(
        mode=padded(modes).astype(np.int64),
        duration_s=padded([[switch.duration_s for switch in row] for row in rows]),
        votes=votes_of(Switch, levels),
    )


def _state(table: SwitchTable, num_envs: int) -> SwitchState:
    shape = (num_envs, table.mode.shape[1])
    return SwitchState(np.zeros(shape, dtype=bool), np.zeros(shape))


def _react(now: After, table: SwitchTable, state: SwitchState, own: Own) -> None:
    """Switch what was touched, let the timers run, and give the votes of those that are on."""
    on, left_s = state.on[now.env], state.left_s[now.env]
    for switch in range(own.regions):
        entered = now.entry[own.region + switch] < np.inf
        mode = table.mode[now.level, switch]
        # Sums of control steps miss a timer's end by rounding: that is no time at all.
        left_s[switch] = max(left_s[switch] - now.duration_s - 1e-9, 0.0)
        if mode == _ONCE:
            on[switch] |= entered
        elif mode == _TOGGLE:
            on[switch] = on[switch] != entered
        elif mode == _HOLD:
            on[switch] = entered or now.inside[own.region + switch]
        else:
            if entered:
                left_s[switch] = table.duration_s[now.level, switch]
            on[switch] = left_s[switch] > 0.0
        if on[switch]:
            for signal in range(len(now.votes)):
                now.votes[signal] += table.votes[now.level, switch, signal]


def _show(now: Seen, table: SwitchTable, state: SwitchState, own: Own) -> None:
    """Write the nearest switch, whether it is on, and how much longer."""
    nearest = show_nearest(now, own)
    if nearest >= 0:
        now.out[own.entry + 4] = 1.0 if state.on[now.env, nearest] else 0.0
        if table.duration_s[now.level, nearest] > 0.0:
            left = state.left_s[now.env, nearest] / table.duration_s[now.level, nearest]
            now.out[own.entry + 5] = left


SWITCH: Final = Rules(
    name="switch",
    table=_table,
    state=_state,
    entries=(
        place_entry("switch", "centre of the nearest switch; 0 if none"),
        fraction_entry("switch_present", "1 where `switch` shows one"),
        fraction_entry("switch_on", "1 while that switch is on"),
        fraction_entry("switch_left", "share of its time that is left, if it is timed"),
    ),
    react=_react,
    show=_show,
)
Switch.rules = SWITCH
