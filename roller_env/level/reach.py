"""Where the ball can get to, and where it surely cannot: a flood from the start.

Nothing that a player could do may be missed, so the flood is generous wherever it simplifies: the
ball has the speed of the longest way there is with two keys held, loses none of it, turns it
upwards on every kerb and ramp as well as a rigid ball can, and flies on from there with the keys
still held. What it is not generous about is geometry: it does not pass through solids, nor rise
without anything to rise on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from roller_env.arrays import Bool, Float64
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.pieces.coin import COIN_REACH_M
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.finish import Finish
from roller_env.pieces.lift_pad import LiftPad, pad_groups
from roller_env.pieces.piece import Region, Solid
from roller_env.pieces.plate import Plate
from roller_env.pieces.spans import EDGE, FLAT, SLOPE, Indices, Spans, free_spans

_CLIMB: Final = 0.9
"""How far, in radii, the ball's centre may rise from one column to the next while it rolls: that of
a kerb of nearly its radius."""

_NEAR: Final = 2
"""Columns that are not counted in a distance, since neither end of it is exact."""

_KERB: Final = 0.58
"""Share of its speed that a rolling ball can have upwards after striking a kerb h high, without
elasticity: the largest (1 - 5 x / 7) sqrt(1 - (1 - x)^2), x = h / r, from the conservation of
angular momentum about the edge."""

_HIGHER: Final = 1e-6
"""Metres that do not count."""

_FAR: Final = np.iinfo(np.int32).max // 2
_NEIGHBOURS: Final = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if (x, y) != (0, 0)]


class Play(NamedTuple):
    """How a level is to be played.

    Attributes:
        dt_s: physics step, seconds; 0 if the engine jumps over nothing.
        push_n: the hardest push there is, newtons.
    """

    dt_s: float
    push_n: float


class _Motion(NamedTuple):
    """What a ball on what has been reached can do at most.

    Attributes:
        rests: highest height at which its centre can come to rest, metres.
        apex: highest height that its centre can have.
        speed: horizontally, m/s.
        rise_s: time it can be on its way up, seconds.
        push: acceleration by the keys, m/s^2.
        gravity: m/s^2.
    """

    rests: float
    apex: float
    speed: float
    rise_s: float
    push: float
    gravity: float

    def range(self, drop: Float64) -> Float64:
        """Return how far it can fly until it is ``drop`` under the apex, metres; -inf above it."""
        time = self.rise_s + np.sqrt(2.0 * np.maximum(drop, 0.0) / self.gravity)
        far: Float64 = np.where(drop < 0.0, -np.inf, time * (self.speed + 0.5 * self.push * time))
        return far

    def drop(self, distance: Float64) -> Float64:
        """Return how far under the apex it is, at the least, after flying so far. Metres."""
        fast = self.speed
        time = (np.sqrt(fast**2 + 2.0 * self.push * distance) - fast) / self.push
        down: Float64 = 0.5 * self.gravity * np.maximum(time - self.rise_s, 0.0) ** 2
        return down


@dataclass(frozen=True)
class Reach:
    """What the ball can get to.

    Attributes:
        coins: (coins,) whether each can be collected.
        plates: (plates,) whether each can be struck.
        finish: whether it can be touched.
        landings: how hard the ball can come down, by the field of what it comes down on.
    """

    coins: Bool
    plates: Bool
    finish: bool
    landings: dict[str, Landing]


class Landing(NamedTuple):
    """The deepest fall onto a solid.

    Attributes:
        drop: height fallen through, metres.
        straight: share of the speed that is at right angles to what it falls on.
        thickness: of what it falls on, metres.
    """

    drop: float
    straight: float
    thickness: float


def reach(level: Level, play: Play) -> Reach | None:
    """Return what can be reached in a level, and more rather than less.

    Plates that can be struck are down and their gates open from then on.

    Returns:
        What can be reached; None where that cannot be told: the ball starts over nothing, the level
        has pieces that take it where the search does not, such as platforms, or it is too large for
        the ball to be searched in a few seconds.
    """
    if not all(kind.is_searched for kind in expand(level).pieces):
        return None
    coins = expand(level).coins
    found = Reach(np.zeros(len(coins), bool), np.zeros(len(level.plates), bool), False, {})
    while True:
        flood = _flood(level, play, coins, found.plates)
        if flood is None:
            return None
        plates = found.plates | flood.plates
        landings = found.landings | flood.landings
        found = Reach(found.coins | flood.coins, plates, found.finish or flood.finish, landings)
        if not (plates & ~flood.struck).any():
            return found


@dataclass(frozen=True)
class _Found(Reach):
    """What a flood reached.

    Attributes:
        struck: (plates,) which plates were down during it.
    """

    struck: Bool


def _flood(level: Level, play: Play, coins: Float64, struck: Bool) -> _Found | None:
    solids, regions = _solids(level, struck), expand(level).regions
    finish = level.finish
    around = np.array([level.start.at, finish.at, *coins.tolist()])[:, :2]
    spans = free_spans(solids, level.ball.radius, around)
    if spans is None:
        return None
    lowest = min([finish.at[2] - finish.size[2], *(coins[:, 2] - COIN_REACH_M)])
    flood = _Flood(level, play, spans, lowest)
    if not flood.begin():
        return None
    motion = flood.run()
    boxes = flood.boxes(motion)
    wide = np.full(3, COIN_REACH_M)
    plates, (goal,) = regions.get(Plate, ()), regions[Finish]
    return _Found(
        coins=np.array([boxes.meets(at - wide, at + wide) for at in coins], dtype=bool),
        plates=np.array([boxes.meets(*_corners(plate)) for plate in plates], dtype=bool),
        finish=boxes.meets(*_corners(goal)),
        landings=flood.landings(motion, solids),
        struck=struck,
    )


def _solids(level: Level, struck: Bool) -> list[Solid]:
    """Return what is solid, with the plates that were struck down and their gates open."""
    plates = [level.plates[index] for index in np.flatnonzero(struck)]
    down = {name for plate in plates for name in (plate.name, *plate.signals())}
    everything = expand(level)
    return [
        *everything.solids,
        *(mover.end if mover.name in down else mover.solid for mover in everything.movers),
    ]


def _corners(region: Region, beside: float = 0.0) -> tuple[Float64, Float64]:
    """Return the corners of the box that holds a region, and ``beside`` it."""
    centre, half = np.array(region.centre), np.array(region.half) + region.radius + beside
    low, high = centre - half, centre + half
    low[2] = max(low[2], centre[2] + region.floor)
    return low, high


class _Boxes:
    """Where the ball's centre can be: in each column, some boxes.

    Attributes:
        spans: the columns.
        low: (spans,) metres.
        high: (spans,) metres; below ``low`` where it cannot be.
    """

    def __init__(self, spans: Spans, low: Float64, high: Float64) -> None:
        self.spans, self.low, self.high = spans, low, high

    def meets(self, low: Float64, high: Float64) -> bool:
        """Say whether the centre can be between two corners, or a column's width beside that."""
        cell = self.spans.cell
        near = self.spans.window((low[:2] - cell).tolist(), (high[:2] + cell).tolist())
        bottom, top = self.low[near], self.high[near]
        return bool(((bottom <= top) & (bottom <= high[2] + cell) & (top >= low[2] - cell)).any())


class _Flood:
    """A flood over the spans of a level.

    Attributes:
        away: (spans,) columns from the nearest support that was reached, over which the ball flies;
            0 for what was reached, `_FAR` for where it has not been.
        cap: (spans,) highest that its centre can be there, for what it had to pass under, metres.
    """

    def __init__(self, level: Level, play: Play, spans: Spans, lowest: float) -> None:
        """Begin a flood; what lies lower than ``lowest`` and every floor is of no interest."""
        self._level, self._spans, self._lowest = level, spans, lowest
        self._push = play.push_n / level.ball.mass_kg
        self._climb = _CLIMB * level.ball.radius
        self._column = spans.column
        self._support = spans.is_support
        self.away = np.full(len(spans.floor), _FAR, dtype=np.int32)
        self.cap = np.full(len(spans.floor), -np.inf)

    def begin(self) -> bool:
        """Put the ball on what is under its start; say whether there is anything."""
        at, spans = np.array(self._level.start.at), self._spans
        wide = np.maximum(self._level.start.jitter, spans.cell)
        near = spans.window((at[:2] - wide).tolist(), (at[:2] + wide).tolist())
        height = at[2] + self._climb
        under = near[(spans.floor[near] <= height) & (spans.ceiling[near] >= at[2] - spans.cell)]
        self.away[under[self._support[under]]] = 0
        return bool((self.away == 0).any())

    def run(self) -> _Motion:
        """Flood until nothing more is reached; return what the ball can do in the end."""
        while True:
            motion = self._motion()
            reached = np.count_nonzero(self.away == 0)
            self._spread(motion)
            if np.count_nonzero(self.away == 0) == reached:
                return motion

    def boxes(self, motion: _Motion) -> _Boxes:
        """Return where the ball's centre can be."""
        flown = np.maximum(self.away - _NEAR, 0) * self._spans.cell
        high = np.minimum(motion.apex - motion.drop(flown), self.cap)
        reached = self.away == 0
        high[reached] = np.maximum(high[reached], self._spans.floor[reached])
        high[self.away == _FAR] = -np.inf
        low = np.where(self.away == _FAR, np.inf, self._spans.floor)
        return _Boxes(self._spans, low, high)

    def landings(self, motion: _Motion, solids: Sequence[Solid]) -> dict[str, Landing]:
        """Return the deepest fall onto each solid that has been reached.

        Of a hull only the level face counts, and it as nowhere thinner than the hull is high.
        """
        spans = self._spans
        is_hull = np.array([isinstance(solid, ConvexSolid) for solid in solids], dtype=bool)
        onto_face = np.where(is_hull[spans.solid], spans.kind == FLAT, spans.kind != EDGE)
        on = np.flatnonzero((self.away == 0) & onto_face)
        drops = np.minimum(spans.ceiling[on], motion.rests) - spans.floor[on]
        # The deepest fall onto each solid, and where it is thinnest of those.
        order = np.lexsort((spans.under[on], -drops))
        numbers, first = np.unique(spans.solid[on[order]], return_index=True)
        found: dict[str, Landing] = {}
        for number, index in zip(numbers.tolist(), order[first].tolist(), strict=True):
            solid, radius = solids[number], self._level.ball.radius
            steepness = float(np.abs(solid.rotation[2]).max())
            across = steepness * (float(spans.under[on[index]]) + 2.0 * radius) - 2.0 * radius
            if is_hull[number]:
                across = max(across, 2.0 * solid.half_size[2])
            landing = Landing(float(drops[index]), steepness, across)
            if solid.source not in found or landing.drop > found[solid.source].drop:
                found[solid.source] = landing
        return found

    def _motion(self) -> _Motion:
        level, spans = self._level, self._spans
        reached = np.flatnonzero(self.away == 0)
        floor, gravity = spans.floor[reached], level.gravity
        high = max(float(floor.max()), level.start.at[2])
        places = self._column[reached]
        extent = [np.ptp(places // spans.shape[1]), np.ptp(places % spans.shape[1])]
        run = (math.hypot(*extent) + _NEAR) * spans.cell
        speed = math.sqrt(2.0 * (self._push * run + gravity * (high - float(floor.min()))))
        hop = (self._upwards(reached) * speed) ** 2 / (2.0 * gravity)
        rests, push_s = high, 0.0
        regions = expand(level).regions.get(LiftPad, ())
        pads = [index for index, region in enumerate(regions) if self._touches(region)]
        if pads:
            groups = pad_groups(level.lift_pads)
            strongest: dict[int, float] = {}
            for index in pads:
                group, force = groups[index], level.lift_pads[index].force_n
                strongest[group] = max(strongest.get(group, 0.0), force)
            net = sum(strongest.values()) / level.ball.mass_kg - gravity
            push_s = max(level.lift_pads[index].duration_s for index in pads)
            rests = high + 0.5 * net * push_s**2 + (net * push_s) ** 2 / (2.0 * gravity)
        rise_s = push_s + math.sqrt(2.0 * (rests + hop - high) / gravity)
        return _Motion(rests, rests + hop, speed, rise_s, self._push, gravity)

    def _touches(self, pad: Region) -> bool:
        """Say whether a lift pad has been reached."""
        low, high = _corners(pad, self._spans.cell)
        near = self._spans.window(low[:2].tolist(), high[:2].tolist())
        near = near[self.away[near] == 0]
        floor = self._spans.floor[near]
        return bool(((floor <= high[2]) & (self._spans.ceiling[near] >= low[2])).any())

    def _upwards(self, reached: Indices) -> float:
        """Return the largest share of its speed that the ball can turn upwards."""
        spans, best = self._spans, 0.0
        firm = reached[spans.kind[reached] != EDGE]
        for step in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            for here, there in self._pairs(firm, step):
                up = spans.floor[there] - spans.floor[here]
                higher = (self.away[there] == 0) & (up > _HIGHER) & (up <= self._climb)
                slopes = higher & (spans.kind[there] == SLOPE)
                if (higher & ~slopes).any():
                    best = max(best, _KERB)
                if slopes.any():
                    steepest = float(up[slopes].max())
                    best = max(best, steepest / math.hypot(steepest, spans.cell))
        return best * (1.0 + self._level.ball.elasticity)

    def _pairs(self, of: Indices, step: tuple[int, int]) -> Iterator[tuple[Indices, Indices]]:
        """Yield spans with a span each of the column ``step`` away; each pair once."""
        spans = self._spans
        x, y = np.divmod(self._column[of], spans.shape[1])
        x, y = x + step[0], y + step[1]
        inside = (x >= 0) & (x < spans.shape[0]) & (y >= 0) & (y < spans.shape[1])
        of, beside = of[inside], (x * spans.shape[1] + y)[inside]
        layer = 0
        while len(of):
            yield of, spans.first[beside] + layer
            layer += 1
            more = spans.first[beside] + layer < spans.first[beside + 1]
            of, beside = of[more], beside[more]

    def _spread(self, motion: _Motion) -> None:
        """Let the ball roll and fly on from what has been reached."""
        spans, away, cap = self._spans, self.away, self.cap
        useful = min(float(spans.floor[self._support].min()) - self._climb, self._lowest)
        flight = float(motion.range(np.array(motion.apex - useful))) / spans.cell + _NEAR
        farthest = int(min(flight, _FAR - 1))
        # How many columns it can fly before it would come down on each span.
        drop = motion.apex + self._climb - np.where(self._support, spans.floor, -np.inf)
        land = np.minimum(motion.range(drop) / spans.cell + _NEAR, float(_FAR))
        front = np.flatnonzero(away == 0)
        away[away > 0] = _FAR
        stays = np.maximum(np.minimum(spans.ceiling, motion.apex), spans.floor)
        cap[:] = np.where(away == 0, stays, -np.inf)
        while len(front):
            changed = []
            for step in _NEIGHBOURS:
                for here, there in self._pairs(front, step):
                    rolls = away[here] == 0
                    low = np.maximum(spans.floor[here], spans.floor[there])
                    top = np.minimum(spans.ceiling[here], spans.ceiling[there])
                    rise = np.where(rolls, spans.floor[here] + self._climb, -np.inf)
                    free = (low <= top) & (low <= np.maximum(rise, cap[here] + self._climb))
                    beyond = away[here] + 1
                    lands = (rolls | (beyond <= land[there])) & self._support[there]
                    new = np.where(lands, 0, beyond)
                    under = np.where(lands, stays[there], np.minimum(cap[here], top))
                    nearer = (new < away[there]) | (under > cap[there] + _HIGHER)
                    better = free & nearer & (new <= farthest)
                    at = there[better]
                    away[at] = np.minimum(new[better], away[at])
                    cap[at] = np.maximum(under[better], cap[at])
                    changed.append(at)
            front = np.unique(np.concatenate(changed))
