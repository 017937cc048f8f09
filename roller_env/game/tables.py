"""What the rules read of a level, as plain arrays with a leading axis.

`LevelTable.of` makes a table of L levels, padded to equal sizes; `LevelTable.for_rows` makes the
view in which every environment's row has its own level's numbers. Padding never acts: a padded
region lies infinitely far away.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.game.cameras import TriggerKind
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.pieces.gate import Gate
from roller_env.pieces.lift_pad import pad_groups
from roller_env.pieces.piece import Piece
from roller_env.pieces.plate import PLATE_HIT_HEIGHT_M, Plate

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

TOUCH_TOLERANCE_M: Final = 1e-4
"""Soft contacts hold surfaces this near to each other; nearer counts as touching."""

FAR_M: Final = 1e12
"""Where padding lies."""


class Kind(IntEnum):
    """Kinds of regions, in the order in which events at the same moment are taken.

    Coins come before all of them; they are found by their own table, since a level may have
    thousands. The finish is the last.
    """

    PLATE = 0
    LIFT_PAD = 1
    TRIGGER = 2
    FINISH = 3


@dataclass(frozen=True, eq=False)
class LevelTable:
    """Arrays of L levels (or of N rows). SI units, world frame; K coins, P plates, ... are padded.

    Regions are what the ball's path is tested against: rounded boxes, being all points within
    ``region_radius`` of the box ``region_centre`` +- ``region_half`` whose height over the centre
    is more than ``region_floor``. They stand in the order of `Kind`, and ``slices`` finds them.
    """

    slices: dict[Kind, slice]
    region_centre: Float64  # (L, M, 3)
    region_half: Float64  # (L, M, 3)
    region_radius: Float64  # (L, M)
    region_floor: Float64  # (L, M)
    region_real: Bool  # (L, M) no padding
    ball_radius: Float64  # (L,)
    kill_height: Float64  # (L,)
    time_limit_s: Float64  # (L,)
    start: Float64  # (L, 3)
    jitter: Float64  # (L, 2)
    coin_count: Int64  # (L,)
    coin_at: Float64  # (L, K, 3)
    coin_order: Int64  # (L, K) the coins' numbers in the order of their x
    coin_x: Float64  # (L, K) the coins' x in that order
    plate_stop: Float64  # (L, P) displacement at which a plate is down, <= 0
    plate_speed: Float64  # (L, P)
    plate_opens: Bool  # (L, P, G)
    plate_heading: Float64  # (L, P, 2) cosine and sine of its yaw, which is none
    gate_centre: Float64  # (L, G, 3)
    gate_half: Float64  # (L, G, 3) half edges
    gate_heading: Float64  # (L, G, 2) cosine and sine of its yaw
    gate_stop: Float64  # (L, G)
    gate_speed: Float64  # (L, G)
    pad_force_n: Float64  # (L, A)
    pad_duration_s: Float64  # (L, A)
    pad_group: Int64  # (L, A) number of the first pad of those that push as one; own, if alone
    trigger_kind: Int64  # (L, T)
    route: Float64  # (L, W, 3)
    route_arc: Float64  # (L, W) metres along the route up to each waypoint
    route_radius: Float64  # (L,)
    route_length: Int64  # (L,) number of waypoints, 0 for none

    @staticmethod
    def of(levels: Sequence[Level]) -> LevelTable:
        """Return the table of ``levels``, which `roller_env.level.load_level` has accepted."""
        if not levels:
            raise ValueError("levels: found none; at least one is needed")
        parts = [_regions(level) for level in levels]
        widths = {kind: max(len(part[kind]) for part in parts) for kind in Kind}
        slices, begin = {}, 0
        for kind in Kind:
            slices[kind] = slice(begin, begin + widths[kind])
            begin += widths[kind]
        count = len(levels)
        region = np.zeros((count, begin, 8))
        region[..., :3] = FAR_M
        region[..., 7] = -np.inf
        for index, part in enumerate(parts):
            for kind in Kind:
                start = slices[kind].start
                region[index, start : start + len(part[kind])] = part[kind]

        def pad(pieces: Callable[[Level], Sequence[Any]], shape: tuple[int, ...] = ()) -> Float64:
            rows = [pieces(level) for level in levels]
            width = max(map(len, rows))
            result = np.zeros((count, width, *shape))
            for index, row in enumerate(rows):
                if len(row):
                    result[index, : len(row)] = row
            return result

        coins = [expand(level).coins for level in levels]
        coin_at = np.full((count, max(map(len, coins)), 3), FAR_M)
        for places, own in zip(coin_at, coins, strict=True):
            places[: len(own)] = np.reshape(own, (-1, 3))
        # Stable: coins of one x stay in the order of their numbers, padding behind all.
        coin_order = np.argsort(coin_at[..., 0], axis=1, kind="stable")

        gates = max(len(level.gates) for level in levels)
        routes = [
            np.array(level.route.points) if level.route else np.zeros((0, 3)) for level in levels
        ]
        return LevelTable(
            slices=slices,
            region_centre=region[..., :3],
            region_half=region[..., 3:6],
            region_radius=region[..., 6],
            region_floor=region[..., 7],
            region_real=region[..., 0] < FAR_M,
            ball_radius=np.array([level.ball.radius for level in levels]),
            kill_height=np.array([level.kill_height for level in levels]),
            time_limit_s=np.array([level.time_limit_s for level in levels]),
            start=np.array([level.start.at for level in levels]),
            jitter=np.array([level.start.jitter for level in levels]),
            coin_count=np.array([len(own) for own in coins]),
            coin_at=coin_at,
            coin_order=coin_order,
            coin_x=np.take_along_axis(coin_at[..., 0], coin_order, axis=1),
            plate_stop=pad(lambda level: _stops(level, Plate)),
            plate_speed=pad(lambda level: [p.speed for p in level.plates]),
            plate_opens=pad(lambda level: _opens(level, gates), (gates,)) > 0.0,
            plate_heading=pad(lambda level: [(1.0, 0.0) for _ in level.plates], (2,)),
            gate_centre=pad(lambda level: [g.at for g in level.gates], (3,)),
            gate_half=pad(lambda level: [np.array(g.size) / 2 for g in level.gates], (3,)),
            gate_heading=pad(lambda level: [_heading(g.yaw_deg) for g in level.gates], (2,)),
            gate_stop=pad(lambda level: _stops(level, Gate)),
            gate_speed=pad(lambda level: [g.speed for g in level.gates]),
            pad_force_n=pad(lambda level: [p.force_n for p in level.lift_pads]),
            pad_duration_s=pad(lambda level: [p.duration_s for p in level.lift_pads]),
            pad_group=pad(lambda level: pad_groups(level.lift_pads)).astype(np.int64),
            trigger_kind=pad(
                lambda level: [TriggerKind[t.kind.upper()] for t in level.camera_triggers]
            ).astype(np.int64),
            route=pad(lambda level: level.route.points if level.route else [], (3,)),
            route_arc=_padded_arcs(routes),
            route_radius=np.array([level.route.radius if level.route else 0.0 for level in levels]),
            route_length=np.array([len(route) for route in routes]),
        )

    def for_rows(self, level_of_row: Int64) -> LevelTable:
        """Return the table whose row i holds level ``level_of_row[i]``, shape (N,).

        Where there is one level only, the rows are views of the same memory.
        """

        def choose(array: Any) -> Any:
            if len(self.start) == 1:
                return np.broadcast_to(array, (len(level_of_row), *array.shape[1:]))
            return array[level_of_row]

        arrays = {f.name: choose(getattr(self, f.name)) for f in fields(self) if f.name != "slices"}
        return LevelTable(slices=self.slices, **arrays)

    def width(self, kind: Kind) -> int:
        """Return the padded number of regions of ``kind``."""
        return int(self.slices[kind].stop - self.slices[kind].start)

    def centres(self, kind: Kind) -> Float64:
        """Return the centres, (L, n, 3), of the regions of ``kind``."""
        return self.region_centre[:, self.slices[kind]]

    def halves(self, kind: Kind) -> Float64:
        """Return the half edges, (L, n, 3), of the regions of ``kind``."""
        return self.region_half[:, self.slices[kind]]

    def exists(self, kind: Kind) -> Bool:
        """Say which of the regions of ``kind``, (L, n), are not padding."""
        return self.region_real[:, self.slices[kind]]


def _regions(level: Level) -> dict[Kind, Float64]:
    """Return rows of (centre 3, half 3, radius, floor) for each kind."""
    touch = level.ball.radius + TOUCH_TOLERANCE_M
    none = -np.inf

    def row(at: Any, size: Any, radius: float, floor: float = none) -> list[float]:
        return [*at, *(edge / 2 for edge in size), radius, floor]

    point = (0.0, 0.0, 0.0)
    rows = {
        Kind.PLATE: [row(p.at, p.size, touch, PLATE_HIT_HEIGHT_M) for p in level.plates],
        Kind.LIFT_PAD: [row(p.at, p.size, touch) for p in level.lift_pads],
        Kind.TRIGGER: [
            row(t.at, point, t.reach) if t.size is None else row(t.at, t.size, touch)
            for t in level.camera_triggers
        ],
        Kind.FINISH: [row(level.finish.at, level.finish.size, touch)],
    }
    return {kind: np.array(values).reshape(-1, 8) for kind, values in rows.items()}


def _stops(level: Level, kind: type[Piece]) -> list[float]:
    movers = expand(level).movers_of(kind)
    return [mover.stop - mover.solid.centre[2] for mover in movers]


def _heading(yaw_deg: float) -> tuple[float, float]:
    yaw = math.radians(yaw_deg)
    return math.cos(yaw), math.sin(yaw)


def _opens(level: Level, gates: int) -> list[list[float]]:
    names = [gate.name for gate in level.gates]
    padding = [0.0] * (gates - len(names))
    return [[float(name in plate.opens) for name in names] + padding for plate in level.plates]


def _padded_arcs(routes: Sequence[Float64]) -> Float64:
    arcs = np.zeros((len(routes), max(len(route) for route in routes)))
    for arc, route in zip(arcs, routes, strict=True):
        if len(route):
            lengths = np.linalg.norm(np.diff(route, axis=0), axis=1)
            arc[1 : len(route)] = np.cumsum(lengths)
    return arcs
