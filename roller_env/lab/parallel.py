"""The parallel cube: the report's rigid body and MuJoCo's free joint through the same flights.

Both get the same mass, inertia, start, gravity, keys, lift, damping and torque, and are compared
with one another and with a **reference**, over time. Keys and lift change by jumps: both sides
sample them at the beginning of a step and hold them through it. What depends on the motion has to
be seen by every stage of a Runge-Kutta step, so MuJoCo gets damping as ``dof_damping``, not as an
applied force. A free joint's damping acts along world axes in translation and along body axes in
rotation; being the same number on every axis here, it is -c v and -c omega in any axes.

The reference is a closed form of `roller_env.rigid_body.exact` for the linear motion and for every
free rotation, and `exact.reference` for the rotations under damping or torque on which a closed
form is silent. It was compared with a Taylor series in 40 digits that shares no code with it; see
`REFERENCE_ERROR`.

`EulerEquations` is the report's method with one thing exchanged, to find out what makes a result.
"""

from __future__ import annotations

import difflib
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple, TypeVar

import mujoco
import numpy as np
import numpy.typing as npt

from roller_env.lab.methods import MUJOCO, MujocoMethod
from roller_env.rigid_body import (
    LIE_RK4,
    RK4,
    SPLITTING4,
    Body,
    DerivativeFunction,
    Integrator,
    Load,
    PiecewiseConstantForce,
    State,
    driving_torque,
    exact,
    gravity,
    key_sequence,
    linear_drag,
    quaternion,
    total,
    trajectory,
)
from roller_env.rigid_body.arrays import Float64, cross, positive_time
from roller_env.units import quants

Vector = tuple[float, float, float]

AGREEMENT: Final = 1e-9
"""The two sides agree when position, m, and attitude, rad, stay within this of one another."""

REFERENCE_ERROR: Final[Mapping[str, float]] = {"position_m": 5e-13, "attitude_rad": 5e-13}
"""What the reference itself may be wrong by in 10 s. Measured against 40 digits: 2.2e-13 rad for
the thrown box, whose closed form is next to its separatrix, and at most 1.3e-13 rad else."""

SAMPLES: Final = 100
"""About as many moments of a flight are compared; the last step always is."""

_WHOLE_STEPS: Final = 1e-6
"""Fraction of a step by which a time may miss a step's boundary: 0.3 / 0.1 is not 3."""

GRAVITY_M_S2: Final[Vector] = (0.0, 0.0, -quants(386.0))
"""The original's."""

LIFT_N: Final = quants(500.0)
"""The original's lift pad on its ball of 1 kg, in force for `LIFT_S`."""
LIFT_S: Final = 5.0

START_ORIENTATION: Final = (0.8, 0.2, -0.4, 0.4)
"""A unit quaternion with no special direction, so that no axis hides another."""


# --- what flies --------------------------------------------------------------------------------

BODIES: Final[Mapping[str, Body]] = {
    "cube": Body.cube(size=1.0, mass=1.0),
    "box": Body.box(size=(0.1, 0.4, 0.9), mass=10.0),
}
"""The report's cube, and the slender box of the free-body benchmark (scpeters/benchmark)."""


@dataclass(frozen=True)
class FlightScene:
    """A flight: how it begins and what acts.

    Attributes:
        name: its key on the command line and in files.
        title: what people read.
        velocity_m_s: at the start, world axes.
        spin_rad_s: angular velocity at the start, **body** axes: that is where a box's axes differ.
        gravity_m_s2: world axes.
        held: keys or lift, a force on the centre of mass that changes by jumps.
        drag_n_s_m: force a m/s of velocity.
        damping_nms: torque a rad/s of angular velocity.
        torque_nm: constant, world axes.
    """

    name: str
    title: str
    velocity_m_s: Vector
    spin_rad_s: Vector
    gravity_m_s2: Vector = (0.0, 0.0, 0.0)
    held: PiecewiseConstantForce | None = None
    drag_n_s_m: float = 0.0
    damping_nms: float = 0.0
    torque_nm: Vector = (0.0, 0.0, 0.0)

    @property
    def turns_freely(self) -> bool:
        """Whether no torque ever acts."""
        return self.damping_nms == 0.0 and not any(self.torque_nm)

    @property
    def switches_s(self) -> Float64:
        """Times at which the held force jumps, rising."""
        return np.empty(0) if self.held is None else self.held.switches_s

    def held_force(self, t: float) -> Float64:
        """Return the keys' or lift's force at ``t``, (3,) N."""
        return np.zeros(3) if self.held is None else self.held.force_at_time(t)

    def start(self, body: Body) -> State:
        """Return the state in which ``body``, one of `BODIES`, begins."""
        q = np.array([START_ORIENTATION])
        return State.create(
            body,
            orientation=START_ORIENTATION,
            velocity=self.velocity_m_s,
            angular_velocity=quaternion.rotate(q, np.array([self.spin_rad_s])),
        )


KEYS_HELD: Final = ((0.0, "W"), (1.0, "WA"), (2.5, "A"), (4.0, "SD"), (6.5, "D"), (8.0, ""))
"""The WASD sequence: every key, singly and in pairs, and none. (time in s, keys from then on)."""

SCENES: Final[Mapping[str, FlightScene]] = {
    scene.name: scene
    for scene in (
        FlightScene("drift", "drift and spin, no gravity", (-0.9, 0.4, 0.1), (3.0, -5.0, 2.0)),
        FlightScene(
            "ballistic",
            "thrown, spun about the box's middle axis",
            (-2.0, 2.0, 8.0),
            (0.1, 5.0, 0.1),
            GRAVITY_M_S2,
        ),
        FlightScene(
            "keys",
            "WASD key sequence in free fall",
            (0.0, 0.0, 5.0),
            (2.0, 3.0, -4.0),
            GRAVITY_M_S2,
            held=key_sequence(KEYS_HELD),
        ),
        FlightScene(
            "lift",
            "lift of 12.7 N for 5 s",
            (0.5, 0.0, 0.0),
            (-3.0, 1.0, 5.0),
            GRAVITY_M_S2,
            held=PiecewiseConstantForce(
                np.array([0.0, LIFT_S]), np.array([(0.0, 0.0, LIFT_N), (0.0, 0.0, 0.0)])
            ),
        ),
        FlightScene(
            "damping",
            "linear and angular damping",
            (5.0, -3.0, 10.0),
            (4.0, -4.0, 3.0),
            GRAVITY_M_S2,
            drag_n_s_m=0.5,
            damping_nms=0.05,
        ),
        FlightScene(
            "torque",
            "the report's torque, (1, 0, 0) - 0.1 omega",
            (1.0, 0.0, 0.0),
            (1.0, -2.0, 3.0),
            damping_nms=0.1,
            torque_nm=(1.0, 0.0, 0.0),
        ),
    )
}
"""The scenes of free flight by name. The first two start as the benchmark's free boxes do, but the
first with a spin about no principal axis, which is harder than the benchmark's."""


# --- the velocity form: what MuJoCo keeps ----------------------------------------------------


def to_mujoco(state: State) -> tuple[Float64, Float64]:
    """Return a free joint's ``qpos`` (N, 7) and ``qvel`` (N, 6).

    Its velocity is in world axes and its angular velocity in body axes, m/s and rad/s.
    """
    spin = quaternion.rotate_inverse(state.rotation, state.angular_velocity)
    return np.hstack([state.position, state.rotation]), np.hstack([state.velocity, spin])


def from_mujoco(body: Body, qpos: npt.ArrayLike, qvel: npt.ArrayLike) -> State:
    """Return the momentum form of a free joint's ``qpos`` (N, 7) and ``qvel`` (N, 6).

    Raises:
        ValueError: on other shapes, NaN, or a quaternion far from unit.
    """
    pose, rate = np.asarray(qpos, dtype=np.float64), np.asarray(qvel, dtype=np.float64)
    wanted = (body.count, 7), (body.count, 6)
    if (pose.shape, rate.shape) != wanted:
        raise ValueError(
            f"qpos and qvel of {body.count} free joints must have shapes {wanted[0]} and "
            f"{wanted[1]}, got {pose.shape} and {rate.shape}"
        )
    still = State.create(body, position=pose[:, :3], orientation=pose[:, 3:], velocity=rate[:, :3])
    return still.recalculate(
        angular_momentum=quaternion.rotate(still.rotation, body.inertia * rate[:, 3:])
    )


@dataclass(frozen=True, eq=False)
class _Carried(State):
    """A state that keeps the angular velocity it came from, to the last bit.

    To and from angular momentum in every step would round ten thousand times more than MuJoCo, and
    next to a separatrix that shows: 6e-9 rad on the thrown box.
    """

    omega: Float64 = field(kw_only=True)


@dataclass(frozen=True)
class EulerEquations:
    """The report's Runge-Kutta and its sums of quaternions on another equation: Euler's.

    Angular velocity is primary instead of angular momentum, I w' = torque - w x I w. In body axes
    I stands still and w needs no attitude, as in MuJoCo; in world axes I turns with the body, and
    w needs the attitude as in the report's momentum form. So the two tell apart what the choice of
    the primary value does from what the choice of axes does.
    """

    axes: Literal["body", "world"]
    order: int = 4
    evaluations: int = 4

    @property
    def name(self) -> str:
        """What tables call it; not in `INTEGRATORS`, being an experiment."""
        return f"velocity_rk4_{self.axes}_axes"

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        half = 0.5 * dt
        y = self._packed(state)
        k1 = self._rates(state, derivative, t)
        k2 = self._rates(self._state(state, y + half * k1), derivative, t + half)
        k3 = self._rates(self._state(state, y + half * k2), derivative, t + half)
        k4 = self._rates(self._state(state, y + dt * k3), derivative, t + dt)
        y = y + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        end = self._state(state, y).recalculate(orientation=quaternion.normalise(y[:, 6:10]))
        primary = (end.position, end.momentum, end.orientation, end.angular_momentum)
        return _Carried(state.body, *primary, omega=y[:, 10:])

    def _own_axes(self, state: State, vector: Float64) -> Float64:
        if self.axes == "world":
            return vector
        return quaternion.rotate_inverse(state.rotation, vector)

    def _packed(self, state: State) -> Float64:
        if isinstance(state, _Carried):
            omega = state.omega
        else:
            omega = self._own_axes(state, state.angular_velocity)
        return np.hstack([state.position, state.momentum, state.orientation, omega])

    def _state(self, start: State, y: Float64) -> State:
        x, p, q, omega = np.split(y, [3, 6, 10], axis=1)
        moved = start.recalculate(position=x, momentum=p, orientation=q, renormalise=False)
        if self.axes == "world":
            return moved.recalculate(angular_momentum=moved.times_inertia(omega))
        turned = quaternion.rotate(moved.rotation, start.body.inertia * omega)
        return moved.recalculate(angular_momentum=turned)

    def _rates(self, state: State, derivative: DerivativeFunction, t: float) -> Float64:
        rate = derivative(state, t)
        gyroscopic = cross(rate.angular_velocity, state.angular_momentum)
        alpha = self._own_axes(state, state.over_inertia(rate.torque - gyroscopic))
        return np.hstack([rate.velocity, rate.force, rate.spin, alpha])


REMEDIES: Final[Mapping[str, tuple[Integrator, str]]] = {
    "rk4": (RK4, "the report's: momentum, world axes"),
    "lie_rk4": (LIE_RK4, "turns instead of sums of quaternions"),
    "velocity_rk4_world_axes": (EulerEquations("world"), "velocity instead of momentum"),
    "velocity_rk4_body_axes": (EulerEquations("body"), "body axes instead of world axes"),
    "splitting4": (SPLITTING4, "exact turns about body axes"),
}
"""The report's method and what could mend it, each with the one thing that it exchanges."""


# --- the three motions -----------------------------------------------------------------------


def sampled_steps(steps: int) -> npt.NDArray[np.intp]:
    """Return the numbers of the steps after which a flight of ``steps`` is compared, rising."""
    stride = max(1, steps // SAMPLES)
    return np.unique(np.append(np.arange(stride, steps + 1, stride), steps))


def ours(
    scenes: Sequence[FlightScene],
    body: Body,
    method: Integrator,
    dt_s: float,
    sampled: Sequence[int] | npt.NDArray[np.intp],
) -> list[State]:
    """Fly all ``scenes`` at once with a method of ours.

    Args:
        scenes: K flights of one body.
        body: one of `BODIES`.
        method: how.
        dt_s: step, s.
        sampled: numbers of the steps to keep, rising.

    Returns:
        For each scene a state whose rows are the ``sampled`` moments.
    """
    starts = [scene.start(body) for scene in scenes]
    crowd = State.create(
        body.take([0] * len(scenes)),
        orientation=START_ORIENTATION,
        momentum=np.vstack([start.momentum for start in starts]),
        angular_momentum=np.vstack([start.angular_momentum for start in starts]),
    )
    wanted = {int(step) for step in sampled}
    kept = []
    flight = trajectory(
        crowd, method, dt_s, max(wanted), load=_load(scenes), held=_held_together(scenes)
    )
    for step, state in enumerate(flight, start=1):
        if step in wanted:
            kept.append(state)
    return [_rows(body, kept, index) for index in range(len(scenes))]


def _rows(body: Body, states: Sequence[State], index: int) -> State:
    """Return one body's states one after the other as the rows of a state."""
    parts = [
        np.stack([part[index] for part in parts])
        for parts in zip(
            *((s.position, s.momentum, s.rotation, s.angular_momentum) for s in states),
            strict=True,
        )
    ]
    return State(body.take([0] * len(states)), *parts)


def _load(scenes: Sequence[FlightScene]) -> Load:
    """Return what acts smoothly, a row for each scene."""
    return total(
        gravity([scene.gravity_m_s2 for scene in scenes]),
        linear_drag([scene.drag_n_s_m for scene in scenes]),
        driving_torque(
            [scene.torque_nm for scene in scenes], [scene.damping_nms for scene in scenes]
        ),
    )


def _held_together(scenes: Sequence[FlightScene]) -> PiecewiseConstantForce | None:
    """Return all scenes' held forces as one, which jumps whenever one of them does."""
    switches = np.unique(np.concatenate([scene.switches_s for scene in scenes]))
    if len(switches) == 0:
        return None
    forces = np.array([[scene.held_force(t) for scene in scenes] for t in switches])
    return PiecewiseConstantForce(switches, forces)


def mujoco_model(
    scene: FlightScene, body: Body, method: MujocoMethod, dt_s: float
) -> mujoco.MjModel:
    """Return a world in which one free joint makes the flight; the held force is up to the caller.

    No geoms: nothing can be hit, and mass and inertia are exactly the body's.
    """
    spec = mujoco.MjSpec()
    method.configure(spec, dt_s)
    spec.option.gravity = scene.gravity_m_s2
    flyer = spec.worldbody.add_body(name="flyer")
    flyer.add_freejoint()
    flyer.explicitinertial = True
    flyer.mass, flyer.inertia = body.mass[0], body.inertia[0]
    model = spec.compile()
    model.dof_damping[:3] = scene.drag_n_s_m
    model.dof_damping[3:] = scene.damping_nms
    return model


def mujocos(
    scene: FlightScene,
    body: Body,
    method: MujocoMethod,
    dt_s: float,
    sampled: Sequence[int] | npt.NDArray[np.intp],
) -> State:
    """Fly a scene with MuJoCo; arguments and result as `ours`, for one scene."""
    model = mujoco_model(scene, body, method, dt_s)
    data = mujoco.MjData(model)
    (data.qpos[:],), (data.qvel[:],) = to_mujoco(scene.start(body))
    wrench = data.xfrc_applied[model.body("flyer").id]
    wrench[3:] = scene.torque_nm
    poses, rates, done = [], [], 0
    for stop in sampled:
        for step in range(done, int(stop)):
            wrench[:3] = scene.held_force(step * dt_s)
            mujoco.mj_step(model, data)
        done = int(stop)
        poses.append(data.qpos.copy())
        rates.append(data.qvel.copy())
    return from_mujoco(body.take([0] * len(poses)), np.array(poses), np.array(rates))


def reference(scene: FlightScene, body: Body, times_s: Float64) -> State:
    """Return the true motion at ``times_s``, rising, as rows; how true says `REFERENCE_ERROR`."""
    start = scene.start(body)
    many = start.take([0] * len(times_s))
    if not scene.turns_freely:
        turned = _turned(scene, start, times_s)
    elif body.isotropic:
        turned = exact.constant_spin(many, times_s)
    else:
        turned = exact.asymmetric_top(many, times_s)
    moved = _moved(scene, start, times_s)
    return turned.recalculate(position=moved.position, momentum=moved.momentum)


def _turned(scene: FlightScene, start: State, times_s: Float64) -> State:
    """Return the rotation under torque and damping, integrated from each moment to the next."""
    load = driving_torque(scene.torque_nm, scene.damping_nms)
    states = [start]
    for begin, end in itertools.pairwise([0.0, *times_s]):
        states.append(exact.reference(states[-1], end - begin, load, start_s=begin))
    return _rows(start.body, states[1:], 0)


def _moved(scene: FlightScene, start: State, times_s: Float64) -> State:
    """Return the linear motion, a closed form between the jumps of the held force."""
    end = float(times_s[-1])
    jumps = [float(t) for t in scene.switches_s if 0.0 < t < end]
    weight = start.body.mass[0] * np.array(scene.gravity_m_s2)
    pieces: list[State] = []
    for begin, stop in itertools.pairwise([0.0, *jumps, end]):
        within = times_s[(times_s > begin) & (times_s <= stop)]
        passed = np.append(within, stop) - begin
        force = weight + scene.held_force(begin)
        many = start.take([0] * len(passed))
        reached = exact.linear_drag(many, passed, scene.drag_n_s_m, force)
        pieces += [reached.take([row]) for row in range(len(within))]
        start = reached.take([-1])
    return _rows(start.body, pieces, 0)


# --- differences -----------------------------------------------------------------------------


class Difference(NamedTuple):
    """How far two motions of one body are apart, each (moments,)."""

    position_m: Float64
    attitude_rad: Float64
    momentum_kg_m_s: Float64
    angular_momentum_kg_m2_s: Float64
    energy_j: Float64

    def largest(self) -> tuple[float, ...]:
        """Return the maximum over time of each; NaN when a motion was no number."""
        return tuple(float(values.max()) for values in self)


def difference(a: State, b: State, gravity_m_s2: Vector) -> Difference:
    """Return how far ``a`` and ``b``, rows of one body's moments, are apart.

    Vectors by the length of their difference, attitude by the angle, energy (kinetic and potential)
    by its absolute value.
    """
    height = (a.position - b.position) @ np.array(gravity_m_s2)
    energy = a.kinetic_energy() - b.kinetic_energy() - a.body.mass * height
    return Difference(
        quaternion.norm(a.position - b.position),
        quaternion.angle_between(a.rotation, b.rotation),
        quaternion.norm(a.momentum - b.momentum),
        quaternion.norm(a.angular_momentum - b.angular_momentum),
        np.abs(energy),
    )


Pair = Literal["ours - MuJoCo", "ours - reference", "MuJoCo - reference"]


@dataclass(frozen=True, slots=True)
class Sample:
    """One row of the results over time."""

    body: str
    scene: str
    pair: Pair
    time_s: float
    position_m: float
    attitude_rad: float
    momentum_kg_m_s: float
    angular_momentum_kg_m2_s: float
    energy_j: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """One row of the summary: the largest differences of a flight, and which side is wrong.

    The first five are ours against MuJoCo, the ``error`` ones against the reference.
    """

    body: str
    scene: str
    ours: str
    mujoco: str
    dt_s: float
    duration_s: float
    position_m: float
    attitude_rad: float
    momentum_kg_m_s: float
    angular_momentum_kg_m2_s: float
    energy_j: float
    ours_position_error_m: float
    ours_attitude_error_rad: float
    mujoco_position_error_m: float
    mujoco_attitude_error_rad: float

    @property
    def agree(self) -> bool:
        """Whether position and attitude stay within `AGREEMENT`; a motion that blew up does not."""
        return self.position_m <= AGREEMENT and self.attitude_rad <= AGREEMENT

    @property
    def words(self) -> str:
        """``agree``, or which side is further from the truth, by what and how much."""
        if self.agree:
            return "agree"
        sides = {
            self.ours: (self.ours_position_error_m, self.ours_attitude_error_rad),
            self.mujoco: (self.mujoco_position_error_m, self.mujoco_attitude_error_rad),
        }
        which, unit = (1, "rad") if self.position_m <= AGREEMENT else (0, "m")
        right, wrong = sorted(sides, key=lambda side: sides[side][which])
        return (
            f"{wrong} is off by {sides[wrong][which]:.1e} {unit}, "
            f"{right} by {sides[right][which]:.1e}"
        )


@dataclass(frozen=True, slots=True)
class Remedy:
    """One row of what could mend a disagreement: largest attitude errors over a flight, rad."""

    body: str
    scene: str
    method: str
    dt_s: float
    against_mujoco_rad: float
    error_rad: float
    mujoco_error_rad: float


# --- experiments -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Settings:
    """What to compare.

    Attributes:
        bodies: names in `BODIES`.
        scenes: flights.
        ours: a method of ours.
        mujoco: a method of MuJoCo's.
        dt_s: step of both, s.
        duration_s: of every flight, s.

    Raises:
        ValueError: when a flight or the time between two jumps is no whole number of steps.
    """

    bodies: tuple[str, ...]
    scenes: tuple[FlightScene, ...]
    ours: Integrator
    mujoco: MujocoMethod
    dt_s: float
    duration_s: float

    def __post_init__(self) -> None:
        positive_time("dt", self.dt_s)
        positive_time("duration", self.duration_s)
        for what, time_s in self._boundaries():
            steps = time_s / self.dt_s
            if not _whole(steps):
                raise ValueError(
                    f"dt {self.dt_s:g} s: {what} {time_s:g} s, which is {steps:.6g} steps and has "
                    f"to be a whole number of them; {time_s / math.ceil(steps):.9g} s would do"
                )

    def _boundaries(self) -> list[tuple[str, float]]:
        """Return the times at which a step has to end, with what happens then."""
        jumps = [
            (f"the scene {scene.name!r} changes its force at", float(t))
            for scene in self.scenes
            for t in scene.switches_s
        ]
        return [("a flight ends at", self.duration_s), *jumps]

    def fits(self, factor: float) -> bool:
        """Say whether a step ``factor`` times as long would end at every jump and at the end."""
        return all(_whole(time_s / (factor * self.dt_s)) for _, time_s in self._boundaries())

    @property
    def steps(self) -> int:
        """Steps of a flight."""
        return round(self.duration_s / self.dt_s)


def _whole(steps: float) -> bool:
    return abs(steps - round(steps)) <= _WHOLE_STEPS


def _seconds(steps: npt.NDArray[np.intp], dt_s: float) -> Float64:
    return steps.astype(np.float64) * dt_s


def compare(settings: Settings, body_name: str) -> tuple[list[Verdict], list[Sample]]:
    """Fly every scene three ways with one body; return the summary and the differences in time."""
    body, dt_s = BODIES[body_name], settings.dt_s
    sampled = sampled_steps(settings.steps)
    times = _seconds(sampled, dt_s)
    verdicts, samples = [], []
    flights = ours(settings.scenes, body, settings.ours, dt_s, sampled)
    for scene, mine in zip(settings.scenes, flights, strict=True):
        theirs = mujocos(scene, body, settings.mujoco, dt_s, sampled)
        truth = reference(scene, body, times)
        pairs: dict[Pair, Difference] = {
            "ours - MuJoCo": difference(mine, theirs, scene.gravity_m_s2),
            "ours - reference": difference(mine, truth, scene.gravity_m_s2),
            "MuJoCo - reference": difference(theirs, truth, scene.gravity_m_s2),
        }
        verdicts.append(_verdict(settings, body_name, scene, pairs))
        for pair, apart in pairs.items():
            samples += [
                Sample(body_name, scene.name, pair, float(t), *(float(v) for v in values))
                for t, *values in zip(times, *apart, strict=True)
            ]
    return verdicts, samples


def _verdict(
    settings: Settings, body_name: str, scene: FlightScene, pairs: Mapping[Pair, Difference]
) -> Verdict:
    mine, theirs = pairs["ours - reference"].largest(), pairs["MuJoCo - reference"].largest()
    return Verdict(
        body_name,
        scene.name,
        f"ours {settings.ours.name}",
        settings.mujoco.name,
        settings.dt_s,
        settings.duration_s,
        *pairs["ours - MuJoCo"].largest(),
        *mine[:2],
        *theirs[:2],
    )


def remedy_steps_s(settings: Settings) -> tuple[float, ...]:
    """Return the steps at which remedies are tried, s, largest first: those that fit a flight."""
    return tuple(factor * settings.dt_s for factor in (4.0, 2.0, 1.0, 0.5) if settings.fits(factor))


def remedies(settings: Settings, body_name: str) -> Iterator[list[Remedy]]:
    """Yield how far the scenes' attitude is from MuJoCo and from truth by other methods and steps.

    The settings' own method takes every step of `remedy_steps_s`; the others spare the smallest,
    which would cost as much as all before it.
    """
    body, steps_s = BODIES[body_name], remedy_steps_s(settings)
    sampled = sampled_steps(round(settings.duration_s / steps_s[0]))
    times = _seconds(sampled, steps_s[0])
    truths = [reference(scene, body, times) for scene in settings.scenes]
    others = [method for method, _ in REMEDIES.values() if method.name != settings.ours.name]
    for dt_s in steps_s:
        here = sampled * round(steps_s[0] / dt_s)
        theirs = [mujocos(scene, body, settings.mujoco, dt_s, here) for scene in settings.scenes]
        for method in (settings.ours, *(others if dt_s >= settings.dt_s else ())):
            mine = ours(settings.scenes, body, method, dt_s, here)
            yield [
                Remedy(body_name, scene.name, method.name, dt_s, *_attitudes_apart(*motions))
                for scene, *motions in zip(settings.scenes, mine, theirs, truths, strict=True)
            ]


def _attitudes_apart(mine: State, theirs: State, truth: State) -> tuple[float, float, float]:
    """Return the largest angles of ours to MuJoCo, ours to the truth and MuJoCo to the truth."""
    pairs = ((mine, theirs), (mine, truth), (theirs, truth))
    angles = [quaternion.angle_between(a.rotation, b.rotation).max() for a, b in pairs]
    return float(angles[0]), float(angles[1]), float(angles[2])


# --- names -----------------------------------------------------------------------------------

Named = TypeVar("Named")


def chosen(what: str, name: str, options: Mapping[str, Named]) -> Named:
    """Return the option called ``name``.

    Raises:
        ValueError: when there is none, with the nearest name.
    """
    if name not in options:
        near = difflib.get_close_matches(name, options, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"no {what} {name!r}: there are {', '.join(options)}{hint}")
    return options[name]


def chosen_several(what: str, name: str, options: Mapping[str, Named]) -> tuple[str, ...]:
    """Return the name asked for, or every name for ``all``; errors as `chosen`."""
    if name == "all":
        return tuple(options)
    chosen(what, name, {**options, "all": options})
    return (name,)


def mujoco_method(integrator_name: str) -> MujocoMethod:
    """Return MuJoCo with the integrator of that name; errors as `chosen`."""
    return chosen("MuJoCo integrator", integrator_name, {m.integrator: m for m in MUJOCO})


def parsed_keys(events: Iterable[str]) -> PiecewiseConstantForce:
    """Return the key sequence written as ``0=W 1=WA 2.5=``: time in s, and the keys from then on.

    Raises:
        ValueError: on anything else, an unknown key, or times that do not rise.
    """
    sequence = []
    for event in events:
        time, separator, keys = event.partition("=")
        try:
            when = float(time)
        except ValueError:
            when = math.nan
        if not separator or not math.isfinite(when):
            raise ValueError(f"keys: found {event!r}; a time in s and keys, such as 1.5=WA")
        sequence.append((when, keys.upper()))
    return key_sequence(sequence)
