"""Held contacts: which press, stick and slip, and the accelerations that follow."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from roller_env.physics.rigid.closest import EDGE, FACE
from roller_env.physics.rigid.coulomb import EXACT, SLIP_PER_IMPULSE, SLIPS, slip, solve
from roller_env.physics.rigid.impact import (
    CHATTER_M_S,
    LIFTED_M_S,
    STICK_M_S,
    solve_jam,
    true_slip,
    velocity_over,
)
from roller_env.physics.rigid.kernels import (
    Ball,
    Record,
    Twist,
    Vector,
    cross,
    dot,
    inlined,
    kernel,
    none_of,
    norm,
    plus,
    scaled,
    store,
    sub,
    tangential,
    vector,
)
from roller_env.physics.rigid.scene import Solids
from roller_env.physics.rigid.workspace import swap

STRAIGHT: Final = 1e-6
"""Velocity (m/s) and acceleration (m/s^2) across an edge below which its normal stands still."""

TURNING: Final = 1e-9
"""Acceleration (m/s^2) of a slip across its direction below which it goes straight on."""

_ALIKE_IN_STEP: Final = 0.1
"""As `solve` has it: how edges turn in a step says how their points move only to first order."""

_SHORTEST_STEP_S: Final = 1e-9

# Kinds of motion.
PARABOLA: Final = 0
SKID: Final = 1
CURVE: Final = 2
STEP: Final = 3


class Motion(NamedTuple):
    """How the ball goes on until the next event."""

    kind: int
    rates: Twist  # accelerations, now
    holding: int  # contacts that hold the ball; they are the first
    solved: bool
    step: float  # seconds for which a `STEP` is meant


@kernel
def across(contact: Record, a: Vector) -> Vector:
    """Return the part of a vector that leads round an edge or a corner."""
    a = tangential(a, vector(contact.normal))
    if contact.kind == EDGE:
        edge = vector(contact.edge)
        a = plus(a, -dot(a, edge), edge)
    return a


@kernel
def bend(contact: Record, radius: float, twist: Twist) -> None:
    """Write what is asked of the accelerations at a contact.

    Around an edge or a corner the normal turns with the ball, by which it must accelerate inwards,
    and the slip changes as the spin is seen along another normal. Where nothing moves across,
    nothing bends; two contacts that stick then have a closed form.
    """
    store(contact.surface, (0.0, 0.0, 0.0))
    contact.bias = 0.0
    if contact.kind != FACE:
        round_it = across(contact, velocity_over(contact, twist.linear))
        if dot(round_it, round_it) > STRAIGHT * STRAIGHT:
            turning = cross(twist.angular, round_it)
            store(contact.surface, tangential(turning, vector(contact.normal)))
            contact.bias = -dot(round_it, round_it) / radius


@kernel
def lay_out(work: Record, count: int, radius: float, ball: Ball, time: float) -> None:
    """Write the contacts' normals and problem for accelerations, ``time`` after they were found."""
    for i in range(count):
        contact = work.contact[i]
        if contact.kind != FACE:
            pivot = vector(contact.pivot)
            arm = sub(ball.position, plus(pivot, time, vector(contact.carried)))
            if contact.kind == EDGE:
                edge = vector(contact.edge)
                arm = plus(arm, -dot(arm, edge), edge)
            store(contact.normal, scaled(1.0 / norm(arm), arm))
        bend(contact, radius, Twist(ball.velocity, ball.spin))


@inlined
def choose_motion(
    work: Record,
    count: int,
    radius: float,
    twist: Twist,
    pull: Vector,
    step: float,
    many: bool,
) -> Motion:
    """Return how the ball goes on with the contacts that touch it.

    Slips that have a direction may leave no forces that hold (P. Painlevé, 1895; with several
    contacts at any friction). Then an impulse acts without an impact: the velocities after ``step``
    seconds are found instead, with what slips then (J. J. Moreau's time stepping), for which there
    always is an answer. So are those at the end of a slip that turns, in a step just long enough.

    Args:
        work: the contacts.
        count: how many.
        radius: of the ball, metres.
        twist: its velocities.
        pull: acceleration without contacts, m/s^2.
        step: seconds.
        many: step over what happens at once.
    """
    still = (0.0, 0.0, 0.0)
    if count == 0:
        return Motion(PARABOLA, Twist(pull, still), 0, True, step)
    for i in range(count):
        contact = work.contact[i]
        bend(contact, radius, twist)
        u = true_slip(contact, radius, twist)
        size = norm(u)
        contact.slides = 0
        # A slip that is to lift the ball off has done so: what is held is slower (`lift_off_time`).
        contact.dilatancy = 0.0
        if size > STICK_M_S:
            contact.slides = 1
            store(contact.direction, scaled(1.0 / size, u))
    if not many:
        rates, solved = solve(work, count, radius, Twist(pull, still), EXACT)
        if solved:
            holding = _pressing_first(work, count)
            kind = _kind_of_motion(work, holding, radius, twist, rates)
            ends = slip_time(work, holding, radius, twist, rates) if kind == CURVE else math.inf
            if ends >= 0.25 * step:
                return Motion(kind, rates, holding, True, step)
            # What slips hardly at all turns its slip faster than steps of RK4 could follow.
            step = max(2.0 * ends, _SHORTEST_STEP_S)
    for i in range(count):
        contact = work.contact[i]
        turning = vector(contact.surface)
        store(contact.surface, plus(vector(contact.carried), step, turning))
        contact.bias *= step
        contact.slides = 0
    free = Twist(plus(twist.linear, step, pull), twist.angular)
    after, solved = solve(work, count, radius, free, _ALIKE_IN_STEP)
    if not solved:
        after, solved = solve_jam(work, count, radius, free, _ALIKE_IN_STEP)
    rates = Twist(
        scaled(1.0 / step, sub(after.linear, twist.linear)),
        scaled(1.0 / step, sub(after.angular, twist.angular)),
    )
    return Motion(STEP, rates, _pressing_first(work, count), solved, step)


@kernel
def _pressing_first(work: Record, count: int) -> int:
    """Put the contacts that press first; return how many there are."""
    i = none_of(count)
    while i < count:
        if work.contact[i].push <= 0.0:
            count -= 1
            swap(work, i, count)
        else:
            i += 1
    return count


@kernel
def slip_time(work: Record, count: int, radius: float, twist: Twist, rates: Twist) -> float:
    """Return in what time the first slip would end or turn round as it changes now, or ``inf``."""
    time = math.inf
    for i in range(count):
        contact = work.contact[i]
        if contact.slides:
            d, change = vector(contact.direction), slip(contact, radius, rates)
            along = dot(d, change)
            fastest = max(-along, norm(plus(change, -along, d)))
            if fastest > 0.0:
                time = min(time, norm(true_slip(contact, radius, twist)) / fastest)
    return time


@kernel
def lift_off_time(work: Record, solids: Solids, count: int, radius: float, rates: Twist) -> float:
    """Return in what time a slip grows to one that lifts the ball off, or ``inf``."""
    time = math.inf
    for i in range(count):
        contact = work.contact[i]
        dilatancy = solids.one[contact.solid].dilatancy
        if contact.status == SLIPS and dilatancy > 0.0:
            most = CHATTER_M_S if count > 1 else LIFTED_M_S
            most *= 1.0 + SLIP_PER_IMPULSE * contact.friction * dilatancy
            change = dilatancy * norm(slip_change(contact, radius, rates))
            if change > 0.0:
                time = min(time, 2.0 * most / change)
    return time


@kernel
def slip_change(contact: Record, radius: float, rates: Twist) -> Vector:
    """Return how a slip changes, m/s^2, where the normal stands still."""
    n = vector(contact.normal)
    return plus(tangential(rates.linear, n), radius, cross(n, rates.angular))


@kernel
def _kind_of_motion(work: Record, count: int, radius: float, twist: Twist, rates: Twist) -> int:
    """Return the kind of motion under the contacts that hold the ball; write how slips begin."""
    kind = PARABOLA
    for i in range(count):
        contact = work.contact[i]
        if contact.kind != FACE:
            going = across(contact, velocity_over(contact, twist.linear))
            if norm(going) > STRAIGHT or norm(across(contact, rates.linear)) > STRAIGHT:
                kind = CURVE
        if contact.slides and contact.friction > 0.0:
            aside = cross(vector(contact.direction), slip_change(contact, radius, rates))
            if norm(aside) > TURNING and kind == PARABOLA:
                kind = SKID if count == 1 and contact.kind == FACE else CURVE
        elif contact.status == SLIPS and not contact.slides:
            # It begins to slip, against the friction that no longer holds it.
            drag = vector(contact.drag)
            size = norm(drag)
            if size > 0.0:
                store(contact.direction, scaled(-1.0 / size, drag))
    return kind


@kernel
def slips_end(work: Record, count: int, radius: float, twist: Twist, rates: Twist) -> float:
    """Return when the first of the straight slips ends, or ``inf``."""
    end = math.inf
    for i in range(count):
        contact = work.contact[i]
        if contact.slides:
            d = vector(contact.direction)
            change = dot(d, slip_change(contact, radius, rates))
            if change < 0.0:
                end = min(end, dot(d, true_slip(contact, radius, twist)) / -change)
    return end


@kernel
def end_slip(work: Record, count: int, radius: float, twist: Twist) -> Twist:
    """Return the velocities of a ball that rolls, if its only contact's slip has ended."""
    if count != 1 or not work.contact[0].slides:
        return twist
    contact = work.contact[0]
    if norm(true_slip(contact, radius, twist)) > 1e3 * STICK_M_S:
        return twist
    n = vector(contact.normal)
    rolling = scaled(1.0 / radius, cross(n, velocity_over(contact, twist.linear)))
    return Twist(twist.linear, plus(rolling, dot(twist.angular, n), n))
