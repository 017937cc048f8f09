"""What the rules read of levels, as plain arrays with a leading axis of levels.

An env has a level's number, so that envs of one level share its numbers, and those of several have
them packed, padded to equal sizes. Padding never acts: a padded region lies infinitely far away.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from roller_env.arrays import Bool, Float64, Int64
from roller_env.game.kinds import RULES
from roller_env.game.observations import Kinds, entries, layout
from roller_env.level.expand import expand
from roller_env.level.schema import PIECE_KINDS, Level
from roller_env.pieces.piece import ExpandedLevel, Mover, Piece, Region
from roller_env.pieces.rules import FAR_M, HIDDEN, Own, Rules, TableT, padded
from roller_env.pieces.signals import first_signals


class Regions(NamedTuple):
    """What the balls' paths are tested against, R of them in each of L levels.

    A region is all points within ``radius`` of the box ``centre`` +- ``half`` whose height over the
    centre is more than ``floor``.
    """

    centre: Float64  # (L, R, 3) metres, world frame
    half: Float64  # (L, R, 3) half edges
    radius: Float64  # (L, R)
    floor: Float64  # (L, R)
    real: Bool  # (L, R) no padding


class Movers(NamedTuple):
    """The slabs that move along lines, M of them in each of L levels."""

    centre: Float64  # (L, M, 3) at the start, metres, world frame
    half: Float64  # (L, M, 3) half edges
    heading: Float64  # (L, M, 2) cosine and sine of the yaw
    along: Float64  # (L, M, 3) direction in which its displacement counts
    stop: Float64  # (L, M) displacement at which it has arrived, <= 0; 0 for padding
    ball_radius: Float64  # (L,) of the ball that they must not press


class Routes(NamedTuple):
    """One good way through each of L levels."""

    points: Float64  # (L, W, 3) metres, world frame
    arc: Float64  # (L, W) metres along the route up to each
    radius: Float64  # (L,) a leg counts as reached within this distance
    length: Int64  # (L,) number of points, 0 for none


class LevelTable(NamedTuple):
    """Arrays of L levels: SI units, world frame; what each kind has is padded.

    Regions and movers stand in the order of `roller_env.game.kinds.RULES`; a row of ``owns`` is the
    `Own` of a kind.
    """

    regions: Regions
    movers: Movers
    routes: Routes
    signals: int  # how many pieces can be told something, S
    kill_height: Float64  # (L,)
    comes_back: Bool  # (L,) whether a fall does not end the game
    time_limit_s: Float64  # (L,)
    start: Float64  # (L, 3)
    jitter: Float64  # (L, 2)
    kinds: tuple[Any, ...]
    owns: Int64  # (kinds, 6)

    @property
    def ball_radius(self) -> Float64:
        """(L,) the balls' radii, metres."""
        return self.movers.ball_radius

    @staticmethod
    def of_levels(levels: Sequence[Level], shown: Kinds = "level") -> LevelTable:
        """Return the table of ``levels``, which `roller_env.level.load_level` has accepted.

        Args:
            levels: the levels.
            shown: whose entries an observation has; see `roller_env.game.observations`.
        """
        if not levels:
            raise ValueError("levels: found none; at least one is needed")
        expanded = [expand(level) for level in levels]
        kinds = [kind for kind in PIECE_KINDS if kind.rules is not None]
        regions = [[_regions(level, kind) for level in expanded] for kind in kinds]
        movers = [[_movers(level, kind) for level in expanded] for kind in kinds]
        region = _side_by_side(regions, [FAR_M] * 3 + [0.0] * 4 + [-np.inf])
        mover = _side_by_side(movers, [0.0] * 12)
        routes = [
            np.array(level.route.points) if level.route else np.zeros((0, 3)) for level in levels
        ]
        return LevelTable(
            regions=Regions(
                centre=np.ascontiguousarray(region[..., :3]),
                half=np.ascontiguousarray(region[..., 3:6]),
                radius=np.ascontiguousarray(region[..., 6]),
                floor=np.ascontiguousarray(region[..., 7]),
                real=region[..., 0] < FAR_M,
            ),
            movers=Movers(
                centre=np.ascontiguousarray(mover[..., :3]),
                half=np.ascontiguousarray(mover[..., 3:6]),
                heading=np.ascontiguousarray(mover[..., 6:8]),
                along=np.ascontiguousarray(mover[..., 8:11]),
                stop=np.ascontiguousarray(mover[..., 11]),
                ball_radius=np.array([level.ball.radius for level in levels]),
            ),
            routes=Routes(
                points=padded(routes, (3,)),
                arc=padded([_arcs(route) for route in routes]),
                radius=np.array([level.route.radius if level.route else 0.0 for level in levels]),
                length=np.array([len(route) for route in routes]),
            ),
            signals=first_signals(expanded)[Piece],
            kill_height=np.array([level.kill_height for level in levels]),
            comes_back=np.array([level.falls == "checkpoint" for level in levels]),
            time_limit_s=np.array([level.time_limit_s for level in levels]),
            start=np.array([level.start.at for level in levels]),
            jitter=np.array([level.start.jitter for level in levels]),
            kinds=tuple(rules.table(expanded) for rules in RULES),
            owns=_owns(
                expanded,
                _widths(regions),
                _widths(movers),
                layout(entries("state", shown, expanded)),
            ),
        )

    def slots(self, levels: Sequence[Level]) -> list[list[int]]:
        """Return of each of the table's levels which mover of the table each of its movers is."""
        kinds = [kind for kind in PIECE_KINDS if kind.rules is not None]
        slots = []
        for expanded in map(expand, levels):
            used = dict.fromkeys(kinds, 0)
            own = []
            for kind in expanded.mover_kinds:
                own.append(int(self.owns[kinds.index(kind)][2]) + used[kind])
                used[kind] += 1
            slots.append(own)
        return slots

    def of(self, rules: Rules[TableT, Any]) -> TableT:
        """Return a kind's own table."""
        table: TableT = self.kinds[RULES.index(rules)]
        return table

    def own(self, rules: Rules[Any, Any]) -> Own:
        """Return where a kind's regions and movers are."""
        return Own(*self.owns[RULES.index(rules)].tolist())


def _regions(level: ExpandedLevel, kind: type[Piece]) -> list[list[float]]:
    return [_region_row(region) for region in level.regions.get(kind, ())]


def _region_row(region: Region) -> list[float]:
    return [*region.centre, *region.half, region.radius, region.floor]


def _movers(level: ExpandedLevel, kind: type[Piece]) -> list[list[float]]:
    return [_mover_row(mover) for mover in level.movers_of(kind)]


def _mover_row(mover: Mover) -> list[float]:
    solid = mover.solid
    heading = (solid.rotation[0][0], solid.rotation[1][0])
    return [*solid.centre, *solid.half_size, *heading, *mover.along, mover.stop]


def _widths(kinds: Sequence[Sequence[Sequence[Any]]]) -> list[int]:
    return [max(map(len, levels)) for levels in kinds]


def _side_by_side(kinds: Sequence[Sequence[Sequence[Any]]], padding: Sequence[float]) -> Float64:
    """Return rows by kind and level as one array, (L, all kinds' widths, numbers)."""
    widths = _widths(kinds)
    result = np.empty((len(kinds[0]), sum(widths), len(padding)))
    result[:] = padding
    for kind, begin in zip(kinds, accumulate(widths, initial=0), strict=False):
        for numbers, rows in zip(result, kind, strict=True):
            if rows:
                numbers[begin : begin + len(rows)] = rows
    return result


def _owns(
    levels: Sequence[ExpandedLevel],
    regions: Sequence[int],
    movers: Sequence[int],
    entries: Mapping[str, slice],
) -> Int64:
    first, told = [], first_signals(levels)
    signal = {kind.rules: number for kind, number in told.items()}
    for rules in RULES:
        shown = entries.get(rules.entries[0].name) if rules.entries else None
        first.append(HIDDEN if shown is None else shown.start)
    region, mover = accumulate(regions, initial=0), accumulate(movers, initial=0)
    signals = [signal.get(rules, 0) for rules in RULES]
    return np.array(list(zip(region, regions, mover, movers, first, signals, strict=False)))


def _arcs(route: Float64) -> Float64:
    lengths = np.linalg.norm(np.diff(route, axis=0), axis=1)
    return np.concatenate([np.zeros(min(len(route), 1)), np.cumsum(lengths)])
