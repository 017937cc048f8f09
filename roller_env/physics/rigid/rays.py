"""Rays from the balls: how far it is to the first solid."""

from __future__ import annotations

import math
from typing import Any, Final

from roller_env.arrays import Float64, Int64
from roller_env.physics.rigid.closest import from_centre, is_hull, local
from roller_env.physics.rigid.kernels import (
    Record,
    Vector,
    add,
    dot,
    entry,
    inlined,
    kernel,
    plus,
    row,
    vector,
)
from roller_env.physics.rigid.scene import MARGIN_M, Scenes, Solids
from roller_env.physics.rigid.states import POSITION, SLAB

_PARALLEL: Final = 1e-15


@entry
def cast_rays(
    scenes: Scenes,
    level_of_row: Int64,
    states: Float64,
    rows: Int64,
    offsets: Float64,
    directions: Float64,
    longest: float,
    out: Float64,
) -> None:
    """Write how far it is from beside some balls to the first solid; the balls are none.

    From inside a solid it is the way out of it, as MuJoCo has it.

    Args:
        scenes: the solids.
        level_of_row: (N,) which level each ball is in.
        states: (N, width) where the balls and slabs are, as `States.packed`.
        rows: (n,) which balls.
        offsets: (R, 3) where each ray begins, from the ball's centre, metres, world frame.
        directions: (R, 3) unit vectors, world frame.
        longest: how far to look, metres; ``inf`` only for rays that are vertical.
        out: (n, R) receives the distances in metres, ``inf`` where there is nothing.
    """
    for place in range(len(rows)):
        number = rows[place]
        level = scenes.level[level_of_row[number]]
        body = states[number]
        ball = vector(body[POSITION:])
        for ray in range(len(directions)):
            origin = add(ball, row(offsets, ray))
            out[place, ray] = _first(scenes, level, body, origin, row(directions, ray), longest)


@inlined
def _first(
    scenes: Scenes,
    level: Record,
    body: Any,
    origin: Vector,
    direction: Vector,
    longest: float,
) -> float:
    """Return how far it is to the first solid along one ray.

    A cell lists all that is within the margin of it. So the ray is looked at from points on it
    that are twice as far apart, each for what is before and behind it.
    """
    margin = level.radius + MARGIN_M
    # A vertical ray stays over one cell.
    level_part = math.sqrt(direction[0] * direction[0] + direction[1] * direction[1])
    half = margin / level_part if level_part > _PARALLEL else math.inf
    nearest = math.inf
    middle = 0.0 if half == math.inf else half
    while True:
        at = origin if middle == 0.0 else plus(origin, middle, direction)
        x = math.floor((at[0] - level.origin[0]) / level.cell)
        y = math.floor((at[1] - level.origin[1]) / level.cell)
        if 0 <= x < level.grid[0] and 0 <= y < level.grid[1]:
            cell = level.first_cell + x * level.grid[1] + y
            for place in range(scenes.cell_start[cell], scenes.cell_start[cell + 1]):
                solid = scenes.solids.one[scenes.cell_solid[place]]
                shift = body[SLAB + solid.slab] if solid.slab >= 0 else 0.0
                if _may_meet(solid, shift, origin, direction):
                    relative = from_centre(solid, shift, origin)
                    nearest = min(nearest, _into(scenes.solids, solid, relative, direction))
        middle += half
        if nearest <= middle or middle >= longest:
            break
        middle += half
    return nearest if nearest <= longest else math.inf


@inlined
def _may_meet(solid: Record, shift: float, origin: Vector, direction: Vector) -> bool:
    """Say whether a ray's bounding box meets a solid's."""
    low, high = vector(solid.low), vector(solid.high)
    at = origin if shift == 0.0 else plus(origin, -shift, vector(solid.along))
    return not (
        (at[2] < low[2] and direction[2] <= 0.0)
        or (at[2] > high[2] and direction[2] >= 0.0)
        or (at[0] < low[0] and direction[0] <= 0.0)
        or (at[0] > high[0] and direction[0] >= 0.0)
        or (at[1] < low[1] and direction[1] <= 0.0)
        or (at[1] > high[1] and direction[1] >= 0.0)
    )


@kernel
def _into(solids: Solids, solid: Record, from_middle: Vector, direction: Vector) -> float:
    """Return how far it is to the surface of a solid, ``inf`` if the ray misses it."""
    enters, leaves = -math.inf, math.inf
    if is_hull(solid):
        for number in range(solid.faces, solid.edges):
            face = solids.feature[number]
            normal = vector(face.direction)
            height, rate = dot(normal, from_middle) - face.offset, dot(normal, direction)
            if abs(rate) < _PARALLEL:
                if height > 0.0:
                    return math.inf
            elif rate < 0.0:
                enters = max(enters, -height / rate)
            else:
                leaves = min(leaves, -height / rate)
        return _first_of(enters, leaves)
    at, way = local(solid, from_middle), local(solid, direction)
    half = vector(solid.half)
    for k in range(3):
        if abs(way[k]) < _PARALLEL:
            if abs(at[k]) > half[k]:
                return math.inf
            continue
        one, other = (-half[k] - at[k]) / way[k], (half[k] - at[k]) / way[k]
        enters, leaves = max(enters, min(one, other)), min(leaves, max(one, other))
    return _first_of(enters, leaves)


@kernel
def _first_of(enters: float, leaves: float) -> float:
    """Return how far it is to where a ray enters a solid, or from inside to where it leaves it."""
    if enters > leaves or leaves < 0.0:
        return math.inf
    return enters if enters >= 0.0 else leaves
