"""Free motions with a known answer: no contact, so that an error is the integrator's alone.

The rigid closed form is what every method here approaches as the time step vanishes, MuJoCo's as
well as ours: in free flight the models are the same, and all errors are discretisation errors.

An error is the largest over ten equally spaced moments, not the last one, which an oscillating
error may happen to cross. It is relative to the largest value that the true motion reaches, but for
the attitude's, which is an angle.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import mujoco
import numpy as np

from roller_env import rigid_body
from roller_env.lab import simulate
from roller_env.lab.methods import FREE, Method, MujocoMethod, RigidBodyMethod, without_warnings
from roller_env.lab.scene import Measure
from roller_env.rigid_body import Body, PiecewiseConstantForce, State, exact, quaternion
from roller_env.rigid_body.arrays import Float64, dot

Vector = tuple[float, float, float]
_STILL: Final[Vector] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Acting:
    """What acts on the body: the same numbers for our integrators and for MuJoCo. World frame."""

    gravity_m_s2: Vector = _STILL
    force_n: Vector = _STILL
    torque_nm: Vector = _STILL
    drag_n_s_m: float = 0.0  # c of the force -c v
    spin_damping_nm_s: float = 0.0  # c of the torque -c omega
    held: PiecewiseConstantForce | None = None  # keys or a lift, held through every step

    @property
    def turns(self) -> bool:
        """Whether any torque acts."""
        return any(self.torque_nm) or self.spin_damping_nm_s != 0.0

    @property
    def jumps_s(self) -> Float64:
        """Times at which the held force jumps, rising."""
        return np.empty(0) if self.held is None else self.held.switches_s

    def load(self) -> rigid_body.Load:
        """Return it for our integrators; what is zero costs nothing."""
        loads = [
            load
            for acts, load in (
                (any(self.gravity_m_s2), rigid_body.gravity(self.gravity_m_s2)),
                (any(self.force_n), rigid_body.constant(force=self.force_n)),
                (self.drag_n_s_m, rigid_body.linear_drag(self.drag_n_s_m)),
                (self.turns, rigid_body.driving_torque(self.torque_nm, self.spin_damping_nm_s)),
            )
            if acts
        ]
        return loads[0] if len(loads) == 1 else rigid_body.total(*loads)

    def apply(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Let it act on the only body of a compiled model, but for what is held.

        The damping goes into the joint. As a force in ``xfrc_applied`` MuJoCo would hold it through
        the stages of a Runge-Kutta step, which would then be of first order. A free joint's damping
        acts along body axes in rotation; being the same on every axis it is -c omega in any.
        """
        model.opt.gravity[:] = self.gravity_m_s2
        model.dof_damping[:] = np.repeat([self.drag_n_s_m, self.spin_damping_nm_s], 3)
        data.xfrc_applied[1] = (*self.force_n, *self.torque_nm)

    def hold(self, data: mujoco.MjData, t: float) -> None:
        """Let what is held at ``t`` act on the only body of a compiled model."""
        if self.held is not None:
            data.xfrc_applied[1, :3] = self.held.force_at_time(t) + self.force_n


def _sizes(values: Float64) -> Float64:
    """Return the lengths of vectors, or the magnitudes of numbers, (K,)."""
    return np.abs(values) if values.ndim == 1 else quaternion.norm(values)


def _travelled(scene: FreeScene, state: State) -> Float64:
    return state.position - scene.start.position


def _energy(scene: FreeScene, state: State) -> Float64:
    weight = state.body.mass[:, None] * np.array(scene.acting.gravity_m_s2)
    return state.kinetic_energy() - dot(weight, state.position)


def _growth(scene: FreeScene, state: State) -> Float64:
    """Return the rate at which a wobble about the axis of middle inertia has grown, (1,) 1/s.

    Where the wobble begins in w1, about the axis of least inertia, Euler's equations linearised
    about the steady spin give w1 = w1(0) cosh(rate t): the rate follows from one later moment.
    """
    moment = min(int(np.abs(scene.times_s - GROWTH_S).argmin()), state.count - 1)
    axis = int(state.body.axes_by_inertia[0, 0])
    begun = quaternion.rotate_inverse(scene.start.rotation, scene.start.angular_velocity)
    wobble = quaternion.rotate_inverse(state.rotation, state.angular_velocity)
    grown = wobble[moment : moment + 1, axis] / begun[0, axis]
    rate: Float64 = np.arccosh(grown) / scene.times_s[moment]
    return rate


QUANTITIES: Final[Mapping[str, tuple[str, Callable[[FreeScene, State], Float64]]]] = {
    "position": ("position error over {} / distance from the start", _travelled),
    "velocity": ("velocity error over {} / largest velocity", lambda _, s: s.velocity),
    "attitude": ("attitude error over {}, rad", lambda _, s: s.rotation),
    "angular_velocity": (
        "angular velocity error over {} / largest",
        lambda _, s: s.angular_velocity,
    ),
    "angular_momentum": (
        "angular momentum error over {} / largest",
        lambda _, s: s.angular_momentum,
    ),
    "energy": ("energy error over {} / largest energy", _energy),
    "growth": ("error of the wobble's growth rate, relative", _growth),
}
"""What a chart's axis says of each error, with the seconds simulated, and its value in the rows of
a state, (K,) or (K, n)."""


@dataclass(frozen=True)
class FreeScene:
    """A free body with a known motion; a `roller_env.lab.scene.Scene`."""

    name: str
    title: str
    start: State  # one body at time 0
    quantities: tuple[str, ...]  # of `QUANTITIES`; a chart shows the first
    time_steps_s: Sequence[float]  # largest first; each divides the time between two moments
    acting: Acting = Acting()
    horizon_s: float = 10.0
    methods: Sequence[Method] = FREE
    failure: float = 1.0  # an error as large as the motion (or a radian): nothing is left of it
    limits_s: Mapping[str, float] = field(default_factory=dict)  # by a method's name: see `DRAG`
    moments: int = 10  # at which the error is taken, evenly to the end

    @property
    def measures(self) -> Sequence[Measure]:
        """See `Scene.measures`."""
        horizon = f"{self.horizon_s:g} s"
        labels = {name: QUANTITIES[name][0].format(horizon) for name in self.quantities}
        return [Measure(name, label, "discretisation") for name, label in labels.items()]

    @property
    def moment_s(self) -> float:
        """Time between two moments at which errors are taken, which every step must divide, s."""
        return self.horizon_s / self.moments

    @cached_property
    def times_s(self) -> Float64:
        """The moments at which errors are taken, (moments,) s."""
        return np.arange(1.0, self.moments + 1.0) * self.moment_s

    @cached_property
    def truth(self) -> State:
        """The true motion, a row for each moment."""
        turned = _turned(self.acting, self.start, self.times_s)
        moved = _moved(self.acting, self.start, self.times_s)
        return turned.recalculate(position=moved.position, momentum=moved.momentum)

    def steps_to_a_moment(self, dt_s: float) -> int:
        """Return the steps from one moment to the next, or raise a ValueError if none fit."""
        steps = round(self.moment_s / dt_s) if dt_s > 0.0 else 0
        if steps < 1 or not math.isclose(steps * dt_s, self.moment_s, rel_tol=1e-9):
            moment = f"{self.moment_s:g} s (a moment of the {self.moments})"
            raise ValueError(f"{self.name}: the time step must divide {moment}, found {dt_s:g} s")
        return steps

    def trial(self, method: Method, dt_s: float) -> FreeTrial:
        """See `Scene.trial`; a ``dt_s`` that does not divide `moment_s` is a ValueError."""
        if isinstance(method, RigidBodyMethod):
            return _RigidBodyTrial(self, method, dt_s)
        return _MujocoTrial(self, method, dt_s)

    def over(self, horizon_s: float) -> FreeScene:
        """Return the scene over another time, with those of its time steps that divide that."""
        moment_s = horizon_s / self.moments
        fitting = [dt for dt in self.time_steps_s if dt <= moment_s * (1.0 + 1e-9)]
        return replace(self, horizon_s=horizon_s, time_steps_s=fitting)

    def error(self, name: str, measured: State) -> float:
        """Return the largest error of a quantity over the moments, relative unless an angle."""
        of = QUANTITIES[name][1]
        value, truth = of(self, measured), of(self, self.truth)
        if name == "attitude":
            return float(quaternion.angle_between(value, truth).max())
        scale = max(_sizes(truth).max(), _sizes(of(self, self.start)).max())
        return float(_sizes(value - truth).max() / scale)


def _turned(acting: Acting, start: State, times_s: Float64) -> State:
    """Return the rotation at rising times: a closed form where there is one."""
    body, many = start.body, start.take([0] * len(times_s))
    if acting.turns:
        torque = acting.torque_nm, acting.spin_damping_nm_s
        if body.isotropic and not start.angular_momentum.any():
            return exact.damped_spin(many, times_s, *torque)
        states = [start]
        for begin, end in itertools.pairwise([0.0, *times_s.tolist()]):
            load = rigid_body.driving_torque(*torque)
            states.append(exact.reference(states[-1], end - begin, load, start_s=begin))
        return in_rows(states[1:])
    if body.isotropic:
        return exact.constant_spin(many, times_s)
    symmetric = len(set(body.inertia[0].tolist())) == 2
    return (exact.symmetric_top if symmetric else exact.asymmetric_top)(many, times_s)


def _moved(acting: Acting, start: State, times_s: Float64) -> State:
    """Return the linear motion, a closed form between the jumps of the held force."""
    end = float(times_s[-1])
    jumps = [float(t) for t in acting.jumps_s if 0.0 < t < end]
    steady = start.body.mass[0] * np.array(acting.gravity_m_s2) + acting.force_n
    pieces: list[State] = []
    for begin, stop in itertools.pairwise([0.0, *jumps, end]):
        within = times_s[(times_s > begin) & (times_s <= stop)]
        passed = np.append(within, stop) - begin
        force = steady + (0.0 if acting.held is None else acting.held.force_at_time(begin))
        many = start.take([0] * len(passed))
        reached = exact.linear_drag(many, passed, acting.drag_n_s_m, force)
        pieces += [reached.take([row]) for row in range(len(within))]
        start = reached.take([-1])
    return in_rows(pieces)


class FreeTrial(ABC):
    """One run of a free scene; a `roller_env.lab.scene.SteadyTrial`.

    Attributes:
        part_s: simulated time of the part that is timed, seconds: of some milliseconds of work,
            against which starting the clock is nothing.
    """

    def __init__(self, scene: FreeScene, dt_s: float, part_steps: int) -> None:
        self._scene, self._dt_s, self._part_steps = scene, dt_s, part_steps
        self._steps, self.part_s = scene.steps_to_a_moment(dt_s), part_steps * dt_s

    @abstractmethod
    def simulate(self, steps: int, moments: int) -> None:
        """Go from the start to so many moments, so many steps apart."""

    @property
    @abstractmethod
    def reached(self) -> State:
        """Where the last run was at its moments, a row for each."""

    def run(self) -> None:
        """See `SteadyTrial.run`."""
        self.simulate(self._steps, self._scene.moments)

    def run_part(self) -> None:
        """See `SteadyTrial.run_part`."""
        self.simulate(self._part_steps, 1)

    def errors(self) -> dict[str, float]:
        """See `SteadyTrial.errors`."""
        with np.errstate(all="ignore"):  # a motion that blew up is a result
            return {name: self._scene.error(name, self.reached) for name in self._scene.quantities}


class _RigidBodyTrial(FreeTrial):
    """One run of one of our integrators."""

    def __init__(self, scene: FreeScene, method: RigidBodyMethod, dt_s: float) -> None:
        super().__init__(scene, dt_s, 5000)
        self._integrator, self._load = method.integrator, scene.acting.load()

    def simulate(self, steps: int, moments: int) -> None:
        path, how = [self._scene.start], (self._integrator, self._dt_s, steps)
        held = self._scene.acting.held
        with np.errstate(all="ignore"):
            for moment in range(moments):
                now = moment * steps * self._dt_s
                path.append(
                    rigid_body.advance(path[-1], *how, load=self._load, held=held, start_s=now)
                )
        self._path = path[1:]

    @property
    def reached(self) -> State:
        return in_rows(self._path)


class _MujocoTrial(FreeTrial):
    """One run of MuJoCo's free joint, stepped in C."""

    def __init__(self, scene: FreeScene, method: MujocoMethod, dt_s: float) -> None:
        super().__init__(scene, dt_s, 2000)
        self._model = free_model(scene.start.body, method, dt_s)
        self._data = mujoco.MjData(self._model)

    def simulate(self, steps: int, moments: int) -> None:
        model, data, acting = self._model, self._data, self._scene.acting
        mujoco.mj_resetData(model, data)
        acting.apply(model, data)
        (data.qpos[:],), (data.qvel[:],) = to_mujoco(self._scene.start)

        def hold(step: int) -> None:
            acting.hold(data, step * self._dt_s)

        # A force that is held has to be looked up in every step, which only keys are worth.
        every = steps if acting.held is None else 1
        with without_warnings():
            path = simulate.record(model, data, steps * moments, every=every, before=hold)
        at = slice(steps // every, None, steps // every)
        self._qpos, self._qvel = path.qpos[at], path.qvel[at]

    @property
    def reached(self) -> State:
        return from_mujoco(self._scene.start, self._qpos, self._qvel)


def in_rows(states: Sequence[State]) -> State:
    """Return one body's states, one after the other, as the rows of a state."""
    rows = states[0].take([0] * len(states))
    return rows.recalculate(
        position=np.vstack([one.position for one in states]),
        momentum=np.vstack([one.momentum for one in states]),
        orientation=np.vstack([one.orientation for one in states]),
        angular_momentum=np.vstack([one.angular_momentum for one in states]),
    )


def to_mujoco(state: State) -> tuple[Float64, Float64]:
    """Return a free joint's ``qpos`` (N, 7) and ``qvel`` (N, 6).

    Its velocity is in world axes and its angular velocity in body axes, m/s and rad/s.
    """
    spin = quaternion.rotate_inverse(state.rotation, state.angular_velocity)
    return np.hstack([state.position, state.rotation]), np.hstack([state.velocity, spin])


def from_mujoco(start: State, qpos: Float64, qvel: Float64) -> State:
    """Return ``start``'s first body where a free joint has ``qpos`` (N, 7), ``qvel`` (N, 6)."""
    rows = start.take([0] * len(qpos))
    q = quaternion.normalise(qpos[:, 3:])
    return rows.recalculate(
        position=qpos[:, :3],
        momentum=rows.body.mass[:, None] * qvel[:, :3],
        orientation=q,
        angular_momentum=quaternion.rotate(q, rows.body.inertia * qvel[:, 3:]),
    )


def free_model(body: Body, method: MujocoMethod, dt_s: float) -> mujoco.MjModel:
    """Return a model of one free body, the first of ``body``, without a shape."""
    spec = mujoco.MjSpec()
    method.configure(spec, dt_s)
    thing = spec.worldbody.add_body(
        mass=body.mass[0], inertia=body.inertia[0], ipos=(0.0, 0.0, 0.0), explicitinertial=True
    )
    thing.add_freejoint()
    return spec.compile()


# --- the scenes ------------------------------------------------------------------------------

GRAVITY_M_S2: Final[Vector] = (0.0, 0.0, -9.8)
"""As the published free-box benchmark has it."""

BENCHMARK_BOX: Final = Body.box((0.1, 0.4, 0.9), 10.0)
"""Of github.com/scpeters/benchmark: I = (0.8083, 0.6833, 0.1417) kg m^2."""

TOP: Final = Body.from_inertia((1.0, 2.0, 3.0))
CUBE: Final = Body.cube(size=1.0, mass=1.0)
"""The report's: I = 1/6 kg m^2."""

WOBBLE: Final = 0.05
"""Of the spin about the middle axis, about that of least inertia, at the start of the tumble."""

GROWTH_S: Final = 1.0
"""When the wobble's growth is read off: it is still small against the spin."""


def one_two_five(largest_s: float, smallest_s: float) -> tuple[float, ...]:
    """Return the time steps {1, 2, 5} x 10^k between two of them, largest first."""
    decades = range(math.floor(math.log10(smallest_s)), math.ceil(math.log10(largest_s)) + 1)
    steps = [float(f"{digit}e{decade}") for decade in decades for digit in (1, 2, 5)]
    return tuple(sorted((s for s in steps if smallest_s <= s <= largest_s), reverse=True))


SIMPLE_BOX: Final = FreeScene(
    name="simple-box",
    title="Weightless box turning about a principal axis",
    start=State.create(BENCHMARK_BOX, velocity=(-0.9, 0.4, 0.1), angular_velocity=(0.5, 0.0, 0.0)),
    quantities=("attitude", "position", "velocity", "energy", "angular_momentum"),
    time_steps_s=one_two_five(1.0, 1e-4),
)
COMPLEX_BOX: Final = FreeScene(
    name="complex-box",
    title="Thrown box that tumbles about its middle axis",
    start=State.create(BENCHMARK_BOX, velocity=(-2.0, 2.0, 8.0), angular_velocity=(0.1, 5.0, 0.1)),
    acting=Acting(gravity_m_s2=GRAVITY_M_S2),
    quantities=("attitude", "position", "velocity", "energy", "angular_momentum"),
    time_steps_s=one_two_five(0.2, 1e-4),
)
ASYMMETRIC_TOP: Final = FreeScene(
    name="asymmetric-top",
    title="Free body of three different moments of inertia",
    start=State.create(TOP, angular_velocity=(1.5, 0.7, 2.0)),
    quantities=("attitude", "angular_velocity", "energy", "angular_momentum"),
    time_steps_s=one_two_five(0.5, 1e-4),
)
MIDDLE_AXIS: Final = FreeScene(
    name="middle-axis",
    title="Spin about the middle axis, which turns over",
    start=State.create(TOP, angular_velocity=(2.0 * WOBBLE, 2.0, 0.0)),
    quantities=("attitude", "growth", "energy", "angular_momentum"),
    time_steps_s=one_two_five(0.5, 1e-4),
)
SYMMETRIC_TOP: Final = FreeScene(
    name="symmetric-top",
    title="Free symmetric top, wobbling",
    start=State.create(Body.from_inertia((1.0, 1.0, 1.7)), angular_velocity=(1.0, 0.5, 2.0)),
    quantities=("attitude", "angular_velocity", "energy", "angular_momentum"),
    time_steps_s=one_two_five(0.5, 1e-4),
)
CONSTANT_SPIN: Final = FreeScene(
    name="constant-spin",
    title="Cube spinning freely at 3 rad/s",
    start=State.create(CUBE, angular_velocity=(1.0, 2.0, 2.0)),
    quantities=("attitude", "energy", "angular_momentum"),
    time_steps_s=one_two_five(1.0, 1e-4),
)
DAMPED_SPIN: Final = FreeScene(
    name="damped-spin",
    title="The report's cube: torque (1, 0, 0) - 0.1 ω",
    start=State.create(CUBE),
    acting=Acting(torque_nm=(1.0, 0.0, 0.0), spin_damping_nm_s=0.1),
    quantities=("attitude", "angular_momentum", "energy"),
    time_steps_s=one_two_five(1.0, 1e-4),
)
_REAL_LIMITS: Final = {1: 2.0, 2: 2.0, 3: 2.5127453266183286, 4: 2.785293563405282}
"""Largest dt c / m without growth of a method whose stages are as many as its order: where its
polynomial 1 - z + z^2/2 - ... has magnitude 1. By the order."""

DRAG: Final = FreeScene(
    name="drag",
    title="Pushed cube under linear drag, five times a second",
    start=State.create(CUBE, velocity=(10.0, -4.0, 3.0)),
    acting=Acting(force_n=(2.0, 0.0, 0.0), drag_n_s_m=5.0),
    limits_s={
        method.name: _REAL_LIMITS[method.order] * float(CUBE.mass[0]) / 5.0
        for method in FREE
        # MuJoCo's Euler family damps implicitly, and splitting4 is composed of other methods.
        if method.name == "MuJoCo RK4"
        or (isinstance(method, RigidBodyMethod) and method.name != "ours splitting4")
    },
    quantities=("position", "velocity", "energy"),
    time_steps_s=one_two_five(1.0, 1e-4),
)
PROJECTILE: Final = FreeScene(
    name="projectile",
    title="Thrown cube, in 2 s",
    start=State.create(CUBE, velocity=(3.0, 0.0, 8.0)),
    acting=Acting(gravity_m_s2=GRAVITY_M_S2),
    quantities=("position", "velocity", "energy"),
    time_steps_s=one_two_five(0.2, 1e-4),
    horizon_s=2.0,
)

FREE_SCENES: Final = (
    SIMPLE_BOX,
    COMPLEX_BOX,
    ASYMMETRIC_TOP,
    MIDDLE_AXIS,
    SYMMETRIC_TOP,
    CONSTANT_SPIN,
    DAMPED_SPIN,
    DRAG,
    PROJECTILE,
)
