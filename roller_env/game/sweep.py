"""When does a moving ball enter a region? Decided on the whole path, so nothing is jumped over.

A region is a rounded box: all points within a radius of a box, and higher than a floor. It is
convex, so along a straight piece of path the distance to it is a convex function of time: it is
entered at most once a piece, and a piece that starts and ends outside crosses it only if the
minimum between is inside.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from roller_env.game.tables import LevelTable

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

_HALVINGS = 40
"""Bisections of one substep: 2^-40 of it is below a nanometre at any speed of the game."""

_TRISECTIONS = 60
"""Ternary searches of one substep: (2/3)^60 = 3e-11 of it."""


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
    rows, columns = np.nonzero(_near(path, table) & live)
    if len(rows) == 0:
        return entry, inside
    regions = _Regions(table, rows, columns)
    depth = regions.depth(path[rows])
    inside[rows, columns] = depth[:, -1] <= 0.0
    times = _first_crossing(path[rows], depth, regions)
    times[(depth[:, 0] <= 0.0) & ~touching[rows, columns]] = 0.0
    entry[rows, columns] = times
    return entry, inside


def _near(path: Float64, table: LevelTable) -> Bool:
    """Say which regions' bounding boxes, (n, M), meet the bounding box of the row's path."""
    low, high = path.min(axis=1), path.max(axis=1)
    near = np.ones(table.region_radius.shape, dtype=bool)
    for axis in range(3):
        near &= table.region_low[axis] <= high[:, axis, None]
        near &= table.region_high[axis] >= low[:, axis, None]
    return near


class _Regions:
    """The regions of a selection of (row, region) pairs, for a close look."""

    def __init__(self, table: LevelTable, rows: Int64, columns: Int64):
        self.centre = table.region_centre[rows, columns]
        self.half = table.region_half[rows, columns]
        self.radius = table.region_radius[rows, columns]
        self.floor = table.region_floor[rows, columns]

    def depth(self, points: Float64, pairs: Int64 | slice = slice(None)) -> Float64:
        """Return how far outside its region each point lies, negative or zero inside.

        It changes by at most a metre for each metre that the point moves.

        Args:
            points: (n, ..., 3) metres, world frame, for the n ``pairs`` (all, by default).
            pairs: indices of pairs.

        Returns:
            (n, ...) metres: the distance to the rounded box, or to the floor if that is more.
        """
        wide = (slice(None),) + (None,) * (points.ndim - 2)
        relative = points - self.centre[pairs][wide]
        beyond = np.maximum(np.abs(relative) - self.half[pairs][wide], 0.0)
        distance = np.sqrt((beyond * beyond).sum(axis=-1)) - self.radius[pairs][wide]
        height: Float64 = self.floor[pairs][wide] - relative[..., 2]
        result: Float64 = np.maximum(distance, height)
        return result


def _first_crossing(path: Float64, depth: Float64, regions: _Regions) -> Float64:
    """Return the time, (pairs,) in substeps, at which each path first goes from out to inside."""
    before, after = depth[:, :-1], depth[:, 1:]
    enters = (before > 0.0) & (after <= 0.0)
    length = np.linalg.norm(np.diff(path, axis=1), axis=-1)
    may_graze = (before > 0.0) & (after > 0.0) & (before + after <= length)
    inside_at = np.ones_like(before)
    pairs, pieces = np.nonzero(may_graze)
    if len(pairs):
        deepest, bottom = _deepest(path[pairs, pieces], path[pairs, pieces + 1], regions, pairs)
        inside_at[pairs, pieces] = deepest
        enters[pairs, pieces] = bottom <= 0.0
    times = np.full(len(depth), np.inf)
    pairs = np.flatnonzero(enters.any(axis=1))
    if len(pairs):
        piece = enters[pairs].argmax(axis=1)
        start, end = path[pairs, piece], path[pairs, piece + 1]
        times[pairs] = piece + _boundary(start, end, inside_at[pairs, piece], regions, pairs)
    return times


def _deepest(
    start: Float64, end: Float64, regions: _Regions, pairs: Int64
) -> tuple[Float64, Float64]:
    """Return the fraction of each piece at which it is deepest, and the depth there; both (n,)."""
    low, high = np.zeros(len(start)), np.ones(len(start))
    for _ in range(_TRISECTIONS):
        left, right = low + (high - low) / 3.0, high - (high - low) / 3.0
        is_left = regions.depth(_between(start, end, left), pairs) < regions.depth(
            _between(start, end, right), pairs
        )
        low, high = np.where(is_left, low, left), np.where(is_left, right, high)
    middle = (low + high) / 2.0
    return middle, regions.depth(_between(start, end, middle), pairs)


def _boundary(
    start: Float64, end: Float64, inside_at: Float64, regions: _Regions, pairs: Int64
) -> Float64:
    """Return the fraction, (n,), at which each piece, outside at 0, first is inside."""
    low, high = np.zeros(len(start)), inside_at
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        is_inside = regions.depth(_between(start, end, middle), pairs) <= 0.0
        low, high = np.where(is_inside, low, middle), np.where(is_inside, middle, high)
    return high


def _between(start: Float64, end: Float64, fraction: Float64) -> Float64:
    return start + (end - start) * fraction[:, None]
