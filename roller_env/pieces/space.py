"""What is where: which solids hold a point, and which hold up the ball."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Bool, Float64
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.piece import TOUCHING_M, Solid

Indices = npt.NDArray[np.intp]

MAX_SAMPLES: Final = 65
"""Points tried along one edge of a region; its corners and middle are always among them."""

_RING: Final = 8
_RING_SHARE: Final = 0.9
"""Rays down to what may hold up a ball, besides the one through its middle: how many, and how far
out, in radii."""


def samples(half: float, step: float, most: int = MAX_SAMPLES) -> Float64:
    """Return an odd number of places from -half to half, ``step`` or less apart if ``most`` allow.

    A ``half`` of 0 has one.
    """
    if half == 0.0:
        return np.zeros(1)
    each = min(int(np.ceil(half / step)), most // 2)
    return np.linspace(-half, half, 1 + 2 * each)


def inside(
    blocks: Sequence[Solid], points: Float64, margin: float
) -> Iterator[tuple[Solid, Indices]]:
    """Yield each solid that holds points, with their indices.

    Of the three axes, each solid looks along the one on which fewest points fall into its extent:
    a level's thousands of cells then meet only the few coins near them.

    Args:
        blocks: the solids.
        points: (n, 3) metres.
        margin: how far outside still counts; below zero, how deep inside it must be.
    """
    if not blocks or not len(points):
        return
    centres, reach = _extents(blocks)
    reach += max(margin, 0.0) + TOUCHING_M
    orders = [np.argsort(points[:, axis]) for axis in range(3)]
    spans = np.empty((3, 2, len(blocks)), dtype=np.intp)
    for axis, order in enumerate(orders):
        along = points[order, axis]
        spans[axis, 0] = np.searchsorted(along, centres[:, axis] - reach[:, axis], "left")
        spans[axis, 1] = np.searchsorted(along, centres[:, axis] + reach[:, axis], "right")
    counts = spans[:, 1] - spans[:, 0]
    narrowest = counts.argmin(axis=0)
    for number in np.flatnonzero(counts.min(axis=0) > 0).tolist():
        axis = int(narrowest[number])
        first, last = spans[axis, :, number]
        near = orders[axis][first:last]
        found = near[blocks[number].contains(points[near], margin)]
        if len(found):
            yield blocks[number], found


def burying(
    blocks: Sequence[Solid], at: Sequence[float], size: Sequence[float], step: float
) -> dict[str, None]:
    """Return the sources of the solids that wholly hold a level box; none if some of it is free.

    A face that lies in a solid's face is free: the ball can touch it.

    Args:
        blocks: the solids.
        at: the box's centre, metres.
        size: its edges, metres.
        step: how far apart, at most, its surface is looked at where it is not larger than
            `MAX_SAMPLES` of them.
    """
    half = np.array(size) / 2 + TOUCHING_M
    around: dict[str, None] = {}
    # Mostly a corner is free, and nothing else has to be looked at.
    for edges in ([np.array([-h, h]) for h in half], [samples(h, step) for h in half]):
        grid = np.stack(np.meshgrid(*edges, indexing="ij"), axis=-1).reshape(-1, 3)
        surface = grid[(np.abs(grid) >= half).any(axis=1)] + np.array(at)
        held = np.zeros(len(surface), dtype=bool)
        for solid, found in inside(blocks, surface, TOUCHING_M / 1000.0):
            held[found] = True
            around[solid.source] = None
        if not held.all():
            return {}
    return around


def held_up(blocks: Sequence[Solid], places: Float64, radius: float, lowest: float) -> Bool:
    """Say at which places, (n,), something is under a ball that can hold it up.

    It is under the ball's middle, or on two opposite sides of it, as rails are.

    Args:
        blocks: the solids.
        places: (n, 3) ball centres, metres.
        radius: the ball's, metres.
        lowest: height down to which solids count.
    """
    angles = 2.0 * np.pi * np.arange(_RING) / _RING
    ring = _RING_SHARE * radius * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    feet = places[:, None, :] + np.concatenate([np.zeros((1, 3)), ring])
    hits = np.zeros(feet.shape[:2], dtype=bool)
    centres, reach = _extents(blocks)
    low, high = feet.min(axis=(0, 1)) - reach, feet.max(axis=(0, 1)) + reach
    low[:, 2] = lowest - reach[:, 2]
    near = np.flatnonzero(((centres >= low) & (centres <= high)).all(axis=1))
    for number in near.tolist():
        hits |= _stands_over(blocks[number], feet, lowest)
    opposite = hits[:, 1 : 1 + _RING // 2] & hits[:, 1 + _RING // 2 :]
    firm: Bool = hits[:, 0] | opposite.any(axis=1)
    return firm


def _stands_over(solid: Solid, feet: Float64, lowest: float) -> Bool:
    """Say from which points, (..., 3), the way straight down to ``lowest`` meets a solid."""
    over: Bool
    if isinstance(solid, ConvexSolid):
        bottom, top = solid.upright(feet[..., :2])
        over = np.maximum(bottom, lowest) <= np.minimum(top, feet[..., 2])
        return over
    rotation, half = np.array(solid.rotation), np.array(solid.half_size)
    local = (feet - np.array(solid.centre)) @ rotation
    down = -rotation[2]
    enter, leave = np.zeros(feet.shape[:-1]), feet[..., 2] - lowest
    for axis in range(3):
        if abs(down[axis]) < 1e-12:
            leave = np.where(np.abs(local[..., axis]) <= half[axis], leave, -1.0)
            continue
        ends = (np.array([-half[axis], half[axis]]) - local[..., [axis]]) / down[axis]
        enter = np.maximum(enter, ends.min(axis=-1))
        leave = np.minimum(leave, ends.max(axis=-1))
    over = enter <= leave
    return over


def _extents(blocks: Sequence[Solid]) -> tuple[Float64, Float64]:
    """Return the centres and half extents along the world's axes, (n, 3) each."""
    centres = np.array([solid.centre for solid in blocks]).reshape(-1, 3)
    rotations = np.array([solid.rotation for solid in blocks]).reshape(-1, 3, 3)
    halves = np.array([solid.half_size for solid in blocks]).reshape(-1, 3)
    return centres, np.einsum("nij,nj->ni", np.abs(rotations), halves)
