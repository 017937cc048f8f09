"""Motions under contacts that keep their modes: a turning skid, and what only steps can follow.

Flight, rolling and straight skids are parabolas. A skid over a face that a force turns is exact too
(`sliding`). Around edges and corners, and where slips turn at several contacts, the classical
Runge-Kutta method of fourth order goes on by steps no longer than the cap.
"""

from __future__ import annotations

import math
from typing import Final

from roller_env.physics.rigid.closest import FACE, closest, feature_margin, from_centre
from roller_env.physics.rigid.coulomb import SLIPS, STICKS, hold
from roller_env.physics.rigid.holding import across, lay_out
from roller_env.physics.rigid.impact import STICK_M_S, true_slip, velocity_over
from roller_env.physics.rigid.impact_time import CONTACT_GAP_M
from roller_env.physics.rigid.kernels import (
    Ball,
    Record,
    Twist,
    Vector,
    add,
    cross,
    dot,
    kernel,
    norm,
    plus,
    position_at,
    scaled,
    store,
    sub,
    tangential,
    vector,
)
from roller_env.physics.rigid.scene import Solids
from roller_env.physics.rigid.sliding import SLIP_SHARE, slide, stop_time

LONGEST_ARC: Final = 0.05
"""Radians round an edge or a corner in one step of RK4, whose error is their fifth power."""

_MOST_TRIES: Final = 100
_MOST_ALIKE: Final = 3

_STILL: Final = (0.0, 0.0, 0.0)


@kernel
def arc_end(work: Record, count: int, radius: float, v: Vector) -> float:
    """Return the time in which the ball rounds an edge or a corner by `LONGEST_ARC`, or ``inf``.

    It is less where friction is high and the ball slips: the normal force gives way with the square
    of the velocity, v^2 / r, and by way of mu N the slip does at the rate 2 mu v / r.
    """
    fastest = 0.0
    for i in range(count):
        contact = work.contact[i]
        if contact.kind != FACE:
            speed = norm(across(contact, velocity_over(contact, v)))
            if contact.status == SLIPS:
                speed *= max(1.0, 2.0 * contact.friction)
            fastest = max(fastest, speed)
    return LONGEST_ARC * radius / fastest if fastest > 0.0 else math.inf


@kernel
def _skid_setting(
    contact: Record, radius: float, ball: Ball, pull: Vector
) -> tuple[Vector, Vector, float, float, float, float, float]:
    """Return the unit vectors along and across the push, slip, push, cosine, sine, and k."""
    n = vector(contact.normal)
    u = true_slip(contact, radius, Twist(ball.velocity, ball.spin))
    g = tangential(pull, n)
    speed, push = norm(u), norm(g)
    along = scaled(1.0 / push, g)
    aside = cross(n, along)
    x, y = dot(u, along), dot(u, aside)
    size = math.sqrt(x * x + y * y)
    k = 3.5 * contact.friction * -dot(pull, n)
    return along, aside, speed, push, x / size, y / size, k


@kernel
def skid_end(contact: Record, radius: float, ball: Ball, pull: Vector) -> float:
    """Return when a turning skid ends, seconds or ``inf``."""
    _, _, speed, push, cosine, _, k = _skid_setting(contact, radius, ball, pull)
    return stop_time(speed, push, cosine, k)


@kernel
def skid(contact: Record, radius: float, ball: Ball, pull: Vector, time: float) -> Ball:
    """Return the ball after ``time`` of a skid over a plane that turns: see `sliding`."""
    n = vector(contact.normal)
    along, aside, speed, push, cosine, sine, k = _skid_setting(contact, radius, ball, pull)
    x, y, way_x, way_y = slide(speed, push, cosine, sine, k, time)
    before = true_slip(contact, radius, Twist(ball.velocity, ball.spin))
    after = plus(scaled(x, along), y, aside)
    way = plus(scaled(way_x, along), way_y, aside)
    rolling = scaled((1.0 - SLIP_SHARE) * push, along)
    change = scaled(SLIP_SHARE, sub(after, before))
    p = position_at(ball.position, plus(ball.velocity, -SLIP_SHARE, before), rolling, time)
    p = plus(p, SLIP_SHARE, way)
    v = add(plus(ball.velocity, time, rolling), change)
    lowest = scaled(1.0 / radius, sub(after, tangential(velocity_over(contact, v), n)))
    # lowest = n x w
    return Ball(p, v, plus(cross(lowest, n), dot(ball.spin, n), n))


@kernel
def _rates(work: Record, count: int, radius: float, ball: Ball, pull: Vector, time: float) -> Twist:
    """Return the accelerations under contacts that keep their modes."""
    lay_out(work, count, radius, ball, time)
    for i in range(count):
        contact = work.contact[i]
        if contact.status == SLIPS:
            u = true_slip(contact, radius, Twist(ball.velocity, ball.spin))
            size = norm(u)
            if size > STICK_M_S:
                store(contact.direction, scaled(1.0 / size, u))
    return hold(work, count, radius, Twist(pull, _STILL))


@kernel
def _moved(ball: Ball, velocity: Vector, rates: Twist, time: float) -> Ball:
    return Ball(
        plus(ball.position, time, velocity),
        plus(ball.velocity, time, rates.linear),
        plus(ball.spin, time, rates.angular),
    )


@kernel
def runge_kutta(
    work: Record, count: int, radius: float, ball: Ball, pull: Vector, h: float
) -> Ball:
    """Return the ball after one step of the classical method of fourth order."""
    a = _rates(work, count, radius, ball, pull, 0.0)
    second = _moved(ball, ball.velocity, a, 0.5 * h)
    b = _rates(work, count, radius, second, pull, 0.5 * h)
    third = _moved(ball, second.velocity, b, 0.5 * h)
    c = _rates(work, count, radius, third, pull, 0.5 * h)
    fourth = _moved(ball, third.velocity, c, h)
    d = _rates(work, count, radius, fourth, pull, h)
    sixth = h / 6.0
    return Ball(
        plus(
            ball.position,
            sixth,
            _sum(ball.velocity, second.velocity, third.velocity, fourth.velocity),
        ),
        plus(ball.velocity, sixth, _sum(a.linear, b.linear, c.linear, d.linear)),
        plus(ball.spin, sixth, _sum(a.angular, b.angular, c.angular, d.angular)),
    )


@kernel
def _sum(a: Vector, b: Vector, c: Vector, d: Vector) -> Vector:
    """Return ``a + 2 b + 2 c + d``."""
    return add(add(a, d), scaled(2.0, add(b, c)))


@kernel
def hermite(ball: Ball, after: Ball, duration: float, time: float) -> Vector:
    """Return a place on the cubic through two states, ``time`` after the first."""
    x = time / duration
    way = sub(after.position, plus(ball.position, duration, ball.velocity))
    bent = scaled(duration, sub(after.velocity, ball.velocity))
    p = plus(ball.position, time, ball.velocity)
    return plus(plus(p, x * x * (3.0 - 2.0 * x), way), x * x * (x - 1.0), bent)


@kernel
def _room(
    work: Record,
    solids: Solids,
    count: int,
    radius: float,
    ball: Ball,
    pull: Vector,
    time: float,
) -> float:
    """Return how far a ball is from the first change of a contact's mode; negative beyond it.

    A contact presses; sticks within its cone; slips in about the direction it slipped in at the
    start; and stays on its feature. In the units of each.
    """
    _rates(work, count, radius, ball, pull, time)
    room = math.inf
    for i in range(count):
        contact = work.contact[i]
        room = min(room, contact.push)
        if contact.status == STICKS:
            most = contact.friction * contact.push
            room = min(room, most - norm(vector(contact.drag)) + 1e-9)
        else:
            u = true_slip(contact, radius, Twist(ball.velocity, ball.spin))
            room = min(room, dot(vector(contact.start), u) + 0.5 * STICK_M_S)
        solid = solids.one[contact.solid]
        relative = from_centre(solid, contact.shift + time * contact.speed, ball.position)
        room = min(room, feature_margin(solids, solid, contact.kind, contact.axis, relative))
    return room


@kernel
def _directions_as_at_start(work: Record, count: int) -> None:
    for i in range(count):
        store(work.contact[i].direction, vector(work.contact[i].start))


@kernel
def curve_until(
    work: Record,
    solids: Solids,
    count: int,
    radius: float,
    ball: Ball,
    pull: Vector,
    limit: float,
) -> tuple[float, Ball]:
    """Return for how long, at most ``limit``, no contact changes its mode, and the ball then."""
    for i in range(count):
        store(work.contact[i].start, vector(work.contact[i].direction))
    there = runge_kutta(work, count, radius, ball, pull, limit)
    beyond = _room(work, solids, count, radius, there, pull, limit)
    _directions_as_at_start(work, count)
    if beyond >= 0.0:
        return limit, there
    # Regula falsi, where an end that stays counts half (the Illinois method), and halves.
    low, within = 0.0, max(_room(work, solids, count, radius, ball, pull, 0.0), 0.0)
    same = 0  # how often in a row the limit (below zero) or the lower end moved
    for _ in range(_MOST_TRIES):
        share = within / (within - beyond) if abs(same) < _MOST_ALIKE else 0.5
        middle = low + share * (limit - low)
        if not low < middle < limit:
            middle = 0.5 * (low + limit)
        if limit - low <= 1e-15 + 1e-13 * limit or not low < middle < limit:
            break
        _directions_as_at_start(work, count)
        halfway = runge_kutta(work, count, radius, ball, pull, middle)
        room = _room(work, solids, count, radius, halfway, pull, middle)
        if room < 0.0:
            limit, beyond, there = middle, room, halfway
            within = 0.5 * within if same < 0 else within
            same = min(same, 0) - 1
        else:
            low, within = middle, room
            beyond = 0.5 * beyond if same > 0 else beyond
            same = max(same, 0) + 1
    _directions_as_at_start(work, count)
    return limit, there


@kernel
def back_to_surface(
    work: Record, solids: Solids, count: int, radius: float, p: Vector, time: float
) -> Vector:
    """Return the centre at the contacts' distance again, of which steps keep only most."""
    for _ in range(1 if count == 1 else 4):
        for i in range(count):
            contact = work.contact[i]
            solid = solids.one[contact.solid]
            relative = from_centre(solid, contact.shift + time * contact.speed, p)
            distance, n, _, _ = closest(solids, solid, relative)
            error = distance - radius - 0.5 * CONTACT_GAP_M
            if abs(error) < 1e-3:
                p = plus(p, -error, n)
    return p


@kernel
def without_gain(
    work: Record, count: int, radius: float, ball: Ball, pull: Vector, p: Vector, twist: Twist
) -> Twist:
    """Return the velocities at ``p``, slower if friction would have given the ball energy.

    Steps err to both sides. Contacts that stand still ask of velocities only that some parts of
    them are 0, which a smaller multiple keeps.
    """
    for i in range(count):
        if work.contact[i].speed != 0.0:
            return twist
    before = _kinetic(radius, ball.velocity, ball.spin) + dot(pull, sub(p, ball.position))
    after = _kinetic(radius, twist.linear, twist.angular)
    if after <= before or after <= 0.0:
        return twist
    share = math.sqrt(max(before, 0.0) / after)
    return Twist(scaled(share, twist.linear), scaled(share, twist.angular))


@kernel
def _kinetic(radius: float, v: Vector, w: Vector) -> float:
    """Return the kinetic energy over the mass."""
    return 0.5 * dot(v, v) + 0.2 * radius * radius * dot(w, w)
