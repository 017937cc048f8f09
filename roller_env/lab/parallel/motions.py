"""The three motions of a flight: ours, MuJoCo's and the true one.

Keys and lift change by jumps: both sides sample them at the beginning of a step and hold them
through it. What depends on the motion has to be seen by every stage of a Runge-Kutta step, so
MuJoCo gets damping as ``dof_damping``, not as an applied force. A free joint's damping acts along
world axes in translation and along body axes in rotation; being the same number on every axis here,
it is -c v and -c omega in any axes.

The reference is a closed form of `roller_env.rigid_body.exact` for the linear motion and for every
free rotation, and `exact.reference` for the rotations under damping or torque on which a closed
form is silent. It was compared with a Taylor series in 40 digits that shares no code with it; see
`REFERENCE_ERROR`.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from roller_env.lab.methods import MujocoMethod
from roller_env.lab.parallel.scenes import START_ORIENTATION, FlightScene
from roller_env.lab.parallel.velocity_form import from_mujoco, to_mujoco
from roller_env.rigid_body import (
    Body,
    Integrator,
    Load,
    PiecewiseConstantForce,
    State,
    driving_torque,
    exact,
    gravity,
    linear_drag,
    total,
    trajectory,
)
from roller_env.rigid_body.arrays import Float64

REFERENCE_ERROR: Final[Mapping[str, float]] = {"position_m": 5e-13, "attitude_rad": 5e-13}
"""What the reference itself may be wrong by in 10 s. Measured against 40 digits: 2.2e-13 rad for
the thrown box, whose closed form is next to its separatrix, and at most 1.3e-13 rad else."""

SAMPLES: Final = 100
"""About as many moments of a flight are compared; the last step always is."""


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
