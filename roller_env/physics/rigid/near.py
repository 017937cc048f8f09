"""What is near the ball, and what it touches; what touches twice counts once."""

from __future__ import annotations

import math
from typing import Final

from roller_env.physics.rigid.closest import EDGE, FACE, closest, edge_direction, from_centre
from roller_env.physics.rigid.impact_time import CONTACT_GAP_M
from roller_env.physics.rigid.kernels import (
    Record,
    Records,
    Vector,
    dot,
    inlined,
    kernel,
    none_of,
    plus,
    scaled,
    store,
    sub,
    vector,
)
from roller_env.physics.rigid.scene import MARGIN_M, Scenes, Solids
from roller_env.physics.rigid.workspace import MOST_CONTACTS, swap

WELD_M: Final = 100.0 * CONTACT_GAP_M
"""What lies this near to a plane lies in it."""


@inlined
def look_ahead(speed: float, pull: float, left: float) -> float:
    """Return for how long, at most ``left``, the ball stays within the grid's margin.

    Contacts only take away from the way ``speed t + pull t^2`` that a free ball can go.
    """
    if speed * left + pull * left * left > MARGIN_M:
        left = min(left, 0.5 * MARGIN_M / (speed + 1e-9))
        if speed * left + pull * left * left > MARGIN_M:
            left = min(left, 0.7 * math.sqrt(0.5 * MARGIN_M / pull))
    return left


@inlined
def time_within(way: float, speed: float, acceleration: float, left: float) -> float:
    """Return for how long, at most ``left``, a ball goes no further than ``way``."""
    if speed * left + 0.5 * acceleration * left * left > way:
        left = 2.0 * way / (speed + math.sqrt(speed * speed + 2.0 * acceleration * way))
    return left


@inlined
def gather(
    scenes: Scenes,
    level: Record,
    slabs: Records,
    work: Record,
    position: Vector,
    way: float,
    left: float,
) -> None:
    """List the solids that a ball can meet which goes at most ``way`` metres in ``left`` seconds.

    Args:
        scenes: the solids.
        level: the ball's.
        slabs: of that level.
        work: receives the list.
        position: of the ball.
        way: at most `MARGIN_M`.
        left: seconds.
    """
    work.found = 0
    # A floor is an integer but for CUDA.
    x = int(math.floor((position[0] - level.origin[0]) / level.cell))  # noqa: RUF046
    y = int(math.floor((position[1] - level.origin[1]) / level.cell))  # noqa: RUF046
    if not (0 <= x < level.grid[0] and 0 <= y < level.grid[1]):
        return
    cell = level.first_cell + x * level.grid[1] + y
    wide = level.radius + way + CONTACT_GAP_M
    found = 0
    for place in range(scenes.cell_start[cell], scenes.cell_start[cell + 1]):
        number = scenes.cell_solid[place]
        solid = scenes.solids.one[number]
        at, around = position, wide
        if solid.slab >= 0:
            slab = slabs[solid.slab]
            at = plus(position, -slab.shift, vector(solid.along))
            around = wide + abs(slab.speed) * left
        if (
            at[2] - around > solid.high[2]
            or at[2] + around < solid.low[2]
            or at[0] - around > solid.high[0]
            or at[0] + around < solid.low[0]
            or at[1] - around > solid.high[1]
            or at[1] + around < solid.low[1]
        ):
            continue
        work.near[found].solid = number
        found += 1
    work.found = found


@inlined
def touch(solids: Solids, slabs: Records, work: Record, radius: float, position: Vector) -> int:
    """Measure the distances of all that is near, and list the contacts; return how many."""
    count = 0
    for place in range(work.found):
        near = work.near[place]
        solid = solids.one[near.solid]
        shift = speed = 0.0
        if solid.slab >= 0:
            shift, speed = slabs[solid.slab].shift, slabs[solid.slab].speed
        near.shift, near.speed = shift, speed
        carried = scaled(speed, vector(solid.along))
        store(near.carried, carried)
        distance, normal, kind, axis = closest(solids, solid, from_centre(solid, shift, position))
        gap = distance - radius
        near.gap, near.kind = gap, kind
        store(near.normal, normal)
        if gap <= CONTACT_GAP_M and count < MOST_CONTACTS:
            contact = work.contact[count]
            contact.solid, contact.kind, contact.axis = near.solid, kind, axis
            contact.gap, contact.shift, contact.speed = gap, shift, speed
            store(contact.carried, carried)
            store(contact.normal, normal)
            if kind != FACE:
                store(contact.pivot, plus(position, -distance, normal))
                if kind == EDGE:
                    store(contact.edge, edge_direction(solids, solid, axis))
            contact.friction, contact.dilatancy = solid.friction, solid.dilatancy
            contact.elasticity, contact.reversal = solid.elasticity, solid.reversal
            count += 1
    return count


@kernel
def weld(work: Record, count: int, radius: float) -> int:
    """Leave out contacts that are parts of others; return how many are left.

    An edge or corner that lies in a plane on which the ball rests is an inner one, or one that it
    has not reached; it neither stops nor lifts. Of two equal features one is enough.
    """
    i = none_of(count)
    while i < count:
        a = work.contact[i]
        inner = False
        for j in range(count):
            b = work.contact[j]
            # Planes that move along themselves stay what they are to what lies in them.
            apart = sub(vector(a.carried), vector(b.carried))
            if i == j or dot(vector(b.normal), apart) != 0.0:
                continue
            cosine = dot(vector(a.normal), vector(b.normal))
            if b.kind == FACE and a.kind != FACE:
                over = (radius + b.gap) - (radius + a.gap) * cosine
                inner = inner or abs(over) < WELD_M
            elif dot(apart, apart) == 0.0 and a.kind == b.kind and cosine > 1.0 - 1e-12:
                inner = inner or a.gap > b.gap or (a.gap == b.gap and j < i)
        if inner:
            count -= 1
            swap(work, i, count)
        else:
            i += 1
    return count
