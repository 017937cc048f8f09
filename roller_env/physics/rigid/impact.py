"""Impacts: what approaches is stopped or thrown back, all contacts at once."""

from __future__ import annotations

from typing import Final

from roller_env.physics.rigid.coulomb import EXACT, slip_over, slip_response, solve
from roller_env.physics.rigid.kernels import (
    Record,
    Records,
    Twist,
    Vector,
    cross,
    dot,
    inlined,
    kernel,
    none_of,
    norm,
    plus,
    store,
    sub,
    vector,
)
from roller_env.physics.rigid.scene import Solids
from roller_env.physics.rigid.sliding import SLIP_SHARE
from roller_env.physics.rigid.workspace import swap

CLOSED_M_S: Final = 1e-6
"""A contact whose normal velocity is less is held; it neither bounces nor opens."""

CHATTER_M_S: Final = 1e-3
"""The same where several contacts touch. Friction at one lifts the ball off another, and a ball
that comes to rest in a corner would do so through ever smaller hops without end."""

LIFTED_M_S: Final = 1e-4
"""The same of one contact whose slip makes it open: what opens more slowly falls back before it has
risen by a contact's gap (v^2 / 2g), so that such a slip is Coulomb's."""

REST_M_S: Final = 1e-3
"""An impact slower than this is plastic, whatever the elasticity: the bounces end."""

STICK_M_S: Final = 1e-9
"""A slip slower than this has ended."""

_MOST_PROJECTIONS: Final = 50

_ROUNDING: Final = 1.0 + 1e-9
"""Share of the energy that is no gain."""

_OPPOSED: Final = -1.0 + 1e-12
"""Cosine of the angle between normals that face each other."""


@kernel
def velocity_over(contact: Record, v: Vector) -> Vector:
    """Return a velocity relative to a contact's solid."""
    return sub(v, vector(contact.carried))


@kernel
def opening(contact: Record, v: Vector) -> float:
    """Return how fast a contact opens, m/s; negative where it closes."""
    return dot(vector(contact.normal), velocity_over(contact, v))


@kernel
def true_slip(contact: Record, radius: float, twist: Twist) -> Vector:
    """Return the velocity of the ball's point of contact over the solid, m/s."""
    return slip_over(vector(contact.normal), vector(contact.carried), radius, twist)


@kernel
def _kinetic(radius: float, twist: Twist) -> float:
    """Return twice the kinetic energy over the mass."""
    v, w = twist
    return dot(v, v) + 0.4 * radius * radius * dot(w, w)


@kernel
def calmed(before: Twist, after: Twist, radius: float) -> Twist:
    """Return velocities that are no answer, or none if they would have gained energy."""
    if _kinetic(radius, after) <= _kinetic(radius, before):
        return after
    return Twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@kernel
def closed_m_s(work: Record, count: int) -> float:
    """Return the normal velocity below which ``count`` contacts are held."""
    if count > 1:
        return CHATTER_M_S
    return CLOSED_M_S if work.contact[0].dilatancy == 0.0 else LIFTED_M_S


@kernel
def closing(contact: Record, radius: float, twist: Twist) -> float:
    """Return how fast a contact closes, or would open if its slip made it, m/s."""
    approach = -opening(contact, twist.linear)
    if contact.dilatancy > 0.0:
        asked = contact.dilatancy * norm(true_slip(contact, radius, twist))
        approach = max(approach, (asked + approach) / slip_response(contact))
    return approach


@kernel
def _ask_back(contact: Record, radius: float, twist: Twist) -> None:
    """Write what the restitution asks of the velocities at a contact."""
    store(contact.surface, vector(contact.carried))
    contact.bias, contact.slides = 0.0, 0
    approach = opening(contact, twist.linear)
    if approach < -REST_M_S:
        contact.bias = -contact.elasticity * approach
        if contact.reversal > 0.0:
            back = true_slip(contact, radius, twist)
            store(contact.surface, plus(vector(contact.surface), -contact.reversal, back))


@kernel
def _squeezed(work: Record, count: int) -> bool:
    """Say whether two contacts face each other and close in: then nothing rigid gives."""
    for i in range(count):
        a = work.contact[i]
        n = vector(a.normal)
        for j in range(i):
            b = work.contact[j]
            if dot(n, vector(b.normal)) < _OPPOSED:
                apart = dot(n, sub(vector(b.surface), vector(a.surface)))
                if apart < a.bias + b.bias - CLOSED_M_S:
                    return True
    return False


@kernel
def solve_jam(
    work: Record, count: int, radius: float, free: Twist, alike: float
) -> tuple[Twist, bool]:
    """Return what `solve` does of contacts that are asked for no more than not to close.

    Friction can let two contacts press on each other along the line between them however hard
    (force closure: V.-D. Nguyen, *Constructing force-closure grasps*, 1988). No rigid ball then
    has velocities by which its two points come apart, as restitution would have it, or as edges
    that turn do to first order in a step. That they stand still is always an answer.
    """
    for i in range(count):
        contact = work.contact[i]
        contact.bias = 0.0
        store(contact.surface, vector(contact.carried))
    after, solved = solve(work, count, radius, free, alike)
    if not solved:
        after = calmed(free, after, radius)
    return after, solved


@inlined
def collide(
    work: Record, slabs: Records, solids: Solids, count: int, radius: float, twist: Twist
) -> tuple[Twist, bool, int]:
    """Return the velocities after the impacts, success, and how many slabs were held up.

    A moving slab that would have to pass through the ball stands still for the rest of the step:
    what squeezes a rigid ball against something rigid is held up by it.

    Nothing bounces out of a jam: see `solve_jam`. Nor does what would gain energy by it, as
    restitution at several contacts with friction can (T. R. Kane, D. A. Levinson, *Dynamics: Theory
    and Applications*, 1985). Such an impact is plastic.
    """
    approaches, most = False, closed_m_s(work, count)
    for i in range(count):
        approaches = approaches or closing(work.contact[i], radius, twist) > most
    if not approaches:
        return twist, True, 0
    fastest, moving = norm(twist.linear) + radius * norm(twist.angular), False
    for i in range(count):
        contact = work.contact[i]
        _ask_back(contact, radius, twist)
        moving = moving or contact.speed != 0.0
        fastest = max(fastest, abs(contact.speed))
    after, solved, blocked = twist, False, 0
    if not (moving and _squeezed(work, count)):
        after, solved = solve(work, count, radius, twist, EXACT)
    if moving and (not solved or norm(after.linear) > 4.0 * fastest + 1.0):
        for i in range(count):
            contact = work.contact[i]
            number = solids.one[contact.solid].slab
            if number >= 0 and slabs[number].speed != 0.0:
                slabs[number].speed = 0.0
                blocked += 1
            contact.speed, contact.bias = 0.0, 0.0
            store(contact.carried, (0.0, 0.0, 0.0))
            store(contact.surface, (0.0, 0.0, 0.0))
        after, solved = solve(work, count, radius, twist, EXACT)
    gains = not moving and _kinetic(radius, after) > _ROUNDING * _kinetic(radius, twist)
    if not solved or gains:
        after, solved = solve_jam(work, count, radius, twist, EXACT)
    return after, solved, blocked


@inlined
def keep_closed(work: Record, count: int, v: Vector) -> int:
    """Leave out contacts that open; return how many are left."""
    fastest = closed_m_s(work, count)
    i = none_of(count)
    while i < count:
        if opening(work.contact[i], v) > fastest:
            count -= 1
            swap(work, i, count)
        else:
            i += 1
    return count


@inlined
def settle(work: Record, count: int, radius: float, twist: Twist) -> Twist:
    """Return the velocities without what rounding left of closed contacts and ended slips."""
    v, w = twist
    for _ in range(_MOST_PROJECTIONS if count > 1 else count):
        largest = 0.0
        for i in range(count):
            contact = work.contact[i]
            left = opening(contact, v)
            v = plus(v, -left, vector(contact.normal))
            largest = max(largest, abs(left))
        if largest < 1e-16:
            break
    if count == 1:
        contact = work.contact[0]
        u = true_slip(contact, radius, Twist(v, w))
        if 0.0 < norm(u) <= STICK_M_S:
            v = plus(v, -SLIP_SHARE, u)
            w = plus(w, 2.5 * SLIP_SHARE / radius, cross(vector(contact.normal), u))
    return Twist(v, w)
