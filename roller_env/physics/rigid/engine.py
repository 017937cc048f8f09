"""The motion of balls among solids, from event to event.

A segment is the motion between two events under one set of held contacts. In order:

1. **near**: the solids that the ball can reach, and those it touches;
2. **weld**: what touches twice counts once, inner edges do not count at all;
3. **impact**: whatever approaches is stopped or thrown back, all contacts at once;
4. **hold**: which contacts press, stick and slip, and the acceleration that follows;
5. **motion**: a parabola, a skid that turns (both exact), or a step of RK4 around edges and corners
   and for slips that turn at several contacts, no longer than the cap;
6. **until**: the first of the end of the step, the end of a slip, a contact that lets go, a feature
   that ends, and the next impact.

A row needs nothing of the others, so any split of the rows over threads gives the same bits.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from roller_env.physics.rigid.attitude import turn
from roller_env.physics.rigid.closest import (
    EDGE,
    FACE,
    closest,
    extent,
    feature_margin,
    time_on_feature,
)
from roller_env.physics.rigid.coulomb import (
    MOST_CONTACTS,
    SLIPS,
    STICKS,
    Contacts,
    hold,
    make_contacts,
    slip,
    solve,
    swap,
)
from roller_env.physics.rigid.impact_time import CONTACT_GAP_M, impact_time, position_at
from roller_env.physics.rigid.kernels import (
    Vector,
    add,
    cross,
    dot,
    first_root,
    kernel,
    norm,
    plus,
    put,
    row,
    scaled,
    sub,
    tangential,
)
from roller_env.physics.rigid.scene import MARGIN_M, Scene
from roller_env.physics.rigid.sliding import SLIP_SHARE, slide, stop_time

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]

CLOSED_M_S: Final = 1e-6
"""A contact whose normal velocity is less is held; it neither bounces nor opens."""

CHATTER_M_S: Final = 1e-3
"""The same where several contacts touch. Friction at one lifts the ball off another, and a ball
that comes to rest in a corner would do so through ever smaller hops without end."""

REST_M_S: Final = 1e-3
"""An impact slower than this is plastic, whatever the elasticity: the bounces end."""

STICK_M_S: Final = 1e-9
"""A slip slower than this has ended."""

STRAIGHT: Final = 1e-6
"""Velocity (m/s) and acceleration (m/s^2) across an edge below which its normal stands still."""

TURNING: Final = 1e-9
"""Acceleration (m/s^2) of a slip across its direction below which it goes straight on."""

LONGEST_ARC: Final = 0.05
"""Radians round an edge or a corner in one step of RK4, whose error is their fifth power."""

MOST_NEAR: Final = 512
MOST_SEGMENTS: Final = 200
"""In one control step; beyond it the ball is moved on by force, and that is counted."""

FORCED_STEP_S: Final = 1e-3

MANY_SEGMENTS: Final = 32
"""In one control step; beyond it contacts change faster than is worth following (a ball that spins
in a corner chatters against its walls), and several at once are stepped over."""

SHORTEST_S: Final = 1e-13

_MOST_PROJECTIONS: Final = 50

# Motions of a segment.
_PARABOLA: Final = 0
_SKID: Final = 1
_CURVE: Final = 2
_STEP: Final = 3


class Balls(NamedTuple):
    """N balls and the slabs of their scenes. SI units, world frame."""

    position: Float64  # (N, 3) centres
    velocity: Float64  # (N, 3)
    angular_velocity: Float64  # (N, 3)
    attitude: Float64  # (N, 4) unit quaternion (w, x, y, z), ball frame to world frame
    slab: Float64  # (N, P) displacement of each slab along z, <= 0


class Counts(NamedTuple):
    """What the steps took, (N,) each, since they were last set to 0."""

    segments: Int64
    forced: Int64  # segments that did not end by themselves
    unsolved: Int64  # contact problems without an answer
    blocked: Int64  # slabs that were held up by a ball


class _Near(NamedTuple):
    """Solids within reach, one a row."""

    box: Int64
    gap: Float64
    normal: Float64
    kind: Int64


@kernel
def advance(
    scene: Scene,
    balls: Balls,
    force: Float64,
    slab_speed: Float64,
    duration: float,
    cap: float,
    first: int,
    last: int,
    path: Float64,
    counts: Counts,
) -> None:
    """Move the balls ``first`` to ``last`` (excluded) by ``duration`` seconds.

    Args:
        scene: what they meet.
        balls: where they are; changed in place.
        force: (N, 3) force over mass besides gravity, constant over the step, m/s^2.
        slab_speed: (N, P) speed of each slab along z, m/s; it ends at its stop.
        duration: of the control step, seconds.
        cap: longest step of RK4, seconds.
        first: row.
        last: row after the last.
        path: (N, S + 1, 3) receives the centres at the start and after each S-th of the step.
        counts: counted up.
    """
    contacts = make_contacts()
    near = _Near(
        np.empty(MOST_NEAR, np.int64),
        np.empty(MOST_NEAR),
        np.empty((MOST_NEAR, 3)),
        np.empty(MOST_NEAR, np.int64),
    )
    slabs = scene.slab_stop.shape[0]
    offset, speed = np.zeros(slabs + 1), np.zeros(slabs + 1)
    for ball in range(first, last):
        for k in range(slabs):
            offset[k] = balls.slab[ball, k]
            speed[k] = slab_speed[ball, k] if offset[k] > scene.slab_stop[k] else 0.0
        _advance_one(
            scene, balls, ball, force, offset, speed, duration, cap, path, counts, contacts, near
        )
        for k in range(slabs):
            balls.slab[ball, k] = offset[k]


@kernel
def _advance_one(
    scene: Scene,
    balls: Balls,
    ball: int,
    force: Float64,
    offset: Any,
    speed: Any,
    duration: float,
    cap: float,
    path: Float64,
    counts: Counts,
    c: Contacts,
    near: _Near,
) -> None:
    """Move one ball; ``offset`` and ``speed`` of the slabs are its own."""
    r = scene.radius
    p, v = row(balls.position, ball), row(balls.velocity, ball)
    w = row(balls.angular_velocity, ball)
    f = sub(row(force, ball), (0.0, 0.0, scene.gravity))
    samples = path.shape[1] - 1
    put(path[ball], 0, p)
    sampled = 1
    time = 0.0
    segments = 0
    while time < duration:
        segments += 1
        left = _look_ahead(scene, p, v, f, offset, speed, duration - time)
        found, count = _find_near(scene, p, v, f, offset, speed, left, near, c)
        count = _weld(c, count, r)
        p = _keep_gaps(c, count, p)
        v, w, solved = _impact(c, count, r, v, w, scene, speed, counts, ball)
        if not solved:
            counts.unsolved[ball] += 1
        count = _keep_closed(c, count, v)
        v, w = _settle(c, count, r, v, w)
        motion, a, alpha, count, solved = _hold_contacts(
            c, count, r, v, w, f, 0.25 * cap, segments > MANY_SEGMENTS
        )
        if not solved:
            counts.unsolved[ball] += 1
        limit, curved = _plan(scene, c, count, motion, r, p, v, w, f, a, alpha, offset, left, cap)
        until = limit
        if motion != _CURVE:
            until = min(until, _features_end(scene, c, count, p, v, curved, offset))
        until = _next_impact(scene, c, count, near, found, p, v, curved, offset, speed, until)
        if segments > MOST_SEGMENTS:
            until = max(until, min(duration - time, FORCED_STEP_S))
            counts.forced[ball] += 1
        while sampled <= samples and sampled * duration <= (time + until) * samples * (1.0 + 1e-15):
            at = sampled * duration / samples - time
            put(path[ball], sampled, position_at(p, v, curved, at))
            sampled += 1
        before = w
        p, v, w = _move(scene, c, count, motion, r, p, v, w, f, a, alpha, offset, speed, until)
        if until == limit:
            w = _end_slip(c, count, r, v, w)
        turn(balls.attitude[ball], before, w, until)
        _move_slabs(scene, offset, speed, until)
        time += until
        if duration - time < SHORTEST_S:
            time = duration
    while sampled <= samples:
        put(path[ball], sampled, p)
        sampled += 1
    counts.segments[ball] += segments
    put(balls.position, ball, p)
    put(balls.velocity, ball, v)
    put(balls.angular_velocity, ball, w)


@kernel
def _plan(
    scene: Scene,
    c: Contacts,
    count: int,
    motion: int,
    r: float,
    p: Vector,
    v: Vector,
    w: Vector,
    f: Vector,
    a: Vector,
    alpha: Vector,
    offset: Any,
    left: float,
    cap: float,
) -> tuple[float, Vector]:
    """Return when a motion ends if it meets nothing, and a parabola through both of its ends.

    The parabola is told by its acceleration.
    """
    if motion == _PARABOLA:
        return min(left, _slips_end(c, count, r, v, w, a, alpha)), a
    if motion == _STEP:
        return min(left, 0.25 * cap), a
    limit = min(left, cap, _arc_end(c, count, r, v))
    if motion == _CURVE:
        limit = min(limit, max(0.5 * _slowing(c, count, r, v, w), cap / 64.0))
    if motion == _SKID:
        limit = min(limit, _skid_end(c, r, v, w, f))
        there, _, _ = _skid(c, r, p, v, w, f, limit)
    else:
        limit = _curve_until(scene, c, count, r, p, v, w, f, offset, limit)
        there, _, _ = _runge_kutta(c, count, r, p, v, w, f, limit)
    return limit, scaled(2.0 / (limit * limit), sub(there, plus(p, limit, v)))


@kernel
def _arc_end(c: Contacts, count: int, radius: float, v: Vector) -> float:
    """Return the time in which the ball rounds an edge or a corner by `LONGEST_ARC`, or ``inf``."""
    fastest = 0.0
    for i in range(count):
        if c.kind[i] != FACE:
            fastest = max(fastest, norm(_across(c, i, sub(v, row(c.moving, i)))))
    return LONGEST_ARC * radius / fastest if fastest > 0.0 else math.inf


@kernel
def _move(
    scene: Scene,
    c: Contacts,
    count: int,
    motion: int,
    r: float,
    p: Vector,
    v: Vector,
    w: Vector,
    f: Vector,
    a: Vector,
    alpha: Vector,
    offset: Any,
    speed: Any,
    time: float,
) -> tuple[Vector, Vector, Vector]:
    """Return position, velocity and angular velocity after ``time`` of a motion."""
    if motion == _CURVE:
        p, v, w = _runge_kutta(c, count, r, p, v, w, f, time)
        return _back_to_surface(scene, c, count, p, offset, speed, time), v, w
    if motion == _SKID:
        return _skid(c, r, p, v, w, f, time)
    p = position_at(p, v, a, time)
    if motion == _STEP:
        p = _back_to_surface(scene, c, count, p, offset, speed, time)
    return p, plus(v, time, a), plus(w, time, alpha)


@kernel
def _move_slabs(scene: Scene, offset: Any, speed: Any, time: float) -> None:
    for k in range(len(scene.slab_stop)):
        offset[k] += time * speed[k]
        if speed[k] < 0.0 and offset[k] <= scene.slab_stop[k] + 1e-12:
            offset[k], speed[k] = scene.slab_stop[k], 0.0


# 1 What is near -----------------------------------------------------------------------------------


@kernel
def _look_ahead(
    scene: Scene, p: Vector, v: Vector, f: Vector, offset: Any, speed: Any, left: float
) -> float:
    """Return for how long the ball stays within the grid's margin, and every slab on its way."""
    fastest, pull = norm(v), norm(f)
    # The reactions of contacts only take away from the free motion's way.
    if fastest * left + pull * left * left > MARGIN_M:
        left = min(left, 0.5 * MARGIN_M / (fastest + 1e-9))
        if fastest * left + pull * left * left > MARGIN_M:
            left = min(left, 0.7 * math.sqrt(0.5 * MARGIN_M / pull))
    for k in range(len(scene.slab_stop)):
        if speed[k] < 0.0:
            stop = (scene.slab_stop[k] - offset[k]) / speed[k]
            if stop > 1e-12:
                left = min(left, stop)
    return left


@kernel
def _from_box(scene: Scene, box: int, p: Vector, offset: Any) -> Vector:
    """Return a point relative to a box's centre, where the box is now."""
    relative = sub(p, row(scene.centre, box))
    slab = scene.slab[box]
    if slab >= 0:
        relative = (relative[0], relative[1], relative[2] - offset[slab])
    return relative


@kernel
def _box_velocity(scene: Scene, box: int, speed: Any) -> Vector:
    slab = scene.slab[box]
    return 0.0, 0.0, speed[slab] if slab >= 0 else 0.0


@kernel
def _find_near(
    scene: Scene,
    p: Vector,
    v: Vector,
    f: Vector,
    offset: Any,
    speed: Any,
    left: float,
    near: _Near,
    c: Contacts,
) -> tuple[int, int]:
    """Write the boxes that can be met in ``left`` seconds, and the contacts; return how many."""
    x = math.floor((p[0] - scene.origin[0]) / scene.cell)
    y = math.floor((p[1] - scene.origin[1]) / scene.cell)
    if not (0 <= x < scene.grid[0] and 0 <= y < scene.grid[1]):
        return 0, 0
    cell = x * scene.grid[1] + y
    reach = scene.radius + norm(v) * left + norm(f) * left * left + CONTACT_GAP_M
    found = count = 0
    for place in range(scene.cell_start[cell], scene.cell_start[cell + 1]):
        box = scene.cell_box[place]
        slab = scene.slab[box]
        shift = offset[slab] if slab >= 0 else 0.0
        wide = reach + (abs(speed[slab]) * left if slab >= 0 else 0.0)
        if (
            p[2] - shift - wide > scene.high[box, 2]
            or p[2] - shift + wide < scene.low[box, 2]
            or p[0] - wide > scene.high[box, 0]
            or p[0] + wide < scene.low[box, 0]
            or p[1] - wide > scene.high[box, 1]
            or p[1] + wide < scene.low[box, 1]
        ):
            continue
        distance, normal, kind, axis = closest(scene, box, _from_box(scene, box, p, offset))
        if distance > wide or found == MOST_NEAR:
            continue
        gap = distance - scene.radius
        near.box[found], near.gap[found], near.kind[found] = box, gap, kind
        put(near.normal, found, normal)
        found += 1
        if gap <= CONTACT_GAP_M and count < MOST_CONTACTS:
            c.box[count], c.kind[count], c.axis[count], c.gap[count] = box, kind, axis, gap
            put(c.normal, count, normal)
            put(c.pivot, count, plus(p, -distance, normal))
            if kind == EDGE:
                put(c.edge, count, row(scene.axes[box], axis))
            c.friction[count] = scene.friction[box]
            c.elasticity[count] = scene.elasticity[box]
            put(c.moving, count, _box_velocity(scene, box, speed))
            count += 1
    return found, count


# 2 Welding ----------------------------------------------------------------------------------------


@kernel
def _weld(c: Contacts, count: int, radius: float) -> int:
    """Leave out contacts that are parts of others; return how many are left.

    An edge or corner that lies in a plane on which the ball rests is an inner one, or one that it
    has not reached; it neither stops nor lifts. Of two equal features one is enough.
    """
    i = 0
    while i < count:
        inner = False
        for j in range(count):
            if i == j or not _move_alike(c, i, j):
                continue
            cosine = dot(row(c.normal, i), row(c.normal, j))
            if c.kind[j] == FACE and c.kind[i] != FACE:
                over = (radius + c.gap[j]) - (radius + c.gap[i]) * cosine
                inner = inner or abs(over) < 100.0 * CONTACT_GAP_M
            elif c.kind[i] == c.kind[j] and cosine > 1.0 - 1e-12:
                inner = inner or c.gap[i] > c.gap[j] or (c.gap[i] == c.gap[j] and j < i)
        if inner:
            swap(c, i, count - 1)
            count -= 1
        else:
            i += 1
    return count


@kernel
def _move_alike(c: Contacts, i: int, j: int) -> bool:
    apart = sub(row(c.moving, i), row(c.moving, j))
    return apart == (0.0, 0.0, 0.0)


@kernel
def _keep_gaps(c: Contacts, count: int, p: Vector) -> Vector:
    """Return the centre, moved by less than a contact's gap, half of it away from each contact."""
    for i in range(count):
        p = plus(p, 0.5 * CONTACT_GAP_M - c.gap[i], row(c.normal, i))
    return p


# 3 Impacts ----------------------------------------------------------------------------------------


@kernel
def _impact(
    c: Contacts,
    count: int,
    radius: float,
    v: Vector,
    w: Vector,
    scene: Scene,
    speed: Any,
    counts: Counts,
    ball: int,
) -> tuple[Vector, Vector, bool]:
    """Return the velocities after the impacts of all contacts at once, and whether there are any.

    A moving slab that would have to pass through the ball stands still for the rest of the step:
    what squeezes a rigid ball against something rigid is held up by it.
    """
    approaches = False
    for i in range(count):
        put(c.surface, i, row(c.moving, i))
        c.slides[i] = False
        approach = dot(row(c.normal, i), sub(v, row(c.moving, i)))
        c.bias[i] = -c.elasticity[i] * approach if approach < -REST_M_S else 0.0
        approaches = approaches or approach < -_closed(count)
    if not approaches:
        return v, w, True
    after_v, after_w, solved = solve(c, count, radius, v, w)
    fastest = norm(v) + radius * norm(w)
    moving = False
    for i in range(count):
        moving = moving or norm(row(c.moving, i)) > 0.0
        fastest = max(fastest, norm(row(c.moving, i)))
    if moving and (not solved or norm(after_v) > 4.0 * fastest + 1.0):
        for i in range(count):
            slab = scene.slab[c.box[i]]
            if slab >= 0 and speed[slab] != 0.0:
                speed[slab] = 0.0
                counts.blocked[ball] += 1
            put(c.moving, i, (0.0, 0.0, 0.0))
            put(c.surface, i, (0.0, 0.0, 0.0))
            c.bias[i] = 0.0
        after_v, after_w, solved = solve(c, count, radius, v, w)
    return after_v, after_w, solved


@kernel
def _closed(count: int) -> float:
    return CLOSED_M_S if count == 1 else CHATTER_M_S


@kernel
def _keep_closed(c: Contacts, count: int, v: Vector) -> int:
    """Leave out contacts that open; return how many are left."""
    slowest = _closed(count)
    i = 0
    while i < count:
        if dot(row(c.normal, i), sub(v, row(c.moving, i))) > slowest:
            swap(c, i, count - 1)
            count -= 1
        else:
            i += 1
    return count


@kernel
def _settle(c: Contacts, count: int, radius: float, v: Vector, w: Vector) -> tuple[Vector, Vector]:
    """Return the velocities without what rounding left of closed contacts and ended slips."""
    for _ in range(_MOST_PROJECTIONS if count > 1 else count):
        largest = 0.0
        for i in range(count):
            n = row(c.normal, i)
            left = dot(n, sub(v, row(c.moving, i)))
            v = plus(v, -left, n)
            largest = max(largest, abs(left))
        if largest < 1e-16:
            break
    if count != 1:
        return v, w
    n, moving = row(c.normal, 0), row(c.moving, 0)
    put(c.surface, 0, moving)
    u = slip(c, 0, radius, v, w)
    if 0.0 < norm(u) <= STICK_M_S:
        v = plus(v, -SLIP_SHARE, u)
        w = plus(w, 2.5 * SLIP_SHARE / radius, cross(n, u))
    return v, w


# 4 Held contacts ----------------------------------------------------------------------------------


@kernel
def _lay_out(
    c: Contacts, count: int, radius: float, p: Vector, v: Vector, w: Vector, time: float
) -> None:
    """Write the contacts' normals and problem for accelerations where the ball is at ``p``."""
    for i in range(count):
        if c.kind[i] != FACE:
            arm = sub(p, plus(row(c.pivot, i), time, row(c.moving, i)))
            if c.kind[i] == EDGE:
                arm = plus(arm, -dot(arm, row(c.edge, i)), row(c.edge, i))
            put(c.normal, i, scaled(1.0 / norm(arm), arm))
        _bend(c, i, radius, v, w)


@kernel
def _bend(c: Contacts, i: int, radius: float, v: Vector, w: Vector) -> None:
    """Write what is asked of the accelerations at a contact.

    Around an edge or a corner the normal turns with the ball, by which it must accelerate inwards,
    and the slip changes as the spin is seen along another normal. Where nothing moves across,
    nothing bends; two contacts that stick then have a closed form.
    """
    put(c.surface, i, (0.0, 0.0, 0.0))
    c.bias[i] = 0.0
    if c.kind[i] != FACE:
        across = _across(c, i, sub(v, row(c.moving, i)))
        if norm(across) > STRAIGHT:
            put(c.surface, i, tangential(cross(w, across), row(c.normal, i)))
            c.bias[i] = -dot(across, across) / radius


@kernel
def _across(c: Contacts, i: int, a: Vector) -> Vector:
    """Return the part of a vector that leads round an edge or a corner."""
    a = tangential(a, row(c.normal, i))
    if c.kind[i] == EDGE:
        a = plus(a, -dot(a, row(c.edge, i)), row(c.edge, i))
    return a


@kernel
def _directions(c: Contacts, count: int, radius: float, v: Vector, w: Vector) -> None:
    """Write which contacts slip already, and in what direction."""
    for i in range(count):
        surface = row(c.surface, i)
        put(c.surface, i, row(c.moving, i))
        u = slip(c, i, radius, v, w)
        put(c.surface, i, surface)
        size = norm(u)
        c.slides[i] = size > STICK_M_S
        if c.slides[i]:
            put(c.direction, i, scaled(1.0 / size, u))


@kernel
def _hold_contacts(
    c: Contacts,
    count: int,
    radius: float,
    v: Vector,
    w: Vector,
    f: Vector,
    step: float,
    many: bool,
) -> tuple[int, Vector, Vector, int, bool]:
    """Return the kind of motion, both accelerations, how many contacts hold the ball, and success.

    Those that do are put first. Slips that have a direction may leave no forces that hold (P.
    Painlevé, 1895; with several contacts at any friction). Then an impulse acts without an impact:
    the velocities after ``step`` seconds are found instead, with what slips then (J. J. Moreau's
    time stepping), for which there always is an answer.
    """
    if count == 0:
        return _PARABOLA, f, (0.0, 0.0, 0.0), 0, True
    for i in range(count):
        _bend(c, i, radius, v, w)
    _directions(c, count, radius, v, w)
    if not many:
        a, alpha, solved = solve(c, count, radius, f, (0.0, 0.0, 0.0))
        if solved:
            holding = _pressing_first(c, count)
            motion = _motion_of(c, holding, radius, v, a, alpha)
            # What slips hardly at all turns its slip faster than steps of RK4 could follow.
            if not (motion == _CURVE and _slowing(c, holding, radius, v, w) < 0.25 * step):
                return motion, a, alpha, holding, True
    for i in range(count):
        put(c.surface, i, row(c.moving, i))
        c.bias[i] *= step
        c.slides[i] = False
    after_v, after_w, solved = solve(c, count, radius, plus(v, step, f), w)
    a, alpha = scaled(1.0 / step, sub(after_v, v)), scaled(1.0 / step, sub(after_w, w))
    return _STEP, a, alpha, _pressing_first(c, count), solved


@kernel
def _pressing_first(c: Contacts, count: int) -> int:
    """Put the contacts that press first; return how many there are."""
    i = 0
    while i < count:
        if c.push[i] <= 0.0:
            swap(c, i, count - 1)
            count -= 1
        else:
            i += 1
    return count


@kernel
def _slowing(c: Contacts, count: int, radius: float, v: Vector, w: Vector) -> float:
    """Return the time in which friction alone would end the first slip, or ``inf``."""
    time = math.inf
    for i in range(count):
        if c.slides[i] and c.friction[i] * c.push[i] > 0.0:
            surface = row(c.surface, i)
            put(c.surface, i, row(c.moving, i))
            size = norm(slip(c, i, radius, v, w))
            put(c.surface, i, surface)
            time = min(time, size / (3.5 * c.friction[i] * c.push[i]))
    return time


@kernel
def _motion_of(c: Contacts, count: int, radius: float, v: Vector, a: Vector, alpha: Vector) -> int:
    """Return the kind of motion under the contacts that hold the ball; write how slips begin."""
    motion = _PARABOLA
    for i in range(count):
        if c.kind[i] != FACE:
            across = _across(c, i, sub(v, row(c.moving, i)))
            if norm(across) > STRAIGHT or norm(_across(c, i, a)) > STRAIGHT:
                motion = _CURVE
        if c.slides[i]:
            n = row(c.normal, i)
            change = plus(tangential(a, n), radius, cross(n, alpha))
            aside = cross(row(c.direction, i), change)
            if norm(aside) > TURNING and motion == _PARABOLA:
                motion = _SKID if count == 1 and c.kind[i] == FACE else _CURVE
        elif c.status[i] == SLIPS:
            # It begins to slip, against the friction that no longer holds it.
            size = norm(row(c.drag, i))
            if size > 0.0:
                put(c.direction, i, scaled(-1.0 / size, row(c.drag, i)))
    return motion


@kernel
def _slips_end(
    c: Contacts, count: int, radius: float, v: Vector, w: Vector, a: Vector, alpha: Vector
) -> float:
    """Return when the first of the straight slips ends, or ``inf``."""
    end = math.inf
    for i in range(count):
        if not c.slides[i]:
            continue
        n, d = row(c.normal, i), row(c.direction, i)
        put(c.surface, i, row(c.moving, i))
        speed = dot(d, slip(c, i, radius, v, w))
        change = dot(d, plus(tangential(a, n), radius, cross(n, alpha)))
        if change < 0.0:
            end = min(end, speed / -change)
    return end


@kernel
def _end_slip(c: Contacts, count: int, radius: float, v: Vector, w: Vector) -> Vector:
    """Return the angular velocity of a ball that rolls, if its only contact's slip has ended."""
    if count != 1 or not c.slides[0]:
        return w
    n, moving = row(c.normal, 0), row(c.moving, 0)
    put(c.surface, 0, moving)
    if norm(slip(c, 0, radius, v, w)) > 1e3 * STICK_M_S:
        return w
    rolling = scaled(1.0 / radius, cross(n, sub(v, moving)))
    return plus(rolling, dot(w, n), n)


# 5 Motions ----------------------------------------------------------------------------------------


@kernel
def _skid_setting(
    c: Contacts, radius: float, v: Vector, w: Vector, f: Vector
) -> tuple[Vector, Vector, float, float, float, float, float]:
    """Return the unit vectors along and across the push, slip, push, cosine, sine, and k."""
    n = row(c.normal, 0)
    put(c.surface, 0, row(c.moving, 0))
    u, g = slip(c, 0, radius, v, w), tangential(f, n)
    speed, push = norm(u), norm(g)
    along = scaled(1.0 / push, g)
    across = cross(n, along)
    x, y = dot(u, along), dot(u, across)
    size = math.hypot(x, y)
    k = 3.5 * c.friction[0] * -dot(f, n)
    return along, across, speed, push, x / size, y / size, k


@kernel
def _skid_end(c: Contacts, radius: float, v: Vector, w: Vector, f: Vector) -> float:
    _, _, speed, push, cosine, _, k = _skid_setting(c, radius, v, w, f)
    return stop_time(speed, push, cosine, k)


@kernel
def _skid(
    c: Contacts, radius: float, p: Vector, v: Vector, w: Vector, f: Vector, time: float
) -> tuple[Vector, Vector, Vector]:
    """Return the state after ``time`` of a skid over a plane that turns: see `sliding`."""
    n, moving = row(c.normal, 0), row(c.moving, 0)
    along, across, speed, push, cosine, sine, k = _skid_setting(c, radius, v, w, f)
    x, y, way_x, way_y = slide(speed, push, cosine, sine, k, time)
    before = slip(c, 0, radius, v, w)
    after = plus(scaled(x, along), y, across)
    way = plus(scaled(way_x, along), way_y, across)
    rolling = scaled((1.0 - SLIP_SHARE) * push, along)
    change = scaled(SLIP_SHARE, sub(after, before))
    p = position_at(p, plus(v, -SLIP_SHARE, before), rolling, time)
    p = plus(p, SLIP_SHARE, way)
    v = add(plus(v, time, rolling), change)
    lowest = scaled(1.0 / radius, sub(after, tangential(sub(v, moving), n)))
    # lowest = n x w
    return p, v, plus(cross(lowest, n), dot(w, n), n)


@kernel
def _rates(
    c: Contacts, count: int, radius: float, p: Vector, v: Vector, w: Vector, f: Vector, time: float
) -> tuple[Vector, Vector]:
    """Return both accelerations under contacts that keep their modes."""
    _lay_out(c, count, radius, p, v, w, time)
    for i in range(count):
        if c.status[i] == SLIPS:
            surface = row(c.surface, i)
            put(c.surface, i, row(c.moving, i))
            u = slip(c, i, radius, v, w)
            put(c.surface, i, surface)
            size = norm(u)
            if size > STICK_M_S:
                put(c.direction, i, scaled(1.0 / size, u))
    return hold(c, count, radius, f, (0.0, 0.0, 0.0))


@kernel
def _runge_kutta(
    c: Contacts, count: int, radius: float, p: Vector, v: Vector, w: Vector, f: Vector, h: float
) -> tuple[Vector, Vector, Vector]:
    """Return the state after one step of the classical method of fourth order."""
    a1, b1 = _rates(c, count, radius, p, v, w, f, 0.0)
    v2, w2 = plus(v, 0.5 * h, a1), plus(w, 0.5 * h, b1)
    a2, b2 = _rates(c, count, radius, plus(p, 0.5 * h, v), v2, w2, f, 0.5 * h)
    v3, w3 = plus(v, 0.5 * h, a2), plus(w, 0.5 * h, b2)
    a3, b3 = _rates(c, count, radius, plus(p, 0.5 * h, v2), v3, w3, f, 0.5 * h)
    v4, w4 = plus(v, h, a3), plus(w, h, b3)
    a4, b4 = _rates(c, count, radius, plus(p, h, v3), v4, w4, f, h)
    sixth = h / 6.0
    p = plus(p, sixth, add(add(v, v4), scaled(2.0, add(v2, v3))))
    v = plus(v, sixth, add(add(a1, a4), scaled(2.0, add(a2, a3))))
    w = plus(w, sixth, add(add(b1, b4), scaled(2.0, add(b2, b3))))
    return p, v, w


@kernel
def _room(
    scene: Scene,
    c: Contacts,
    count: int,
    radius: float,
    start: Any,
    p: Vector,
    v: Vector,
    w: Vector,
    f: Vector,
    offset: Any,
    time: float,
) -> float:
    """Return how far a state is from the first change of a contact's mode; negative beyond it.

    A contact presses; sticks within its cone; slips in about the direction it slipped in at the
    start; and stays on its feature. In the units of each.
    """
    _rates(c, count, radius, p, v, w, f, time)
    room = math.inf
    for i in range(count):
        room = min(room, c.push[i])
        if c.status[i] == STICKS:
            room = min(room, c.friction[i] * c.push[i] - norm(row(c.drag, i)) + 1e-9)
        else:
            put(c.surface, i, row(c.moving, i))
            room = min(room, dot(row(start, i), slip(c, i, radius, v, w)) + 0.5 * STICK_M_S)
        box = c.box[i]
        relative = plus(_from_box(scene, box, p, offset), -time, row(c.moving, i))
        room = min(room, feature_margin(scene, box, c.kind[i], c.axis[i], relative))
    return room


@kernel
def _curve_until(
    scene: Scene,
    c: Contacts,
    count: int,
    radius: float,
    p: Vector,
    v: Vector,
    w: Vector,
    f: Vector,
    offset: Any,
    limit: float,
) -> float:
    """Return for how long, at most ``limit``, no contact changes its mode."""
    start = c.direction[:count].copy()
    q, x, y = _runge_kutta(c, count, radius, p, v, w, f, limit)
    beyond = _room(scene, c, count, radius, start, q, x, y, f, offset, limit)
    if beyond < 0.0:
        low, high = 0.0, limit
        for _ in range(60):
            middle = 0.5 * (low + high)
            c.direction[:count] = start
            q, x, y = _runge_kutta(c, count, radius, p, v, w, f, middle)
            if _room(scene, c, count, radius, start, q, x, y, f, offset, middle) < 0.0:
                high = middle
            else:
                low = middle
            if high - low <= 1e-15 + 1e-13 * high:
                break
        limit = high
    c.direction[:count] = start
    return limit


@kernel
def _back_to_surface(
    scene: Scene, c: Contacts, count: int, p: Vector, offset: Any, speed: Any, time: float
) -> Vector:
    """Return the centre at the contacts' distance again, of which steps keep only most."""
    for _ in range(1 if count == 1 else 4):
        for i in range(count):
            box = c.box[i]
            relative = plus(
                _from_box(scene, box, p, offset), -time, _box_velocity(scene, box, speed)
            )
            distance, n, _, _ = closest(scene, box, relative)
            error = distance - scene.radius - 0.5 * CONTACT_GAP_M
            if abs(error) < 1e-3:
                p = plus(p, -error, n)
    return p


# 6 Until ------------------------------------------------------------------------------------------


@kernel
def _features_end(
    scene: Scene, c: Contacts, count: int, p: Vector, v: Vector, a: Vector, offset: Any
) -> float:
    """Return when the ball first leaves a feature that holds it."""
    end = math.inf
    for i in range(count):
        box = c.box[i]
        relative = _from_box(scene, box, p, offset)
        velocity = sub(v, row(c.moving, i))
        end = min(end, time_on_feature(scene, box, c.kind[i], c.axis[i], relative, velocity, a))
    return end


@kernel
def _next_impact(
    scene: Scene,
    c: Contacts,
    count: int,
    near: _Near,
    found: int,
    p: Vector,
    v: Vector,
    a: Vector,
    offset: Any,
    speed: Any,
    until: float,
) -> float:
    """Return the time of the first impact before ``until``, or ``until``."""
    for i in range(found):
        box = near.box[i]
        moving = _box_velocity(scene, box, speed)
        if _cannot_meet(scene, c, count, box, p, offset, moving):
            continue
        relative, velocity = _from_box(scene, box, p, offset), sub(v, moving)
        n = row(near.normal, i)
        gap = max(near.gap[i], 0.5 * CONTACT_GAP_M)
        touches = near.gap[i] <= CONTACT_GAP_M
        if not (touches and near.kind[i] != FACE):
            # The supporting plane at the start rules most of them out.
            soonest = first_root(gap - 0.25 * CONTACT_GAP_M, dot(n, velocity), 0.5 * dot(n, a))
            if soonest >= until:
                continue
        time = impact_time(scene, box, relative, velocity, a, gap, n, near.kind[i], until)
        until = min(until, time)
    return until


@kernel
def _cannot_meet(
    scene: Scene, c: Contacts, count: int, box: int, p: Vector, offset: Any, moving: Vector
) -> bool:
    """Say whether a box holds the ball, or lies wholly behind a face that does."""
    for i in range(count):
        if c.box[i] == box:
            return True
    for i in range(count):
        if c.kind[i] == FACE and c.moving[i, 2] == moving[2]:
            n = row(c.normal, i)
            relative = _from_box(scene, box, p, offset)
            if extent(scene, box, n) - dot(n, relative) + scene.radius <= 100.0 * CONTACT_GAP_M:
                return True
    return False
