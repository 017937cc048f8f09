"""What a piece stands on, and the heights that follow from it where a level says none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Final, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Float64
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.piece import Piece, Solid
from roller_env.units import METRES_PER_QUANT, quants

BESIDE_M: Final = quants(16.0)
"""What is this near beside or below a piece, the radius of the original's ball, it stands on."""

_P = TypeVar("_P", bound=Piece)


class Ground:
    """The upper faces of solids."""

    def __init__(self, solids: Callable[[], Iterable[Solid]]) -> None:
        """Take what returns the solids; it is called when somebody stands on them."""
        self._solids = solids

    @cached_property
    def _faces(self) -> _Faces:
        return _Faces.of([solid for solid in self._solids() if solid.material])

    def under(self, solid: Solid) -> float | None:
        """Return the height of what a solid stands on, metres; None where that is nothing.

        It is the highest face under the solid's middle that is not over its top; where there is
        none, as under a gate in a gap, the lowest of the faces round about.
        """
        x, y, z = solid.half_size
        low, high = solid.centre[2] - z - BESIDE_M, solid.centre[2] + z

        def highest(along: float, across: float) -> float:
            """Return how high it is there, in the solid's own axes; -inf over nothing."""
            offset = np.array(solid.rotation)[:2, :2] @ (along, across)
            heights = self._faces.over(np.array(solid.centre[:2]) + offset)
            return float(heights[(heights >= low) & (heights <= high)].max(initial=-math.inf))

        middle = highest(0.0, 0.0)
        if middle > -math.inf:
            return middle
        far_x, far_y = x + BESIDE_M, y + BESIDE_M
        around = [highest(i * far_x, j * far_y) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        return min((height for height in around if height > -math.inf), default=None)


class _Faces(NamedTuple):
    """The upper faces of n boxes, and of other solids.

    Arrays that begin with n, but for the first two, (2, n).
    """

    middle: Float64
    beside: Float64
    aligned: npt.NDArray[np.bool_]
    centre: Float64
    rotation: Float64
    half: Float64
    others: list[ConvexSolid]

    @staticmethod
    def of(solids: Sequence[Solid]) -> _Faces:
        others = [solid for solid in solids if isinstance(solid, ConvexSolid)]
        solids = [solid for solid in solids if not isinstance(solid, ConvexSolid)]
        centre = np.array([solid.centre for solid in solids]).reshape(-1, 3)
        rotation = np.array([solid.rotation for solid in solids]).reshape(-1, 3, 3)
        half = np.array([solid.half_size for solid in solids]).reshape(-1, 3)
        reach = np.einsum("nij,nj->ni", np.abs(rotation), half)
        aligned = np.array([solid.axis_aligned for solid in solids], dtype=bool)
        middle, beside = (np.ascontiguousarray(array.T[:2]) for array in (centre, reach))
        return _Faces(middle, beside, aligned, centre, rotation, half, others)

    def over(self, place: Float64) -> Float64:
        """Return how high those at a place (x, y) are, metres."""
        ends = [solid.upright(place) for solid in self.others]
        tops = [float(top) for bottom, top in ends if bottom <= top]
        return np.append(self._over_boxes(place), tops)

    def _over_boxes(self, place: Float64) -> Float64:
        x, y = np.abs(place[:, None] - self.middle) <= self.beside
        near = x & y
        level, tilted = near & self.aligned, near & ~self.aligned
        flat: Float64 = self.centre[level, 2] + self.half[level, 2]
        if not tilted.any():
            return flat
        centre, rotation, half = self.centre[tilted], self.rotation[tilted], self.half[tilted]
        across = np.einsum("ni,nij->nj", place - centre[:, :2], rotation[:, :2])
        lying = np.abs(rotation[:, 2]) < 1e-9
        slope = np.where(lying, 1.0, rotation[:, 2])
        ends = np.stack([-half - across, half - across]) / slope
        # Along an axis that lies flat an upright line is inside all the way, or nowhere.
        always = np.where(np.abs(across) <= half, np.inf, -np.inf)
        leave = np.where(lying, always, ends.max(axis=0)).min(axis=1)
        enter = np.where(lying, -always, ends.min(axis=0)).max(axis=1)
        heights: Float64 = np.concatenate([flat, (centre[:, 2] + leave)[enter <= leave]])
        return heights


def settled(piece: _P, field: str, ground: Ground, solid: Solid, depth: float, none: float) -> _P:
    """Return a piece with the height at which it stops, as far as nobody has given it.

    Args:
        piece: the piece.
        field: the one that says it.
        ground: what it may stand on.
        solid: itself.
        depth: how far under what it stands on its centre stops, metres.
        none: where it stops if it stands on nothing, metres.
    """
    if getattr(piece, field) is not None:
        return piece
    face = ground.under(solid)
    # To a millionth of a quant: what designers write is round in quants or metres, and sums of
    # floats are not.
    stop = none if face is None else quants(round((face - depth) / METRES_PER_QUANT, 6))
    copy = piece.model_copy(update={field: stop})
    copy.model_fields_set.discard(field)
    return copy
