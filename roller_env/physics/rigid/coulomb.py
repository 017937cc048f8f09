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
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from roller_env.physics.rigid.kernels import (
    Vector,
    add,
    cross,
    dot,
    kernel,
    norm,
    plus,
    put,
    row,
    scaled,
    sub,
    tangential,
)

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]

MOST_CONTACTS: Final = 8

OPEN: Final = 0
STICKS: Final = 1
SLIPS: Final = 2

_SLIP_PER_IMPULSE: Final = 3.5
_SPIN_PER_IMPULSE: Final = 2.5
_FIRST_SWEEPS: Final = 8
_MOST_ATTEMPTS: Final = 8
_MOST_NEWTON_STEPS: Final = 12
_SINGULAR: Final = 1e-11
_ROUNDING: Final = 1e-14
_ABSURD: Final = 1e6
"""Impulses that grow beyond this, over the speeds there are, have no end: nothing rigid gives."""


class Contacts(NamedTuple):
    """Working memory for up to `MOST_CONTACTS` contacts of one ball, one a row."""

    box: Int64
    kind: Int64  # of the feature that is touched
    axis: Int64
    gap: Float64
    normal: Float64  # (K, 3) from the solid to the ball
    pivot: Float64  # (K, 3) a point of the edge, or the corner, that is touched
    edge: Float64  # (K, 3) direction of the edge that is touched
    friction: Float64
    elasticity: Float64
    moving: Float64  # (K, 3) velocity of the solid
    surface: Float64  # (K, 3) what the slip is measured against: s
    bias: Float64  # b
    slides: npt.NDArray[np.bool_]  # the slip has a direction already
    direction: Float64  # (K, 3) that direction
    status: Int64  # the answer: `OPEN`, `STICKS` or `SLIPS`
    push: Float64  # the answer: N
    drag: Float64  # (K, 3) the answer: T
    response: Float64  # (3 K, 3 K) rates of change by unit impulses
    system: Float64  # (3 K, 3 K + 1)
    columns: Int64  # (3 K,)
    frame: Float64  # (3 K, 3) normal and two tangents of every contact
    active: Int64


@kernel
def make_contacts() -> Contacts:
    """Return working memory; compiled code makes it once for many balls."""
    k = MOST_CONTACTS
    return Contacts(
        np.zeros(k, np.int64),
        np.zeros(k, np.int64),
        np.zeros(k, np.int64),
        np.zeros(k),
        np.zeros((k, 3)),
        np.zeros((k, 3)),
        np.zeros((k, 3)),
        np.zeros(k),
        np.zeros(k),
        np.zeros((k, 3)),
        np.zeros((k, 3)),
        np.zeros(k),
        np.zeros(k, np.bool_),
        np.zeros((k, 3)),
        np.zeros(k, np.int64),
        np.zeros(k),
        np.zeros((k, 3)),
        np.zeros((3 * k, 3 * k)),
        np.zeros((3 * k, 3 * k + 1)),
        np.zeros(3 * k, np.int64),
        np.zeros((3 * k, 3)),
        np.zeros(k, np.int64),
    )


@kernel
def swap(c: Contacts, i: int, j: int) -> None:
    """Exchange what two rows say of their contacts (not the answers, nor working memory)."""
    if i == j:
        return
    c.box[i], c.box[j] = c.box[j], c.box[i]
    c.kind[i], c.kind[j] = c.kind[j], c.kind[i]
    c.axis[i], c.axis[j] = c.axis[j], c.axis[i]
    c.gap[i], c.gap[j] = c.gap[j], c.gap[i]
    c.friction[i], c.friction[j] = c.friction[j], c.friction[i]
    c.elasticity[i], c.elasticity[j] = c.elasticity[j], c.elasticity[i]
    c.bias[i], c.bias[j] = c.bias[j], c.bias[i]
    c.slides[i], c.slides[j] = c.slides[j], c.slides[i]
    c.status[i], c.status[j] = c.status[j], c.status[i]
    c.push[i], c.push[j] = c.push[j], c.push[i]
    for k in range(3):
        c.normal[i, k], c.normal[j, k] = c.normal[j, k], c.normal[i, k]
        c.pivot[i, k], c.pivot[j, k] = c.pivot[j, k], c.pivot[i, k]
        c.edge[i, k], c.edge[j, k] = c.edge[j, k], c.edge[i, k]
        c.moving[i, k], c.moving[j, k] = c.moving[j, k], c.moving[i, k]
        c.surface[i, k], c.surface[j, k] = c.surface[j, k], c.surface[i, k]
        c.direction[i, k], c.direction[j, k] = c.direction[j, k], c.direction[i, k]
        c.drag[i, k], c.drag[j, k] = c.drag[j, k], c.drag[i, k]


@kernel
def slip(c: Contacts, i: int, radius: float, v: Vector, w: Vector) -> Vector:
    """Return the velocity of the ball's point at contact ``i`` over the surface."""
    n = row(c.normal, i)
    return plus(tangential(sub(v, row(c.surface, i)), n), radius, cross(n, w))


@kernel
def excess(c: Contacts, i: int, v: Vector) -> float:
    """Return by how much contact ``i`` opens faster than it must; negative where it closes."""
    bias: float = c.bias[i]
    return dot(row(c.normal, i), sub(v, row(c.surface, i))) - bias


@kernel
def _apply(
    c: Contacts, i: int, radius: float, v: Vector, w: Vector, push: float, drag: Vector
) -> tuple[Vector, Vector]:
    """Return the velocities after an impulse: ``push`` along the normal, ``drag`` across it."""
    n = row(c.normal, i)
    torque = cross(n, drag)
    return add(plus(v, push, n), drag), plus(w, -_SPIN_PER_IMPULSE / radius, torque)


@kernel
def solve(
    c: Contacts, count: int, radius: float, v: Vector, w: Vector
) -> tuple[Vector, Vector, bool]:
    """Return the velocities after the contacts' impulses, and whether they are the answer.

    Works on rates of any kind: velocities, or accelerations. Writes ``status``, ``push`` and
    ``drag`` of the first ``count`` contacts.

    Args:
        c: the contacts; ``normal``, ``friction``, ``surface``, ``bias``, ``slides``, ``direction``.
        count: how many.
        radius: of the ball.
        v: velocity of the centre without the contacts.
        w: angular velocity without them.
    """
    for i in range(count):
        c.push[i] = 0.0
        put(c.drag, i, (0.0, 0.0, 0.0))
    if count == 1:
        v, w, _ = _sweep(c, count, radius, v, w)
        return v, w, True
    if count == 2:
        done, after_v, after_w = _both_stick(c, radius, v, w)
        if done:
            return after_v, after_w, True
    scale = _scale(c, count, radius, v, w)
    free_v, free_w = v, w
    sweeps = _FIRST_SWEEPS
    for _ in range(_MOST_ATTEMPTS):
        for _ in range(sweeps):
            v, w, change = _sweep(c, count, radius, v, w)
            if change <= _ROUNDING * scale:
                return v, w, True
            if change > _ABSURD * scale:
                return v, w, False
        done, after_v, after_w = _polish(c, count, radius, free_v, free_w, scale)
        if done:
            return after_v, after_w, True
        sweeps *= 3
    return v, w, False


@kernel
def _scale(c: Contacts, count: int, radius: float, v: Vector, w: Vector) -> float:
    scale = norm(v) + radius * norm(w) + 1e-12
    for i in range(count):
        scale = max(scale, norm(row(c.surface, i)), abs(c.bias[i]))
    return scale


@kernel
def _sweep(
    c: Contacts, count: int, radius: float, v: Vector, w: Vector
) -> tuple[Vector, Vector, float]:
    """Solve every contact once, given the others; return the velocities and the largest change."""
    change = 0.0
    for i in range(count):
        push = max(c.push[i] - excess(c, i, v), 0.0)
        old = row(c.drag, i)
        most = c.friction[i] * push
        if c.slides[i]:
            drag = scaled(-most, row(c.direction, i))
            c.status[i] = SLIPS
        else:
            drag = plus(old, -1.0 / _SLIP_PER_IMPULSE, slip(c, i, radius, v, w))
            size = norm(drag)
            c.status[i] = STICKS
            if size > most:
                drag = scaled(most / size, drag)
                c.status[i] = SLIPS
        if push == 0.0:
            c.status[i] = OPEN
        step = sub(drag, old)
        v, w = _apply(c, i, radius, v, w, push - c.push[i], step)
        change = max(change, abs(push - c.push[i]), norm(step))
        c.push[i] = push
        put(c.drag, i, drag)
    return v, w, change


@kernel
def _both_stick(c: Contacts, radius: float, v: Vector, w: Vector) -> tuple[bool, Vector, Vector]:
    """Return whether two contacts both stick, and the velocities if they do.

    The ball then turns about the line through both points of contact, and its momentum about that
    line is kept. What the reactions are is known but for one number: the friction with which both
    contacts can press against each other.
    """
    if c.slides[0] or c.slides[1] or c.bias[0] != 0.0 or c.bias[1] != 0.0:
        return False, v, w
    for k in range(3):
        if c.surface[0, k] != c.surface[1, k]:
            return False, v, w
    a, b, surface = row(c.normal, 0), row(c.normal, 1), row(c.surface, 0)
    cosine, d = dot(a, b), cross(a, b)
    sine = norm(d)
    if sine < 1e-3:
        return False, v, w
    d = scaled(1.0 / sine, d)
    apart = sub(a, b)
    axis = scaled(1.0 / norm(apart), apart)
    arm = scaled(radius, a)
    lever = cross(axis, arm)
    inertia = 0.4 * radius * radius
    turning = inertia * dot(axis, w) + dot(lever, sub(v, surface))
    rate = turning / (inertia + dot(lever, lever))
    after_v, after_w = plus(surface, rate, lever), scaled(rate, axis)

    force = sub(after_v, v)
    moment = scaled(-inertia / radius, sub(after_w, w))
    along_a = -dot(moment, b) / sine
    along_b = dot(moment, a) / sine
    shared = dot(moment, d)
    # The friction across d is t at the first contact and shared - t at the second.
    ra, rb = dot(force, a) + sine * shared, dot(force, b)
    push_a = (ra - cosine * rb) / (sine * sine)
    push_b = (rb - cosine * ra) / (sine * sine)
    slope = -(1.0 - cosine) / sine
    mu_a, mu_b = c.friction[0], c.friction[1]
    best, found = 0.0, False
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
            and math.hypot(along_a, t) <= mu_a * na + room
            and math.hypot(along_b, shared - t) <= mu_b * nb + room
        )
        if inside and (not found or abs(t - 0.5 * shared) < abs(best - 0.5 * shared)):
            best, found = t, True
    if not found:
        return False, v, w
    c.push[0], c.push[1] = push_a + slope * best, push_b + slope * best
    c.status[0], c.status[1] = STICKS, STICKS
    put(c.drag, 0, plus(scaled(along_a, d), best, cross(d, a)))
    put(c.drag, 1, plus(scaled(along_b, d), shared - best, cross(d, b)))
    return True, after_v, after_w


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
def hold(c: Contacts, count: int, radius: float, v: Vector, w: Vector) -> tuple[Vector, Vector]:
    """Return the velocities after the impulses of contacts that neither open nor change their mode.

    Every one of the first ``count`` keeps its distance; those with status `STICKS` do not slip, the
    others slip along ``direction``. Writes ``push`` and ``drag``, which may now pull or leave the
    cone: the caller asks.
    """
    for i in range(count):
        c.push[i] = 0.0
        put(c.drag, i, (0.0, 0.0, 0.0))
    if count == 1:
        push = -excess(c, 0, v)
        if c.status[0] == STICKS:
            drag = scaled(-1.0 / _SLIP_PER_IMPULSE, slip(c, 0, radius, v, w))
        else:
            drag = scaled(-c.friction[0] * push, row(c.direction, 0))
        c.push[0] = push
        put(c.drag, 0, drag)
        return _apply(c, 0, radius, v, w, push, drag)
    for i in range(count):
        c.active[i] = i
    _respond(c, count)
    _newton_step(c, count, radius, v, w, True)
    return _sum(c, count, radius, v, w)


@kernel
def _polish(
    c: Contacts, count: int, radius: float, free_v: Vector, free_w: Vector, scale: float
) -> tuple[bool, Vector, Vector]:
    """Newton's method from the impulses there are, with the status that every contact has.

    Returns whether it ended at an answer, and the velocities. If not, the impulses are as before.
    """
    m = 0
    for i in range(count):
        if c.status[i] != OPEN:
            c.active[m] = i
            m += 1
    kept_push, kept_drag = c.push[:count].copy(), c.drag[:count].copy()
    _respond(c, m)
    done = m == 0
    before = math.inf
    for _ in range(_MOST_NEWTON_STEPS):
        if m == 0:
            break
        residual = _newton_step(c, m, radius, free_v, free_w, False)
        if residual <= _ROUNDING * scale or (residual <= 1e-12 * scale and residual >= before):
            done = True
            break
        before = residual
    v, w = _sum(c, count, radius, free_v, free_w)
    if done and _satisfied(c, count, v, scale):
        return True, v, w
    c.push[:count] = kept_push
    c.drag[:count] = kept_drag
    return False, v, w


@kernel
def _satisfied(c: Contacts, count: int, v: Vector, scale: float) -> bool:
    """Say whether no contact pulls, closes or sticks beyond its cone."""
    room = 1e-12 * scale
    for i in range(count):
        if c.push[i] < -room:
            return False
        if c.status[i] == OPEN and excess(c, i, v) < -room:
            return False
        most = c.friction[i] * max(c.push[i], 0.0)
        if c.status[i] == STICKS and norm(row(c.drag, i)) > most + room:
            return False
    return True


@kernel
def _sum(c: Contacts, count: int, radius: float, v: Vector, w: Vector) -> tuple[Vector, Vector]:
    """Return the velocities after all impulses."""
    for i in range(count):
        v, w = _apply(c, i, radius, v, w, c.push[i], row(c.drag, i))
    return v, w


@kernel
def _respond(c: Contacts, m: int) -> None:
    """Write the frames of the active contacts, and what unit impulses along them change (Delassus).

    Row and column 3 i are the normal of the i-th active contact, the next two its tangents.
    """
    for i in range(m):
        n = row(c.normal, c.active[i])
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
        put(c.frame, 3 * i, n)
        put(c.frame, 3 * i + 1, first)
        put(c.frame, 3 * i + 2, cross(n, first))
    for j in range(m):
        source = row(c.frame, 3 * j)
        for b in range(3):
            impulse = row(c.frame, 3 * j + b)
            turned = cross(source, impulse)
            for i in range(m):
                n = row(c.frame, 3 * i)
                moved = plus(impulse, -_SPIN_PER_IMPULSE, cross(n, turned))
                for a in range(3):
                    effect = impulse if a == 0 else moved
                    c.response[3 * i + a, 3 * j + b] = dot(row(c.frame, 3 * i + a), effect)


@kernel
def _newton_step(
    c: Contacts, m: int, radius: float, free_v: Vector, free_w: Vector, known: bool
) -> float:
    """Change the impulses of the ``m`` active contacts by one Newton step; return the residual.

    Args:
        c: the contacts.
        m: how many are active.
        radius: of the ball.
        free_v: velocity without contacts.
        free_w: angular velocity without contacts.
        known: the direction of every slip is known, so that the step is exact.
    """
    v, w = free_v, free_w
    for i in range(m):
        contact = c.active[i]
        v, w = _apply(c, contact, radius, v, w, c.push[contact], row(c.drag, contact))
    size = 3 * m
    residual = 0.0
    system, response = c.system, c.response
    for i in range(m):
        contact = c.active[i]
        first, second = row(c.frame, 3 * i + 1), row(c.frame, 3 * i + 2)
        u = slip(c, contact, radius, v, w)
        u1, u2 = dot(u, first), dot(u, second)
        opening = excess(c, contact, v)
        residual = max(residual, abs(opening))
        for k in range(size):
            system[3 * i, k] = response[3 * i, k]
        system[3 * i, size] = -opening
        if c.status[contact] == STICKS:
            residual = max(residual, abs(u1), abs(u2))
            for k in range(size):
                system[3 * i + 1, k] = response[3 * i + 1, k]
                system[3 * i + 2, k] = response[3 * i + 2, k]
            system[3 * i + 1, size] = -u1
            system[3 * i + 2, size] = -u2
            continue
        mu, push, drag = c.friction[contact], c.push[contact], row(c.drag, contact)
        speed = math.hypot(u1, u2)
        stiffness = 0.0
        if known or c.slides[contact]:
            d = row(c.direction, contact)
            d1, d2 = dot(d, first), dot(d, second)
        elif speed > 0.0:
            d1, d2 = u1 / speed, u2 / speed
            stiffness = mu * push / speed
        else:
            d1 = d2 = 0.0
        r1, r2 = dot(drag, first) + mu * push * d1, dot(drag, second) + mu * push * d2
        residual = max(residual, abs(r1), abs(r2))
        # T + mu N u/|u| = 0, and its derivative by way of u.
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
    _eliminate(system, size, c.columns)
    for i in range(m):
        contact = c.active[i]
        c.push[contact] += system[3 * i, size]
        drag = row(c.drag, contact)
        drag = plus(drag, system[3 * i + 1, size], row(c.frame, 3 * i + 1))
        put(c.drag, contact, plus(drag, system[3 * i + 2, size], row(c.frame, 3 * i + 2)))
    return residual


@kernel
def _eliminate(system: Any, size: int, columns: Any) -> None:
    """Solve a linear system by elimination with complete pivoting; the answer is the last column.

    Where it is singular, as for friction that is indeterminate, the unknowns that nothing decides
    are 0.
    """
    for i in range(size):
        columns[i] = i
        largest = np.abs(system[i, :size]).max()
        if largest > 0.0:
            system[i, : size + 1] /= largest
    rank = size
    for step in range(size):
        if not _pivot(system, size, step, columns):
            rank = step
            break
        _clear_column(system, size, step)
    system[rank:size, size] = 0.0
    for step in range(rank - 1, -1, -1):
        value = system[step, size]
        for k in range(step + 1, rank):
            value -= system[step, k] * system[k, size]
        system[step, size] = value / system[step, step]
    # The first column's memory is free now: put the answer back into the unknowns' own order.
    for step in range(size):
        system[columns[step], 0] = system[step, size]
    system[:size, size] = system[:size, 0]


@kernel
def _clear_column(system: Any, size: int, step: int) -> None:
    """Take the pivot's row away from those below it."""
    for i in range(step + 1, size):
        factor = system[i, step] / system[step, step]
        if factor != 0.0:
            for k in range(step + 1, size + 1):
                system[i, k] -= factor * system[step, k]


@kernel
def _pivot(system: Any, size: int, step: int, columns: Any) -> bool:
    """Bring the largest number that is left to the diagonal; say whether it is more than 0."""
    best, pivot_row, pivot_column = 0.0, step, step
    for i in range(step, size):
        for k in range(step, size):
            if abs(system[i, k]) > best:
                best, pivot_row, pivot_column = abs(system[i, k]), i, k
    if best < _SINGULAR:
        return False
    if pivot_row != step:
        for k in range(size + 1):
            system[step, k], system[pivot_row, k] = system[pivot_row, k], system[step, k]
    if pivot_column != step:
        for i in range(size):
            system[i, step], system[i, pivot_column] = system[i, pivot_column], system[i, step]
        columns[step], columns[pivot_column] = columns[pivot_column], columns[step]
    return True
