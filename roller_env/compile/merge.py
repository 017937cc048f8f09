"""Coplanar boxes into as few as possible.

A ball that rolls over the seam of two boxes meets both of them at once, which costs a contact and,
with soft contacts, a bump. Boxes that share their upper and lower face and their material are one
slab with a rectilinear outline; this module cuts every such slab into few rectangles again.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from roller_env.pieces.piece import Solid

GRID_M = 1e-6
"""Coordinates that differ by less are the same edge: a micrometre, far below any contact's
softness, far above float64 noise at level size."""

Rectangle = tuple[int, int, int, int]
"""Index ranges [x0, x1) and [y0, y1) on a grid, as (x0, x1, y0, y1)."""


def merge_solids(solids: Iterable[Solid]) -> list[Solid]:
    """Return solids that fill exactly the space of ``solids``, coplanar ones merged; never more.

    Only axis-aligned boxes with equal vertical extent and equal material merge. The order of
    first appearance is kept, so equal levels give equal models.
    """
    slabs: dict[tuple[str, int, int], list[Solid]] = defaultdict(list)
    merged: list[Solid] = []
    order: list[tuple[str, int, int] | Solid] = []
    for solid in solids:
        if not solid.axis_aligned:
            order.append(solid)
            continue
        bottom = round((solid.centre[2] - solid.half_size[2]) / GRID_M)
        top = round((solid.centre[2] + solid.half_size[2]) / GRID_M)
        key = (solid.material, bottom, top)
        if key not in slabs:
            order.append(key)
        slabs[key].append(solid)
    for entry in order:
        merged += [entry] if isinstance(entry, Solid) else _merge_slab(slabs[entry])
    return merged


def _merge_slab(boxes: Sequence[Solid]) -> list[Solid]:
    """Merge boxes of one material and one vertical extent."""
    if len(boxes) == 1:
        return list(boxes)
    centre = np.array([box.centre for box in boxes])[:, :2]
    half = np.array([box.half_size for box in boxes])[:, :2]
    low = np.round((centre - half) / GRID_M).astype(np.int64)
    high = np.round((centre + half) / GRID_M).astype(np.int64)
    xs = np.unique(np.concatenate([low[:, 0], high[:, 0]]))
    ys = np.unique(np.concatenate([low[:, 1], high[:, 1]]))
    filled = np.zeros((len(xs) - 1, len(ys) - 1), dtype=bool)
    columns = zip(
        np.searchsorted(xs, low[:, 0]),
        np.searchsorted(xs, high[:, 0]),
        np.searchsorted(ys, low[:, 1]),
        np.searchsorted(ys, high[:, 1]),
        strict=True,
    )
    for x0, x1, y0, y1 in columns:
        filled[x0:x1, y0:y1] = True
    rectangles = cover(filled)
    if len(rectangles) > len(boxes):  # as for two boxes that cross
        return list(boxes)
    first = boxes[0]
    result = []
    for x0, x1, y0, y1 in rectangles:
        corner = np.array([xs[x0], ys[y0]]) * GRID_M
        opposite = np.array([xs[x1], ys[y1]]) * GRID_M
        middle, extent = (corner + opposite) / 2, (opposite - corner) / 2
        result.append(
            Solid(
                (float(middle[0]), float(middle[1]), first.centre[2]),
                (float(extent[0]), float(extent[1]), first.half_size[2]),
                first.rotation,
                first.material,
                first.source,
            )
        )
    return result


def cover(filled: npt.NDArray[np.bool_]) -> list[Rectangle]:
    """Cut the True cells of a grid into disjoint rectangles, few of them.

    Strips of equal runs are joined once along x and once along y, and the better cut is taken.
    The minimum needs a matching of the outline's chords (Lipski et al. 1979); on floor plans the
    simple cut was within a box or two of it, which does not pay for the machinery.
    """
    along_x = _strips(filled)
    along_y = [(x0, x1, y0, y1) for y0, y1, x0, x1 in _strips(filled.T)]
    return min(along_x, along_y, key=len)


def _strips(filled: npt.NDArray[np.bool_]) -> list[Rectangle]:
    """Cut into runs along the second axis, joined while neighbouring rows have the same run."""
    done: list[Rectangle] = []
    running: dict[tuple[int, int], int] = {}
    for x in range(filled.shape[0] + 1):
        runs = _runs(filled[x]) if x < filled.shape[0] else []
        done += [(running.pop(run), x, *run) for run in list(running) if run not in runs]
        for run in runs:
            running.setdefault(run, x)
    return sorted(done)


def _runs(row: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the [start, stop) of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
