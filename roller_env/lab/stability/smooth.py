"""Limits of smooth motion: servos, drag, oscillation and spin."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Final

import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from roller_env import rigid_body
from roller_env.lab.contact.scene import UPWARDS, add_ball, new_spec
from roller_env.lab.methods import MUJOCO, MujocoMethod
from roller_env.lab.simulate import stays
from roller_env.lab.stability.limits import Case, Effort, Limit, Quantity
from roller_env.rigid_body import INTEGRATORS, Body, Integrator, State, Wrench, trajectory
from roller_env.rigid_body.integrators import RungeKutta4, Splitting

EULER, _, IMPLICITFAST, DISCRETE, RK4 = MUJOCO

DT_S: Final = 0.01
SMALL: Final = 1e-6
"""Where a motion starts, m or m/s: it may grow a million times before it is called unstable, and is
still far below the 1e10 at which MuJoCo complains."""

OUR_STEPS: Final = 300
"""Steps of our own methods; a linear motion grows from the first step on, or never."""


def stability_polynomial(method: Integrator) -> Polynomial:
    """Return what a step multiplies y by when y' = lambda y, as a polynomial in h lambda.

    An explicit method of s stages and order s has the exponential series up to the power s,
    whatever its coefficients; a composition has the product of its parts'.
    """
    parts = method.fractions if isinstance(method, Splitting) else (1.0,)
    degree = method.evaluations // len(parts)
    series = [1.0 / math.factorial(power) for power in range(degree + 1)]
    product = Polynomial([1.0])
    for part in parts:
        product *= Polynomial([c * part**power for power, c in enumerate(series)])
    return product


def smallest_instability(gain: Callable[[float], float], upper: float = 10.0) -> float:
    """Return the smallest h at which ``gain``, the growth a step, passes 1; it must below upper."""
    grid = np.linspace(0.3, upper, 400)
    first = int(np.argmax([gain(h) > 1.0 for h in grid]))
    return float(brentq(lambda h: gain(h) - 1.0, grid[first - 1], grid[first]))


def rk4_servo_limit(ratio: float) -> float:
    """Return the largest h w at which Runge-Kutta's region holds both roots of the servo."""
    roots, polynomial = np.roots([1.0, 2.0 * ratio, 1.0]), stability_polynomial(INTEGRATORS["rk4"])
    return smallest_instability(lambda h: float(np.abs(polynomial(h * roots)).max()))


def damping_limit(ratio: float) -> float:
    """Return the largest h w of semi-implicit Euler with the damper taken from before the step.

    Of minus the ``ratio`` it is that with the damper taken from after the step.
    """
    return 2.0 * math.sqrt(ratio**2 + 1.0) - 2.0 * ratio


def drag_limit(method: Integrator) -> float:
    """Return the largest h c / m at which the method's polynomial does not grow."""
    polynomial = stability_polynomial(method)
    return smallest_instability(lambda h: abs(float(polynomial(-h))), upper=40.0)


def rk4_aliasing() -> float:
    """Return h w at which the report's Runge-Kutta step, which is late, has turned half round.

    About a fixed axis the quaternion is a complex number of the rate i w/2 times itself, scaled to
    1 inside the step as well. It has turned a right angle where its real part is 0.
    """

    def real_part(phase: float) -> float:
        q, mean = 1.0 + 0.0j, 0.0j
        for reach, weight in ((0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)):
            rate = 0.5j * phase * q
            mean += weight / 6.0 * rate
            q = 1.0 + reach * rate
            q /= abs(q)
        return (1.0 + mean).real

    return float(brentq(real_part, 2.0, 4.5))


def _servo(
    method: MujocoMethod, ratio: float, joint_damping: bool, effort: Effort, phase: float
) -> bool:
    spec, frequency = new_spec(method, DT_S), phase / DT_S
    add_ball(spec, (0.0, 0.0, 0.0), 0.1, slides=UPWARDS)
    (joint,) = spec.joints
    joint.name = "slide"
    servo = spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_JOINT, target="slide")
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.gainprm[0], servo.biasprm[1] = frequency**2, -(frequency**2)
    if joint_damping:
        joint.damping[0] = 2.0 * ratio * frequency
    else:
        servo.biasprm[2] = -2.0 * ratio * frequency
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[0] = SMALL
    return stays(model, data, effort.steps, lambda: bool(abs(data.qpos[0]) < 1e6 * SMALL))


def _our_drag(method: Integrator, _effort: Effort, phase: float) -> bool:
    state = State.create(Body.cube(1.0, 1.0), velocity=(1.0, 0.0, 0.0))
    motion = trajectory(state, method, 1.0, OUR_STEPS, load=rigid_body.linear_drag(phase))
    return all(abs(reached.velocity[0, 0]) <= 1.0 for reached in motion)


def _mujoco_drag(method: MujocoMethod, flags: int, effort: Effort, phase: float) -> bool:
    spec = new_spec(method, DT_S, disableflags=flags)
    add_ball(spec, (0.0, 0.0, 0.0), 0.5)
    (joint,) = spec.joints
    joint.damping[0] = phase / DT_S
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[0] = SMALL
    steps = effort.steps // 4
    small = stays(model, data, steps, lambda: bool(abs(data.qvel[0]) <= 1e3 * SMALL))
    return small and abs(float(data.qvel[0])) <= SMALL


def _spring(state: State, _t: float) -> Wrench:
    # 1 N/m to the origin on 1 kg: w = 1.
    return Wrench(-state.position, np.zeros_like(state.position))


def _swing(method: str, phase: float, steps: int) -> Iterator[float]:
    """Yield the amplitude, which is 1 at the start, after each step of h w = ``phase``."""
    state = State.create(Body.cube(1.0, 1.0), position=(1.0, 0.0, 0.0))
    for reached in trajectory(state, INTEGRATORS[method], phase, steps, load=_spring):
        yield float(np.hypot(reached.position[0, 0], reached.velocity[0, 0]))


def _oscillation(method: str, _effort: Effort, phase: float) -> bool:
    return all(amplitude < 1e3 for amplitude in _swing(method, phase, 2 * OUR_STEPS))


def _explicit_gain(phase: float, _effort: Effort) -> float:
    *_, last = _swing("explicit_euler", phase, OUR_STEPS)
    return last


def _spinning(rate: float) -> State:
    return State.create(Body.cube(1.0, 1.0), angular_velocity=(0.0, 0.0, rate))


def _norm(_effort: Effort, phase: float) -> bool:
    raw = RungeKutta4(renormalise=False, renormalise_stages=False)
    motion = trajectory(_spinning(phase), raw, 1.0, OUR_STEPS)
    return all(float(np.linalg.norm(reached.orientation)) <= 1.0 for reached in motion)


def _our_turn(method: str, _effort: Effort, phase: float) -> bool:
    """Say whether a step, read as the shortest turn between two poses, has the spin's sense."""
    end = rigid_body.advance(_spinning(phase), INTEGRATORS[method], 1.0, 1)
    return bool(end.rotation[0, 0] * end.rotation[0, 3] > 0.0)


def _mujoco_turn(method: MujocoMethod, _effort: Effort, phase: float) -> bool:
    spec = new_spec(method, 1.0)
    add_ball(spec, (0.0, 0.0, 0.0), 0.5)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[5] = phase
    mujoco.mj_step(model, data)
    return bool(data.qpos[3] * data.qpos[6] > 0.0)


_SERVOS: Final[Mapping[str, tuple[MujocoMethod, bool, Callable[[float], float]]]] = {
    "euler_actuator": (EULER, False, damping_limit),
    "euler_joint": (EULER, True, lambda ratio: damping_limit(-ratio)),
    "implicitfast": (IMPLICITFAST, False, lambda ratio: damping_limit(-ratio)),
    "rk4": (RK4, False, rk4_servo_limit),
    "discrete": (DISCRETE, False, lambda _: math.inf),
}
_EXPLICIT: Final = int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)

SMOOTH: Final[Mapping[str, Case]] = {
    **{
        f"servo_{key}_{ratio:g}": Limit(limit(ratio), partial(_servo, method, ratio, joint))
        for key, (method, joint, limit) in _SERVOS.items()
        for ratio in (0.0, 0.5, 1.0)
    },
    **{
        f"drag_{name}": Limit(drag_limit(method), partial(_our_drag, method))
        for name, method in INTEGRATORS.items()
    },
    "drag_mujoco_rk4": Limit(drag_limit(INTEGRATORS["rk4"]), partial(_mujoco_drag, RK4, 0)),
    "drag_mujoco_euler_explicit": Limit(2.0, partial(_mujoco_drag, EULER, _EXPLICIT)),
    "drag_mujoco_euler": Limit(math.inf, partial(_mujoco_drag, EULER, 0)),
    "drag_mujoco_implicitfast": Limit(math.inf, partial(_mujoco_drag, IMPLICITFAST, 0)),
    "drag_mujoco_discrete": Limit(math.inf, partial(_mujoco_drag, DISCRETE, 0)),
    **{
        f"oscillation_explicit_euler_{phase:g}": Quantity(
            (1.0 + phase**2) ** (OUR_STEPS / 2), partial(_explicit_gain, phase)
        )
        for phase in (0.01, 0.1, 0.2)
    },
    "oscillation_semi_implicit_euler": Limit(2.0, partial(_oscillation, "semi_implicit_euler")),
    "oscillation_rk4": Limit(2.0 * math.sqrt(2.0), partial(_oscillation, "rk4")),
    "spin_rk4_norm": Limit(4.0 * math.sqrt(2.0), _norm),
    "spin_aliasing_lie_rk4": Limit(math.pi, partial(_our_turn, "lie_rk4")),
    "spin_aliasing_splitting2": Limit(math.pi, partial(_our_turn, "splitting2")),
    "spin_aliasing_rk4": Limit(rk4_aliasing(), partial(_our_turn, "rk4")),
    "spin_aliasing_mujoco_euler": Limit(math.pi, partial(_mujoco_turn, EULER)),
    "spin_aliasing_mujoco_rk4": Limit(math.pi, partial(_mujoco_turn, RK4)),
}
"""By name."""
