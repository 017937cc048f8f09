"""Contacts of one uniform sphere with dry friction: what they do to its velocity.

The same problem twice. At an **impact** the unknown is an impulse: Newton's restitution along the
normal, Coulomb's circular cone across it, tangential restitution 0 (the slip that is left opposes
the friction). In **held contacts** it is a force, with accelerations in the place of velocities.
Both are the complementarity problem

    0 <= n.(v - s) - b  _|_  N >= 0,        |T| <= mu N,  T = -mu N u/|u| where it slips,

all for one unit of mass. A sphere of radius r has the inertia 2/5 r^2, so that an impulse J at the
contact with normal n (from solid to ball) changes the velocity by J and the angular velocity by
``-(5/2r) n x J``: of its own contact alone it changes the normal velocity by N and the slip by
7/2 T. One contact is therefore solved in closed form, and so are two that both stick. Otherwise
block Gauss-Seidel over the contacts finds which of them open, stick and slip, and Newton's method
on that set finds the impulses to rounding (as in P. Alart, A. Curnier, *A mixed formulation for
frictional contact problems prone to Newton like solution methods*, 1991). The answer is taken only
if it satisfies every inequality.

Friction at several contacts that stick is indeterminate, the motion is not: of the reactions of
two sticking contacts the one with the least friction is taken among those in both cones. They stick
if there is any.
"""

from __future__ import annotations

import math
from typing import Final

from roller_env.physics.rigid.kernels import (
    Record,
    Twist,
    Vector,
    add,
    cross,
    dot,
    kernel,
    none_of,
    norm,
    plus,
    put,
    row,
    scaled,
    store,
    sub,
    tangential,
    vector,
)
from roller_env.physics.rigid.linear import eliminate

EXACT: Final = 1e-9

SLIP_PER_IMPULSE: Final = 3.5
"""By how much a unit of drag changes the slip of its own contact: 1 + 5/2."""

OPEN: Final = 0
STICKS: Final = 1
SLIPS: Final = 2

_SPIN_PER_IMPULSE: Final = 2.5
_FIRST_SWEEPS: Final = 8
_MOST_ATTEMPTS: Final = 8
_MOST_NEWTON_STEPS: Final = 12
_ROUNDING: Final = 1e-14
_SINGULAR: Final = 1e-11

_ABSURD: Final = 1e6
"""Impulses that grow beyond this, over the speeds there are, have no end: nothing rigid gives."""


@kernel
def slip_over(normal: Vector, surface: Vector, radius: float, twist: Twist) -> Vector:
    """Return the velocity of the ball's point of contact over a surface."""
    across = tangential(sub(twist.linear, surface), normal)
    return plus(across, radius, cross(normal, twist.angular))


@kernel
def slip(contact: Record, radius: float, twist: Twist) -> Vector:
    """Return the slip at a contact over its ``surface``."""
    return slip_over(vector(contact.normal), vector(contact.surface), radius, twist)


@kernel
def excess(contact: Record, v: Vector) -> float:
    """Return by how much a contact opens faster than it must; negative where it closes."""
    opening = dot(vector(contact.normal), sub(v, vector(contact.surface)))
    excess: float = opening - contact.bias
    return excess


@kernel
def lag(contact: Record, radius: float, twist: Twist) -> float:
    """Return `excess`, less what the slip of a contact with dilatancy asks for besides."""
    value: float = excess(contact, twist.linear)
    if contact.dilatancy > 0.0 and not contact.slides:
        value -= contact.dilatancy * norm(slip(contact, radius, twist))
    return value


@kernel
def _apply(contact: Record, radius: float, twist: Twist, push: float, drag: Vector) -> Twist:
    """Return the velocities after an impulse: ``push`` along the normal, ``drag`` across it."""
    n = vector(contact.normal)
    torque = cross(n, drag)
    return Twist(
        add(plus(twist.linear, push, n), drag),
        plus(twist.angular, -_SPIN_PER_IMPULSE / radius, torque),
    )


@kernel
def solve(work: Record, count: int, radius: float, free: Twist, alike: float) -> tuple[Twist, bool]:
    """Return the velocities after the contacts' impulses, and whether they are the answer.

    Works on rates of any kind: velocities, or accelerations. Writes ``status``, ``push`` and
    ``drag`` of the first ``count`` contacts; reads what says their problem.

    Args:
        work: the contacts.
        count: how many.
        radius: of the ball.
        free: velocities without the contacts.
        alike: share of what is asked of two points of contact by which that may differ along the
            line between them, where both stick: `EXACT`, or more for a step in time.
    """
    if count == 1:
        work.contact[0].push = 0.0
        store(work.contact[0].drag, (0.0, 0.0, 0.0))
        twist, _ = _sweep(work, count, radius, free)
        return twist, True
    if count == 2:
        _, stick, twist = _both_stick(work, radius, free, alike)
        if stick:
            work.contact[0].status, work.contact[1].status = STICKS, STICKS
            return twist, True
    scale = _scale(work, count, radius, free)
    done, twist = _enumerate(work, count, radius, free, scale)
    if done:
        return twist, True
    for i in range(count):
        contact = work.contact[i]
        contact.push = 0.0
        store(contact.drag, (0.0, 0.0, 0.0))
    return _iterate(work, count, radius, free, scale)


@kernel
def _enumerate(
    work: Record, count: int, radius: float, free: Twist, scale: float
) -> tuple[bool, Twist]:
    """Return whether guesses of what every contact does lead to an answer, and the velocities.

    First all press, and stick if they do not slip already; then those that would pull open, one
    after the other; then those that would leave their cone begin to slip.
    """
    for i in range(count):
        contact = work.contact[i]
        contact.status = SLIPS if contact.slides else STICKS
    twist = free
    for _ in range(count):
        twist = _hold_known(work, count, radius, free)
        kept = _kept(work, count, radius, twist, scale)
        if kept and _satisfied(work, count, radius, twist, scale):
            return True, twist
        most, pulls = 0.0, -1
        for i in range(count):
            if work.contact[i].push < most:
                most, pulls = work.contact[i].push, i
        if pulls < 0:
            break
        work.contact[pulls].status = OPEN
    begins = False
    for i in range(count):
        contact = work.contact[i]
        drag, most = vector(contact.drag), contact.friction * contact.push
        if contact.status == STICKS and norm(drag) > most:
            contact.status = SLIPS
            store(contact.drag, scaled(max(most, 0.0) / norm(drag), drag))
            begins = True
    if begins:
        return _polish(work, count, radius, free, scale)
    return False, twist


@kernel
def _iterate(
    work: Record, count: int, radius: float, free: Twist, scale: float
) -> tuple[Twist, bool]:
    """Return what `solve` does, by sweeps over the contacts and Newton's method."""
    twist = free
    sweeps = _FIRST_SWEEPS
    for _ in range(_MOST_ATTEMPTS):
        for _ in range(sweeps):
            twist, change = _sweep(work, count, radius, twist)
            if change <= _ROUNDING * scale:
                return twist, True
            if change > _ABSURD * scale:
                return twist, False
        done, polished = _polish(work, count, radius, free, scale)
        if done:
            return polished, True
        sweeps *= 3
    return twist, False


@kernel
def _scale(work: Record, count: int, radius: float, twist: Twist) -> float:
    scale = norm(twist.linear) + radius * norm(twist.angular) + 1e-12
    for i in range(count):
        contact = work.contact[i]
        scale = max(scale, norm(vector(contact.surface)), abs(contact.bias))
    return scale


@kernel
def _sweep(work: Record, count: int, radius: float, twist: Twist) -> tuple[Twist, float]:
    """Solve every contact once, given the others; return the velocities and the largest change."""
    change = 0.0
    for i in range(count):
        contact = work.contact[i]
        push = max(contact.push - excess(contact, twist.linear), 0.0)
        old = vector(contact.drag)
        most = contact.friction * push
        if contact.dilatancy > 0.0 and not contact.slides:
            push, drag = _alone(contact, radius, twist)
        elif contact.slides:
            drag = scaled(-most, vector(contact.direction))
            contact.status = SLIPS
        else:
            drag = plus(old, -1.0 / SLIP_PER_IMPULSE, slip(contact, radius, twist))
            size = norm(drag)
            contact.status = STICKS
            if size > most:
                drag = scaled(most / size, drag)
                contact.status = SLIPS
        if push == 0.0:
            contact.status = OPEN
        step = sub(drag, old)
        twist = _apply(contact, radius, twist, push - contact.push, step)
        change = max(change, abs(push - contact.push), norm(step))
        contact.push = push
        store(contact.drag, drag)
    return twist, change


@kernel
def slip_response(contact: Record) -> float:
    """Return by how much a unit of push changes ``w - d |u|`` where it slips; see `_alone`."""
    response: float = 1.0 + SLIP_PER_IMPULSE * contact.friction * contact.dilatancy
    return response


@kernel
def _alone(contact: Record, radius: float, twist: Twist) -> tuple[float, Vector]:
    """Return push and drag of a contact whose slip makes it open, given the others; its status.

    Without it the normal velocity exceeds what is asked for by w and the slip is u. It does nothing
    if w >= d u, d being the dilatancy; it sticks if that is within the cone; and otherwise
    w + N = d (u - 7/2 mu N).
    """
    old, mu, dilatancy = vector(contact.drag), contact.friction, contact.dilatancy
    free = excess(contact, twist.linear) - contact.push
    u = plus(slip(contact, radius, twist), -SLIP_PER_IMPULSE, old)
    speed = norm(u)
    contact.status = OPEN
    if free >= dilatancy * speed:
        return 0.0, (0.0, 0.0, 0.0)
    contact.status = STICKS
    if speed <= -SLIP_PER_IMPULSE * mu * free:
        return -free, scaled(-1.0 / SLIP_PER_IMPULSE, u)
    contact.status = SLIPS
    push = (dilatancy * speed - free) / slip_response(contact)
    return push, scaled(-mu * push / speed, u)


@kernel
def _both_stick(work: Record, radius: float, free: Twist, alike: float) -> tuple[bool, bool, Twist]:
    """Return whether two contacts can both stick, whether they do, and the velocities if so.

    Of a rigid ball both points of contact are then given velocities, along the line through them
    alike. About that line, on which the reactions have no moment, its momentum is kept. What the
    reactions are is known but for one number: the friction with which both contacts can press
    against each other. ``alike`` is the share of what is asked of the two points by which it may
    differ along the line between them.
    """
    first, second = work.contact[0], work.contact[1]
    a, b = vector(first.normal), vector(second.normal)
    cosine, d = dot(a, b), cross(a, b)
    sine = norm(d)
    if first.slides or second.slides or sine < 1e-3:
        return False, False, free
    d = scaled(1.0 / sine, d)
    apart = sub(a, b)
    distance = norm(apart)
    axis = scaled(1.0 / distance, apart)
    point_a = plus(vector(first.surface), first.bias, a)
    differ = sub(point_a, plus(vector(second.surface), second.bias, b))
    moves = sub(vector(first.carried), vector(second.carried))
    allowed = alike * norm(differ) if dot(moves, moves) == 0.0 else 0.0
    possible = abs(dot(axis, differ)) <= max(allowed, EXACT * norm(free.linear))
    lever = cross(axis, scaled(radius, a))
    inertia = 0.4 * radius * radius
    tilting = scaled(-1.0 / (radius * distance), cross(axis, differ))
    moving = plus(point_a, -radius, cross(a, tilting))
    turning = inertia * dot(axis, free.angular) + dot(lever, sub(free.linear, moving))
    rate = turning / (inertia + dot(lever, lever))
    after = Twist(plus(moving, rate, lever), plus(tilting, rate, axis))

    force = sub(after.linear, free.linear)
    moment = scaled(-inertia / radius, sub(after.angular, free.angular))
    along_a = -dot(moment, b) / sine
    along_b = dot(moment, a) / sine
    shared = dot(moment, d)
    # The friction across d is t at the first contact and shared - t at the second.
    ra, rb = dot(force, a) + sine * shared, dot(force, b)
    push_a = (ra - cosine * rb) / (sine * sine)
    push_b = (rb - cosine * ra) / (sine * sine)
    slope = -(1.0 - cosine) / sine
    mu_a, mu_b = first.friction, second.friction
    best, found = 0.5 * shared, False
    for candidate in range(5):
        if candidate == 0:
            t = 0.5 * shared
        elif candidate < 3:
            t = _cone_edge(push_a, slope, mu_a, along_a, 0.0, candidate == 1)
        else:
            t = _cone_edge(push_b, slope, mu_b, along_b, shared, candidate == 3)
        na, nb = push_a + slope * t, push_b + slope * t
        # The edge of a cone is in it, though rounding may say otherwise.
        room = 1e-12 * (abs(na) + abs(nb)) + 1e-300
        inside = (
            na >= 0.0
            and nb >= 0.0
            and _length(along_a, t) <= mu_a * na + room
            and _length(along_b, shared - t) <= mu_b * nb + room
        )
        if inside and (not found or abs(t - 0.5 * shared) < abs(best - 0.5 * shared)):
            best, found = t, True
            if candidate == 0:
                break
    first.push, second.push = push_a + slope * best, push_b + slope * best
    store(first.drag, plus(scaled(along_a, d), best, cross(d, a)))
    store(second.drag, plus(scaled(along_b, d), shared - best, cross(d, b)))
    return True, possible and found, after


@kernel
def _length(x: float, y: float) -> float:
    return math.sqrt(x * x + y * y)


@kernel
def _cone_edge(
    push: float, slope: float, mu: float, along: float, centre: float, lower: bool
) -> float:
    """Return a t at which ``along^2 + (centre - t)^2 = mu^2 (push + slope t)^2``, or nan."""
    a = 1.0 - mu * mu * slope * slope
    b = -2.0 * centre - 2.0 * mu * mu * push * slope
    c = along * along + centre * centre - mu * mu * push * push
    if a == 0.0:
        return -c / b if b != 0.0 else math.nan
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return math.nan
    root = math.sqrt(discriminant)
    big = -0.5 * (b + root) if b >= 0.0 else -0.5 * (b - root)
    if big == 0.0:
        return 0.0
    return big / a if lower else c / big


@kernel
def hold(work: Record, count: int, radius: float, free: Twist) -> Twist:
    """Return the velocities after the impulses of contacts that neither open nor change their mode.

    Every one of the first ``count`` keeps its distance; those with status `STICKS` do not slip, the
    others slip along ``direction``. Writes ``push`` and ``drag``, which may now pull or leave the
    cone: the caller asks.
    """
    if count == 1:
        contact = work.contact[0]
        push = -excess(contact, free.linear)
        if contact.status == STICKS:
            drag = scaled(-1.0 / SLIP_PER_IMPULSE, slip(contact, radius, free))
        else:
            drag = scaled(-contact.friction * push, vector(contact.direction))
        contact.push = push
        store(contact.drag, drag)
        return _apply(contact, radius, free, push, drag)
    return _hold_known(work, count, radius, free)


@kernel
def _hold_known(work: Record, count: int, radius: float, free: Twist) -> Twist:
    """Return what `hold` does, of two contacts or more; `OPEN` ones do nothing."""
    if count == 2:
        done, twist = _hold_pair(work, radius, free)
        if done:
            return twist
    return _hold_several(work, count, radius, free)


@kernel
def _hold_pair(work: Record, radius: float, free: Twist) -> tuple[bool, Twist]:
    """Return whether two contacts are told from each other, and what `hold` does if so."""
    a, b = work.contact[0], work.contact[1]
    if a.status == STICKS and b.status == STICKS:
        defined, _, twist = _both_stick(work, radius, free, EXACT)
        return defined, twist
    if a.status == STICKS:
        a, b = b, a
    if a.status != SLIPS or b.status == OPEN:
        return False, free
    n_a, n_b, first = vector(a.normal), vector(b.normal), _unit_impulse(a, 0)
    opening = excess(a, free.linear)
    if b.status == SLIPS:
        second = _unit_impulse(b, 0)
        ab, ba = dot(n_a, second), dot(n_b, first)
        rest = 1.0 - ab * ba
        if abs(rest) < _SINGULAR:
            return False, free
        other = excess(b, free.linear)
        one = (ab * other - opening) / rest
        impulse = scaled((ba * opening - other) / rest, second)
    else:
        # The point of contact of b is to move so, whatever the impulse at a.
        wanted = plus(vector(b.surface), b.bias, n_b)
        missed = sub(wanted, plus(free.linear, radius, cross(n_b, free.angular)))
        alone = _impulse_for(n_b, missed)
        effect = plus(first, -_SPIN_PER_IMPULSE, cross(n_b, cross(n_a, first)))
        answer = _impulse_for(n_b, effect)
        rest = 1.0 - dot(n_a, answer)
        if abs(rest) < _SINGULAR:
            return False, free
        one = (-opening - dot(n_a, alone)) / rest
        impulse = plus(alone, -one, answer)
    _take(a, scaled(one, first))
    _take(b, impulse)
    twist = _apply(a, radius, free, a.push, vector(a.drag))
    return True, _apply(b, radius, twist, b.push, vector(b.drag))


@kernel
def _impulse_for(n: Vector, change: Vector) -> Vector:
    """Return the impulse that alone changes the velocity of its point of contact so."""
    return plus(
        scaled(1.0 / SLIP_PER_IMPULSE, change),
        _SPIN_PER_IMPULSE / SLIP_PER_IMPULSE * dot(n, change),
        n,
    )


@kernel
def _take(contact: Record, impulse: Vector) -> None:
    """Write an impulse as a contact's push and drag."""
    n = vector(contact.normal)
    contact.push = dot(n, impulse)
    store(contact.drag, tangential(impulse, n))


@kernel
def _hold_several(work: Record, count: int, radius: float, free: Twist) -> Twist:
    """Return what `_hold_known` does, from a system of linear equations.

    Its unknowns are the impulse of a contact that sticks, three numbers, and the normal part of one
    that slips; its equations that the velocity of the one's point, and the normal velocity of the
    other, are what they should be.
    """
    size = none_of(count)
    for i in range(count):
        contact = work.contact[i]
        contact.first = size
        size += _unknowns(contact)
    for i in range(count):
        _write_equations(work, count, size, work.contact[i], radius, free)
    eliminate(work.system, size, work.columns)
    twist = free
    for i in range(count):
        contact = work.contact[i]
        impulse = (0.0, 0.0, 0.0)
        for b in range(_unknowns(contact)):
            impulse = plus(impulse, work.system[contact.first + b, size], _unit_impulse(contact, b))
        _take(contact, impulse)
        twist = _apply(contact, radius, twist, contact.push, vector(contact.drag))
    return twist


@kernel
def _write_equations(
    work: Record, count: int, size: int, contact: Record, radius: float, free: Twist
) -> None:
    """Write the rows of a contact into the system of ``size`` unknowns."""
    system, place, n = work.system, contact.first, vector(contact.normal)
    if contact.status == OPEN:
        return
    if contact.status == STICKS:
        wanted = plus(vector(contact.surface), contact.bias, n)
        moving = plus(free.linear, radius, cross(n, free.angular))
        for a in range(3):
            system[place + a, size] = wanted[a] - moving[a]
    else:
        system[place, size] = -excess(contact, free.linear)
    for j in range(count):
        other = work.contact[j]
        for b in range(_unknowns(other)):
            impulse = _unit_impulse(other, b)
            if contact.status == STICKS:
                turned = cross(vector(other.normal), impulse)
                effect = plus(impulse, -_SPIN_PER_IMPULSE, cross(n, turned))
                for a in range(3):
                    system[place + a, other.first + b] = effect[a]
            else:
                system[place, other.first + b] = dot(n, impulse)


@kernel
def _unknowns(contact: Record) -> int:
    if contact.status == OPEN:
        return 0
    return 3 if contact.status == STICKS else 1


@kernel
def _unit_impulse(contact: Record, b: int) -> Vector:
    """Return an axis of the world for a contact that sticks, and that of the cone for others."""
    if contact.status == STICKS:
        return 1.0 if b == 0 else 0.0, 1.0 if b == 1 else 0.0, 1.0 if b == 2 else 0.0
    return plus(vector(contact.normal), -contact.friction, vector(contact.direction))


@kernel
def _polish(
    work: Record, count: int, radius: float, free: Twist, scale: float
) -> tuple[bool, Twist]:
    """Newton's method from the impulses there are, with the status that every contact has.

    Returns whether it ended at an answer, and the velocities. If not, the impulses are as before.
    """
    m = none_of(count)
    for i in range(count):
        contact = work.contact[i]
        contact.kept_push = contact.push
        store(contact.kept_drag, vector(contact.drag))
        if contact.status != OPEN:
            work.active[m] = i
            m += 1
    _respond(work, m)
    done = m == 0
    before = math.inf
    for _ in range(_MOST_NEWTON_STEPS):
        if m == 0:
            break
        residual = _newton_step(work, m, radius, free)
        if residual <= _ROUNDING * scale or (residual <= 1e-12 * scale and residual >= before):
            done = True
            break
        before = residual
    twist = _sum(work, count, radius, free)
    if done and _satisfied(work, count, radius, twist, scale):
        return True, twist
    for i in range(count):
        contact = work.contact[i]
        contact.push = contact.kept_push
        store(contact.drag, vector(contact.kept_drag))
    return False, twist


@kernel
def _kept(work: Record, count: int, radius: float, twist: Twist, scale: float) -> bool:
    """Say whether contacts stay closed, and those that stick do: nothing rigid may give way."""
    room = 1e-12 * scale
    for i in range(count):
        contact = work.contact[i]
        if contact.status != OPEN and abs(lag(contact, radius, twist)) > room:
            return False
        if contact.status == STICKS and norm(slip(contact, radius, twist)) > room:
            return False
    return True


@kernel
def _satisfied(work: Record, count: int, radius: float, twist: Twist, scale: float) -> bool:
    """Say whether no contact pulls, closes or sticks beyond its cone."""
    room = 1e-12 * scale
    for i in range(count):
        contact = work.contact[i]
        if contact.push < -room:
            return False
        if contact.status == OPEN and lag(contact, radius, twist) < -room:
            return False
        most = contact.friction * max(contact.push, 0.0)
        if contact.status == STICKS and norm(vector(contact.drag)) > most + room:
            return False
    return True


@kernel
def _sum(work: Record, count: int, radius: float, twist: Twist) -> Twist:
    """Return the velocities after all impulses."""
    for i in range(count):
        contact = work.contact[i]
        twist = _apply(contact, radius, twist, contact.push, vector(contact.drag))
    return twist


@kernel
def _respond(work: Record, m: int) -> None:
    """Write the frames of the active contacts, and what unit impulses along them change (Delassus).

    Row and column 3 i are the normal of the i-th active contact, the next two its tangents.
    """
    for i in range(m):
        n = vector(work.contact[work.active[i]].normal)
        # The axis along which the normal is shortest is not along it.
        x, y, z = abs(n[0]), abs(n[1]), abs(n[2])
        if x <= y and x <= z:
            other = (1.0, 0.0, 0.0)
        elif y <= z:
            other = (0.0, 1.0, 0.0)
        else:
            other = (0.0, 0.0, 1.0)
        first = cross(n, other)
        first = scaled(1.0 / norm(first), first)
        put(work.frame, 3 * i, n)
        put(work.frame, 3 * i + 1, first)
        put(work.frame, 3 * i + 2, cross(n, first))
    for j in range(m):
        source = row(work.frame, 3 * j)
        for b in range(3):
            impulse = row(work.frame, 3 * j + b)
            turned = cross(source, impulse)
            for i in range(m):
                n = row(work.frame, 3 * i)
                moved = plus(impulse, -_SPIN_PER_IMPULSE, cross(n, turned))
                for a in range(3):
                    effect = impulse if a == 0 else moved
                    work.response[3 * i + a, 3 * j + b] = dot(row(work.frame, 3 * i + a), effect)


@kernel
def _newton_step(work: Record, m: int, radius: float, free: Twist) -> float:
    """Change the impulses of the ``m`` active contacts by one Newton step; return the residual.

    Args:
        work: the contacts.
        m: how many are active.
        radius: of the ball.
        free: velocities without contacts.
    """
    twist = free
    for i in range(m):
        contact = work.contact[work.active[i]]
        twist = _apply(contact, radius, twist, contact.push, vector(contact.drag))
    size = 3 * m
    residual = 0.0
    for i in range(m):
        contact = work.contact[work.active[i]]
        first, second = row(work.frame, 3 * i + 1), row(work.frame, 3 * i + 2)
        u = slip(contact, radius, twist)
        u1, u2 = dot(u, first), dot(u, second)
        opening = excess(contact, twist.linear)
        if contact.status == STICKS:
            for a in range(3):
                for k in range(size):
                    work.system[3 * i + a, k] = work.response[3 * i + a, k]
            work.system[3 * i, size] = -opening
            work.system[3 * i + 1, size] = -u1
            work.system[3 * i + 2, size] = -u2
            residual = max(residual, abs(opening), abs(u1), abs(u2))
        else:
            residual = max(residual, _write_slip(work, i, size, contact, u1, u2, opening))
    eliminate(work.system, size, work.columns)
    for i in range(m):
        contact = work.contact[work.active[i]]
        contact.push += work.system[3 * i, size]
        drag = vector(contact.drag)
        drag = plus(drag, work.system[3 * i + 1, size], row(work.frame, 3 * i + 1))
        store(contact.drag, plus(drag, work.system[3 * i + 2, size], row(work.frame, 3 * i + 2)))
    return residual


@kernel
def _write_slip(
    work: Record, i: int, size: int, contact: Record, u1: float, u2: float, opening: float
) -> float:
    """Write the rows of the ``i``-th active contact, which slips; return their residual.

    They are w - d |u| = 0, where w is the `excess` and d the dilatancy, and T + mu N u/|u| = 0.
    """
    system, response = work.system, work.response
    first, second = row(work.frame, 3 * i + 1), row(work.frame, 3 * i + 2)
    mu, push, drag = contact.friction, contact.push, vector(contact.drag)
    speed = _length(u1, u2)
    stiffness = dilatancy = 0.0
    if contact.slides:
        d = vector(contact.direction)
        d1, d2 = dot(d, first), dot(d, second)
    elif speed > 0.0:
        d1, d2 = u1 / speed, u2 / speed
        stiffness = mu * push / speed
        dilatancy = contact.dilatancy
    else:
        d1 = d2 = 0.0
    for k in range(size):
        system[3 * i, k] = response[3 * i, k]
    system[3 * i, size] = -opening
    if dilatancy > 0.0:
        opening -= dilatancy * speed
        system[3 * i, size] = -opening
        for k in range(size):
            along = d1 * response[3 * i + 1, k] + d2 * response[3 * i + 2, k]
            system[3 * i, k] -= dilatancy * along
    r1, r2 = dot(drag, first) + mu * push * d1, dot(drag, second) + mu * push * d2
    # The derivative of the direction by way of u.
    for k in range(size):
        g1, g2 = response[3 * i + 1, k], response[3 * i + 2, k]
        across = stiffness * (d1 * g2 - d2 * g1)
        system[3 * i + 1, k] = -across * d2
        system[3 * i + 2, k] = across * d1
    system[3 * i + 1, 3 * i] += mu * d1
    system[3 * i + 2, 3 * i] += mu * d2
    system[3 * i + 1, 3 * i + 1] += 1.0
    system[3 * i + 2, 3 * i + 2] += 1.0
    system[3 * i + 1, size] = -r1
    system[3 * i + 2, size] = -r2
    residual: float = max(abs(opening), abs(r1), abs(r2))
    return residual
