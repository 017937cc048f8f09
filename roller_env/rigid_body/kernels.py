"""The methods and the built-in loads as loops over bodies, compiled to machine code by Numba.

A method is a list of **stages**. Stage s lays point s, the state in which the load is evaluated
next, from the beginning of the step and the rates at the points before it; the stage after the last
one lays the end of the step. So one function, `_lay`, is all that the methods are, and there are
two ways to drive it: `advance_bodies` runs whole steps of a body with the built-in loads, and
`lay_points` and `take_rates` run one stage of all bodies, between which Python evaluates a load of
the user's own.

Arithmetic is IEEE's in the order written, body by body: a result does not depend on how many bodies
there are. Compiled functions are all in this module, since Numba's cache sees no other file's
changes. With ``NUMBA_DISABLE_JIT=1`` all of it runs as plain Python.

A body's point is a row of 16 numbers: position 0 to 2, momentum 3 to 5, orientation 6 to 9 and
angular momentum 10 to 12 in world axes, and angular momentum in body axes 13 to 15, which only
`RK4_BODY` keeps. Its rates are 19: velocity 0 to 2, force 3 to 5, angular velocity 6 to 8, torque 9
to 11, rate of the quaternion 12 to 15, and 16 to 18 of what else the method turns by.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple, ParamSpec, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

_P = ParamSpec("_P")
_R = TypeVar("_R")

Float64 = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

POINT: Final = 16
"""Numbers in a row of points."""

_RATES: Final = 19

EXPLICIT_EULER, SEMI_IMPLICIT_EULER, RK4, RK4_BODY, LIE_RK4, BUSS2, BUSS3, SPLITTING = range(8)
"""Methods."""

CONSTANT, GRAVITY, DRAG, DRIVE, PUSH, THRUST = range(6)
"""Kinds of load: see `Terms`."""


def compiled(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function`` compiled at its first call, and kept for the next process if it can be.

    No fused or reassociated operations, and division by zero gives what IEEE says.
    """
    try:
        return cast("Callable[_P, _R]", numba.njit(cache=True, error_model="numpy")(function))
    except RuntimeError:  # nowhere to write
        return cast("Callable[_P, _R]", numba.njit(error_model="numpy")(function))


class Bodies(NamedTuple):
    """What never changes, of N bodies; see `roller_env.rigid_body.state.Body`."""

    mass: Float64
    inverse_mass: Float64
    inertia: Float64
    """(N, 3), as is the next."""
    inverse_inertia: Float64
    by_inertia: npt.NDArray[np.int64]
    """(N, 3) body axes in order of rising moment."""
    isotropic: npt.NDArray[np.bool_]
    """(N,): three equal moments."""


class Terms(NamedTuple):
    """A sum of T built-in loads on N bodies.

    `CONSTANT`: force a, torque b. `GRAVITY`: mass * a. `DRAG`: force -c v. `DRIVE`: torque a - c w.
    `PUSH` and `THRUST`: force a at the body point b, a being in world or in body axes.
    """

    kind: npt.NDArray[np.int64]
    c: Float64
    """(T, N)."""
    a: Float64
    """(T, N, 3), as is the next."""
    b: Float64
    held: npt.NDArray[np.bool_]
    """(T,): acts through an axle, which takes up the force and some of the torque."""
    axle: Float64
    """(T, N, 3, 3): what of a torque an axle lets through."""


class Plan(NamedTuple):
    """A method."""

    kind: int
    stages: int
    """Evaluations of the load in a step."""
    renormalise: bool
    """Make the orientation at the end of a step a unit quaternion."""
    renormalise_points: bool
    """And that of the points within."""
    fractions: Float64
    """Of a splitting: its parts of the step."""


# --- vectors and quaternions -----------------------------------------------------------------


@compiled
def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled
def _scaled(k: float, v: Vector) -> Vector:
    return (k * v[0], k * v[1], k * v[2])


@compiled
def _plus(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@compiled
def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@compiled
def _times(a: Vector, b: Vector) -> Vector:
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2])


@compiled
def _vector(rows: Float64, s: int, first: int) -> Vector:
    return (rows[s, first], rows[s, first + 1], rows[s, first + 2])


@compiled
def _put(rows: Float64, s: int, first: int, v: Vector) -> None:
    rows[s, first] = v[0]
    rows[s, first + 1] = v[1]
    rows[s, first + 2] = v[2]


@compiled
def _quaternion(rows: Float64, s: int, first: int) -> Quaternion:
    return (rows[s, first], rows[s, first + 1], rows[s, first + 2], rows[s, first + 3])


@compiled
def _put_quaternion(rows: Float64, s: int, first: int, q: Quaternion) -> None:
    rows[s, first] = q[0]
    rows[s, first + 1] = q[1]
    rows[s, first + 2] = q[2]
    rows[s, first + 3] = q[3]


@compiled
def _multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@compiled
def _unit(q: Quaternion) -> Quaternion:
    """Return q of norm 1; of zero or infinite q NaN. Squares stay within float64's range."""
    square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    if not 1e-280 < square < 1e280:
        largest = max(abs(q[0]), abs(q[1]), abs(q[2]), abs(q[3]))
        q = (q[0] / largest, q[1] / largest, q[2] / largest, q[3] / largest)
        square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    norm = math.sqrt(square)
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm)


@compiled
def _turning(v: Vector) -> Quaternion:
    """Return the rotation about v by its length."""
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if not 1e-280 < square < 1e280:
        largest = max(abs(v[0]), abs(v[1]), abs(v[2]))
        if largest == 0.0:
            return (1.0, 0.0, 0.0, 0.0)
        x, y, z = v[0] / largest, v[1] / largest, v[2] / largest
        half = 0.5 * largest * math.sqrt(x * x + y * y + z * z)
    else:
        half = 0.5 * math.sqrt(square)
    ratio = 0.5 * math.sin(half) / half
    return (math.cos(half), ratio * v[0], ratio * v[1], ratio * v[2])


@compiled
def _rotate(q: Quaternion, v: Vector) -> Vector:
    """Return v turned by q: from body to world axes."""
    u = (q[1], q[2], q[3])
    twice = _scaled(2.0, _cross(u, v))
    return _plus(_plus(v, _scaled(q[0], twice)), _cross(u, twice))


@compiled
def _rotate_back(q: Quaternion, v: Vector) -> Vector:
    """Return v turned back by q: from world to body axes."""
    return _rotate((-q[0], q[1], q[2], q[3]), v)


class _Body(NamedTuple):
    """The constants of one body, out of the arrays."""

    mass: float
    inverse_mass: float
    inverse_inertia: Vector
    isotropic: bool
    low: int
    """Body axis of the least moment, and so on."""
    middle: int
    high: int


@compiled
def _body(bodies: Bodies, n: int) -> _Body:
    order = bodies.by_inertia
    return _Body(
        bodies.mass[n],
        bodies.inverse_mass[n],
        _vector(bodies.inverse_inertia, n, 0),
        bodies.isotropic[n],
        order[n, 0],
        order[n, 1],
        order[n, 2],
    )


@compiled
def _over_inertia(body: _Body, q: Quaternion, v: Vector) -> Vector:
    """Return I^-1 v, world axes, for a unit q."""
    if body.isotropic:
        return _times(body.inverse_inertia, v)
    return _rotate(q, _times(body.inverse_inertia, _rotate_back(q, v)))


# --- rates -----------------------------------------------------------------------------------


@compiled
def _kinematics(
    body: _Body, points: Float64, rates: Float64, s: int, unit: bool, body_axes: bool
) -> Quaternion:
    """Write the rates at point s that follow from the state, and return the unit quaternion."""
    q = _quaternion(points, s, 6)
    r = q if unit else _unit(q)
    _put(rates, s, 0, _scaled(body.inverse_mass, _vector(points, s, 3)))
    if body_axes:
        own = _times(body.inverse_inertia, _vector(points, s, 13))
        omega = _rotate(r, own)
        _put(rates, s, 16, own)
        spin = _multiply(q, (0.0, 0.5 * own[0], 0.5 * own[1], 0.5 * own[2]))
    else:
        omega = _over_inertia(body, r, _vector(points, s, 10))
        spin = _multiply((0.0, 0.5 * omega[0], 0.5 * omega[1], 0.5 * omega[2]), q)
    _put(rates, s, 6, omega)
    _put_quaternion(rates, s, 12, spin)
    return r


@compiled
def _act(body: _Body, terms: Terms, n: int, q: Quaternion, rates: Float64, s: int) -> None:
    """Write what the loads do to body n at point s: force and torque, from its other rates."""
    force, torque = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(len(terms.kind)):
        kind = terms.kind[i]
        push, turn = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        a = (terms.a[i, n, 0], terms.a[i, n, 1], terms.a[i, n, 2])
        b = (terms.b[i, n, 0], terms.b[i, n, 1], terms.b[i, n, 2])
        if kind == CONSTANT:
            push, turn = a, b
        elif kind == GRAVITY:
            push = _scaled(body.mass, a)
        elif kind == DRAG:
            push = _scaled(-terms.c[i, n], _vector(rates, s, 0))
        elif kind == DRIVE:
            turn = _minus(a, _scaled(terms.c[i, n], _vector(rates, s, 6)))
        else:
            push = _rotate(q, a) if kind == THRUST else a
            turn = _cross(_rotate(q, b), push)
        if terms.held[i]:
            m = terms.axle[i, n]
            push = (0.0, 0.0, 0.0)
            turn = (
                m[0, 0] * turn[0] + m[0, 1] * turn[1] + m[0, 2] * turn[2],
                m[1, 0] * turn[0] + m[1, 1] * turn[1] + m[1, 2] * turn[2],
                m[2, 0] * turn[0] + m[2, 1] * turn[1] + m[2, 2] * turn[2],
            )
        force, torque = _plus(force, push), _plus(torque, turn)
    _put(rates, s, 3, force)
    _put(rates, s, 9, torque)


@compiled
def _finish_rates(
    plan: Plan, s: int, dt: float, points: Float64, r: Quaternion, rates: Float64
) -> None:
    """Write what else a method needs at point s, once the load is known."""
    if plan.kind == RK4_BODY:
        # Euler's equations in body axes: L' = R^T torque - w x L.
        gyroscopic = _cross(_vector(rates, s, 16), _vector(points, s, 13))
        _put(rates, s, 16, _minus(_rotate_back(r, _vector(rates, s, 9)), gyroscopic))
    elif plan.kind == LIE_RK4:
        turned = (0.0, 0.0, 0.0)
        if s > 0:
            turned = _scaled(dt if s == 3 else 0.5 * dt, _vector(rates, s - 1, 16))
        omega = _vector(rates, s, 6)
        # dexp^-1 by its series to the order four.
        first = _cross(turned, omega)
        second = _cross(turned, first)
        _put(rates, s, 16, _plus(_minus(omega, _scaled(0.5, first)), _scaled(1.0 / 12.0, second)))


# --- stages ----------------------------------------------------------------------------------


@compiled
def _add(points: Float64, s: int, dt: float, rates: Float64, k: int, body_axes: bool) -> None:
    """Write as point s the first one with dt times the rates of row k added."""
    for i in range(3):
        points[s, i] = points[0, i] + dt * rates[k, i]
        points[s, 3 + i] = points[0, 3 + i] + dt * rates[k, 3 + i]
        points[s, 10 + i] = points[0, 10 + i] + dt * rates[k, 9 + i]
    for i in range(4):
        points[s, 6 + i] = points[0, 6 + i] + dt * rates[k, 12 + i]
    if body_axes:
        for i in range(3):
            points[s, 13 + i] = points[0, 13 + i] + dt * rates[k, 16 + i]


@compiled
def _turn(points: Float64, s: int, v: Vector) -> None:
    """Write as point s' orientation the first one's turned by a world rotation vector."""
    _put_quaternion(points, s, 6, _unit(_multiply(_turning(v), _quaternion(points, 0, 6))))


@compiled
def _mean(rates: Float64, first: int, stages: int, to: int) -> None:
    """Write as row ``to`` the mean of the rates of Kutta's three or Runge and Kutta's four points.

    (k1 + 4 k2 + k3) / 6 or (k1 + 2 (k2 + k3) + k4) / 6.
    """
    last = first + stages - 1
    for i in range(_RATES):
        if stages == 3:
            middle = 4.0 * rates[first + 1, i]
        else:
            middle = 2.0 * (rates[first + 1, i] + rates[first + 2, i])
        rates[to, i] = (rates[first, i] + middle + rates[last, i]) / 6.0


@compiled
def _lay_runge_kutta(plan: Plan, s: int, dt: float, points: Float64, rates: Float64) -> None:
    body_axes = plan.kind == RK4_BODY
    k, part, renormalise = s - 1, 0.5 * dt if s < 3 else dt, plan.renormalise_points
    if s == plan.stages:
        _mean(rates, 0, 4, s)
        k, renormalise = s, plan.renormalise
    _add(points, s, part, rates, k, body_axes)
    if plan.kind == LIE_RK4:
        _turn(points, s, _scaled(part, _vector(rates, k, 16)))
    elif renormalise:
        _put_quaternion(points, s, 6, _unit(_quaternion(points, s, 6)))
    if body_axes:
        unit = _quaternion(points, s, 6) if renormalise else _unit(_quaternion(points, s, 6))
        _put(points, s, 10, _rotate(unit, _vector(points, s, 13)))


@compiled
def _lay_euler(body: _Body, plan: Plan, dt: float, points: Float64, rates: Float64) -> None:
    _add(points, 1, dt, rates, 0, False)
    if plan.kind == SEMI_IMPLICIT_EULER:
        # The momenta first; then the pose, at the new momenta.
        velocity = _scaled(body.inverse_mass, _vector(points, 1, 3))
        _put(points, 1, 0, _plus(_vector(points, 0, 0), _scaled(dt, velocity)))
        omega = _over_inertia(body, _unit(_quaternion(points, 0, 6)), _vector(points, 1, 10))
        _turn(points, 1, _scaled(dt, omega))
    elif plan.renormalise:
        _put_quaternion(points, 1, 6, _unit(_quaternion(points, 1, 6)))


@compiled
def _buss_predict(
    body: _Body, s: int, dt: float, points: Float64, rates: Float64, force: Vector, torque: Vector
) -> Vector:
    """Write as point s the pose from the first rates, and the momenta from mean forces.

    Return the rotation vector.
    """
    omega = _vector(rates, 0, 6)
    acceleration = _scaled(body.inverse_mass, _vector(rates, 0, 3))
    moved = _scaled(dt, _plus(_vector(rates, 0, 0), _scaled(0.5 * dt, acceleration)))
    _put(points, s, 0, _plus(_vector(points, 0, 0), moved))
    _put(points, s, 3, _plus(_vector(points, 0, 3), _scaled(dt, force)))
    _put(points, s, 10, _plus(_vector(points, 0, 10), _scaled(dt, torque)))
    gyroscopic = _minus(_vector(rates, 0, 9), _cross(omega, _vector(points, 0, 10)))
    alpha = _over_inertia(body, _unit(_quaternion(points, 0, 6)), gyroscopic)
    augmented = _plus(omega, _scaled(0.5 * dt, alpha))
    turn = _scaled(dt, _plus(augmented, _scaled(dt * dt / 12.0, _cross(alpha, omega))))
    _turn(points, s, turn)
    return turn


@compiled
def _omega_second(body: _Body, points: Float64, rates: Float64, torque_rate: Vector) -> Vector:
    """Return w'' at the first point, the derivative of I^-1 (torque - w x L): inertia turns too."""
    r = _unit(_quaternion(points, 0, 6))
    momentum, omega, torque = _vector(points, 0, 10), _vector(rates, 0, 6), _vector(rates, 0, 9)
    gyroscopic = _minus(torque, _cross(omega, momentum))
    alpha = _over_inertia(body, r, gyroscopic)
    change = _minus(_minus(torque_rate, _cross(alpha, momentum)), _cross(omega, torque))
    change = _minus(change, _cross(omega, gyroscopic))
    return _plus(_cross(omega, alpha), _over_inertia(body, r, change))


@compiled
def _lay_buss(body: _Body, plan: Plan, s: int, dt: float, points: Float64, rates: Float64) -> None:
    force, torque = _vector(rates, 0, 3), _vector(rates, 0, 9)
    if plan.kind == BUSS2:
        if s == 2:
            # The pose as predicted; the momenta take the mean of both ends' forces.
            force = _scaled(0.5, _plus(force, _vector(rates, 1, 3)))
            torque = _scaled(0.5, _plus(torque, _vector(rates, 1, 9)))
        _buss_predict(body, s, dt, points, rates, force, torque)
    elif s == 1:
        _buss_predict(body, s, 0.5 * dt, points, rates, force, torque)
    elif s == 2:
        force = _minus(_scaled(2.0, _vector(rates, 1, 3)), force)
        torque = _minus(_scaled(2.0, _vector(rates, 1, 9)), torque)
        _buss_predict(body, s, dt, points, rates, force, torque)
    else:
        turn = _buss_predict(body, s, dt, points, rates, force, torque)
        change = _minus(_scaled(4.0, _vector(rates, 1, 9)), _scaled(3.0, torque))
        torque_rate = _scaled(1.0 / dt, _minus(change, _vector(rates, 2, 9)))
        second = _omega_second(body, points, rates, torque_rate)
        _mean(rates, 0, 3, 3)
        _add(points, s, dt, rates, 3, False)
        _turn(points, s, _plus(turn, _scaled(dt * dt * dt / 6.0, second)))


@compiled
def _component(v: Vector, axis: int) -> float:
    if axis == 0:
        return v[0]
    return v[1] if axis == 1 else v[2]


@compiled
def _about_own(body: _Body, dt: float, axis: int, momentum: Vector, q: Quaternion) -> Quaternion:
    """Return q after the part of a free motion that turns the body about an axis of its own."""
    rate = _component(body.inverse_inertia, axis) - _component(body.inverse_inertia, body.middle)
    half = 0.5 * dt * rate * _component(_rotate_back(q, momentum), axis)
    sine, cosine = math.sin(half), math.cos(half)
    if axis == 0:
        return _multiply(q, (cosine, sine, 0.0, 0.0))
    if axis == 1:
        return _multiply(q, (cosine, 0.0, sine, 0.0))
    return _multiply(q, (cosine, 0.0, 0.0, sine))


@compiled
def _drift(body: _Body, dt: float, mirrored: bool, points: Float64, s: int) -> None:
    """Move point s by the free motion's parts one after the other, or in reverse order."""
    momentum = _vector(points, s, 10)
    about_it = _scaled(dt * _component(body.inverse_inertia, body.middle), momentum)
    q = _multiply(_turning(about_it), _quaternion(points, s, 6))
    if not body.isotropic:
        one, other = (body.high, body.low) if mirrored else (body.low, body.high)
        q = _about_own(body, dt, one, momentum, q)
        q = _about_own(body, dt, other, momentum, q)
    _put_quaternion(points, s, 6, _unit(q))
    velocity = _scaled(body.inverse_mass, _vector(points, s, 3))
    _put(points, s, 0, _plus(_vector(points, s, 0), _scaled(dt, velocity)))


@compiled
def _kick(points: Float64, middle: int, dt: float, rates: Float64, k: int, s: int) -> None:
    """Write as point s the one before the push with only its momenta moved along rates k."""
    for i in range(POINT):
        points[s, i] = points[middle, i]
    for i in range(3):
        points[s, 3 + i] += dt * rates[k, 3 + i]
        points[s, 10 + i] += dt * rates[k, 9 + i]


@compiled
def _lay_splitting(
    body: _Body, plan: Plan, s: int, dt: float, points: Float64, rates: Float64
) -> None:
    pushes = plan.stages // len(plan.fractions)
    part, j = s // pushes, s % pushes
    if j > 0:
        # Pose and time frozen: a point of the push's own small integration.
        whole = plan.fractions[part] * dt
        _kick(points, s - j, whole if j == 3 else 0.5 * whole, rates, s - 1, s)
        return
    if s > 0:
        whole, k = plan.fractions[part - 1] * dt, s - 1
        if pushes == 4:
            k = plan.stages
            _mean(rates, s - 4, 4, k)
        _kick(points, s - pushes, whole, rates, k, s)
        _drift(body, 0.5 * whole, True, points, s)
    if s < plan.stages:
        _drift(body, 0.5 * plan.fractions[part] * dt, False, points, s)


@compiled
def _lay(body: _Body, plan: Plan, s: int, dt: float, points: Float64, rates: Float64) -> None:
    """Write point s of a body's step, or its end when s is the number of stages.

    Args:
        body: its constants.
        plan: the method.
        s: stage.
        dt: s.
        points: (stages + 1, POINT) of the body; for s = 0, row 0 holds the beginning of the step.
        rates: (stages + 1, 19) of the body, known before s; the last row is scratch.
    """
    if plan.kind == SPLITTING:
        _lay_splitting(body, plan, s, dt, points, rates)
    elif s > 0:
        if plan.kind == EXPLICIT_EULER or plan.kind == SEMI_IMPLICIT_EULER:
            _lay_euler(body, plan, dt, points, rates)
        elif plan.kind == BUSS2 or plan.kind == BUSS3:
            _lay_buss(body, plan, s, dt, points, rates)
        else:
            _lay_runge_kutta(plan, s, dt, points, rates)


def workspace(count: int, stages: int) -> tuple[Float64, Float64]:
    """Return room for the points and the rates of a step of ``count`` bodies."""
    return np.zeros((count, stages + 1, POINT)), np.zeros((count, stages + 1, _RATES))


# --- drivers ---------------------------------------------------------------------------------


@compiled
def advance_bodies(
    bodies: Bodies, terms: Terms, plan: Plan, dt: float, steps: int, unit: bool, rows: Float64
) -> None:
    """Advance every body by whole steps under built-in loads, in place.

    Args:
        bodies: of N rows.
        terms: loads, of N rows.
        plan: the method.
        dt: s.
        steps: how many.
        unit: whether the orientations are unit quaternions.
        rows: (N, POINT) states.
    """
    stages, body_axes = plan.stages, plan.kind == RK4_BODY
    points = np.zeros((stages + 1, POINT))
    rates = np.zeros((stages + 1, _RATES))
    for n in range(len(rows)):
        body = _body(bodies, n)
        for i in range(POINT):
            points[0, i] = rows[n, i]
        known = unit
        for _ in range(steps):
            for s in range(stages):
                _lay(body, plan, s, dt, points, rates)
                is_unit = known if s == 0 else plan.renormalise_points
                r = _kinematics(body, points, rates, s, is_unit, body_axes)
                _act(body, terms, n, r, rates, s)
                _finish_rates(plan, s, dt, points, r, rates)
            _lay(body, plan, stages, dt, points, rates)
            for i in range(POINT):
                points[0, i] = points[stages, i]
            known = plan.renormalise
        for i in range(POINT):
            rows[n, i] = points[0, i]


@compiled
def lay_points(
    bodies: Bodies, plan: Plan, s: int, dt: float, points: Float64, rates: Float64
) -> None:
    """Write point s of every body's step, as `_lay`; arrays of `workspace`."""
    for n in range(len(points)):
        _lay(_body(bodies, n), plan, s, dt, points[n], rates[n])


@compiled
def take_rates(
    bodies: Bodies,
    plan: Plan,
    s: int,
    dt: float,
    unit: bool,
    points: Float64,
    rates: Float64,
    force: Float64,
    torque: Float64,
) -> None:
    """Write the rates at point s of every body, given what a load of the user's own does there."""
    is_unit = unit if s == 0 else plan.renormalise_points
    for n in range(len(points)):
        body, point, rate = _body(bodies, n), points[n], rates[n]
        r = _kinematics(body, point, rate, s, is_unit, plan.kind == RK4_BODY)
        for i in range(3):
            rate[s, 3 + i] = force[n, i]
            rate[s, 9 + i] = torque[n, i]
        _finish_rates(plan, s, dt, point, r, rate)


@compiled
def wrenches(
    bodies: Bodies, terms: Terms, unit: bool, rows: Float64, force: Float64, torque: Float64
) -> None:
    """Write what built-in loads do to every body in a state (N, POINT), each (N, 3)."""
    rates = np.zeros((len(rows), _RATES))
    for n in range(len(rows)):
        body = _body(bodies, n)
        r = _kinematics(body, rows, rates, n, unit, False)
        _act(body, terms, n, r, rates, n)
        for i in range(3):
            force[n, i] = rates[n, 3 + i]
            torque[n, i] = rates[n, 9 + i]
