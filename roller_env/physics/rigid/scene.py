"""The solids that balls can meet, as arrays, and a grid that finds those near a ball.

Any number of levels lie one behind the other in the same arrays; a ball has the index of its level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Float64, Int64
from roller_env.physics.rigid.kernels import Records
from roller_env.physics.rigid.law import COULOMB, ContactLaw

Int32 = npt.NDArray[np.int32]

STATIC: Final = -1
"""Slab index of a solid that stands still."""

CELL_M: Final = 1.0
"""Edge of the grid's cells."""

MARGIN_M: Final = 1.25
"""A cell lists every solid within this distance of a ball whose centre is over it. The engine
looks no further ahead than the ball can travel over this distance."""

MOST_CELLS: Final = 4_000_000
"""Of one level. The cells grow where there would be more."""

MOST_NEAR: Final = 512
"""Solids that a cell may list."""

SOLID: Final = np.dtype(
    [
        ("centre", np.float64, 3),  # of a slab where it is before it moves
        ("half", np.float64, 3),  # half edges
        ("axes", np.float64, (3, 3)),  # row k: the box's axis k in the world
        ("low", np.float64, 3),  # bounding box, of a slab before it moves
        ("high", np.float64, 3),
        ("friction", np.float64),
        ("elasticity", np.float64),  # coefficient of restitution, as the law has it
        ("reversal", np.float64),  # tangential restitution
        ("dilatancy", np.float64),  # v_n / |u| where the ball slips on it
        ("slab", np.int64),  # which slab of its level it is, or `STATIC`
        ("aligned", np.int64),  # 1 if its axes are the world's
    ],
    align=True,
)
"""A box that a ball can meet. SI units, world frame."""

LEVEL: Final = np.dtype(
    [
        ("radius", np.float64),  # of the ball
        ("mass", np.float64),  # of the ball
        ("gravity", np.float64),  # m/s^2, downwards
        ("slabs", np.int64),  # how many it has
        ("first_cell", np.int64),  # its first cell's place in `Scenes.cell_start`
        ("grid", np.int64, 2),  # cells along x and y
        ("origin", np.float64, 2),  # corner of the grid
        ("cell", np.float64),  # edge of a cell
    ],
    align=True,
)
"""What a level's solids have in common. SI units, world frame."""


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


@dataclass(frozen=True, slots=True)
class RigidLevel:
    """A ball and what it can meet.

    Attributes:
        boxes: solids, overlapping as they like.
        radius: of the ball, metres.
        gravity: m/s^2, downwards.
        mass: of the ball, kg.
        law: of all its contacts.
        slab_stop: (P,) the displacement, metres, <= 0, at which each slab is down. It stands
            between there and 0, where it is before it moves.
    """

    boxes: Sequence[SolidBox]
    radius: float
    gravity: float
    mass: float = 1.0
    slab_stop: Sequence[float] = ()
    law: ContactLaw = COULOMB


class Scenes(NamedTuple):
    """L levels with B boxes in all, as compiled code takes them. SI units, world frame."""

    level: Records  # (L,) of `LEVEL`
    solid: Records  # (B,) of `SOLID`, one level after the other
    slab_stop: Float64  # (L, P) displacement at which a slab is down, <= 0; 0 for none
    cell_start: Int64  # (cells + 1,) where each cell's boxes begin in `cell_solid`
    cell_solid: Int32  # boxes of all cells, one cell after the other


def pack(levels: Sequence[RigidLevel]) -> Scenes:
    """Return the levels as arrays.

    Raises:
        ValueError: a box names a slab that its level does not have, or more boxes than `MOST_NEAR`
            lie in one place.
    """
    level = np.zeros(len(levels), LEVEL).view(np.recarray)
    slab_stop = np.zeros((len(levels), max((len(each.slab_stop) for each in levels), default=0)))
    solids, starts, lists = [], [np.zeros(1, dtype=np.int64)], []
    boxes = cells = entries = 0
    for number, each in enumerate(levels):
        solid = _solids(each, number)
        cell, origin, grid, start, found = _grid(solid, each.radius + MARGIN_M)
        if len(start) > 1 and np.diff(start).max() > MOST_NEAR:
            raise ValueError(
                f"levels[{number}]: found {np.diff(start).max()} boxes within {MARGIN_M:g} m of a "
                f"square of {cell:g} m; at most {MOST_NEAR} can be there"
            )
        slab_stop[number, : len(each.slab_stop)] = each.slab_stop
        level[number] = (
            each.radius,
            each.mass,
            each.gravity,
            len(each.slab_stop),
            cells,
            grid,
            origin,
            cell,
        )
        solids.append(solid)
        starts.append(start[1:] + entries)
        lists.append(found + boxes)
        boxes, cells, entries = boxes + len(solid), cells + len(start) - 1, entries + len(found)
    return Scenes(
        level=level,
        solid=np.concatenate([*solids, np.zeros(0, SOLID)]).view(np.recarray),
        slab_stop=slab_stop,
        cell_start=np.concatenate(starts),
        cell_solid=np.concatenate([*lists, np.zeros(0, np.int64)]).astype(np.int32),
    )


def _solids(level: RigidLevel, number: int) -> Records:
    """Return a level's boxes."""
    boxes = level.boxes
    slab = np.array([box.slab for box in boxes], dtype=np.int64)
    if len(slab) and (slab.max() >= len(level.slab_stop) or slab.min() < STATIC):
        raise ValueError(
            f"levels[{number}].boxes: found slab {slab.min()} to {slab.max()}; must be {STATIC} to "
            f"{len(level.slab_stop) - 1}"
        )
    centre = np.array([box.centre for box in boxes], dtype=np.float64).reshape(-1, 3)
    half = np.array([box.half_size for box in boxes], dtype=np.float64).reshape(-1, 3)
    rotation = np.array([box.rotation for box in boxes], dtype=np.float64).reshape(-1, 3, 3)
    extent = np.einsum("bij,bj->bi", np.abs(rotation), half)
    solid = np.zeros(len(boxes), SOLID)
    solid["centre"], solid["half"] = centre, half
    solid["axes"] = rotation.transpose(0, 2, 1)
    solid["low"], solid["high"] = centre - extent, centre + extent
    solid["friction"] = [box.friction for box in boxes]
    solid["elasticity"] = [level.law.restitution(box.elasticity) for box in boxes]
    solid["reversal"] = [level.law.tangential_restitution(box.elasticity) for box in boxes]
    solid["dilatancy"] = level.law.dilatancy * solid["friction"]
    solid["slab"] = slab
    solid["aligned"] = (rotation == np.eye(3)).all(axis=(1, 2))
    return solid


def _grid(solid: Records, reach: float) -> tuple[float, Float64, Int64, Int64, Int64]:
    """Return cell edge, origin, numbers of cells, and each cell's boxes."""
    if len(solid) == 0:
        empty = np.zeros(2, dtype=np.int64)
        return CELL_M, np.zeros(2), empty, np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    low, high = solid["low"][:, :2], solid["high"][:, :2]
    origin = low.min(axis=0) - reach
    span = high.max(axis=0) + reach - origin
    cell = max(CELL_M, float(np.sqrt(span.prod() / MOST_CELLS)))
    grid = np.floor(span / cell).astype(np.int64) + 1
    first = np.floor((low - reach - origin) / cell).astype(np.int64)
    last = np.floor((high + reach - origin) / cell).astype(np.int64)
    cells, boxes = [], []
    for index, ((x0, y0), (x1, y1)) in enumerate(zip(first, last, strict=True)):
        covered = (np.arange(x0, x1 + 1)[:, None] * grid[1] + np.arange(y0, y1 + 1)).ravel()
        cells.append(covered)
        boxes.append(np.full(len(covered), index, dtype=np.int64))
    where, what = np.concatenate(cells), np.concatenate(boxes)
    order = np.argsort(where, kind="stable")
    start = np.searchsorted(where[order], np.arange(grid.prod() + 1)).astype(np.int64)
    return cell, origin, grid, start, what[order]
