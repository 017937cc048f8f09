"""Level -> the plain shapes that its shorthands stand for: solid boxes and coin positions.

The checker asks whether a point lies inside a solid and the compiler makes geoms of the same
solids, so what a floor plan, ramp, wall or tube *is* must be said once: here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from roller_env.level.schema import Box, FloorPlan, Level, Ramp, Tube, Wall
from roller_env.units import quants

Float64 = npt.NDArray[np.float64]

COIN_HEIGHT_M = quants(16.0)
"""Height of a floor plan's coin over its cell: the middle of the original's ball."""

TOUCHING_M = 0.001
"""Things that are this near to each other touch, and one may reach this deep into another: covers
rounded numbers in files and the depth to which a resting ball sinks into MuJoCo's soft contacts."""

_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
Matrix = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class Solid:
    """A static box.

    Attributes:
        centre: world frame, metres.
        half_size: half edge lengths along its own axes, metres.
        rotation: box frame to world frame, 3x3, row major.
        material: name of its material.
        source: the piece of the level it comes from, as a path such as ``floors[0]``.
    """

    centre: tuple[float, float, float]
    half_size: tuple[float, float, float]
    rotation: Matrix
    material: str
    source: str

    @property
    def axis_aligned(self) -> bool:
        """Whether its edges lie along the world's axes."""
        return self.rotation == _IDENTITY

    def contains(self, points: Float64, margin: float = 0.0) -> npt.NDArray[np.bool_]:
        """Say which of ``points``, (n, 3) in metres, lie inside or within ``margin`` of it.

        With a ``margin`` below zero, which lie inside and that deep under each face.
        """
        local = (points - np.array(self.centre)) @ np.array(self.rotation)
        half = np.maximum(np.array(self.half_size) + min(margin, 0.0), 0.0)
        outside = np.maximum(np.abs(local) - half, 0.0)
        inside: npt.NDArray[np.bool_] = (outside**2).sum(axis=-1) <= max(margin, 0.0) ** 2
        return inside


def rotation_matrix(yaw_deg: float = 0.0, pitch_deg: float = 0.0) -> Matrix:
    """Return the matrix of a pitch about y followed by a yaw about z, box to world frame."""
    if yaw_deg == 0.0 and pitch_deg == 0.0:
        return _IDENTITY
    yaw, pitch = math.radians(yaw_deg), math.radians(pitch_deg)
    cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    return ((cy * cp, -sy, cy * sp), (sy * cp, cy, sy * sp), (-sp, 0.0, cp))


def solids(level: Level) -> tuple[Solid, ...]:
    """Return every static solid of the level; plates and gates, which move, are not among them."""
    return tuple(_solids(level))


def _solids(level: Level) -> Iterator[Solid]:
    for index, plan in enumerate(level.floors):
        yield from _floor_solids(plan, f"floors[{index}]")
    for index, box in enumerate(level.boxes):
        yield _box_solid(box, f"boxes[{index}]")
    for index, ramp in enumerate(level.ramps):
        yield _ramp_solid(ramp, f"ramps[{index}]")
    for index, wall in enumerate(level.walls):
        yield _wall_solid(wall, f"walls[{index}]")
    for index, tube in enumerate(level.tubes):
        yield from _tube_solids(tube, f"tubes[{index}]")


def _half(size: tuple[float, float, float]) -> tuple[float, float, float]:
    return (size[0] / 2, size[1] / 2, size[2] / 2)


def _box_solid(box: Box, source: str) -> Solid:
    rotation = rotation_matrix(box.yaw_deg, box.pitch_deg)
    return Solid(box.at, _half(box.size), rotation, box.material, source)


def _ramp_solid(ramp: Ramp, source: str) -> Solid:
    (x0, y0, z0), (x1, y1, z1) = ramp.start, ramp.end
    run = math.hypot(x1 - x0, y1 - y0)
    yaw, slope = math.atan2(y1 - y0, x1 - x0), math.atan2(z1 - z0, run)
    rotation = rotation_matrix(math.degrees(yaw), -math.degrees(slope))
    upward = [row[2] for row in rotation]
    middle = ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2)
    centre = tuple(m - u * ramp.thickness / 2 for m, u in zip(middle, upward, strict=True))
    half = (math.hypot(run, z1 - z0) / 2, ramp.width / 2, ramp.thickness / 2)
    return Solid((centre[0], centre[1], centre[2]), half, rotation, ramp.material, source)


def _wall_solid(wall: Wall, source: str) -> Solid:
    (x0, y0), (x1, y1) = wall.start, wall.end
    dx, dy = x1 - x0, y1 - y0
    half_length, z = math.hypot(dx, dy) / 2, wall.bottom + wall.height / 2
    centre = ((x0 + x1) / 2, (y0 + y1) / 2, z)
    if dy == 0.0:
        half = (half_length, wall.thickness / 2, wall.height / 2)
        return Solid(centre, half, _IDENTITY, wall.material, source)
    if dx == 0.0:
        half = (wall.thickness / 2, half_length, wall.height / 2)
        return Solid(centre, half, _IDENTITY, wall.material, source)
    rotation = rotation_matrix(math.degrees(math.atan2(dy, dx)))
    half = (half_length, wall.thickness / 2, wall.height / 2)
    return Solid(centre, half, rotation, wall.material, source)


def _floor_cells(plan: FloorPlan) -> Iterator[tuple[str, float, float]]:
    """Yield the character and the middle (x, y) of every cell that is not empty."""
    rows = plan.rows
    for from_top, row in enumerate(rows):
        x = plan.corner[0] + (len(rows) - from_top - 0.5) * plan.cell
        for from_left, character in enumerate(row):
            if character != ".":
                y = plan.corner[1] + (len(row) - from_left - 0.5) * plan.cell
                yield character, x, y


def _floor_solids(plan: FloorPlan, source: str) -> Iterator[Solid]:
    half, top = plan.cell / 2, plan.corner[2]
    for character, x, y in _floor_cells(plan):
        cell = plan.cells[character]
        slab = (half, half, plan.thickness / 2)
        yield Solid((x, y, top - plan.thickness / 2), slab, _IDENTITY, cell.material, source)
        if cell.wall > 0.0:
            block = (half, half, cell.wall / 2)
            yield Solid((x, y, top + cell.wall / 2), block, _IDENTITY, cell.material, source)


def tube_frame(tube: Tube) -> Float64:
    """Return the tube's frame, (3, 3), columns: angle zero, angle 90 degrees, axis.

    Angles count from +x towards +y for an upright tube, from straight up for a lying one.
    """
    axis = np.subtract(tube.end, tube.start)
    axis /= np.linalg.norm(axis)
    reference = np.array([1.0, 0.0, 0.0]) if abs(axis[2]) > 0.999 else np.array([0.0, 0.0, 1.0])
    zero = reference - axis * (axis @ reference)
    zero /= np.linalg.norm(zero)
    quarter = np.cross(axis, zero)
    if abs(axis[2]) > 0.999 and axis[2] < 0.0:
        quarter = -quarter
    return np.stack([zero, quarter, axis], axis=1)


def _tube_solids(tube: Tube, source: str) -> Iterator[Solid]:
    frame = tube_frame(tube)
    middle = (np.array(tube.start) + np.array(tube.end)) / 2
    half_length = math.dist(tube.start, tube.end) / 2
    step = 2.0 * math.pi / tube.sides
    outer = tube.inner_radius + tube.thickness
    half_width = outer * math.tan(step / 2)
    for side in range(tube.sides):
        angle = side * step
        if tube.opening is not None:
            away = (math.degrees(angle) - tube.opening.toward_deg + 180.0) % 360.0 - 180.0
            if abs(away) < tube.opening.width_deg / 2:
                continue
        out = frame[:, 0] * math.cos(angle) + frame[:, 1] * math.sin(angle)
        along = np.cross(frame[:, 2], out)
        centre = middle + out * (tube.inner_radius + tube.thickness / 2)
        rotation = np.stack([out, along, frame[:, 2]], axis=1)
        yield Solid(
            (float(centre[0]), float(centre[1]), float(centre[2])),
            (tube.thickness / 2, half_width, half_length),
            tuple((float(r[0]), float(r[1]), float(r[2])) for r in rotation),
            tube.material,
            source,
        )


def pad_groups(level: Level) -> list[int]:
    """Return, for each lift pad, the number of the first pad of those that push as one with it.

    Pads that overlap or touch, if only by way of others between them, are one pad to the ball.
    """
    pads = level.lift_pads
    middle = np.array([pad.at for pad in pads]).reshape(-1, 3)
    half = np.array([pad.size for pad in pads]).reshape(-1, 3) / 2
    low, high = middle - half, middle + half + TOUCHING_M
    first = list(range(len(pads)))
    in_x = np.argsort(low[:, 0], kind="stable")
    for place, number in enumerate(in_x.tolist()):
        beside = in_x[place + 1 : np.searchsorted(low[in_x, 0], high[number, 0], "right")]
        near = (low[beside] <= high[number]) & (low[number] <= high[beside])
        for other in beside[near.all(axis=1)].tolist():
            one, two = sorted((_root(first, number), _root(first, other)))
            first[two] = one
    return [_root(first, number) for number in range(len(pads))]


def _root(first: list[int], number: int) -> int:
    """Follow ``first`` to a number that is its own, and shorten the way for the next time."""
    while first[number] != number:
        first[number] = first[first[number]]
        number = first[number]
    return number


def coin_positions(level: Level) -> tuple[Float64, tuple[str, ...]]:
    """Return the coins' centres, (n, 3) metres world frame, and the piece each comes from."""
    positions: list[Float64] = []
    sources: list[str] = []
    for index, coins in enumerate(level.coins):
        group: Float64
        if coins.at is not None:
            group = np.array([coins.at])
        elif coins.line is not None:
            group = np.linspace(coins.line.start, coins.line.end, coins.line.count)
        elif coins.arc is not None:
            arc = coins.arc
            angles = np.radians(np.linspace(arc.from_deg, arc.to_deg, arc.count))
            ring = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
            group = np.array(arc.centre) + arc.radius * ring
        else:
            assert coins.grid is not None, "Coins holds exactly one of its four shapes"
            grid = coins.grid
            along = [
                (np.arange(n) - (n - 1) / 2) * gap
                for n, gap in zip(grid.count, grid.spacing, strict=True)
            ]
            xs, ys = np.meshgrid(*along, indexing="ij")
            group = np.array(grid.centre) + np.stack([xs, ys, np.zeros_like(xs)], -1).reshape(-1, 3)
        positions.append(group)
        sources += [f"coins[{index}]"] * len(group)
    for index, plan in enumerate(level.floors):
        for character, x, y in _floor_cells(plan):
            if plan.cells[character].coin:
                z = plan.corner[2] + plan.cells[character].wall + COIN_HEIGHT_M
                positions.append(np.array([[x, y, z]]))
                sources.append(f"floors[{index}]")
    if not positions:
        return np.zeros((0, 3)), ()
    return np.concatenate(positions).astype(np.float64), tuple(sources)
