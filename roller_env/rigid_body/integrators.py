"""Methods that carry a state over a time step, behind one interface.

Every method takes the derivative function and gives the next state; its ``name``, its ``order`` and
its ``evaluations`` (calls of the derivative a step) are data, so that an experiment can loop over
`INTEGRATORS`. All bodies of a state advance together, in the same calls.

| name | order | evaluations | orientation advances by |
|---|---|---|---|
| ``explicit_euler`` | 1 | 1 | adding spin |
| ``semi_implicit_euler`` | 1 | 1 | turning at the new momentum |
| ``rk4`` (the report's) | 4 | 4 | adding spins, renormalising after each sum |
| ``lie_rk4`` | 4 | 4 | turning, with the Munthe-Kaas correction |
| ``buss2`` | 2 | 2 | turning once, by Buss's augmented mean of omega |
| ``buss3`` | 3 | 3 | turning once, by Buss's third order mean |
| ``splitting2`` | 2 | 2 | exact turns about two body axes and the angular momentum |
| ``splitting4`` | 4 | 20 | five of those |

Since angular momentum is a primary value in the world frame, **every** method here conserves it to
the last bit while no torque acts. They differ in attitude and in energy: the splittings keep the
energy error bounded for good, the others let it grow.

The force must be smooth within a step for a method to have its order. What changes by jumps is
given as ``held`` to `advance` and `trajectory`, which sample it once at the beginning of each step.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from roller_env.rigid_body import quaternion
from roller_env.rigid_body.arrays import Float64, cross, dot, finite_number, positive_time, whole
from roller_env.rigid_body.forces import (
    Derivative,
    DerivativeFunction,
    Load,
    PiecewiseConstantForce,
    derivative_of,
    none,
    total,
)
from roller_env.rigid_body.state import State


class Integrator(Protocol):
    """A one-step method."""

    @property
    def name(self) -> str:
        """Its key in `INTEGRATORS`."""
        ...

    @property
    def order(self) -> int:
        """Power of dt with which the error after a fixed time falls."""
        ...

    @property
    def evaluations(self) -> int:
        """Calls of the derivative function in a step."""
        ...

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """Return the state at t + dt from that at t, both s.

        Raises:
            ValueError: when dt is not positive and finite.
        """
        ...


def _turned(rotation_vector: Float64, q: Float64) -> Float64:
    """Return q turned by a world-frame rotation vector."""
    return quaternion.multiply(quaternion.from_rotation_vector(rotation_vector), q)


@dataclass(frozen=True)
class ExplicitEuler:
    """All four primary values go on along their present rates.

    At constant spin it multiplies the quaternion's norm by sqrt(1 + (dt w / 2)^2) a step, and it
    feeds energy into every oscillation, at any dt.
    """

    renormalise: bool = True
    name: str = "explicit_euler"
    order: int = 1
    evaluations: int = 1

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        return _added(state, derivative(state, t), dt, renormalise=self.renormalise)


def _added(state: State, rate: Derivative, dt: float, *, renormalise: bool) -> State:
    """Return ``state`` with ``dt`` times the rates added to its primary values."""
    return state.recalculate(
        position=state.position + dt * rate.velocity,
        momentum=state.momentum + dt * rate.force,
        orientation=state.orientation + dt * rate.spin,
        angular_momentum=state.angular_momentum + dt * rate.torque,
        renormalise=renormalise,
    )


@dataclass(frozen=True)
class SemiImplicitEuler:
    """Momenta first; then the positions, at the new momenta. What most game engines do.

    Symplectic for forces that depend on position alone. The orientation turns by the rotation
    vector dt * omega, omega being the new momentum over the inertia in the old orientation.
    """

    name: str = "semi_implicit_euler"
    order: int = 1
    evaluations: int = 1

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        rate = derivative(state, t)
        kicked = state.recalculate(
            momentum=state.momentum + dt * rate.force,
            angular_momentum=state.angular_momentum + dt * rate.torque,
        )
        return kicked.recalculate(
            position=state.position + dt * kicked.velocity,
            orientation=_turned(dt * kicked.angular_velocity, state.orientation),
        )


@dataclass(frozen=True)
class RungeKutta4:
    """The report's method: classical fourth order Runge-Kutta, quaternions added like vectors.

    "Recalculate whenever primary values change" is the report's rule, and its ``recalculate``
    renormalises; so the points inside a step are renormalised like the one at its end. At constant
    spin w the orientation is then late by T w (dt w)^4 / 5120 rad after a time T, and the last sum
    of a step has lost 5/8 (dt w / 2)^6 / 144 of its norm.

    ``renormalise_stages=False`` renormalises once, at the end of the step: the textbook's method on
    four numbers. Same order; late by T w (dt w)^4 / 1920, a loss of (dt w / 2)^6 / 144, and if the
    end is not renormalised either (``renormalise=False``) it diverges above dt w = 4 sqrt 2.

    On a cube angular velocity is momentum over a number. On any other body it also depends on the
    orientation, so an error of attitude comes back as an error of spin: for a tumbling box of 0.1 x
    0.4 x 0.9 m the same Runge-Kutta on Euler's equations in the body frame, which is what MuJoCo
    has, was measured 27 to 500 times as accurate. It does not conserve angular momentum.

    Source: Kutta 1901; the report's use of it is Fiedler 2004, "Physics in 3D".
    """

    renormalise: bool = True
    renormalise_stages: bool = True
    name: str = "rk4"
    order: int = 4
    evaluations: int = 4

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        half, stages = 0.5 * dt, self.renormalise_stages
        k1 = derivative(state, t)
        k2 = derivative(_added(state, k1, half, renormalise=stages), t + half)
        k3 = derivative(_added(state, k2, half, renormalise=stages), t + half)
        k4 = derivative(_added(state, k3, dt, renormalise=stages), t + dt)
        return state.recalculate(
            position=state.position
            + dt * _mean(k1.velocity, k2.velocity, k3.velocity, k4.velocity),
            momentum=state.momentum + dt * _mean(k1.force, k2.force, k3.force, k4.force),
            orientation=state.orientation + dt * _mean(k1.spin, k2.spin, k3.spin, k4.spin),
            angular_momentum=state.angular_momentum
            + dt * _mean(k1.torque, k2.torque, k3.torque, k4.torque),
            renormalise=self.renormalise,
        )


def _mean(k1: Float64, k2: Float64, k3: Float64, k4: Float64) -> Float64:
    """Return Runge and Kutta's mean of four rates."""
    return (k1 + 2.0 * (k2 + k3) + k4) / 6.0


@dataclass(frozen=True)
class LieRungeKutta4:
    """Runge-Kutta-Munthe-Kaas of order four: the stages are rotations, never sums of quaternions.

    Over a step the orientation is exp(u) q, and u obeys u' = dexp^-1_u(omega), a vector equation
    which the classical tableau integrates; the inverse of dexp is cut after the term that order
    four needs. Constant spin comes out exactly, at any dt.

    Source: Munthe-Kaas 1998, "Runge-Kutta methods on Lie groups", BIT 38.
    """

    name: str = "lie_rk4"
    order: int = 4
    evaluations: int = 4

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        half = 0.5 * dt
        k1 = derivative(state, t)
        r1 = k1.angular_velocity
        k2 = derivative(_moved(state, k1, half * r1, half), t + half)
        r2 = _dexp_inverse(half * r1, k2.angular_velocity)
        k3 = derivative(_moved(state, k2, half * r2, half), t + half)
        r3 = _dexp_inverse(half * r2, k3.angular_velocity)
        k4 = derivative(_moved(state, k3, dt * r3, dt), t + dt)
        r4 = _dexp_inverse(dt * r3, k4.angular_velocity)
        return state.recalculate(
            position=state.position
            + dt * _mean(k1.velocity, k2.velocity, k3.velocity, k4.velocity),
            momentum=state.momentum + dt * _mean(k1.force, k2.force, k3.force, k4.force),
            orientation=_turned(dt * _mean(r1, r2, r3, r4), state.orientation),
            angular_momentum=state.angular_momentum
            + dt * _mean(k1.torque, k2.torque, k3.torque, k4.torque),
        )


def _moved(state: State, rate: Derivative, turn: Float64, dt: float) -> State:
    """Return ``state`` with dt times the rates added, and turned by a rotation vector."""
    return state.recalculate(
        position=state.position + dt * rate.velocity,
        momentum=state.momentum + dt * rate.force,
        orientation=_turned(turn, state.orientation),
        angular_momentum=state.angular_momentum + dt * rate.torque,
    )


def _dexp_inverse(u: Float64, omega: Float64) -> Float64:
    """Return omega - u x omega / 2 + u x (u x omega) / 12, the series to the order four."""
    first = cross(u, omega)
    return omega - 0.5 * first + cross(u, first) / 12.0


@dataclass(frozen=True)
class BussSecondOrder:
    """Buss's augmented second order method: one rotation a step, by a corrected mean of omega.

    The rotation vector is dt (omega + dt/2 alpha + dt^2/12 alpha x omega), with the angular
    acceleration alpha = I^-1 (torque - omega x L). The last term is what the turning of omega
    contributes in the next order. Measured on random free boxes it does not pay by itself (the
    plain dt (omega + dt/2 alpha) came out 1.5 times as accurate); it does in `BussThirdOrder`.

    The momenta take the mean of the forces at both ends of the step, the second evaluated at the
    predicted state (Heun 1900), so that the order holds under forces as well.

    Source: Buss 2000, "Accurate and Efficient Simulation of Rigid-Body Rotations", J. Comput.
    Phys. 164. The paper is about free bodies; the treatment of forces is ours.
    """

    name: str = "buss2"
    order: int = 2
    evaluations: int = 2

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        now = derivative(state, t)
        predicted = _buss_predicted(state, now, dt, now.force, now.torque)
        then = derivative(predicted, t + dt)
        return predicted.recalculate(
            momentum=state.momentum + 0.5 * dt * (now.force + then.force),
            angular_momentum=state.angular_momentum + 0.5 * dt * (now.torque + then.torque),
        )


@dataclass(frozen=True)
class BussThirdOrder:
    """Buss's third order method: one rotation a step, by omega and its first two derivatives.

    The rotation vector is dt (omega + dt/2 omega' + dt^2/6 omega'' + dt^2/12 omega' x omega). The
    forces are evaluated at the beginning, the middle and the end, which gives the torque's rate
    that omega'' needs, and the momenta by Kutta's third order rule.

    Source: Buss 2000, as `BussSecondOrder`; Kutta 1901; the treatment of forces is ours.
    """

    name: str = "buss3"
    order: int = 3
    evaluations: int = 3

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        half = 0.5 * dt
        k1 = derivative(state, t)
        k2 = derivative(_buss_predicted(state, k1, half, k1.force, k1.torque), t + half)
        force, torque = 2.0 * k2.force - k1.force, 2.0 * k2.torque - k1.torque
        k3 = derivative(_buss_predicted(state, k1, dt, force, torque), t + dt)
        torque_rate = (4.0 * k2.torque - 3.0 * k1.torque - k3.torque) / dt
        turn = _buss_augmented(state, k1, dt)
        turn += dt**3 / 6.0 * _second_derivative_of_omega(state, k1, torque_rate)
        return state.recalculate(
            position=state.position + dt * _simpson(k1.velocity, k2.velocity, k3.velocity),
            momentum=state.momentum + dt * _simpson(k1.force, k2.force, k3.force),
            orientation=_turned(turn, state.orientation),
            angular_momentum=state.angular_momentum
            + dt * _simpson(k1.torque, k2.torque, k3.torque),
        )


def _simpson(k1: Float64, k2: Float64, k3: Float64) -> Float64:
    """Return Kutta's mean of the rates at the beginning, the middle and the end of a step."""
    return (k1 + 4.0 * k2 + k3) / 6.0


def _gyroscopic(state: State, rate: Derivative) -> Float64:
    """Return torque - omega x L: what makes omega change."""
    return rate.torque - cross(rate.angular_velocity, state.angular_momentum)


def _buss_augmented(state: State, rate: Derivative, dt: float) -> Float64:
    """Return the rotation vector of Buss's augmented second order method."""
    omega = rate.angular_velocity
    alpha = state.over_inertia(_gyroscopic(state, rate))
    return dt * (omega + 0.5 * dt * alpha + dt**2 / 12.0 * cross(alpha, omega))


def _buss_predicted(
    state: State, rate: Derivative, dt: float, force: Float64, torque: Float64
) -> State:
    """Return the state after dt: the pose from the present rates, the momenta from mean forces."""
    acceleration = rate.force * state.body.inverse_mass[:, None]
    return state.recalculate(
        position=state.position + dt * (rate.velocity + 0.5 * dt * acceleration),
        momentum=state.momentum + dt * force,
        orientation=_turned(_buss_augmented(state, rate, dt), state.orientation),
        angular_momentum=state.angular_momentum + dt * torque,
    )


def _second_derivative_of_omega(state: State, rate: Derivative, torque_rate: Float64) -> Float64:
    """Return omega'': the derivative of I^-1 (torque - omega x L), the inertia turning as well."""
    omega, gyroscopic = rate.angular_velocity, _gyroscopic(state, rate)
    alpha = state.over_inertia(gyroscopic)
    change = torque_rate - cross(alpha, state.angular_momentum) - cross(omega, rate.torque)
    return cross(omega, alpha) + state.over_inertia(change - cross(omega, gyroscopic))


@dataclass(frozen=True)
class Splitting:
    """Symplectic splitting: half a free motion, the whole push, the other half mirrored.

    The energy of rotation is split into L^2 / (2 I_m), m being the axis of middle inertia, whose
    motion is a turn about the angular momentum, and two terms in one body component of L each,
    whose motions are turns about those body axes. Every part is solved exactly, so the whole is a
    rotation and conserves momentum; being symmetric and symplectic it has no drift of the energy
    of a free body, and a cube or a symmetric top come out exactly at any dt. The first part
    commutes with the others (L^2 is a Casimir), so the method's error is that of the other two.

    Forces push at the middle of the step with pose and time frozen. Since they may depend on the
    momenta (drag), the push is itself a small integration, explicit in the momenta.

    ``fractions`` compose several such steps to one of higher order.

    Source: Touma & Wisdom 1994, "Lie-Poisson integrators for rigid body dynamics in the solar
    system"; Fasso 2003, "Comparison of splitting algorithms for the rigid body"; the composition
    is Suzuki 1990, "Fractal decomposition of exponential operators".
    """

    name: str
    order: int
    evaluations: int
    fractions: tuple[float, ...]
    push: Callable[[State, DerivativeFunction, float, float], State]

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        begun = t
        for fraction in self.fractions:
            part = fraction * dt
            middle = _drifted(state, 0.5 * part, mirrored=False)
            pushed = self.push(middle, derivative, begun + 0.5 * part, part)
            state = _drifted(pushed, 0.5 * part, mirrored=True)
            begun += part
        return state


def _drifted(state: State, dt: float, *, mirrored: bool) -> State:
    """Return ``state`` after the free motion's parts one after the other, or in reverse order."""
    body, momentum = state.body, state.angular_momentum
    order = body.axes_by_inertia
    ranked = np.take_along_axis(body.inverse_inertia, order, axis=1)
    q = _turned(dt * ranked[:, 1:2] * momentum, state.orientation)
    if not body.isotropic:
        for rank in (2, 0) if mirrored else (0, 2):
            axis = np.eye(3)[order[:, rank]]
            along = dot(axis, quaternion.rotate_inverse(q, momentum))
            angle = dt * (ranked[:, rank] - ranked[:, 1]) * along
            turn = quaternion.from_rotation_vector(angle[:, None] * axis)
            q = quaternion.multiply(q, turn)
    return state.recalculate(position=state.position + dt * state.velocity, orientation=q)


def _pushed(state: State, rate: Derivative, dt: float) -> State:
    """Return ``state`` with only its momenta moved along the rates."""
    return state.recalculate(
        momentum=state.momentum + dt * rate.force,
        angular_momentum=state.angular_momentum + dt * rate.torque,
    )


def _push_midpoint(state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
    """Return ``state`` pushed for dt, pose and time frozen, by the midpoint rule."""
    halfway = _pushed(state, derivative(state, t), 0.5 * dt)
    return _pushed(state, derivative(halfway, t), dt)


def _push_runge_kutta(state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
    """Return ``state`` pushed for dt, pose and time frozen, by classical Runge-Kutta."""
    k1 = derivative(state, t)
    k2 = derivative(_pushed(state, k1, 0.5 * dt), t)
    k3 = derivative(_pushed(state, k2, 0.5 * dt), t)
    k4 = derivative(_pushed(state, k3, dt), t)
    return state.recalculate(
        momentum=state.momentum + dt * _mean(k1.force, k2.force, k3.force, k4.force),
        angular_momentum=state.angular_momentum
        + dt * _mean(k1.torque, k2.torque, k3.torque, k4.torque),
    )


_SUZUKI: Final = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
"""Outer fractions of Suzuki's fourth order composition; the middle one goes back in time."""

EXPLICIT_EULER: Final = ExplicitEuler()
SEMI_IMPLICIT_EULER: Final = SemiImplicitEuler()
RK4: Final = RungeKutta4()
LIE_RK4: Final = LieRungeKutta4()
BUSS2: Final = BussSecondOrder()
BUSS3: Final = BussThirdOrder()
SPLITTING2: Final = Splitting("splitting2", 2, 2, (1.0,), _push_midpoint)
SPLITTING4: Final = Splitting(
    "splitting4",
    4,
    20,
    (_SUZUKI, _SUZUKI, 1.0 - 4.0 * _SUZUKI, _SUZUKI, _SUZUKI),
    _push_runge_kutta,
)

INTEGRATORS: Final[Mapping[str, Integrator]] = {
    method.name: method
    for method in (
        EXPLICIT_EULER,
        SEMI_IMPLICIT_EULER,
        RK4,
        LIE_RK4,
        BUSS2,
        BUSS3,
        SPLITTING2,
        SPLITTING4,
    )
}
"""Every method by its name."""


def integrator(name: str) -> Integrator:
    """Return the method called ``name``.

    Raises:
        ValueError: when there is none, with the nearest name.
    """
    if name not in INTEGRATORS:
        near = difflib.get_close_matches(name, INTEGRATORS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"no integrator {name!r}: there are {sorted(INTEGRATORS)}{hint}")
    return INTEGRATORS[name]


def trajectory(
    state: State,
    method: Integrator,
    dt: float,
    steps: int,
    *,
    load: Load = none,
    held: PiecewiseConstantForce | None = None,
    start_s: float = 0.0,
) -> Iterator[State]:
    """Yield the state after each of ``steps`` steps of ``dt`` seconds.

    Args:
        state: where it begins; not itself yielded.
        method: an integrator.
        dt: s.
        steps: how many.
        load: what acts, smooth in time.
        held: a force that changes by jumps, sampled at the beginning of each step and held.
        start_s: time of ``state``. Step k begins at start_s + k dt: rounding does not pile up.

    Raises:
        ValueError: when dt is not positive and finite, ``steps`` is negative or no whole
            number, ``start_s`` is no finite number, or a load does not fit the bodies.
    """
    positive_time("dt", dt)
    steps, start_s = whole("steps", steps, 0), finite_number("start_s", start_s)
    derivative = derivative_of(load)
    for k in range(steps):
        t = start_s + k * dt
        if held is not None:
            derivative = derivative_of(total(load, held.held(t)))
        state = method.step(state, derivative, t, dt)
        yield state


def advance(
    state: State,
    method: Integrator,
    dt: float,
    steps: int,
    *,
    load: Load = none,
    held: PiecewiseConstantForce | None = None,
    start_s: float = 0.0,
) -> State:
    """Return the state after ``steps`` steps; arguments and errors as `trajectory`."""
    for reached in trajectory(state, method, dt, steps, load=load, held=held, start_s=start_s):
        state = reached
    return state
