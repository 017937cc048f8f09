"""What a kind of piece does in a game: what it is told, what varies, and its part in every step.

A kind with rules has, besides its model, a table (what never changes while playing, by level), a
state (what varies, by env) and hooks. A hook is compiled by Numba into the kernels of
`roller_env.game.step`, is called for one env at a time and has the signature
``hook(now, table, state, own)``: ``now`` is what happens to the env, ``own`` says where the kind's
own begin among the regions, the movers and the numbers of an observation. What it has nothing to do
with it leaves alone; what it tells others goes by way of ``now``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, NamedTuple, TypeVar

import numpy as np

from roller_env.arrays import Bool, Float32, Float64, Int64
from roller_env.compiled import device_function
from roller_env.pieces.piece import ExpandedLevel

FAR_M: Final = 1e12
"""Where padding lies."""

HIDDEN: Final = -1
"""Entry of a kind that is not shown."""

WORK: Final = 8
"""Numbers that a hook has to work with, since it makes no arrays."""

TableT = TypeVar("TableT")
StateT = TypeVar("StateT")
Hook = Callable[[Any, Any, Any, "Own"], None]


class Own(NamedTuple):
    """Where a kind's own begin, and how many there are.

    Attributes:
        region: the first of its regions.
        regions: their number.
        mover: the first of its movers.
        movers: their number.
        entry: the first of its numbers in an observation; `HIDDEN` if they are not shown.
        signal: the first of its signals.
    """

    region: int
    regions: int
    mover: int
    movers: int
    entry: int
    signal: int


class Before(NamedTuple):
    """An env before a step.

    Attributes:
        level: row of the tables.
        env: row of the states.
        duration_s: of the step.
        moving_s: how much of it, at its end, things move: all, but in the intro.
        signals: (S,) which receivers have been told to go on.
        touching: (R,) which regions the ball is in.
        aim: (M,) displacements to which the movers are being pulled, metres, <= 0.
        force_n: (3,) to add to: mean force on the ball over the step, newtons, world frame.
        pull: (M,) to set: velocity of each mover along its line, m/s; below 0 towards its end.
    """

    level: int
    env: int
    duration_s: float
    moving_s: float
    signals: Bool
    touching: Bool
    aim: Float64
    force_n: Float64
    pull: Float64


class CameraAsked(NamedTuple):
    """What the pieces ask of the cameras in a step.

    Attributes:
        trigger: (N,) the kind of the trigger that sets the mode; -1 for none.
        overhead: (N,) whether the wait of an overhead trigger has ended.
        behind: (N,) whether a lift pad holds the camera behind the ball.
    """

    trigger: Int64
    overhead: Bool
    behind: Bool


class Noticed(NamedTuple):
    """An env whose path is about to be looked at.

    Attributes:
        level: row of the tables.
        env: row of the states.
        coins: how many are collected.
        live: (R,) to take back: which regions can do something if the ball enters them.
    """

    level: int
    env: int
    coins: int
    live: Bool


class After(NamedTuple):
    """An env after the physics of a step.

    Attributes:
        level: row of the tables.
        env: row of the states.
        duration_s: of the step.
        path: (S + 1, 3 or 6) the ball's way, as `roller_env.pieces.sweep` takes it, metres.
        end: pieces of the path until the game ended, ``inf`` if it did not.
        entry: (R,) pieces of the path until the ball entered each region; ``inf`` where it did not,
            or behind the end.
        inside: (R,) which regions it is in at the end.
        displacement: (M,) how far the movers are from where they began, metres, <= 0.
        coins: (1,) to add to: how many coins the step has earned.
        votes: (S,) to add to: how many of the sources of each receiver are on.
        signals: (S,) to set: which receivers are told to go on.
        camera: what the pieces ask of it.
        returns: whether the ball has fallen and is put back at the end of the step.
        back_at: (3,) to set: where its centre is put then; the level's start so far. Metres.
        place: (3,) to set: where the ball's centre goes on, metres, world frame.
        velocity: (3,) to set: with what velocity, m/s, world frame.
    """

    level: int
    env: int
    duration_s: float
    path: Float64
    end: float
    entry: Float64
    inside: Bool
    displacement: Float64
    coins: Int64
    votes: Int64
    signals: Bool
    camera: CameraAsked
    returns: bool
    back_at: Float64
    place: Float64
    velocity: Float64


class Seen(NamedTuple):
    """An env whose observation is written.

    Attributes:
        level: row of the tables.
        env: row of the states.
        ball: (3,) its centre, metres, world frame.
        centre: (R, 3) the regions' centres.
        half: (R, 3) the half edges of their boxes.
        real: (R,) which regions there are; the others are padding.
        mover_centre: (M, 3) where the movers began, metres.
        mover_along: (M, 3) directions in which their displacements count.
        mover_stop: (M,) displacement at which each has arrived, <= 0; 0 for padding.
        displacement: (M,) how far they are from there.
        work: (`WORK`,) numbers to work with; anything is in them.
        out: (entries,) to write to, zeros so far.
    """

    level: int
    env: int
    ball: Float64
    centre: Float64
    half: Float64
    real: Bool
    mover_centre: Float64
    mover_along: Float64
    mover_stop: Float64
    displacement: Float64
    work: Float64
    out: Float32


@dataclass(frozen=True, slots=True)
class Entry:
    """One named part of an observation.

    Attributes:
        name: its key in the ``dict`` observation.
        size: how many numbers.
        unit: SI unit, or a dash.
        frame: ``world``, ``ball`` (world axes, origin at the ball's centre) or a dash.
        low: smallest value.
        high: largest value.
        meaning: one line.
    """

    name: str
    size: int
    unit: str
    frame: str
    low: float
    high: float
    meaning: str


def place_entry(name: str, meaning: str) -> Entry:
    """Return the entry of a place, as seen from the ball."""
    return Entry(name, 3, "m", "ball", -np.inf, np.inf, meaning)


def fraction_entry(name: str, meaning: str, size: int = 1) -> Entry:
    """Return the entry of numbers from 0 to 1."""
    return Entry(name, size, "-", "-", 0.0, 1.0, meaning)


def nothing(now: Any, table: Any, state: Any, own: Own) -> None:
    """Leave everything as it is."""


def no_table(levels: Sequence[ExpandedLevel]) -> None:
    """Return nothing: all that the kind needs is in its regions and movers."""


def no_state(table: Any, num_envs: int) -> None:
    """Return nothing: nothing of the kind varies."""


@dataclass(frozen=True, eq=False)
class Rules(Generic[TableT, StateT]):
    """What a kind of piece does in a game.

    Attributes:
        name: of the kind.
        table: makes the kind's numbers of L levels, a NamedTuple of arrays (L, ...).
        state: makes, of a table and a number N, the state at the start of an episode: a NamedTuple
            of arrays (N, ...).
        deeds: fields of the state, (N, k) bools, that become true once in an episode, as an
            achievement.
        entries: what an observation shows of it.
        is_basic: whether it shows them in every level; otherwise only where there are such pieces.
        act: a hook with `Before`: adds forces on the ball, and says how its movers go.
        notice: a hook with `Noticed`: says which of its regions can do something.
        react: a hook with `After`: draws the consequences of a step.
        show: a hook with `Seen`: writes its entries.
    """

    name: str
    table: Callable[[Sequence[ExpandedLevel]], TableT]
    state: Callable[[TableT, int], StateT]
    deeds: tuple[str, ...] = ()
    entries: tuple[Entry, ...] = ()
    is_basic: bool = False
    act: Hook = nothing
    notice: Hook = nothing
    react: Hook = nothing
    show: Hook = nothing


def padded(
    rows: Sequence[Sequence[Any] | Float64], shape: tuple[int, ...] = (), fill: float = 0.0
) -> Float64:
    """Return rows of different lengths as one array (L, longest, *shape), filled up."""
    result = np.full((len(rows), max(map(len, rows)), *shape), fill)
    for numbers, row in zip(result, rows, strict=True):
        if len(row):
            numbers[: len(row)] = row
    return result


@device_function
def distance2(point: Float64, ball: Float64) -> float:
    """Return the squared distance of two places."""
    x, y, z = point[0] - ball[0], point[1] - ball[1], point[2] - ball[2]
    squared: float = x * x + y * y + z * z
    return squared


@device_function
def nearest_in_box(centre: Float64, half: Float64, ball: Float64) -> tuple[float, float, float]:
    """Return the place of a box that is nearest to the ball, as seen from the ball."""
    x = min(max(ball[0], centre[0] - half[0]), centre[0] + half[0]) - ball[0]
    y = min(max(ball[1], centre[1] - half[1]), centre[1] + half[1]) - ball[1]
    z = min(max(ball[2], centre[2] - half[2]), centre[2] + half[2]) - ball[2]
    return x, y, z


@device_function
def show_nearest(now: Seen, own: Own) -> int:
    """Write the place of the nearest of a kind's regions, and 1; return which it is, -1 if none."""
    best, best2 = -1, np.inf
    for region in range(own.region, own.region + own.regions):
        new2 = distance2(now.centre[region], now.ball)
        if now.real[region] and new2 < best2:
            best, best2 = region - own.region, new2
    if best >= 0:
        show_place(now.out, own.entry, now.centre[own.region + best], now.ball)
        now.out[own.entry + 3] = 1.0
    return best


@device_function
def show_place(out: Float32, begin: int, point: Float64, ball: Float64) -> None:
    """Write a place as seen from the ball."""
    for axis in range(3):
        out[begin + axis] = point[axis] - ball[axis]
