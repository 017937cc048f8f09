"""When does a moving ball enter a region? Decided on the whole path, so nothing is jumped over.

A region is a rounded box: all points within a radius of a box, and higher than a floor. Along a
straight piece of path the squared distance to the box is a convex and piecewise quadratic function
of time, whose pieces meet where the path crosses the planes of the box's faces. So the time of
entry is the root of one quadratic, and nothing has to be searched for.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from roller_env.game.tables import LevelTable

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]


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
    low, high = path.min(axis=1)[..., None], path.max(axis=1)[..., None]
    meets: Bool = (table.region_low <= high) & (table.region_high >= low)
    return meets[:, 0] & meets[:, 1] & meets[:, 2]


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
    times = np.full(len(depth), np.inf)
    pairs, pieces = np.nonzero(enters | may_graze)
    if len(pairs):
        share = _crossing(path[pairs, pieces], path[pairs, pieces + 1], regions, pairs)
        # A piece that ends inside by less than rounding enters at its end.
        share = np.where(enters[pairs, pieces], np.minimum(share, 1.0), share)
        np.minimum.at(times, pairs, pieces + share)
    return times


def _crossing(start: Float64, end: Float64, regions: _Regions, pairs: Int64) -> Float64:
    """Return the share, (n,) in 0 to 1, at which straight pieces enter; ``inf`` for a miss.

    Args:
        start: (n, 3) metres, outside the region.
        end: (n, 3) metres.
        regions: of all pairs.
        pairs: (n,) the pair of each piece.
    """
    way = end - start
    box = _BoxDistance(start - regions.centre[pairs], way, regions.half[pairs])
    height = start[:, 2] - regions.centre[pairs, 2] - regions.floor[pairs]
    reach2 = regions.radius[pairs] ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        rises = np.where((height < 0.0) & (way[:, 2] > 0.0), -height / way[:, 2], np.inf)
    over_floor = np.where(height >= 0.0, 0.0, rises)
    near = box.entry(reach2)
    share = np.maximum(near, over_floor)
    # Both sets are convex, so the later of the two entries is in both, or nothing is.
    at = np.minimum(share, 1.0)
    holds = (near >= over_floor) | (box.squared(at[:, None])[:, 0] <= reach2)
    holds &= (over_floor >= near) | (height + at * way[:, 2] >= 0.0)
    return np.where(holds & (share <= 1.0), share, np.inf)


class _BoxDistance:
    """The squared distance to a box along straight pieces, as functions of the share 0 to 1."""

    def __init__(self, start: Float64, way: Float64, half: Float64):
        """Take (n, 3) starts relative to the boxes' centres, ways and half edges, all metres."""
        self._start, self._way, self._half = start, way, half
        with np.errstate(divide="ignore", invalid="ignore"):
            planes = np.concatenate([(half - start) / way, (-half - start) / way], axis=1)
        # Along an axis on which nothing moves no plane is crossed.
        planes = np.clip(np.where(np.isfinite(planes), planes, 0.0), 0.0, 1.0)
        ends = np.tile([0.0, 1.0], (len(start), 1))
        self._nodes = np.sort(np.concatenate([ends, planes], axis=1), axis=1)

    def _beyond(self, share: Float64) -> Float64:
        """Return the vectors, (n, k, 3), from the nearest point of the box at (n, k) shares."""
        at = self._start[:, None] + self._way[:, None] * share[..., None]
        half = self._half[:, None]
        beyond: Float64 = at - np.clip(at, -half, half)
        return beyond

    def squared(self, share: Float64) -> Float64:
        """Return the squared distance, (n, k), at (n, k) shares."""
        beyond = self._beyond(share)
        squared: Float64 = np.einsum("nki,nki->nk", beyond, beyond)
        return squared

    def _half_slope(self, share: Float64) -> Float64:
        """Return half the derivative, (n, k): continuous, never falling, linear between nodes."""
        slope: Float64 = np.einsum("nki,ni->nk", self._beyond(share), self._way)
        return slope

    def nearest(self) -> Float64:
        """Return the share, (n,), at which each piece is nearest to its box."""
        slope = self._half_slope(self._nodes)
        rows = np.arange(len(slope))
        rising = slope >= 0.0
        after = np.where(rising.any(axis=1), rising.argmax(axis=1), slope.shape[1] - 1)
        before = np.maximum(after - 1, 0)
        low, high = slope[rows, before], slope[rows, after]
        left, right = self._nodes[rows, before], self._nodes[rows, after]
        crosses = (low < 0.0) & (high > 0.0)
        part = np.where(crosses, -low / np.where(crosses, high - low, 1.0), 1.0)
        share: Float64 = left + (right - left) * part
        return share

    def entry(self, reach2: Float64) -> Float64:
        """Return the share, (n,), at which the squared distance falls to ``reach2``, or ``inf``."""
        nodes = np.minimum(self._nodes, self.nearest()[:, None])
        within = self.squared(nodes) <= reach2[:, None]
        rows, after = np.arange(len(nodes)), within.argmax(axis=1)
        left = nodes[rows, np.maximum(after - 1, 0)]
        right = nodes[rows, after]
        excess = self.squared(left[:, None])[:, 0] - reach2
        slopes = self._half_slope(np.stack([left, right], axis=1))
        width = np.where(right > left, right - left, 1.0)
        curvature = (slopes[:, 1] - slopes[:, 0]) / width
        # excess + 2 slope s + curvature s^2 = 0, the smaller root, without cancellation.
        fall = -slopes[:, 0]
        root = np.sqrt(np.maximum(fall * fall - curvature * excess, 0.0))
        step = excess / np.maximum(fall + root, np.finfo(np.float64).tiny)
        share = np.where(after == 0, 0.0, np.minimum(left + step, right))
        return np.where(within.any(axis=1), share, np.inf)
