"""Until when a motion goes on: the end of a feature, and the next impact."""

from __future__ import annotations

from roller_env.physics.rigid.closest import (
    FACE,
    extent,
    feature_margin,
    from_centre,
    time_on_feature,
)
from roller_env.physics.rigid.impact import velocity_over
from roller_env.physics.rigid.impact_time import CONTACT_GAP_M, impact_time
from roller_env.physics.rigid.kernels import (
    Record,
    Vector,
    alike,
    dot,
    first_root,
    inlined,
    kernel,
    sub,
    vector,
)
from roller_env.physics.rigid.near import WELD_M
from roller_env.physics.rigid.scene import Solids


@inlined
def features_end(
    work: Record,
    solids: Solids,
    count: int,
    p: Vector,
    v: Vector,
    a: Vector,
    way: float,
    until: float,
) -> float:
    """Return when, before ``until``, the ball leaves a feature that holds it, or ``until``."""
    for i in range(count):
        contact = work.contact[i]
        solid = solids.one[contact.solid]
        relative = from_centre(solid, contact.shift, p)
        margin = feature_margin(solids, solid, contact.kind, contact.axis, relative)
        if margin <= way + abs(contact.speed) * until:
            velocity = velocity_over(contact, v)
            end = time_on_feature(solids, solid, contact.kind, contact.axis, relative, velocity, a)
            until = min(until, end)
    return until


@inlined
def goes_alone(work: Record, solids: Solids, p: Vector, way: float, until: float) -> bool:
    """Say whether a ball on one face, of the first contact, meets nothing and stays on it."""
    contact = work.contact[0]
    solid = solids.one[contact.solid]
    relative = from_centre(solid, contact.shift, p)
    margin = feature_margin(solids, solid, contact.kind, contact.axis, relative)
    if margin <= way + abs(contact.speed) * until:
        return False
    for place in range(work.found):
        near = work.near[place]
        if near.solid != contact.solid and near.gap <= way + abs(near.speed) * until:
            return False
    return True


@inlined
def next_impact(
    work: Record,
    solids: Solids,
    count: int,
    radius: float,
    p: Vector,
    v: Vector,
    a: Vector,
    way: float,
    until: float,
) -> float:
    """Return the time of the first impact before ``until``, or ``until``.

    Args:
        work: what is near, and the contacts that hold the ball.
        solids: all.
        count: how many contacts hold it.
        radius: of the ball, metres.
        p: position, metres.
        v: velocity, m/s.
        a: acceleration, m/s^2.
        way: how far the ball can go, metres.
        until: seconds.
    """
    for place in range(work.found):
        near = work.near[place]
        if near.gap > way + abs(near.speed) * until + CONTACT_GAP_M:
            continue
        if count > 0 and work.contact[0].solid == near.solid:
            continue
        solid = solids.one[near.solid]
        n = vector(near.normal)
        velocity = sub(v, vector(near.carried))
        gap = max(near.gap, 0.5 * CONTACT_GAP_M)
        if near.gap > CONTACT_GAP_M or near.kind == FACE:
            # The supporting plane at the start rules most of them out.
            soonest = first_root(gap - 0.25 * CONTACT_GAP_M, dot(n, velocity), 0.5 * dot(n, a))
            if soonest >= until:
                continue
        relative = from_centre(solid, near.shift, p)
        if _cannot_meet(work, solids, solid, near, count, radius, relative):
            continue
        time = impact_time(solids, solid, radius, relative, velocity, a, gap, n, near.kind, until)
        until = min(until, time)
    return until


@kernel
def _cannot_meet(
    work: Record,
    solids: Solids,
    solid: Record,
    near: Record,
    count: int,
    radius: float,
    relative: Vector,
) -> bool:
    """Say whether a solid holds the ball, or lies wholly behind a face that does."""
    for i in range(count):
        if work.contact[i].solid == near.solid:
            return True
    for i in range(count):
        contact = work.contact[i]
        if contact.kind == FACE and alike(vector(contact.carried), vector(near.carried)):
            n = vector(contact.normal)
            if extent(solids, solid, n) - dot(n, relative) + radius <= WELD_M:
                return True
    return False
