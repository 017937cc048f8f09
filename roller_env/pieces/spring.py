"""A pad that gives the ball a stated velocity."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, ClassVar, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Float64
from roller_env.pieces.fields import OptionalName, Point, Size, Velocity
from roller_env.pieces.look import Paint, Shape, part
from roller_env.pieces.piece import ExpandedLevel, Piece, Region, Vector, half_of
from roller_env.pieces.rules import (
    After,
    Entry,
    Own,
    Rules,
    Seen,
    fraction_entry,
    no_state,
    padded,
    place_entry,
    show_nearest,
)
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

_PAD: Final = (Paint("spring/", "#ffd23fd0", emission=0.45),)
_ARROW: Final = (Paint("arrow/", "#ff7a18", emission=0.6),)


class Spring(Piece):
    """A box without substance that throws the ball: touched, it gives it a velocity.

    Along the direction of ``velocity`` the ball is then as fast as that says, however it came;
    across it nothing changes. It happens at the end of the control step, each time that the ball
    comes to touch it.
    """

    is_searched: ClassVar[bool] = False

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths.")
    velocity: Velocity = Field(description="Length per second, x, y and z.")
    name: OptionalName = None

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that it does nothing."""
        if not any(self.velocity):
            yield Problem((*path, "velocity"), "found no velocity; wanted one that is not 0")

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield a pad with bars on it, across the way it throws."""
        x, y, z = half_of(self.size)
        yield Shape(part("spring", number), "box", _PAD, (x, y, z), self.at)
        forwards = abs(self.velocity[0]) >= abs(self.velocity[1])
        thick = quants(0.5)
        for bar in (-0.5, 0.0, 0.5):
            half = (0.08 * x, 0.7 * y, thick) if forwards else (0.7 * x, 0.08 * y, thick)
            shift = (bar * x, 0.0) if forwards else (0.0, bar * y)
            at = (self.at[0] + shift[0], self.at[1] + shift[1], self.at[2] + z)
            yield Shape(part("arrow", number, round(2 * bar) + 1), "box", _ARROW, half, at)

    def label(self) -> tuple[str, Vector]:
        """Return what it is."""
        return self.name or "spring", self.at


# Rules --------------------------------------------------------------------------------------------


class SpringTable(NamedTuple):
    """Numbers of S springs.

    Attributes:
        speed: (L, S) m/s.
        direction: (L, S, 3) unit vectors, world frame.
    """

    speed: Float64
    direction: Float64


def _table(levels: Sequence[ExpandedLevel]) -> SpringTable:
    rows = [[spring.velocity for spring in level.of(Spring)] for level in levels]
    speeds = [[math.hypot(*velocity) for velocity in row] for row in rows]
    velocity, speed = padded(rows, (3,)), padded(speeds, fill=1.0)
    return SpringTable(speed, velocity / speed[..., None])


def _react(now: After, table: SpringTable, state: None, own: Own) -> None:
    """Throw the ball from each spring that was entered."""
    for spring in range(own.regions):
        if now.entry[own.region + spring] < np.inf:
            direction = table.direction[now.level, spring]
            gain = table.speed[now.level, spring]
            for axis in range(3):
                gain -= direction[axis] * now.velocity[axis]
            for axis in range(3):
                now.velocity[axis] += gain * direction[axis]


def _show(now: Seen, table: SpringTable, state: None, own: Own) -> None:
    """Write the nearest spring, and the velocity that it gives."""
    nearest = show_nearest(now, own)
    if nearest >= 0:
        speed = table.speed[now.level, nearest]
        for axis in range(3):
            now.out[own.entry + 4 + axis] = speed * table.direction[now.level, nearest, axis]


SPRING: Final = Rules(
    name="spring",
    table=_table,
    state=no_state,
    entries=(
        place_entry("spring", "centre of the nearest spring; 0 if none"),
        fraction_entry("spring_present", "1 where `spring` shows one"),
        Entry("spring_velocity", 3, "m/s", "world", -np.inf, np.inf, "velocity that it gives"),
    ),
    react=_react,
    show=_show,
)
Spring.rules = SPRING
