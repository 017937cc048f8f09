"""What does a moving ball meet, and when? Decided on the whole path, so nothing is jumped over.

A region is a rounded box: all points within a radius of a box, and higher than a floor. Along a
straight piece of path the squared distance to the box is a convex and piecewise quadratic function
of time, whose pieces meet where the path crosses the planes of the box's faces. So the time of
entry is the root of one quadratic, and nothing has to be searched for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from roller_env.compiled import compiled
from roller_env.game.state import GameState
from roller_env.game.tables import Kind, LevelTable
from roller_env.pieces.coin import COIN_REACH_M

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

Vector = tuple[float, float, float]
_POINT: Vector = (0.0, 0.0, 0.0)


@dataclass(slots=True, eq=False)
class Motion:
    """Where the physics took the ball and the slabs in one control step of S substeps.

    Attributes:
        ball: (N, S + 1, 3) ball centres before the first substep and after each, world frame.
        plate: (N, P) plates' displacements from where they began, at the end, <= 0.
        duration_s: length of the control step.
    """

    ball: Float64
    plate: Float64
    duration_s: float


@dataclass(slots=True, eq=False)
class Events:
    """What happened in one control step.

    Attributes:
        entry: (N, M) time in substeps at which the ball entered each region and it counted;
            ``inf`` where it did not.
        inside: (N, M) which regions the ball is in at the end.
        coins: (N, K) coins collected.
        points: (N,) how many.
        plates: (N, P) plates struck.
        triggers: (N, T) camera triggers fired.
        finished: (N,) the finish was reached.
        fallen: (N,) the ball fell below the kill height.
        end: (N,) substep time of the finish or fall, ``inf`` if neither.
    """

    entry: Float64
    inside: Bool
    coins: Bool
    points: Int64
    plates: Bool
    triggers: Bool
    finished: Bool
    fallen: Bool
    end: Float64


def find_events(state: GameState, table: LevelTable, motion: Motion) -> Events:
    """Return what the ball met on its path, as the game stood when the step began.

    What lies behind the end of the game did not happen. Where the physics diverged nothing did.
    """
    live = np.empty(state.touching.shape, dtype=bool)
    _find_live(
        state.diverged,
        state.plate_struck,
        state.trigger_spent,
        table.slices[Kind.PLATE].start,
        table.slices[Kind.TRIGGER].start,
        live,
    )
    entry, inside = find_entries(motion.ball, table, state.touching, live)
    n = len(live)
    met = np.empty(live.shape, dtype=bool)
    finished, fallen, end = np.empty(n, dtype=bool), np.empty(n, dtype=bool), np.empty(n)
    _find_ends(
        motion.ball,
        table.kill_height,
        state.diverged,
        table.slices[Kind.FINISH].start,
        entry,
        met,
        finished,
        fallen,
        end,
    )
    coins = np.zeros(state.coin_taken.shape, dtype=bool)
    points = np.zeros(n, dtype=np.int64)
    _find_coins(
        motion.ball,
        end,
        state.diverged,
        table.coin_at,
        table.coin_order,
        table.coin_x,
        COIN_REACH_M,
        state.coin_taken,
        coins,
        points,
    )
    return Events(
        entry=entry,
        inside=inside,
        coins=coins,
        points=points,
        plates=met[:, table.slices[Kind.PLATE]],
        triggers=met[:, table.slices[Kind.TRIGGER]],
        finished=finished,
        fallen=fallen,
        end=end,
    )


def forget(events: Events, rows: Bool) -> None:
    """Let nothing have happened in the games where ``rows``, (N,), says so."""
    events.entry[rows] = np.inf
    events.end[rows] = np.inf
    events.points[rows] = 0
    for happened in (
        events.inside,
        events.coins,
        events.plates,
        events.triggers,
        events.finished,
        events.fallen,
    ):
        happened[rows] = False


def find_entries(
    path: Float64, table: LevelTable, touching: Bool, live: Bool
) -> tuple[Float64, Bool]:
    """Return when each row's ball enters each region, and which it is in at the end.

    Args:
        path: (n, S + 1, 3) ball centres before the first substep and after each, metres.
        table: the regions, M of them, of the n rows.
        touching: (n, M) whether the ball was inside when the path began.
        live: (n, M) which regions to look at; the others are never entered.

    Returns:
        entry: (n, M) substeps from the start of the path to the first entry, ``inf`` for none.
            A ball that is inside from the start and was not ``touching`` enters at 0.
        inside: (n, M) whether the path ends inside.
    """
    entry = np.full(live.shape, np.inf)
    inside = np.zeros(live.shape, dtype=bool)
    _find_entries(
        path,
        table.region_centre,
        table.region_half,
        table.region_radius,
        table.region_floor,
        touching,
        live,
        entry,
        inside,
    )
    return entry, inside


@compiled
def _find_live(
    diverged: Bool, struck: Bool, spent: Bool, first_plate: int, first_trigger: int, live: Bool
) -> None:
    """Write which regions can do something if the ball enters them."""
    for row in range(len(live)):
        live[row] = not diverged[row]
        for plate in range(struck.shape[1]):
            live[row, first_plate + plate] &= not struck[row, plate]
        for trigger in range(spent.shape[1]):
            live[row, first_trigger + trigger] &= not spent[row, trigger]


@compiled
def _find_entries(
    path: Float64,
    centre: Float64,
    half: Float64,
    radius: Float64,
    floor: Float64,
    touching: Bool,
    live: Bool,
    entry: Float64,
    inside: Bool,
) -> None:
    """Write ``entry`` and ``inside`` of `find_entries` where they are not ``inf`` and False."""
    for row in range(live.shape[0]):
        low, high = _bounds(path[row])
        for region in range(live.shape[1]):
            at = _vector(centre[row, region])
            box = _vector(half[row, region])
            reach = radius[row, region]
            if live[row, region] and _meets(low, high, at, box, reach):
                entry[row, region], inside[row, region] = _visit(
                    path[row], at, box, reach, floor[row, region], touching[row, region]
                )


@compiled
def _find_ends(
    path: Float64,
    kill_height: Float64,
    diverged: Bool,
    first_finish: int,
    entry: Float64,
    met: Bool,
    finished: Bool,
    fallen: Bool,
    end: Float64,
) -> None:
    """Find where each game ends, and take back the entries that lie behind."""
    for row in range(entry.shape[0]):
        finish = np.inf
        for region in range(first_finish, entry.shape[1]):
            finish = min(finish, entry[row, region])
        fall = np.inf if diverged[row] else _time_of_fall(path[row], kill_height[row])
        end[row] = min(finish, fall)
        finished[row] = finish < np.inf and finish <= fall
        fallen[row] = fall < finish
        for region in range(entry.shape[1]):
            met[row, region] = entry[row, region] < np.inf and entry[row, region] <= end[row]
            if not met[row, region]:
                entry[row, region] = np.inf


@compiled
def _time_of_fall(path: Float64, kill_height: float) -> float:
    """Return the substep time at which the ball first is at or below the kill height."""
    for step in range(len(path)):
        after = path[step, 2]
        if after <= kill_height:
            before = path[max(step - 1, 0), 2]
            return step - 1 + (before - kill_height) / (before - after) if step else 0.0
    return np.inf


@compiled
def _find_coins(
    path: Float64,
    end: Float64,
    diverged: Bool,
    coin_at: Float64,
    coin_order: Int64,
    coin_x: Float64,
    reach: float,
    taken: Bool,
    collected: Bool,
    points: Int64,
) -> None:
    """Write which coins each ball comes near before its game's end, and count them.

    The coins lie in the order of their x, so only those beside the path are looked at.
    """
    for row in range(taken.shape[0]):
        if diverged[row]:
            continue
        low, high = _bounds(path[row])
        place = np.searchsorted(coin_x[row], low[0] - reach)
        while place < taken.shape[1] and coin_x[row, place] <= high[0] + reach:
            coin = coin_order[row, place]
            place += 1
            at = _vector(coin_at[row, coin])
            if taken[row, coin] or not _meets(low, high, at, _POINT, reach):
                continue
            time, _ = _visit(path[row], at, _POINT, reach, -np.inf, False)
            if time < np.inf and time <= end[row]:
                collected[row, coin] = True
                points[row] += 1


@compiled
def _vector(array: Float64) -> Vector:
    return array[0], array[1], array[2]


@compiled
def _bounds(path: Float64) -> tuple[Vector, Vector]:
    """Return the lowest and the highest corner of a path's bounding box."""
    x0 = x1 = path[0, 0]
    y0 = y1 = path[0, 1]
    z0 = z1 = path[0, 2]
    for step in range(1, len(path)):
        x, y, z = path[step, 0], path[step, 1], path[step, 2]
        x0, x1 = min(x0, x), max(x1, x)
        y0, y1 = min(y0, y), max(y1, y)
        z0, z1 = min(z0, z), max(z1, z)
    return (x0, y0, z0), (x1, y1, z1)


@compiled
def _meets(low: Vector, high: Vector, at: Vector, half: Vector, reach: float) -> bool:
    """Say whether a region's bounding box meets a path's."""
    for axis in range(3):
        if at[axis] - half[axis] - reach > high[axis] or at[axis] + half[axis] + reach < low[axis]:
            return False
    return True


@compiled
def _visit(
    path: Float64, centre: Vector, half: Vector, radius: float, floor: float, touching: bool
) -> tuple[float, bool]:
    """Return the time of the first entry, in substeps, and whether the path ends inside."""
    time = np.inf
    start = _relative(path[0], centre)
    before = _depth(start, half, radius, floor)
    if before <= 0.0 and not touching:
        time = 0.0
    for piece in range(len(path) - 1):
        stop = _relative(path[piece + 1], centre)
        after = _depth(stop, half, radius, floor)
        if before > 0.0 and time == np.inf:
            way = (stop[0] - start[0], stop[1] - start[1], stop[2] - start[2])
            length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
            # The depth changes by at most a metre for each metre of way.
            if after <= 0.0 or before + after <= length:
                share = _crossing(start, way, half, radius, floor)
                # A piece that ends inside by less than rounding enters at its end.
                time = piece + (min(share, 1.0) if after <= 0.0 else share)
        start, before = stop, after
    return time, before <= 0.0


@compiled
def _relative(point: Float64, centre: Vector) -> Vector:
    return point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]


@compiled
def _depth(at: Vector, half: Vector, radius: float, floor: float) -> float:
    """Return how far outside its region a point lies, negative or zero inside.

    Args:
        at: relative to the region's centre, metres.
        half: half edges of the box, metres.
        radius: of the rounding, metres.
        floor: lowest height over the centre, metres.

    Returns:
        The distance to the rounded box, or to the floor if that is more.
    """
    return max(math.sqrt(_squared(at, _POINT, half, 0.0)) - radius, floor - at[2])


@compiled
def _crossing(start: Vector, way: Vector, half: Vector, radius: float, floor: float) -> float:
    """Return the share, 0 to 1, of a straight piece at which it enters; ``inf`` for a miss.

    Args:
        start: outside the region, relative to its centre.
        way: from there to the end of the piece.
        half: half edges of the box.
        radius: of the rounding.
        floor: lowest height over the centre.
    """
    reach2 = radius * radius
    near = _first_within(start, way, half, reach2)
    height = start[2] - floor
    over_floor = 0.0
    if height < 0.0:
        over_floor = -height / way[2] if way[2] > 0.0 else np.inf
    share = max(near, over_floor)
    # Both sets are convex, so the later of the two entries is in both, or nothing is.
    if share > 1.0:
        return np.inf
    if near < over_floor and _squared(start, way, half, share) > reach2:
        return np.inf
    if over_floor < near and height + share * way[2] < 0.0:
        return np.inf
    return share


@compiled
def _first_within(start: Vector, way: Vector, half: Vector, reach2: float) -> float:
    """Return the share at which the squared distance to the box falls to ``reach2``, or ``inf``."""
    if _squared(start, way, half, 0.0) <= reach2:
        return 0.0
    nodes = _nodes(start, way, half)
    for node in range(len(nodes) - 1):
        left, right = nodes[node], nodes[node + 1]
        fall, rise = -_half_slope(start, way, half, left), _half_slope(start, way, half, right)
        if fall <= 0.0:
            break  # Convex: from here on it only grows.
        if right <= left:
            continue
        nearest = left + (right - left) * (fall / (fall + rise)) if rise > 0.0 else right
        if _squared(start, way, half, nearest) <= reach2:
            # excess - 2 fall s + curvature s^2 = 0, the smaller root, without cancellation.
            excess = _squared(start, way, half, left) - reach2
            curvature = (rise + fall) / (right - left)
            root = math.sqrt(max(fall * fall - curvature * excess, 0.0))
            share: float = min(left + excess / (fall + root), nearest)
            return share
    return np.inf


@compiled
def _nodes(start: Vector, way: Vector, half: Vector) -> Any:
    """Return the shares, in order, between which the squared distance is one quadratic."""
    nodes = np.empty(8)
    nodes[0], nodes[1] = 0.0, 1.0
    count = 2
    for axis in range(3):
        # Along an axis on which nothing moves no plane is crossed.
        if way[axis] != 0.0:
            for side in (-half[axis], half[axis]):
                share = (side - start[axis]) / way[axis]
                if 0.0 < share < 1.0:
                    nodes[count] = share
                    count += 1
    return np.sort(nodes[:count])


@compiled
def _squared(start: Vector, way: Vector, half: Vector, share: float) -> float:
    """Return the squared distance to the box at a share of the piece."""
    total = 0.0
    for axis in range(3):
        beyond = max(abs(start[axis] + way[axis] * share) - half[axis], 0.0)
        total += beyond * beyond
    return total


@compiled
def _half_slope(start: Vector, way: Vector, half: Vector, share: float) -> float:
    """Return half the squared distance's derivative: never falling, linear between nodes."""
    total = 0.0
    for axis in range(3):
        at = start[axis] + way[axis] * share
        total += (at - min(max(at, -half[axis]), half[axis])) * way[axis]
    return total
