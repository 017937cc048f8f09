"""The solids that balls can meet, as arrays, and a grid that finds those near a ball.

Any number of levels lie one behind the other in the same arrays; a ball has the index of its level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Float64, Int64
from roller_env.physics.rigid.hull import Hull, hull_of
from roller_env.physics.rigid.kernels import Records
from roller_env.physics.rigid.law import COULOMB, ContactLaw

Int32 = npt.NDArray[np.int32]

UPWARDS: Final = (0.0, 0.0, 1.0)

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
        ("half", np.float64, 3),  # half edges of a box
        ("axes", np.float64, (3, 3)),  # row k: the box's axis k in the world
        ("faces", np.int64),  # of a hull: its faces in `Solids.feature` begin here
        ("edges", np.int64),  # and its edges here
        ("corners", np.int64),  # and its corners
        ("end", np.int64),  # and here they end; 0 of a box
        ("low", np.float64, 3),  # bounding box, of a slab before it moves
        ("high", np.float64, 3),
        ("friction", np.float64),
        ("elasticity", np.float64),  # coefficient of restitution, as the law has it
        ("reversal", np.float64),  # tangential restitution
        ("dilatancy", np.float64),  # v_n / |u| where the ball slips on it
        ("slab", np.int64),  # which slab of its level it is, or `STATIC`
        ("along", np.float64, 3),  # direction in which that one's displacement counts
        ("aligned", np.int64),  # 1 if its axes are the world's
    ],
    align=True,
)
"""A box or hull that a ball can meet. SI units, world frame."""

FEATURE: Final = np.dtype(
    [
        ("point", np.float64, 3),  # of it, from the solid's centre
        ("direction", np.float64, 3),  # of a face its normal, of an edge along it
        ("offset", np.float64),  # of a face: along its normal
        ("length", np.float64),  # of an edge
        ("ends", np.int64, 2),  # of an edge: its corners
        ("bounds", np.int64),  # of its region in `Solids.bound` begin here
        ("end", np.int64),  # and end here
    ],
    align=True,
)
"""A face, edge or corner of a hull; see `roller_env.physics.rigid.hull.Feature`."""

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
class SolidHull:
    """The convex hull of points, for the ball to meet.

    Attributes:
        points: (n, 3) metres, world frame; of a slab where they are before it moves. They span a
            volume.
        friction: Coulomb's coefficient of the ball on it.
        elasticity: Newton's coefficient of restitution of the ball on it.
        slab: index of the slab that it is, or `STATIC`.
    """

    points: Sequence[Sequence[float]]
    friction: float = 0.3
    elasticity: float = 0.0
    slab: int = STATIC


@dataclass(frozen=True, slots=True)
class RigidLevel:
    """A ball and what it can meet.

    Attributes:
        solids: overlapping as they like.
        radius: of the ball, metres.
        gravity: m/s^2, downwards.
        mass: of the ball, kg.
        law: of all its contacts.
        slab_stop: (P,) the displacement, metres, <= 0, at which each slab is at its end. It stands
            between there and 0, where it is before it moves.
        slab_along: (P, 3) unit vectors along which displacements count; upwards, if there are none.
    """

    solids: Sequence[SolidBox | SolidHull]
    radius: float
    gravity: float
    mass: float = 1.0
    slab_stop: Sequence[float] = ()
    slab_along: Sequence[Sequence[float]] = ()
    law: ContactLaw = COULOMB


class Solids(NamedTuple):
    """B solids, and the features of those that are hulls. SI units, world frame."""

    one: Records  # (B,) of `SOLID`, one level after the other
    feature: Records  # (F,) of `FEATURE`: of each hull its faces, its edges, its corners
    bound: Float64  # (K, 4) half-spaces: `a[:3] @ p <= a[3]`, p from the solid's centre


class Scenes(NamedTuple):
    """L levels with B solids in all, as compiled code takes them. SI units, world frame."""

    level: Records  # (L,) of `LEVEL`
    solids: Solids
    slab_stop: Float64  # (L, P) displacement at which a slab is at its end, <= 0; 0 for none
    cell_start: Int64  # (cells + 1,) where each cell's solids begin in `cell_solid`
    cell_solid: Int32  # solids of all cells, one cell after the other


def pack(levels: Sequence[RigidLevel]) -> Scenes:
    """Return the levels as arrays.

    Raises:
        ValueError: a solid names a slab that its level does not have, the points of a hull span no
            volume, or more solids than `MOST_NEAR` lie in one place.
    """
    level = np.zeros(len(levels), LEVEL).view(np.recarray)
    slab_stop = np.zeros((len(levels), max((len(each.slab_stop) for each in levels), default=0)))
    solids, starts, lists = [], [np.zeros(1, dtype=np.int64)], []
    features = _Features()
    count = cells = entries = 0
    for number, each in enumerate(levels):
        solid = _solids(each, number, features)
        way = np.append(np.asarray(each.slab_stop), 0.0)[solid["slab"]]  # 0 of what stands still
        cell, origin, grid, start, found = _grid(solid, way, each.radius + MARGIN_M)
        if len(start) > 1 and np.diff(start).max() > MOST_NEAR:
            raise ValueError(
                f"levels[{number}]: found {np.diff(start).max()} solids within {MARGIN_M:g} m of a "
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
        lists.append(found + count)
        count, cells, entries = count + len(solid), cells + len(start) - 1, entries + len(found)
    return Scenes(
        level=level,
        solids=Solids(
            one=np.concatenate([*solids, np.zeros(0, SOLID)]).view(np.recarray),
            feature=features.packed(),
            bound=np.concatenate([*features.bounds, np.zeros((0, 4))]),
        ),
        slab_stop=slab_stop,
        cell_start=np.concatenate(starts),
        cell_solid=np.concatenate([*lists, np.zeros(0, np.int64)]).astype(np.int32),
    )


class _Features:
    """Collects the features of hulls."""

    def __init__(self) -> None:
        self.bounds: list[Float64] = []
        self._rows: list[tuple[Any, ...]] = []
        self._bounds = 0

    def add(self, hull: Hull) -> tuple[int, int, int, int]:
        """Add a hull's features; return where its faces, edges and corners begin, and the end."""
        faces = len(self._rows)
        edges, corners = faces + len(hull.faces), faces + len(hull.faces) + len(hull.edges)
        for feature in (*hull.faces, *hull.edges, *hull.corners):
            first, self._bounds = self._bounds, self._bounds + len(feature.bounds)
            self.bounds.append(feature.bounds)
            offset = feature.direction @ feature.point
            ends = [corners + end for end in feature.ends]
            row = feature.point, feature.direction, offset, feature.length, ends
            self._rows.append((*row, first, self._bounds))
        return faces, edges, corners, len(self._rows)

    def packed(self) -> Records:
        """Return all of them, (F,) of `FEATURE`."""
        return np.array(self._rows, FEATURE).view(np.recarray)


def _solids(level: RigidLevel, number: int, features: _Features) -> Records:
    """Return a level's solids, and collect the features of its hulls."""
    slab = np.array([each.slab for each in level.solids], dtype=np.int64)
    if len(slab) and (slab.max() >= len(level.slab_stop) or slab.min() < STATIC):
        raise ValueError(
            f"levels[{number}].solids: found slab {slab.min()} to {slab.max()}; must be {STATIC} "
            f"to {len(level.slab_stop) - 1}"
        )
    solid = np.zeros(len(level.solids), SOLID)
    _write_boxes(solid, level.solids)
    for place, each in enumerate(level.solids):
        if isinstance(each, SolidHull):
            hull = hull_of(each.points)
            corners = hull.centre + np.array([corner.point for corner in hull.corners])
            solid["centre"][place] = hull.centre
            solid["low"][place], solid["high"][place] = corners.min(axis=0), corners.max(axis=0)
            for name, value in zip(
                ("faces", "edges", "corners", "end"), features.add(hull), strict=True
            ):
                solid[name][place] = value
    solid["friction"] = [each.friction for each in level.solids]
    solid["elasticity"] = [level.law.restitution(each.elasticity) for each in level.solids]
    solid["reversal"] = [level.law.tangential_restitution(each.elasticity) for each in level.solids]
    solid["dilatancy"] = level.law.dilatancy * solid["friction"]
    solid["slab"] = slab
    along = np.asarray(level.slab_along or [UPWARDS] * len(level.slab_stop), dtype=np.float64)
    solid["along"][slab >= 0] = along.reshape(-1, 3)[slab[slab >= 0]]
    return solid


def _write_boxes(solid: Records, solids: Sequence[SolidBox | SolidHull]) -> None:
    """Write the shapes of those that are boxes."""
    places = [place for place, each in enumerate(solids) if isinstance(each, SolidBox)]
    boxes = [each for each in solids if isinstance(each, SolidBox)]
    centre = np.array([box.centre for box in boxes], dtype=np.float64).reshape(-1, 3)
    half = np.array([box.half_size for box in boxes], dtype=np.float64).reshape(-1, 3)
    rotation = np.array([box.rotation for box in boxes], dtype=np.float64).reshape(-1, 3, 3)
    extent = np.einsum("bij,bj->bi", np.abs(rotation), half)
    solid["centre"][places], solid["half"][places] = centre, half
    solid["axes"][places] = rotation.transpose(0, 2, 1)
    solid["low"][places], solid["high"][places] = centre - extent, centre + extent
    solid["aligned"][places] = (rotation == np.eye(3)).all(axis=(1, 2))


def _grid(solid: Records, way: Float64, reach: float) -> tuple[float, Float64, Int64, Int64, Int64]:
    """Return cell edge, origin, numbers of cells, and each cell's solids, wherever they move to."""
    if len(solid) == 0:
        empty = np.zeros(2, dtype=np.int64)
        return CELL_M, np.zeros(2), empty, np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    moved = way[:, None] * solid["along"][:, :2]
    low = solid["low"][:, :2] + np.minimum(moved, 0.0)
    high = solid["high"][:, :2] + np.maximum(moved, 0.0)
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
