"""The solids that a ball can meet, as arrays, and a grid that finds those near it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]

STATIC: Final = -1
"""Slab index of a solid that stands still."""

CELL_M: Final = 1.0
"""Edge of the grid's cells."""

MARGIN_M: Final = 1.25
"""A cell lists every solid within this distance of a ball whose centre is over it. The engine
looks no further ahead than the ball can travel over this distance."""

MOST_CELLS: Final = 4_000_000
"""The cells grow where there would be more."""


@dataclass(frozen=True, slots=True)
class SolidBox:
    """A box for the ball to meet.

    Attributes:
        centre: (3,) metres, world frame; of a slab where it is before it moves.
        half_size: (3,) half edges along its own axes, metres.
        rotation: (3, 3) box frame to world frame.
        friction: Coulomb's coefficient of the ball on it.
        elasticity: Newton's coefficient of restitution of the ball on it.
        slab: index of the slab that it is, or `STATIC`.
    """

    centre: Sequence[float]
    half_size: Sequence[float]
    rotation: Sequence[Sequence[float]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    friction: float = 0.3
    elasticity: float = 0.0
    slab: int = STATIC


class Scene(NamedTuple):
    """B boxes and the grid over them, as compiled code takes them. SI units, world frame."""

    radius: float  # of the ball
    gravity: float  # m/s^2, downwards
    centre: Float64  # (B, 3)
    axes: Float64  # (B, 3, 3) row k: the box's axis k
    half: Float64  # (B, 3)
    aligned: npt.NDArray[np.bool_]  # (B,) its axes are the world's
    low: Float64  # (B, 3) bounding box, of a slab before it moves
    high: Float64  # (B, 3)
    friction: Float64  # (B,)
    elasticity: Float64  # (B,)
    slab: Int64  # (B,)
    slab_stop: Float64  # (P,) displacement at which a slab is down, <= 0
    cell_start: Int64  # (cells + 1,) where each cell's boxes begin in `cell_box`
    cell_box: Int64  # boxes of all cells, one cell after the other
    grid: Int64  # (2,) cells along x and y
    origin: Float64  # (2,) corner of the grid
    cell: float  # edge of a cell


def make_scene(
    boxes: Sequence[SolidBox],
    radius: float,
    gravity: float,
    slab_stop: Sequence[float] = (),
) -> Scene:
    """Return the scene of a ball of ``radius`` among ``boxes``.

    Args:
        boxes: what it can meet, overlapping as they like.
        radius: of the ball, metres.
        gravity: m/s^2, downwards.
        slab_stop: (P,) the displacement, <= 0, at which each slab is down.

    Raises:
        ValueError: a box names a slab that ``slab_stop`` does not have.
    """
    slab = np.array([box.slab for box in boxes], dtype=np.int64)
    if len(slab) and (slab.max() >= len(slab_stop) or slab.min() < STATIC):
        raise ValueError(
            f"slab: found {slab.min()} to {slab.max()}; must be {STATIC} to {len(slab_stop) - 1}"
        )
    centre = np.array([box.centre for box in boxes], dtype=np.float64).reshape(-1, 3)
    half = np.array([box.half_size for box in boxes], dtype=np.float64).reshape(-1, 3)
    rotation = np.array([box.rotation for box in boxes], dtype=np.float64).reshape(-1, 3, 3)
    extent = np.einsum("bij,bj->bi", np.abs(rotation), half)
    low, high = centre - extent, centre + extent
    cell, origin, grid, start, found = _grid(low, high, radius + MARGIN_M)
    return Scene(
        radius=float(radius),
        gravity=float(gravity),
        centre=centre,
        axes=np.ascontiguousarray(rotation.transpose(0, 2, 1)),
        half=half,
        aligned=(rotation == np.eye(3)).all(axis=(1, 2)),
        low=low,
        high=high,
        friction=np.array([box.friction for box in boxes], dtype=np.float64),
        elasticity=np.array([box.elasticity for box in boxes], dtype=np.float64),
        slab=slab,
        slab_stop=np.array(slab_stop, dtype=np.float64),
        cell_start=start,
        cell_box=found,
        grid=grid,
        origin=origin,
        cell=cell,
    )


def _grid(low: Float64, high: Float64, reach: float) -> tuple[float, Float64, Int64, Int64, Int64]:
    """Return cell edge, origin, numbers of cells, and each cell's boxes."""
    if len(low) == 0:
        empty = np.zeros(2, dtype=np.int64)
        return CELL_M, np.zeros(2), empty, np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    origin = low[:, :2].min(axis=0) - reach
    span = high[:, :2].max(axis=0) + reach - origin
    cell = max(CELL_M, float(np.sqrt(span.prod() / MOST_CELLS)))
    grid = np.floor(span / cell).astype(np.int64) + 1
    first = np.floor((low[:, :2] - reach - origin) / cell).astype(np.int64)
    last = np.floor((high[:, :2] + reach - origin) / cell).astype(np.int64)
    cells, boxes = [], []
    for index, ((x0, y0), (x1, y1)) in enumerate(zip(first, last, strict=True)):
        covered = (np.arange(x0, x1 + 1)[:, None] * grid[1] + np.arange(y0, y1 + 1)).ravel()
        cells.append(covered)
        boxes.append(np.full(len(covered), index, dtype=np.int64))
    where, what = np.concatenate(cells), np.concatenate(boxes)
    order = np.argsort(where, kind="stable")
    start = np.searchsorted(where[order], np.arange(grid.prod() + 1)).astype(np.int64)
    return cell, origin, grid, start, what[order]
