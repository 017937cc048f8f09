"""A pad that throws the ball up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Float64, Int64
from roller_env.compiled import device_function
from roller_env.pieces.fields import Number, OptionalName, Point, Seconds, Size
from roller_env.pieces.look import ACTIVE, IDLE, LIGHT, Shape, part, states
from roller_env.pieces.piece import (
    TOUCHING_M,
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
    Before,
    Entry,
    Own,
    Rules,
    Seen,
    distance2,
    fraction_entry,
    padded,
    place_entry,
    show_place,
)
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

_PAINT: Final = states("pad", ("#27b5e8", 0.25), ("#8decff", 0.7))


class LiftPad(Piece):
    """A solid pad that throws whatever enters it upwards with a steady force for a while."""

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths.")
    force_n: Annotated[Number, Field(gt=0.0, le=1e6)] = Field(
        quants(500.0), description="Newtons, upwards; more than the ball's weight (9.8 N)."
    )
    duration_s: Seconds = Field(
        5.0, description="How long it pushes, once entered; it cannot fire again until then."
    )
    name: OptionalName = None

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield itself."""
        yield Solid(self.at, half_of(self.size), UNTURNED, "", source)

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield a disc that lights up, and a column of light to rise in."""
        x, y, z = self.at
        radius, top = 0.42 * min(self.size[:2]), z + self.size[2] / 2
        size, glow = (radius, quants(0.5), 0.0), (radius, quants(48.0), 0.0)
        yield Shape(part("pad", number), "cylinder", _PAINT, size, (x, y, top))
        at = (x, y, top + glow[1])
        name = part("glow", number)
        yield Shape(name, "cylinder", (LIGHT,), glow, at, seen_in=(ACTIVE,))

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it pushes."""
        return ACTIVE if state.of(LIFT_PAD).thrust_s[row, number] > 0.0 else IDLE

    def label(self) -> tuple[str, Vector]:
        """Return what it does."""
        return "lift", self.at

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that it is too weak for the ball."""
        if self.force_n <= around.weight_n:
            found = f"found {self.force_n:.6g} N, which never lifts the ball"
            wanted = f"wanted more than its weight, {around.weight_n:.6g} N"
            yield Problem((*path, "force_n"), f"{found}; {wanted}")


def pad_groups(pads: Sequence[LiftPad]) -> list[int]:
    """Return, for each lift pad, the number of the first pad of those that push as one with it.

    Pads that overlap or touch, if only by way of others between them, are one pad to the ball.
    """
    middle = np.array([pad.at for pad in pads]).reshape(-1, 3)
    half = np.array([pad.size for pad in pads]).reshape(-1, 3) / 2
    low, high = middle - half, middle + half + TOUCHING_M
    first = list(range(len(pads)))
    in_x = np.argsort(low[:, 0], kind="stable")
    for place, number in enumerate(in_x.tolist()):
        beside = in_x[place + 1 : np.searchsorted(low[in_x, 0], high[number, 0], "right")]
        near = (low[beside] <= high[number]) & (low[number] <= high[beside])
        for other in beside[near.all(axis=1)].tolist():
            one, two = sorted((_root(first, number), _root(first, other)))
            first[two] = one
    return [_root(first, number) for number in range(len(pads))]


def _root(first: list[int], number: int) -> int:
    """Follow ``first`` to a number that is its own, and shorten the way for the next time."""
    while first[number] != number:
        first[number] = first[first[number]]
        number = first[number]
    return number


# Rules --------------------------------------------------------------------------------------------


class LiftPadTable(NamedTuple):
    """Numbers of A pads.

    Attributes:
        force_n: (L, A) newtons, upwards.
        duration_s: (L, A) how long each pushes.
        group: (L, A) number of the first pad of those that push as one; its own, if alone.
    """

    force_n: Float64
    duration_s: Float64
    group: Int64


class LiftPadState(NamedTuple):
    """What varies of A pads.

    Attributes:
        thrust_s: (N, A) how much longer each pushes the ball up.
    """

    thrust_s: Float64


def _table(levels: Sequence[ExpandedLevel]) -> LiftPadTable:
    pads = [level.of(LiftPad) for level in levels]
    return LiftPadTable(
        force_n=padded([[pad.force_n for pad in row] for row in pads]),
        duration_s=padded([[pad.duration_s for pad in row] for row in pads]),
        group=padded([pad_groups(row) for row in pads]).astype(np.int64),
    )


def _state(table: LiftPadTable, num_envs: int) -> LiftPadState:
    return LiftPadState(np.zeros((num_envs, table.force_n.shape[1])))


def _act(now: Before, table: LiftPadTable, state: LiftPadState, own: Own) -> None:
    for pad in range(own.regions):
        acts = min(state.thrust_s[now.env, pad] / now.duration_s, 1.0)
        now.force_n[2] += acts * table.force_n[now.level, pad]


def _react(now: After, table: LiftPadTable, state: LiftPadState, own: Own) -> None:
    """Let the timers of pushing pads run, and start those of the pads entered.

    A pad that is still pushing does not fire again, so that its push never lasts longer; nor does
    one of its group, so that a pad made of two pushes like one.
    """
    thrust_s, group = state.thrust_s[now.env], table.group[now.level]
    entry = now.entry[own.region : own.region + own.regions]
    for pad in range(own.regions):
        if entry[pad] < np.inf and _fires(pad, entry, group, thrust_s):
            thrust_s[pad] = -1.0  # until those behind it have been asked
    for pad in range(own.regions):
        left = thrust_s[pad]
        if now.returns:
            thrust_s[pad] = 0.0
        elif left < 0.0:
            thrust_s[pad] = table.duration_s[now.level, pad]
        else:
            left -= now.duration_s
            # Sums of control steps miss a timer's end by rounding: that is no time at all.
            thrust_s[pad] = left if left >= 1e-9 else 0.0
        # The original sets the camera's mode 0 in every frame of the push.
        now.camera.behind[now.env] |= thrust_s[pad] > 0.0


@device_function
def _fires(pad: int, entry: Float64, group: Int64, thrust_s: Float64) -> bool:
    """Say whether none of an entered pad's group is pushing or was entered before it."""
    for other in range(len(entry)):
        first = entry[other] < entry[pad] or (entry[other] == entry[pad] and other < pad)
        if group[other] == group[pad] and (thrust_s[other] > 0.0 or first):
            return False
    return True


def _show(now: Seen, table: LiftPadTable, state: LiftPadState, own: Own) -> None:
    """Write the nearest lift pad, and how much longer one pushes."""
    best2 = np.inf
    for pad in range(own.regions):
        region, left = own.region + pad, np.float32(state.thrust_s[now.env, pad])
        new2 = distance2(now.centre[region], now.ball)
        if now.real[region] and new2 < best2:
            best2 = new2
            show_place(now.out, own.entry, now.centre[region], now.ball)
            now.out[own.entry + 3] = 1.0
        now.out[own.entry + 4] = max(now.out[own.entry + 4], left)


LIFT_PAD: Final = Rules(
    name="lift_pad",
    table=_table,
    state=_state,
    is_basic=True,
    entries=(
        place_entry("pad", "centre of the nearest lift pad; 0 if none"),
        fraction_entry("pad_present", "1 where `pad` shows a pad"),
        Entry(
            "thrust_left", 1, "s", "-", 0.0, np.inf, "how much longer a lift pad pushes the ball"
        ),
    ),
    act=_act,
    react=_react,
    show=_show,
)
LiftPad.rules = LIFT_PAD
