"""The motion of balls among solids, from event to event.

A segment is the motion between two events under one set of held contacts. In order:

1. **near**: the solids that the ball can reach, and those it touches;
2. **weld**: what touches twice counts once, inner edges do not count at all;
3. **impact**: whatever approaches is stopped or thrown back, all contacts at once;
4. **holding**: which contacts press, stick and slip, and the accelerations that follow;
5. **motion**: a parabola, a skid that turns (both exact), or a step of RK4 around edges and corners
   and for slips that turn at several contacts, no longer than the cap;
6. **events**: the first of the end of the step, the end of a slip, a contact that lets go, a
   feature that ends, and the next impact.

A ball needs nothing of the others, so any split of the rows over threads gives the same bits.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from roller_env.arrays import Float64, Int64
from roller_env.physics.rigid.attitude import turn, turned, turned_back
from roller_env.physics.rigid.events import features_end, goes_alone, next_impact
from roller_env.physics.rigid.holding import (
    CURVE,
    PARABOLA,
    SKID,
    STEP,
    Motion,
    choose_motion,
    end_slip,
    lift_off_time,
    slip_time,
    slips_end,
)
from roller_env.physics.rigid.impact import collide, keep_closed, settle
from roller_env.physics.rigid.impact_time import CONTACT_GAP_M
from roller_env.physics.rigid.kernels import (
    Ball,
    Record,
    Records,
    Twist,
    Vector,
    entry,
    inlined,
    kernel,
    norm,
    plus,
    position_at,
    scaled,
    store,
    sub,
    vector,
)
from roller_env.physics.rigid.motion import (
    arc_end,
    back_to_surface,
    curve_until,
    hermite,
    runge_kutta,
    skid,
    skid_end,
    without_gain,
)
from roller_env.physics.rigid.near import gather, look_ahead, time_within, touch, weld
from roller_env.physics.rigid.path import begin, bend_through, follow
from roller_env.physics.rigid.scene import MARGIN_M, Scenes, Solids
from roller_env.physics.rigid.slabs import move_slabs, set_going, time_to_stop
from roller_env.physics.rigid.states import (
    DELAY,
    FORCE,
    ORIENTATION,
    POSITION,
    SLAB,
    SPIN,
    VELOCITY,
    Counts,
)
from roller_env.physics.rigid.workspace import Workspace

MOST_SEGMENTS: Final = 200
"""In one control step, besides 8 for each time of the cap; beyond it the ball is moved on by force,
and that is counted."""

FORCED_STEP_S: Final = 1e-3

MANY_SEGMENTS: Final = 32
"""In one control step, besides 4 for each time of the cap; beyond it contacts change faster than is
worth following (a ball that spins in a corner chatters against its walls), and several at once are
stepped over. Beyond twice as many a slip lifts nothing off any more in this step."""

SHORTEST_S: Final = 1e-13

_MOST_REFINEMENTS: Final = 4


class Course(NamedTuple):
    """The way of a ball until the next event, as a parabola from where it is."""

    until: float  # duration, seconds
    limit: float  # the same, if it meets nothing
    acceleration: Vector  # of the parabola
    there: Ball  # the ball at the limit, of motions that are no parabolas
    alone: int  # 1 if the ball is known to meet nothing, and to leave nothing


@entry
def advance(
    scenes: Scenes,
    level_of_row: Int64,
    states: Float64,
    counts: Counts,
    workspace: Workspace,
    duration: float,
    cap: float,
    rows: Int64,
    path: Float64,
    knots: Int64,
    thread: int,
) -> None:
    """Move the balls of some rows by a control step.

    Args:
        scenes: what they meet.
        level_of_row: (N,) which level each ball is in.
        states: (N, width) where they are, and what is done to them, as `States.packed`; changed in
            place.
        counts: counted up.
        workspace: made for the scenes.
        duration: of the control step, seconds.
        cap: longest step of RK4, seconds.
        rows: (n,) which of them to move.
        path: (n, K, 6) receives the ways of the centres: see `roller_env.physics.rigid.path`.
        knots: (n,) receives how many knots each has.
        thread: which of its memories to use; no other thread may use it meanwhile.
    """
    work = workspace.work[thread]
    for place in range(len(rows)):
        number = rows[place]
        level_number = level_of_row[number]
        level = scenes.level[level_number]
        slabs = workspace.slab[thread, : level.slabs]
        body = states[number]
        set_going(scenes, level_number, body, slabs)
        force = vector(body[FORCE:])
        pull = (
            force[0] / level.mass,
            force[1] / level.mass,
            force[2] / level.mass - level.gravity,
        )
        orientation = body[ORIENTATION:]
        spin = turned(orientation, vector(body[SPIN:]))
        ball = Ball(vector(body[POSITION:]), vector(body[VELOCITY:]), spin)
        work.segments = work.forced = work.unsolved = work.blocked = 0
        delay = min(body[DELAY], duration)
        ball, knots[place] = _advance_ball(
            scenes, level, slabs, work, ball, orientation, pull, delay, duration, cap, path[place]
        )
        store(body[POSITION:], ball.position)
        store(body[VELOCITY:], ball.velocity)
        store(body[SPIN:], turned_back(orientation, ball.spin))
        body[DELAY] = 0.0
        for k in range(len(slabs)):
            body[SLAB + k] = slabs[k].shift
        counts.segments[number] += work.segments
        counts.forced[number] += work.forced
        counts.unsolved[number] += work.unsolved
        counts.blocked[number] += work.blocked


@inlined
def _advance_ball(
    scenes: Scenes,
    level: Record,
    slabs: Records,
    work: Record,
    ball: Ball,
    orientation: Any,
    pull: Vector,
    delay: float,
    duration: float,
    cap: float,
    path: Any,
) -> tuple[Ball, int]:
    """Return a ball after a control step, and how many knots its path has.

    Its orientation is turned in place.
    """
    radius, solids = level.radius, scenes.solids
    knots = begin(path, ball.position)
    time = delay
    centre, listed = ball.position, -1.0  # what is listed as near is so around this place
    force = norm(pull)
    while time < duration:
        work.segments += 1
        speed, rest = norm(ball.velocity), duration - time
        left = min(look_ahead(speed, force, rest), time_to_stop(slabs))
        way = speed * left + force * left * left
        if norm(sub(ball.position, centre)) + way > listed:
            centre = ball.position
            listed = min(speed * rest + force * rest * rest, MARGIN_M) + CONTACT_GAP_M
            gather(scenes, level, slabs, work, centre, listed, rest)
        count = touch(solids, slabs, work, radius, ball.position)
        many = work.segments > MANY_SEGMENTS + 4.0 * duration / cap
        hops = work.segments < 2.0 * (MANY_SEGMENTS + 4.0 * duration / cap)
        if count > 0:
            count, ball = _meet(work, slabs, solids, count, radius, ball, hops)
        twist = Twist(ball.velocity, ball.spin)
        motion = choose_motion(work, count, radius, twist, pull, 0.25 * cap, many)
        if not motion.solved:
            work.unsolved += 1
        if hops:
            left = min(left, lift_off_time(work, solids, motion.holding, radius, motion.rates))
        course = _plan(work, solids, motion, radius, ball, pull, way, left, cap)
        course = _until(work, solids, motion, radius, ball, pull, way, course)
        if work.segments > MOST_SEGMENTS + 8.0 * duration / cap:
            course = _at(course, max(course.until, min(rest, FORCED_STEP_S)))
            work.forced += 1
        after = _move(work, solids, motion, radius, ball, pull, course)
        knots = _leave(work, motion.kind, radius, ball, after, pull, course, cap, path, knots)
        turn(orientation, ball.spin, after.spin, course.until)
        ball = after
        move_slabs(slabs, course.until)
        time += course.until
        if duration - time < SHORTEST_S:
            time = duration
    return ball, knots


@inlined
def _leave(
    work: Record,
    kind: int,
    radius: float,
    ball: Ball,
    after: Ball,
    pull: Vector,
    course: Course,
    cap: float,
    path: Any,
    knots: int,
) -> int:
    """Add a course that ends at ``after`` to the ball's path; return how many knots that has.

    What is no parabola is left as parabolas through their ends and middles, two for each time of
    the cap.
    """
    time = course.until
    if kind in (PARABOLA, STEP):
        bend = scaled(0.5 * time * time, course.acceleration)
        return follow(path, knots, after.position, bend)
    pieces = 1 + int(2.0 * time / cap)
    for piece in range(pieces):
        to = after.position
        if piece < pieces - 1:
            at = (piece + 1) * time / pieces
            to = _between(work, kind, radius, ball, after, pull, course, at)
        at = (piece + 0.5) * time / pieces
        middle = _between(work, kind, radius, ball, after, pull, course, at)
        knots = follow(path, knots, to, bend_through(path, knots, middle, to))
    return knots


@inlined
def _between(
    work: Record,
    kind: int,
    radius: float,
    ball: Ball,
    after: Ball,
    pull: Vector,
    course: Course,
    time: float,
) -> Vector:
    """Return where a ball is on a curve or skid, ``time`` after it set out towards ``after``."""
    if kind == SKID:
        return skid(work.contact[0], radius, ball, pull, time).position
    return hermite(ball, after, course.until, time)


@inlined
def _meet(
    work: Record,
    slabs: Records,
    solids: Solids,
    count: int,
    radius: float,
    ball: Ball,
    hops: bool,
) -> tuple[int, Ball]:
    """Return how many contacts stay closed, and the ball after their impacts.

    It is moved by less than a contact's gap, to half of that away from each contact. Without
    ``hops`` what slips stays on the ground by any law.
    """
    count = weld(work, count, radius)
    p = ball.position
    for i in range(count):
        contact = work.contact[i]
        p = plus(p, 0.5 * CONTACT_GAP_M - contact.gap, vector(contact.normal))
        if not hops:
            contact.dilatancy = 0.0
    twist = Twist(ball.velocity, ball.spin)
    twist, solved, blocked = collide(work, slabs, solids, count, radius, twist)
    if not solved:
        work.unsolved += 1
    if blocked > 0:
        work.blocked += blocked
        for place in range(work.found):
            slab = solids.one[work.near[place].solid].slab
            if slab >= 0:
                work.near[place].speed = slabs[slab].speed
                moves = scaled(slabs[slab].speed, vector(solids.one[work.near[place].solid].along))
                store(work.near[place].carried, moves)
    count = keep_closed(work, count, twist.linear)
    twist = settle(work, count, radius, twist)
    return count, Ball(p, twist.linear, twist.angular)


@inlined
def _plan(
    work: Record,
    solids: Solids,
    motion: Motion,
    radius: float,
    ball: Ball,
    pull: Vector,
    way: float,
    left: float,
    cap: float,
) -> Course:
    """Return the course of a ball that meets nothing, no further than ``way``."""
    holding, twist = motion.holding, Twist(ball.velocity, ball.spin)
    # Spin and wedges can drive a ball faster than forces alone.
    changes = 1.0 if motion.kind == PARABOLA or motion.kind == STEP else 2.0
    left = time_within(way, norm(ball.velocity), changes * norm(motion.rates.linear), left)
    if motion.kind == PARABOLA:
        limit = left
        if holding > 0:
            limit = min(left, slips_end(work, holding, radius, twist, motion.rates))
        return Course(limit, limit, motion.rates.linear, ball, 0)
    if motion.kind == STEP:
        limit = min(left, motion.step)
        return Course(limit, limit, motion.rates.linear, ball, 0)
    if motion.kind == SKID:
        contact = work.contact[0]
        limit = min(left, skid_end(contact, radius, ball, pull))
        if goes_alone(work, solids, ball.position, way, limit):
            return Course(limit, limit, pull, skid(contact, radius, ball, pull, limit), 1)
        limit = min(limit, cap)
        there = skid(contact, radius, ball, pull, limit)
    else:
        limit = min(left, cap, arc_end(work, holding, radius, ball.velocity))
        limit = min(
            limit, max(0.5 * slip_time(work, holding, radius, twist, motion.rates), cap / 64.0)
        )
        limit, there = curve_until(work, solids, holding, radius, ball, pull, limit)
    return Course(limit, limit, _through(ball, there.position, limit), there, 0)


@kernel
def _at(course: Course, until: float) -> Course:
    """Return a course that ends at another time."""
    return Course(until, course.limit, course.acceleration, course.there, course.alone)


@kernel
def _through(ball: Ball, there: Vector, time: float) -> Vector:
    """Return the acceleration of the parabola that leads a ball to a place in ``time``."""
    missed = sub(there, plus(ball.position, time, ball.velocity))
    return scaled(2.0 / (time * time), missed)


@inlined
def _until(
    work: Record,
    solids: Solids,
    motion: Motion,
    radius: float,
    ball: Ball,
    pull: Vector,
    way: float,
    course: Course,
) -> Course:
    """Return a course that ends where the ball leaves a feature or meets a solid."""
    if course.alone:
        return course
    p, v, holding = ball.position, ball.velocity, motion.holding
    for _ in range(_MOST_REFINEMENTS):
        a, until = course.acceleration, course.until
        if motion.kind != CURVE:
            until = features_end(work, solids, holding, p, v, a, way, until)
        until = next_impact(work, solids, holding, radius, p, v, a, way, until)
        exact = motion.kind == PARABOLA or motion.kind == STEP
        if exact or until >= course.until or until <= 0.0:
            break
        # A parabola through both ends of a curve is off between them: end it here, and look again.
        if motion.kind == CURVE:
            there = runge_kutta(work, holding, radius, ball, pull, until)
        else:
            there = skid(work.contact[0], radius, ball, pull, until)
        course = Course(until, until, _through(ball, there.position, until), there, 0)
    return _at(course, until)


@inlined
def _move(
    work: Record,
    solids: Solids,
    motion: Motion,
    radius: float,
    ball: Ball,
    pull: Vector,
    course: Course,
) -> Ball:
    """Return the ball at the end of its course."""
    time, holding = course.until, motion.holding
    after = course.there
    if motion.kind == PARABOLA or motion.kind == STEP:
        after = Ball(
            position_at(ball.position, ball.velocity, motion.rates.linear, time),
            plus(ball.velocity, time, motion.rates.linear),
            plus(ball.spin, time, motion.rates.angular),
        )
    elif time != course.limit:
        if motion.kind == CURVE:
            after = runge_kutta(work, holding, radius, ball, pull, time)
        else:
            after = skid(work.contact[0], radius, ball, pull, time)
    p, twist = after.position, Twist(after.velocity, after.spin)
    if motion.kind == CURVE or motion.kind == STEP:
        p = back_to_surface(work, solids, holding, radius, p, time)
        twist = without_gain(work, holding, radius, ball, pull, p, twist)
    if time == course.limit:
        twist = end_slip(work, holding, radius, twist)
    return Ball(p, twist.linear, twist.angular)
