"""Motions with a known answer, to measure integrators against.

Each function takes a `State` at time 0 and gives the state at time ``t_s``, a number or (N,), so
that one call can give a whole trajectory: repeat the body with `State.take` and give each row a
time of its own. A function moves the half it is about, linear or angular, and leaves the other
where it was: a thrown, tumbling box is ``projectile(asymmetric_top(state, t), t, g)``. Times may
be negative.

The closed forms are good to a few 1e-16 times (1 + the angle turned), the asymmetric top's to more
near its separatrix (see there). `reference` is no closed form but an integration, for all else.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import DOP853
from scipy.special import ellipj, ellipkinc, ellipkm1, elliprf, elliprj

from roller_env.rigid_body import quaternion
from roller_env.rigid_body.arrays import (
    Float64,
    cross,
    dot,
    finite_number,
    non_negative,
    positive,
    rows,
    scalars,
    scale_exponent,
)
from roller_env.rigid_body.forces import (
    DerivativeFunction,
    Load,
    PiecewiseConstantForce,
    derivative_of,
    none,
    total,
)
from roller_env.rigid_body.state import State

_EQUAL_INERTIA = 1e-12
"""Relative difference under which two moments of inertia are the same."""

_DISTINCT_INERTIA = 1e-6
"""Relative difference that the asymmetric top's elliptic functions need between two moments."""

_SEPARATRIX = 1e-10
"""Smallest complement 1 - m of the elliptic parameter that the asymmetric top accepts."""

_PARALLEL = 1e-9
"""Sine of the largest angle between two directions that are the same."""

_SERIES_LIMIT = 0.5
"""Up to this |z| fourteen terms of phi_2(z) are exact to rounding; above, nothing cancels."""

_LEAST_RTOL = 2.3e-14
"""100 float64 roundings: scipy takes no smaller tolerance."""


# --- linear motion ---------------------------------------------------------------------------


def projectile(state: State, t_s: npt.ArrayLike, acceleration: npt.ArrayLike) -> State:
    """Return the linear motion under a constant acceleration, m/s^2, (3,) or (N, 3)."""
    t = _column(state, t_s)
    a = rows("acceleration", acceleration, state.count, 3)
    return state.recalculate(
        position=state.position + t * (state.velocity + 0.5 * t * a),
        momentum=state.momentum + t * state.body.mass[:, None] * a,
    )


def linear_drag(
    state: State,
    t_s: npt.ArrayLike,
    coefficient: npt.ArrayLike,
    force: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> State:
    """Return the linear motion under a constant force and the drag -c v.

    v(t) = v_end + (v_0 - v_end) exp(-c t / m) with the terminal velocity v_end = F / c.

    Args:
        state: N bodies at time 0.
        t_s: s.
        coefficient: c, N s/m, not negative, one number or (N,).
        force: F, (3,) or (N, 3) N.

    Raises:
        ValueError: when c is negative, or on a wrong shape.
    """
    t = _column(state, t_s)
    c = scalars("coefficient", non_negative("coefficient", coefficient), state.count)[:, None]
    push = rows("force", force, state.count, 3)
    gained, moved = _relaxed(state.momentum, push, c * state.body.inverse_mass[:, None], t)
    return state.recalculate(
        position=state.position + state.body.inverse_mass[:, None] * moved,
        momentum=state.momentum + gained,
    )


def _relaxed(y: Float64, drive: Float64, rate: Float64, t: Float64) -> tuple[Float64, Float64]:
    """Return how much y' = drive - rate * y changes y in a time t, and the integral of y.

    By the functions phi_k(z) = sum of z^j / (j + k)!, in which a weak damping cancels nothing: the
    textbook's terminal value drive / rate loses every digit there.
    """
    z = -rate * t
    phi1 = np.divide(np.expm1(z), z, out=np.ones_like(z), where=z != 0.0)
    near = np.clip(z, -_SERIES_LIMIT, _SERIES_LIMIT)
    series = sum((near**j / math.factorial(j + 2) for j in range(14)), np.zeros_like(z))
    phi2 = np.divide(phi1 - 1.0, z, out=series, where=near != z)
    return y * np.expm1(z) + drive * t * phi1, t * (y * phi1 + drive * t * phi2)


# --- rotation --------------------------------------------------------------------------------


def constant_spin(state: State, t_s: npt.ArrayLike) -> State:
    """Return the free rotation of bodies whose angular velocity stays: exp(omega t) q.

    Raises:
        ValueError: when a body's angular velocity is not along its angular momentum, so that it
            will not stay: it must be a cube or spin about a principal axis.
    """
    t = _column(state, t_s)
    omega, momentum = state.angular_velocity, state.angular_momentum
    if not _parallel(omega, momentum):
        raise ValueError(
            "constant_spin needs bodies that spin about a principal axis; "
            "use symmetric_top or asymmetric_top"
        )
    turn = quaternion.from_rotation_vector(omega * t)
    return state.recalculate(orientation=quaternion.multiply(turn, state.orientation))


def _parallel(a: Float64, b: Float64) -> bool:
    """Say whether every row of ``a`` has the line of its row of ``b``; a zero has any line."""
    a, b = (np.ldexp(v, -scale_exponent(v)[:, None]) for v in (a, b))
    sine = quaternion.norm(cross(a, b))
    return not (sine > _PARALLEL * quaternion.norm(a) * quaternion.norm(b)).any()


def damped_spin(
    state: State, t_s: npt.ArrayLike, torque: npt.ArrayLike, damping: npt.ArrayLike
) -> State:
    """Return the rotation of cubes under ``torque - damping * omega``, both constant.

    omega(t) = omega_end + (omega_0 - omega_end) exp(-c t / I) with omega_end = torque / c, and the
    angle is its integral. The report's own: torque (1, 0, 0), c = 0.1, omega_end = 10 rad/s.

    Args:
        state: N cubes (or other bodies of three equal moments) at time 0.
        t_s: s.
        torque: (3,) or (N, 3) N m, world frame.
        damping: c, N m s, not negative, one number or (N,).

    Raises:
        ValueError: when a body has unequal moments, spins across the torque (the axis would then
            turn, which has no closed form), or c is negative.
    """
    t = _column(state, t_s)
    c = scalars("damping", non_negative("damping", damping), state.count)[:, None]
    drive = rows("torque", torque, state.count, 3)
    if not state.body.isotropic:
        raise ValueError("damped_spin needs three equal moments of inertia; use reference")
    momentum = state.angular_momentum
    if not _parallel(momentum, drive):
        raise ValueError("damped_spin needs a spin along the torque, or none; use reference")
    gained, turned = _relaxed(momentum, drive, c * state.body.inverse_inertia, t)
    turn = quaternion.from_rotation_vector(state.body.inverse_inertia * turned)
    return state.recalculate(
        orientation=quaternion.multiply(turn, state.orientation),
        angular_momentum=momentum + gained,
    )


def symmetric_top(state: State, t_s: npt.ArrayLike) -> State:
    """Return the free rotation of bodies with two equal moments: two uniform turns.

    With the moments (I, I, K) and the symmetry axis e: the body turns about e, in its own frame,
    at (1/K - 1/I) L_e, and all of it about the angular momentum, in the world frame, at L / I
    (Landau & Lifshitz, Mechanics, section 33).

    Raises:
        ValueError: when a body has no two equal moments.
    """
    t = _column(state, t_s)
    order = state.body.axes_by_inertia
    low, middle, high = np.take_along_axis(state.body.inertia, order, axis=1).T
    oblate = middle - low < high - middle
    if (np.minimum(middle - low, high - middle) > _EQUAL_INERTIA * high).any():
        raise ValueError("symmetric_top needs two equal moments; use asymmetric_top or reference")
    axis = np.eye(3)[np.where(oblate, order[:, 2], order[:, 0])]
    along = np.where(oblate, high, low)
    across = middle
    momentum = state.angular_momentum
    own = dot(axis, quaternion.rotate_inverse(state.rotation, momentum))
    roll = ((1.0 / along - 1.0 / across) * own)[:, None] * t * axis
    precession = momentum / across[:, None] * t
    q = quaternion.multiply(quaternion.from_rotation_vector(precession), state.orientation)
    return state.recalculate(
        orientation=quaternion.multiply(q, quaternion.from_rotation_vector(roll))
    )


def middle_axis_growth_rate(inertia: npt.ArrayLike, spin_rad_s: float) -> float:
    """Return the rate, 1/s, at which a wobble about the axis of middle inertia grows at first.

    w sqrt((I2 - I1)(I3 - I2) / (I1 I3)) for I1 <= I2 <= I3: Euler's equations linearised at the
    steady spin (Landau & Lifshitz, Mechanics, section 37).

    Args:
        inertia: (3,) principal moments in any order, kg m^2.
        spin_rad_s: w.

    Raises:
        ValueError: when there are not three positive moments, or the spin is no number.
    """
    moments, spin = positive("inertia", inertia), abs(finite_number("spin_rad_s", spin_rad_s))
    if moments.shape != (3,):
        raise ValueError(f"inertia must have shape (3,), got {moments.shape}")
    low, middle, high = np.sort(moments)
    # Two roots, since a product of moments may be out of range.
    return float(spin * np.sqrt((middle - low) / low) * np.sqrt((high - middle) / high))


def asymmetric_top(state: State, t_s: npt.ArrayLike) -> State:
    """Return the free rotation of bodies with three different moments, in closed form.

    Angular velocity in the body frame by Jacobi's elliptic functions (Landau & Lifshitz, Mechanics,
    section 37), orientation by the Euler angles of the angular momentum, of which the precession
    takes an elliptic integral of the third kind, in Carlson's form (Carlson 1995, "Numerical
    computation of real or complex elliptic integrals"). No integration, so no error that grows
    faster than the angles themselves.

    Measured against 30 digits: 3e-14 rad after 60 rad of tumbling. Near the separatrix (the tumble
    about the middle axis that never returns) the motion magnifies a rounding of its beginning by up
    to 1/(1 - m), m being the elliptic parameter, and every rounding of an integration on the way.

    Raises:
        ValueError: when two moments are equal to 1e-6, or 1 - m is under 1e-10.
    """
    t = _column(state, t_s)[:, 0]
    top = _Top.of(state)
    begin, end = top.at(np.zeros_like(t)), top.at(t)
    # The Euler angles' frame has the angular momentum upright; only the turn since 0 counts.
    turn = quaternion.multiply(quaternion.conjugate(begin), end)
    back = np.empty_like(turn)
    back[:, 0] = turn[:, 0]
    np.put_along_axis(back[:, 1:], top.axes, turn[:, 1:] * top.signs, axis=1)
    return state.recalculate(orientation=quaternion.multiply(state.rotation, back))


class _Top(NamedTuple):
    """Free asymmetric tops in axes of their own, ordered so that omega_3 never changes sign.

    omega = (a cn u, a slope sn u, c dn u) with u = rate * t + u_0. Arrays are (N,) unless said.

    Time and inertia are in units of powers of two in which spin and inertia are about 1, so that
    their squares are floats for bodies of any size that spin at any speed.
    """

    time_unit: npt.NDArray[np.intc]
    """e: a second is 2^e of these."""

    axes: npt.NDArray[np.intp]
    """(N, 3): the body axis that each of these axes is."""
    signs: Float64
    """(N, 3): -1 where an axis is reversed, which makes an odd exchange of axes a rotation."""
    inertia: Float64
    """(N, 3), the second between the other two."""
    momentum: Float64
    """Length of the angular momentum."""
    a: Float64
    slope: Float64
    c: Float64
    rate: Float64
    complement: Float64
    """1 - m, m being the elliptic parameter."""
    amplitude: Float64
    """am(u_0)."""

    @classmethod
    def of(cls, state: State) -> _Top:
        """Return the tops of a state's bodies.

        Raises:
            ValueError: as `asymmetric_top`.
        """
        momentum = quaternion.rotate_inverse(state.rotation, state.angular_momentum)
        spin = momentum * state.body.inverse_inertia
        of_time, of_inertia = scale_exponent(spin), scale_exponent(state.body.inertia)
        spin = np.ldexp(spin, -of_time[:, None])
        moments = np.ldexp(state.body.inertia, -of_inertia[:, None])
        axes, signs = _upright_axes(state.body.axes_by_inertia, moments, spin)
        w1, w2, w3 = (np.take_along_axis(spin, axes, axis=1) * signs).T
        inertia = np.take_along_axis(moments, axes, axis=1)
        i1, i2, i3 = inertia.T
        # Amplitudes as sums of terms of one sign, so that nothing cancels.
        a = np.sqrt(w1**2 + w2**2 * i2 * (i2 - i3) / (i1 * (i1 - i3)))
        c = np.copysign(np.sqrt(w3**2 + w2**2 * i2 * (i2 - i1) / (i3 * (i3 - i1))), w3)
        rate = np.abs(c) * np.sqrt((i3 - i2) * (i3 - i1) / (i1 * i2))
        slope = np.sqrt(i1 * (i1 - i3) / (i2 * (i2 - i3))) * np.sign(i3 - i1) * np.sign(c)
        above = w3**2 * i3 * (i3 - i2) - w1**2 * i1 * (i2 - i1)
        complement = np.divide(above, i3 * (i3 - i2) * c**2, out=np.ones_like(c), where=c != 0.0)
        # A steady spin about the third axis has m = 0, which rounding may put below.
        complement = np.minimum(complement, 1.0)
        if (complement < _SEPARATRIX).any():
            raise ValueError(
                "asymmetric_top has no periodic answer on the separatrix (spin about the middle "
                f"axis): 1 - m is {complement.min():.1e}, below {_SEPARATRIX}; use reference"
            )
        amplitude = np.arctan2(np.divide(w2, slope, out=np.zeros_like(w2), where=c != 0.0), w1)
        size = np.ldexp(quaternion.norm(momentum), -of_time - of_inertia)
        return cls(of_time, axes, signs, inertia, size, a, slope, c, rate, complement, amplitude)

    def at(self, t: Float64) -> Float64:
        """Return the orientations at ``t`` (N,) s, body to a frame with the momentum along z."""
        t = np.ldexp(t, self.time_unit)
        i1, i2, i3 = self.inertia.T
        parameter, half_period = 1.0 - self.complement, 2.0 * ellipkm1(self.complement)
        u = self.rate * t + ellipkinc(self.amplitude, parameter)
        turns = np.rint(u / half_period)
        sn, cn, dn, am = ellipj(u - half_period * turns, parameter)
        sn, cn = _alternating(turns) * sn, _alternating(turns) * cn
        characteristic = i3 * (i2 - i1) / (i1 * (i3 - i2))
        passed = _third_kind(characteristic, am, self.complement)
        quarter = np.full_like(am, np.pi / 2.0)
        passed += 2.0 * turns * _third_kind(characteristic, quarter, self.complement)
        time_like = np.divide(passed, self.rate, out=np.zeros_like(u), where=self.rate > 0.0)
        precession = self.momentum * (t / i3 + (i3 - i1) / (i1 * i3) * time_like)
        across = self.a * np.hypot(i1 * cn, i2 * self.slope * sn)
        nutation = np.arctan2(across, i3 * self.c * dn)
        # Without the amplitude a: it keeps its limit when there is no wobble.
        proper = np.arctan2(i1 * cn, i2 * self.slope * sn)
        tilted = quaternion.multiply(_about(0, nutation), _about(2, proper))
        return quaternion.multiply(_about(2, precession), tilted)


def _upright_axes(
    order: npt.NDArray[np.intp], inertia: Float64, spin: Float64
) -> tuple[npt.NDArray[np.intp], Float64]:
    """Return the axes and signs of `_Top` for body-frame angular velocities (N, 3)."""
    low, middle, high = np.take_along_axis(inertia, order, axis=1).T
    if (np.minimum(middle - low, high - middle) < _DISTINCT_INERTIA * high).any():
        raise ValueError(
            "asymmetric_top needs three different moments; use symmetric_top or reference"
        )
    w_low, _, w_high = np.take_along_axis(spin, order, axis=1).T
    around_high = high * (high - middle) * w_high**2 >= low * (middle - low) * w_low**2
    axes = np.where(around_high[:, None], order, order[:, ::-1])
    first, second, third = axes.T
    signs = np.ones(axes.shape)
    signs[:, 0] = np.sign((second - first) * (third - first) * (third - second))
    return axes, signs


def _alternating(turns: Float64) -> Float64:
    """Return (-1)^turns."""
    return 1.0 - 2.0 * np.mod(turns, 2.0)


def _third_kind(characteristic: Float64, amplitude: Float64, complement: Float64) -> Float64:
    """Return the integral of du / (1 + characteristic sn^2 u) from 0 to where am u = amplitude.

    For an amplitude within a quarter turn of 0 (Carlson 1995, eq. 4.7, with n = -characteristic).
    """
    sine, cosine = np.sin(amplitude), np.cos(amplitude)
    x, y = cosine**2, cosine**2 + complement * sine**2
    weight = characteristic / 3.0 * sine**3
    integral: Float64 = sine * elliprf(x, y, 1.0) - weight * elliprj(
        x, y, 1.0, 1.0 + characteristic * sine**2
    )
    return integral


def _about(axis: int, angle_rad: Float64) -> Float64:
    """Return the rotations about a coordinate axis, (N, 4)."""
    q = np.zeros((*angle_rad.shape, 4))
    q[..., 0] = np.cos(0.5 * angle_rad)
    q[..., 1 + axis] = np.sin(0.5 * angle_rad)
    return q


# --- everything else -------------------------------------------------------------------------


def reference(
    state: State,
    t_s: float,
    load: Load = none,
    *,
    held: PiecewiseConstantForce | None = None,
    start_s: float = 0.0,
) -> State:
    """Return the motion under any load, by Dormand & Prince's eighth order method done twice.

    The first pass picks its steps for a relative error of 1e-13 a step, which is as small as the
    method's own estimate can be trusted; their sum over 90 rad of tumbling was measured as 4e-11
    rad. So each step is done again in two halves, which divides that by 2^8. Measured against
    `asymmetric_top` what remains is under 1e-12 rad, but for motions near the separatrix, where
    float64's own rounding grows (6e-11 rad after 10 s at 1 - m = 1.4e-4).

    Independent of the package's integrators, but not of its derivative function. Where the held
    force jumps it starts anew, so that no step straddles a jump. All bodies share their steps.

    Args:
        state: N bodies at ``start_s``.
        t_s: duration, s, not negative.
        load: what acts, smooth in time.
        held: a force that changes by jumps.
        start_s: time of ``state``.

    Raises:
        ValueError: a duration that is negative or no finite number, a load that does not fit the
            bodies, or a motion the method cannot follow.
    """
    duration, start_s = finite_number("t_s", t_s), finite_number("start_s", start_s)
    non_negative("t_s", duration)
    end = start_s + duration
    switches = [] if held is None else [float(t) for t in held.switches_s if start_s < t < end]
    for begin, stop in itertools.pairwise([start_s, *switches, end]):
        acting = load if held is None else total(load, held.held(begin))
        if stop > begin:
            state = _integrated(state, derivative_of(acting), begin, stop)
    return state


def _integrated(state: State, derivative: DerivativeFunction, begin: float, end: float) -> State:
    """Return the state at ``end``, the load being smooth all the way from ``begin``."""

    def unpacked(y: Float64) -> State:
        x, p, q, momentum = np.split(y.reshape(state.count, 13), [3, 6, 10], axis=1)
        return state.recalculate(
            position=x, momentum=p, orientation=q, angular_momentum=momentum, renormalise=False
        )

    def slope(t: float, y: Float64) -> Float64:
        rate = derivative(unpacked(y), t)
        return np.hstack([rate.velocity, rate.force, rate.spin, rate.torque]).ravel()

    primary = (state.position, state.momentum, state.orientation, state.angular_momentum)
    y = np.hstack(primary).ravel()
    # scipy weighs the mean over all bodies, so a quiet body would hide a fast one.
    rtol = max(1e-13 / np.sqrt(state.count), _LEAST_RTOL)
    coarse = DOP853(slope, begin, y, end, rtol=rtol, atol=1e-2 * rtol)
    while coarse.status == "running":
        _step(coarse)
        half = (coarse.t - coarse.t_old) / 2.0
        fine = DOP853(slope, coarse.t_old, y, coarse.t, first_step=half, max_step=half, atol=np.inf)
        while fine.status == "running":
            _step(fine)
        y = fine.y
    final = unpacked(y)
    return final.recalculate(orientation=final.orientation)


def _step(solver: DOP853) -> None:
    """Take one accepted step.

    Raises:
        ValueError: when there is none, as after a force that is infinite or jumps.
    """
    message = solver.step()
    if solver.status == "failed":
        raise ValueError(f"reference stopped at t = {solver.t} s: {message}")


def _column(state: State, t_s: npt.ArrayLike) -> Float64:
    """Return the times as a column, (N, 1)."""
    return scalars("t_s", t_s, state.count)[:, None]
