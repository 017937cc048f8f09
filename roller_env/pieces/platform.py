"""A solid platform that goes to and fro."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Bool, Float64, Int64
from roller_env.compiled import device_function
from roller_env.pieces.fields import (
    MaterialName,
    Name,
    Number,
    Point,
    PositiveLength,
    Size,
    Yaw,
)
from roller_env.pieces.look import ACTIVE, IDLE, Shape, part, states
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
    Entry,
    Own,
    Rules,
    Seen,
    fraction_entry,
    padded,
    place_entry,
)
from roller_env.pieces.signals import NEVER, Needs, needed_by
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

_PAINT: Final = states("platform", ("#7a8699", 0.15), ("#57d3ff", 0.5))


class Platform(Piece):
    """A solid slab that goes from `at` to `to` and back, again and again; it carries the ball.

    One that no plate or switch names goes from the beginning on; the others go while they are told
    to, and stand still otherwise. It keeps to its timetable: where the ball holds it up, it makes
    that up at its ends.
    """

    receives: ClassVar[bool] = True
    is_searched: ClassVar[bool] = False

    name: Name = Field(description="For plates and switches; no two pieces share one.")
    at: Point = Field(description="Its centre at the start.")
    to: Point = Field(description="Its centre at the other end.")
    size: Size = Field(description="Full edge lengths.")
    yaw_deg: Yaw = Field(0.0, description="Positive turns it to the left, as a box.")
    speed: PositiveLength = Field(quants(48.0), description="Length per second.")
    wait_s: Annotated[Number, Field(ge=0.0, le=86_400.0)] = Field(
        1.0, description="How long it stands at either end; at the first not at the beginning."
    )
    returns: bool = Field(True, description="Whether it comes back, or stays at the other end.")
    needs: Needs = Field(
        "any", description="Whether one of its plates and switches is enough, or only `all`."
    )
    material: MaterialName = "default"

    @property
    def way(self) -> float:
        """Between its ends, metres."""
        return math.dist(self.at, self.to)

    def mover(self, source: str) -> Mover:
        """Return it."""
        way = max(self.way, 1e-12)
        x, y, z = ((here - there) / way for here, there in zip(self.at, self.to, strict=True))
        rotation = rotation_matrix(self.yaw_deg)
        solid = Solid(self.at, half_of(self.size), rotation, self.material, source)
        return Mover(self.name, solid, -way, -way, self.speed, (x, y, z))

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that it goes nowhere."""
        if self.way < quants(1.0):
            yield Problem((*path, "to"), "that is where it is at the start; wanted another place")

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield a rim that is lit while it goes."""
        x, y, z = half_of(self.size)
        edge = min(quants(3.0), 0.2 * min(x, y))
        for side, (at, half) in enumerate(
            (
                ((x - edge, 0.0, z), (edge, y, quants(0.3))),
                ((edge - x, 0.0, z), (edge, y, quants(0.3))),
                ((0.0, y - edge, z), (x, edge, quants(0.3))),
                ((0.0, edge - y, z), (x, edge, quants(0.3))),
            )
        ):
            yield Shape(part("rim", number, side), "box", _PAINT, half, at, carrier=self.name)

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it goes."""
        return ACTIVE if state.of(PLATFORM).goes[row, number] else IDLE

    def label(self) -> tuple[str, Vector]:
        """Return its name."""
        return self.name, self.at


# Rules --------------------------------------------------------------------------------------------


class PlatformTable(NamedTuple):
    """Numbers of P platforms.

    Attributes:
        way: (L, P) between the ends, metres.
        speed: (L, P) m/s.
        wait_s: (L, P) at either end.
        returns: (L, P) whether each comes back.
        needed: (L, P) how many votes let each go; `NEVER` of those that go by themselves.
    """

    way: Float64
    speed: Float64
    wait_s: Float64
    returns: Bool
    needed: Int64


class PlatformState(NamedTuple):
    """What varies of P platforms.

    Attributes:
        goes: (N, P) which go; those that go by themselves from the first step on.
        clock_s: (N, P) for how long each has gone.
    """

    goes: Bool
    clock_s: Float64


def _table(levels: Sequence[ExpandedLevel]) -> PlatformTable:
    rows = [level.of(Platform) for level in levels]
    return PlatformTable(
        way=padded([[platform.way for platform in row] for row in rows]),
        speed=padded([[platform.speed for platform in row] for row in rows], fill=1.0),
        wait_s=padded([[platform.wait_s for platform in row] for row in rows]),
        returns=padded([[platform.returns for platform in row] for row in rows]) > 0.0,
        needed=needed_by(Platform, levels),
    )


def _state(table: PlatformTable, num_envs: int) -> PlatformState:
    shape = (num_envs, table.way.shape[1])
    return PlatformState(np.zeros(shape, dtype=bool), np.zeros(shape))


@device_function
def _due(clock_s: float, way: float, speed: float, wait_s: float, returns: bool) -> float:
    """Return by how much a platform has left its first end when it has gone for a while, metres."""
    trip_s = way / speed
    if not returns:
        return min(speed * clock_s, way)
    clock_s %= 2.0 * (trip_s + wait_s)
    if clock_s > trip_s + wait_s:
        return max(way - speed * (clock_s - trip_s - wait_s), 0.0)
    return min(speed * clock_s, way)


def _act(now: Before, table: PlatformTable, state: PlatformState, own: Own) -> None:
    """Pull each platform to where it is due at the end of the step, and let its clock go."""
    if now.moving_s <= 0.0:
        return
    for platform in range(own.movers):
        way, speed = table.way[now.level, platform], table.speed[now.level, platform]
        alone = table.needed[now.level, platform] == NEVER and way > 0.0
        goes = alone or now.signals[own.signal + platform]
        state.goes[now.env, platform] = goes
        if goes:
            state.clock_s[now.env, platform] += now.moving_s
            due = _due(
                state.clock_s[now.env, platform],
                way,
                speed,
                table.wait_s[now.level, platform],
                table.returns[now.level, platform],
            )
            velocity = (-due - now.aim[own.mover + platform]) / now.moving_s
            now.pull[own.mover + platform] = min(max(velocity, -speed), speed)


def _react(now: After, table: PlatformTable, state: PlatformState, own: Own) -> None:
    """Count the votes."""
    for platform in range(own.movers):
        signal = own.signal + platform
        now.signals[signal] = now.votes[signal] >= table.needed[now.level, platform]


def _show(now: Seen, table: PlatformTable, state: PlatformState, own: Own) -> None:
    """Write the nearest platform where it is now, where its other end is, and whether it goes."""
    best, best2 = -1, np.inf
    for platform in range(own.movers):
        mover = own.mover + platform
        new2 = 0.0
        for axis in range(3):
            here = now.displacement[mover] * now.mover_along[mover, axis]
            new2 += (now.mover_centre[mover, axis] + here - now.ball[axis]) ** 2
        # Padding has no way to go: its stop is 0.
        if now.mover_stop[mover] < 0.0 and new2 < best2:
            best, best2 = platform, new2
    if best < 0:
        return
    mover = own.mover + best
    clock_s, way = state.clock_s[now.env, best], table.way[now.level, best]
    speed, wait_s = table.speed[now.level, best], table.wait_s[now.level, best]
    soon = _due(clock_s + 0.5, way, speed, wait_s, table.returns[now.level, best])
    velocity = 2.0 * (-soon - now.displacement[mover])
    if not state.goes[now.env, best]:
        velocity = 0.0
    for axis in range(3):
        along, from_ball = now.mover_along[mover, axis], now.mover_centre[mover, axis]
        from_ball += now.displacement[mover] * along - now.ball[axis]
        now.out[own.entry + axis] = from_ball
        now.out[own.entry + 4 + axis] = velocity * along
    now.out[own.entry + 3] = 1.0


PLATFORM: Final = Rules(
    name="platform",
    table=_table,
    state=_state,
    entries=(
        place_entry("platform", "centre of the nearest platform; 0 if none"),
        fraction_entry("platform_present", "1 where `platform` shows one"),
        Entry(
            "platform_velocity",
            3,
            "m/s",
            "world",
            -np.inf,
            np.inf,
            "mean velocity of that platform over the next half second",
        ),
    ),
    act=_act,
    react=_react,
    show=_show,
)
Platform.rules = PLATFORM
