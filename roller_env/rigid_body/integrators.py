"""Methods that carry a state over a time step, behind one interface.

Every method takes the derivative function and gives the next state; its ``name``, its ``order`` and
its ``evaluations`` (calls of the derivative a step) are data, so that an experiment can loop over
`INTEGRATORS`. All bodies of a state advance together, in the same calls. What the
methods do is compiled (`kernels`); under built-in loads whole runs are, too.

| name | order | evaluations | orientation advances by |
|---|---|---|---|
| ``explicit_euler`` | 1 | 1 | adding spin |
| ``semi_implicit_euler`` | 1 | 1 | turning at the new momentum |
| ``rk4`` (the report's) | 4 | 4 | adding spins, renormalising after each sum |
| ``rk4_body`` | 4 | 4 | as ``rk4``, momentum in body axes |
| ``lie_rk4`` | 4 | 4 | turning, with the Munthe-Kaas correction |
| ``buss2`` | 2 | 2 | turning once, by Buss's augmented mean of omega |
| ``buss3`` | 3 | 3 | turning once, by Buss's third order mean |
| ``splitting2`` | 2 | 2 | exact turns about two body axes and the angular momentum |
| ``splitting4`` | 4 | 20 | five of those |

Since angular momentum is a primary value in the world frame, **every** method here but ``rk4_body``
conserves it to the last bit while no torque acts. They differ in attitude and in energy: the
splittings keep the energy error bounded for good, the others let it grow.

The force must be smooth within a step for a method to have its order. What changes by jumps is
given as ``held`` to `advance` and `trajectory`, which sample it once at the beginning of each step.
"""

from __future__ import annotations

import difflib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from roller_env.rigid_body import kernels
from roller_env.rigid_body.arrays import finite_number, positive_time, whole
from roller_env.rigid_body.forces import (
    BuiltInLoad,
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


class CompiledMethod(ABC):
    """A method of `kernels`: what it is called, and the two ways to run it."""

    name: str
    order: int
    evaluations: int

    @property
    @abstractmethod
    def plan(self) -> kernels.Plan:
        """What compiled loops know it by."""

    @property
    def offsets(self) -> tuple[float, ...]:
        """When the load is evaluated, in parts of a step: one a stage."""
        return (0.0, 0.5, 0.5, 1.0)

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`: stage by stage, with whatever Python says of the forces."""
        dt, plan, bodies = positive_time("dt", dt), self.plan, state.body.constants
        body_axes = plan.kind == kernels.RK4_BODY
        points, rates = kernels.workspace(state.count, plan.stages)
        points[:, 0] = state.rows(body_axes=body_axes)
        for s, offset in enumerate(self.offsets):
            kernels.lay_points(bodies, plan, s, dt, points, rates)
            unit = state.normalised if s == 0 else plan.renormalise_points
            point = state.from_rows(points[:, s], normalised=unit, body_axes=body_axes)
            wrench = derivative(point, t + offset * dt).wrench
            kernels.take_rates(bodies, plan, s, dt, unit, points, rates, *wrench)
        kernels.lay_points(bodies, plan, plan.stages, dt, points, rates)
        return state.from_rows(points[:, -1], normalised=plan.renormalise, body_axes=body_axes)

    def advanced(self, state: State, load: BuiltInLoad, dt: float, steps: int) -> State:
        """Return the state after ``steps`` steps of ``dt`` s under built-in loads, all compiled."""
        plan, rows = self.plan, state.rows(body_axes=self.plan.kind == kernels.RK4_BODY)
        kernels.advance_bodies(
            state.body.constants, load.terms(state.count), plan, dt, steps, state.normalised, rows
        )
        return state.from_rows(
            rows, normalised=plan.renormalise, body_axes=plan.kind == kernels.RK4_BODY
        )


def _plan(kind: int, stages: int, *, once: bool = True, within: bool = True) -> kernels.Plan:
    return kernels.Plan(kind, stages, once, within, _WHOLE)


_WHOLE: Final = np.ones(1)


@dataclass(frozen=True)
class ExplicitEuler(CompiledMethod):
    """All four primary values go on along their present rates.

    At constant spin it multiplies the quaternion's norm by sqrt(1 + (dt w / 2)^2) a step, and it
    feeds energy into every oscillation, at any dt.
    """

    renormalise: bool = True
    name: str = "explicit_euler"
    order: int = 1
    evaluations: int = 1
    offsets = (0.0,)

    @property
    def plan(self) -> kernels.Plan:
        """See `CompiledMethod.plan`."""
        return _plan(kernels.EXPLICIT_EULER, 1, once=self.renormalise)


@dataclass(frozen=True)
class SemiImplicitEuler(CompiledMethod):
    """Momenta first; then the positions, at the new momenta. What most game engines do.

    Symplectic for forces that depend on position alone. The orientation turns by the rotation
    vector dt * omega, omega being the new momentum over the inertia in the old orientation.
    """

    name: str = "semi_implicit_euler"
    order: int = 1
    evaluations: int = 1
    offsets = (0.0,)

    @property
    def plan(self) -> kernels.Plan:
        """See `CompiledMethod.plan`."""
        return _plan(kernels.SEMI_IMPLICIT_EULER, 1)


@dataclass(frozen=True)
class RungeKutta4(CompiledMethod):
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

    @property
    def plan(self) -> kernels.Plan:
        """See `CompiledMethod.plan`."""
        once, within = self.renormalise, self.renormalise_stages
        return _plan(kernels.RK4, 4, once=once, within=within)


@dataclass(frozen=True)
class BodyAxesRungeKutta4(CompiledMethod):
    """The report's method with the angular momentum in **body** axes: Euler's equations.

    There the inertia stands still, so the angular velocity follows from the momentum without the
    attitude, and an error of attitude does not come back as an error of spin: what MuJoCo does for
    a free joint, with momentum in the place of velocity. The price is that the angular momentum of
    a free body is no longer right to the last bit.

    The momentum in body axes is carried from step to step (`State.own_momentum`): to the world's
    axes and back would round in each.

    Source: Euler 1758; Kutta 1901.
    """

    name: str = "rk4_body"
    order: int = 4
    evaluations: int = 4

    @property
    def plan(self) -> kernels.Plan:
        """See `CompiledMethod.plan`."""
        return _plan(kernels.RK4_BODY, 4)


@dataclass(frozen=True)
class LieRungeKutta4(CompiledMethod):
    """Runge-Kutta-Munthe-Kaas of order four: the stages are rotations, never sums of quaternions.

    Over a step the orientation is exp(u) q, and u obeys u' = dexp^-1_u(omega), a vector equation
    which the classical tableau integrates; the inverse of dexp is cut after the term that order
    four needs. Constant spin comes out exactly, at any dt.

    Source: Munthe-Kaas 1998, "Runge-Kutta methods on Lie groups", BIT 38.
    """

    name: str = "lie_rk4"
    order: int = 4
    evaluations: int = 4

    @property
    def plan(self) -> kernels.Plan:
        """See `CompiledMethod.plan`."""
        return _plan(kernels.LIE_RK4, 4)


@dataclass(frozen=True)
class BussSecondOrder(CompiledMethod):
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
    offsets = (0.0, 1.0)

    @property
    def plan(self) -> kernels.Plan:
        """See `CompiledMethod.plan`."""
        return _plan(kernels.BUSS2, 2)


@dataclass(frozen=True)
class BussThirdOrder(CompiledMethod):
    """Buss's third order method: one rotation a step, by omega and its first two derivatives.

    The rotation vector is dt (omega + dt/2 omega' + dt^2/6 omega'' + dt^2/12 omega' x omega). The
    forces are evaluated at the beginning, the middle and the end, which gives the torque's rate
    that omega'' needs, and the momenta by Kutta's third order rule.

    Source: Buss 2000, as `BussSecondOrder`; Kutta 1901; the treatment of forces is ours.
    """

    name: str = "buss3"
    order: int = 3
    evaluations: int = 3
    offsets = (0.0, 0.5, 1.0)

    @property
    def plan(self) -> kernels.Plan:
        """See `CompiledMethod.plan`."""
        return _plan(kernels.BUSS3, 3)


@dataclass(frozen=True)
class Splitting(CompiledMethod):
    """Symplectic splitting: half a free motion, the whole push, the other half mirrored.

    The energy of rotation is split into L^2 / (2 I_m), m being the axis of middle inertia, whose
    motion is a turn about the angular momentum, and two terms in one body component of L each,
    whose motions are turns about those body axes. Every part is solved exactly, so the whole is a
    rotation and conserves momentum; being symmetric and symplectic it has no drift of the energy
    of a free body, and a cube or a symmetric top come out exactly at any dt. The first part
    commutes with the others (L^2 is a Casimir), so the method's error is that of the other two.

    Forces push at the middle of the step with pose and time frozen. Since they may depend on the
    momenta (drag), the push is itself a small integration, explicit in the momenta.

    ``fractions`` compose several such steps to one of higher order. A push by the midpoint rule has
    two evaluations, one by the classical Runge-Kutta four.

    Source: Touma & Wisdom 1994, "Lie-Poisson integrators for rigid body dynamics in the solar
    system"; Fasso 2003, "Comparison of splitting algorithms for the rigid body"; the composition
    is Suzuki 1990, "Fractal decomposition of exponential operators".
    """

    name: str
    order: int
    evaluations: int
    fractions: tuple[float, ...]

    @property
    def plan(self) -> kernels.Plan:
        """See `CompiledMethod.plan`."""
        fractions = np.array(self.fractions)
        return kernels.Plan(kernels.SPLITTING, self.evaluations, True, True, fractions)

    @property
    def offsets(self) -> tuple[float, ...]:
        """See `CompiledMethod.offsets`: the middle of each part, the time being frozen there."""
        begun = np.cumsum((0.0, *self.fractions[:-1]))
        middles = begun + 0.5 * np.array(self.fractions)
        return tuple(np.repeat(middles, self.evaluations // len(self.fractions)).tolist())


_SUZUKI: Final = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
"""Outer fractions of Suzuki's fourth order composition; the middle one goes back in time."""

EXPLICIT_EULER: Final = ExplicitEuler()
SEMI_IMPLICIT_EULER: Final = SemiImplicitEuler()
RK4: Final = RungeKutta4()
RK4_BODY: Final = BodyAxesRungeKutta4()
LIE_RK4: Final = LieRungeKutta4()
BUSS2: Final = BussSecondOrder()
BUSS3: Final = BussThirdOrder()
SPLITTING2: Final = Splitting("splitting2", 2, 2, (1.0,))
SPLITTING4: Final = Splitting(
    "splitting4", 4, 20, (_SUZUKI, _SUZUKI, 1.0 - 4.0 * _SUZUKI, _SUZUKI, _SUZUKI)
)

INTEGRATORS: Final[Mapping[str, Integrator]] = {
    method.name: method
    for method in (
        EXPLICIT_EULER,
        SEMI_IMPLICIT_EULER,
        RK4,
        RK4_BODY,
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
    dt = positive_time("dt", dt)
    steps, start_s = whole("steps", steps, 0), finite_number("start_s", start_s)
    for k in range(steps):
        state = _run(state, method, dt, range(k, k + 1), load, held, start_s)
        yield state


def _run(
    state: State,
    method: Integrator,
    dt: float,
    steps: range,
    load: Load,
    held: PiecewiseConstantForce | None,
    start_s: float,
) -> State:
    """Return the state after steps, one or more, in which the held force does not change."""
    acting = load if held is None else total(load, held.held(start_s + steps.start * dt))
    if isinstance(method, CompiledMethod) and isinstance(acting, BuiltInLoad):
        return method.advanced(state, acting, dt, len(steps))
    derivative = derivative_of(acting)
    for k in steps:
        state = method.step(state, derivative, start_s + k * dt, dt)
    return state


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
    dt = positive_time("dt", dt)
    steps, start_s = whole("steps", steps, 0), finite_number("start_s", start_s)
    pieces = [range(steps)] if held is None else held.pieces(start_s, dt, steps)
    for piece in filter(len, pieces):
        state = _run(state, method, dt, piece, load, held, start_s)
    return state
