"""Where the ball's centre can be: a coarse grid of columns, each with its free spans of height.

Every solid is taken as thick as the ball's radius makes it, so that a ball is a point: a span's
lower end is where a ball rests, its upper end where it touches what is over it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.piece import Solid

Indices = npt.NDArray[np.intp]

EDGE, FLAT, SLOPE = 0, 1, 2
"""What a ball rests on: an edge, a level face, a tilted face."""

MAX_COLUMNS: Final = 1_000_000
MAX_ENTRIES: Final = 4_000_000
"""Columns of a grid, and solids met by them: about ten seconds of a busy core, and 500 MB."""

_FINEST: Final = 0.5
_COARSEST: Final = 0.9
"""Edge of a column in radii. Up to the coarser one no beam lies unseen between two columns."""

_STACK: Final = 1e5
"""More than any height: one column's heights are put over another's with it."""


@dataclass(frozen=True)
class Spans:
    """The free spans, by column, from below; every column has at least one.

    Attributes:
        corner: x and y of the first column's middle, metres.
        cell: edge of a column, metres.
        shape: number of columns along x and y.
        first: (columns + 1,) index of each column's first span; columns along y are neighbours.
        floor: (spans,) lowest height of the ball's centre, metres; -inf over the void.
        ceiling: (spans,) highest; inf under the sky.
        kind: (spans,) EDGE, FLAT or SLOPE: what is under it. Meaningless over the void.
        solid: (spans,) index of the solid under it, -1 over the void.
        under: (spans,) thickness of what is under it, upright, metres; inf over the void.
    """

    corner: tuple[float, float]
    cell: float
    shape: tuple[int, int]
    first: Indices
    floor: Float64
    ceiling: Float64
    kind: npt.NDArray[np.int8]
    solid: Indices
    under: Float64

    @property
    def column(self) -> Indices:
        """The column of each span."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))

    @property
    def is_support(self) -> Bool:
        """Whether something is under a span."""
        return np.isfinite(self.floor)

    def window(self, low: Sequence[float], high: Sequence[float]) -> Indices:
        """Return the spans of the columns whose middles lie from ``low`` to ``high``, (x, y)."""
        edges = [
            (
                max(int(np.ceil((low[k] - self.corner[k]) / self.cell)), 0),
                min(int(np.floor((high[k] - self.corner[k]) / self.cell)), self.shape[k] - 1),
            )
            for k in (0, 1)
        ]
        (x0, x1), (y0, y1) = edges
        if x0 > x1 or y0 > y1:
            return np.zeros(0, dtype=np.intp)
        rows = np.arange(x0, x1 + 1) * self.shape[1]
        return np.concatenate(
            [np.arange(self.first[row + y0], self.first[row + y1 + 1]) for row in rows]
        )


def free_spans(solids: Sequence[Solid], radius: float, around: Float64) -> Spans | None:
    """Return where the centre of a ball can be.

    Args:
        solids: what it cannot enter.
        radius: the ball's, metres.
        around: (n, 2) places, metres, that the grid must hold, besides the solids.

    Returns:
        The spans; None for a level that is too large for columns as narrow as the ball needs.
    """
    centres = np.array([solid.centre for solid in solids]).reshape(-1, 3)
    rotations = np.array([solid.rotation for solid in solids]).reshape(-1, 3, 3)
    halves = np.array([solid.half_size for solid in solids]).reshape(-1, 3)
    reach = np.einsum("nij,nj->ni", np.abs(rotations), halves)[:, :2] + radius
    low = np.concatenate([centres[:, :2] - reach, around]).min(axis=0) - 2.0 * radius
    high = np.concatenate([centres[:, :2] + reach, around]).max(axis=0) + 2.0 * radius
    cell = _FINEST * radius
    while _is_too_fine(low, high, reach, cell):
        cell *= 1.2
        if cell > _COARSEST * radius:
            return None
    shape = tuple(int(n) for n in np.ceil((high - low) / cell).astype(int) + 1)
    met = [_met(solid, low, cell, shape, radius) for solid in solids]
    columns, bottoms, tops, kinds = (
        np.concatenate([part[k] for part in met]) if met else np.zeros(0) for k in range(4)
    )
    numbers = np.repeat(np.arange(len(met)), [len(part[0]) for part in met])
    return _complement(
        (float(low[0]), float(low[1])),
        cell,
        (shape[0], shape[1]),
        radius,
        (columns.astype(np.intp), bottoms, tops, kinds.astype(np.int8), numbers),
    )


def _is_too_fine(low: Float64, high: Float64, reach: Float64, cell: float) -> bool:
    entries = np.prod(2.0 * reach / cell + 1.0, axis=1).sum()
    return bool(np.prod((high - low) / cell + 2.0) > MAX_COLUMNS or entries > MAX_ENTRIES)


def _met(
    solid: Solid, low: Float64, cell: float, shape: Sequence[int], radius: float
) -> tuple[Indices, Float64, Float64, npt.NDArray[np.int8]]:
    """Return the columns in which a ball meets a solid, from where to where, and its kind there."""
    rotation, half = np.array(solid.rotation), np.array(solid.half_size)
    centre = np.array(solid.centre)
    reach = (np.abs(rotation) @ half)[:2] + radius
    begin = np.maximum(np.ceil((centre[:2] - reach - low) / cell).astype(int), 0)
    end = np.minimum(np.floor((centre[:2] + reach - low) / cell).astype(int), np.array(shape) - 1)
    xs, ys = np.meshgrid(*(np.arange(begin[k], end[k] + 1) for k in (0, 1)), indexing="ij")
    places = np.stack([xs.ravel(), ys.ravel()], axis=1) * cell + low - centre[:2]
    columns = (xs * shape[1] + ys).ravel()
    if isinstance(solid, ConvexSolid):
        bottoms, tops, kind = _met_convex(solid, places + centre[:2], radius)
        hit = tops > bottoms
        return columns[hit], bottoms[hit], tops[hit], kind[hit]
    if abs(rotation[2, 2]) > 1.0 - 1e-9:
        outside = np.maximum(np.abs(places @ rotation[:2, :2]) - half[:2], 0.0)
        away = (outside**2).sum(axis=1)
        hit = away < radius**2
        height = half[2] + np.sqrt(radius**2 - away[hit])
        kind = np.where(away[hit] == 0.0, FLAT, EDGE).astype(np.int8)
        return columns[hit], centre[2] - height, centre[2] + height, kind
    # A box and a ball's radius around it is at least three boxes, each longer along one axis.
    bottoms, tops = np.full(len(places), np.inf), np.full(len(places), -np.inf)
    kind = np.full(len(places), EDGE, dtype=np.int8)
    upper = int(np.abs(rotation[2]).argmax())
    for axis in (upper, (upper + 1) % 3, (upper + 2) % 3):
        longer = half.copy()
        longer[axis] += radius
        bottom, top = _cut(places, rotation, longer)
        higher = (top > tops + 1e-9) & (bottom <= top)
        kind[higher] = SLOPE if axis == upper else EDGE
        tops[higher] = top[higher]
        lower = (bottom < bottoms) & (bottom <= top)
        bottoms[lower] = bottom[lower]
    hit = tops > bottoms
    return columns[hit], centre[2] + bottoms[hit], centre[2] + tops[hit], kind[hit]


def _met_convex(
    solid: ConvexSolid, places: Float64, radius: float
) -> tuple[Float64, Float64, npt.NDArray[np.int8]]:
    """Return from where to where a ball meets a solid over places, (n, 2) metres, and its kind.

    The solid and a ball's radius around it hold the solid moved by that along each of its normals.
    What they hold besides, round its edges, is left out, as it is of tilted boxes.
    """
    bottoms, tops = solid.upright(places)
    kind = np.full(len(places), EDGE, dtype=np.int8)
    for side in solid.sides:
        normal = np.array(side.normal)
        bottom, top = np.array(solid.upright(places - radius * normal[:2])) + radius * normal[2]
        higher = top > tops + 1e-9
        kind[higher] = EDGE
        if normal[2] > 1e-9:
            beyond = places @ normal[:2] + top * normal[2] - side.offset
            on_face = higher & (beyond > radius - 1e-9)
            kind[on_face] = FLAT if normal[2] > 1.0 - 1e-9 else SLOPE
        tops, bottoms = np.maximum(tops, top), np.minimum(bottoms, bottom)
    return bottoms, tops, kind


def _cut(places: Float64, rotation: Float64, half: Float64) -> tuple[Float64, Float64]:
    """Return from where to where upright lines run inside a box about the origin."""
    bottom, top = np.full(len(places), -np.inf), np.full(len(places), np.inf)
    for axis in range(3):
        across, slope = places @ rotation[:2, axis], rotation[2, axis]
        if abs(slope) < 1e-9:
            top = np.where(np.abs(across) <= half[axis], top, -np.inf)
            continue
        ends = (np.array([[-half[axis]], [half[axis]]]) - across) / slope
        bottom, top = np.maximum(bottom, ends.min(axis=0)), np.minimum(top, ends.max(axis=0))
    return bottom, top


def _complement(
    corner: tuple[float, float],
    cell: float,
    shape: tuple[int, int],
    radius: float,
    met: tuple[Indices, Float64, Float64, npt.NDArray[np.int8], Indices],
) -> Spans:
    """Return what the solids leave free."""
    order = np.lexsort((met[1], met[0]))
    columns, bottoms, tops, kinds, numbers = (part[order] for part in met)
    count = shape[0] * shape[1]
    stacked = tops + columns * _STACK
    highest = np.maximum.accumulate(stacked) if len(stacked) else stacked
    # The one of each column's solids so far that reaches highest.
    upper = np.maximum.accumulate(np.where(stacked >= highest, np.arange(len(stacked)), 0))
    last = np.append(columns[1:] != columns[:-1], True)[: len(columns)]
    first = np.append(True, columns[1:] != columns[:-1])[: len(columns)]
    next_bottom = np.append(bottoms[1:], np.inf)
    # Solids of one column that touch or overlap are one block: where it begins.
    begins = first | np.append(True, bottoms[1:] > tops[upper][:-1])[: len(columns)]
    block = np.maximum.accumulate(np.where(begins, np.arange(len(columns)), 0))
    over = last | (next_bottom > tops[upper])
    empty = np.setdiff1d(np.arange(count), columns)
    void = np.concatenate([columns[first], empty])
    below = np.full(len(void), -np.inf)
    column = np.concatenate([columns[over], void])
    floor = np.concatenate([tops[upper][over], below])
    arranged = np.lexsort((floor, column))
    return Spans(
        corner=corner,
        cell=cell,
        shape=shape,
        first=np.searchsorted(column[arranged], np.arange(count + 1)),
        floor=floor[arranged],
        ceiling=np.concatenate(
            [
                np.where(last, np.inf, next_bottom)[over],
                bottoms[first],
                np.full(len(empty), np.inf),
            ]
        )[arranged],
        kind=np.append(kinds[upper][over], np.full(len(void), EDGE)).astype(np.int8)[arranged],
        solid=np.append(numbers[upper][over], np.full(len(void), -1))[arranged],
        under=np.append((tops[upper] - bottoms[block])[over] - 2.0 * radius, -below)[arranged],
    )
