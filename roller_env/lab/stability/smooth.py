"""Limits of smooth motion: servos, drag, oscillation and spin."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from roller_env.lab.methods import MujocoIntegrator, MujocoMethod
from roller_env.lab.simulate import stays
from roller_env.lab.stability.bisection import first_failure, locate
from roller_env.lab.stability.cases import Case, Effort, Finding
from roller_env.rigid_body import (
    INTEGRATORS,
    Body,
    Integrator,
    State,
    Wrench,
    advance,
    linear_drag,
    trajectory,
)
from roller_env.rigid_body.integrators import RungeKutta4, Splitting

RATIOS: Final = (0.0, 0.5, 1.0)
"""Damping ratios of the servos."""

SERVO_DT_S: Final = 0.01
SERVO_SEARCH: Final = np.geomspace(0.1, 20.0, 60)
"""h w at which a method without a limit is tried."""

SMALL: Final = 1e-6
"""Where a servo starts, m: it may grow a million times before it is called unstable, and is still
far below the 1e10 at which MuJoCo complains."""

OUR_STEPS: Final = 300
"""Steps of our own methods; a linear motion grows from the first step on, or never."""

_HAIRER: Final = "Hairer & Wanner, Solving Ordinary Differential Equations II, IV.2"
_JURY: Final = "roots of the step's characteristic polynomial on the unit circle (Jury)"


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


RK4_POLYNOMIAL: Final = stability_polynomial(INTEGRATORS["rk4"])


def smallest_instability(gain: Callable[[float], float], upper: float = 10.0) -> float:
    """Return the smallest h at which ``gain``, the growth a step, passes 1; it must below upper."""
    grid = np.linspace(0.3, upper, 400)
    above = np.array([gain(h) for h in grid]) > 1.0
    first = int(above.argmax())
    return float(brentq(lambda h: gain(h) - 1.0, grid[first - 1], grid[first]))


# Slide servo ---------------------------------------------------------------------------------


def rk4_servo_limit(ratio: float) -> float:
    """Return the largest h w at which Runge-Kutta's region holds both roots of the servo."""
    roots = np.roots([1.0, 2.0 * ratio, 1.0])
    return smallest_instability(lambda h: float(np.abs(RK4_POLYNOMIAL(h * roots)).max()))


def explicit_damping_limit(ratio: float) -> float:
    """Return the largest h w of semi-implicit Euler with the damper taken from before the step."""
    return 2.0 * math.sqrt(ratio**2 + 1.0) - 2.0 * ratio


def implicit_damping_limit(ratio: float) -> float:
    """Return the largest h w of semi-implicit Euler with the damper taken from after the step."""
    return 2.0 * math.sqrt(ratio**2 + 1.0) + 2.0 * ratio


def servo_model(
    method: MujocoMethod, dt_s: float, frequency: float, ratio: float, *, joint_damping: bool
) -> mujoco.MjModel:
    """Return 1 kg on a slide joint with a position servo.

    Args:
        method: integrator.
        dt_s: time step, s.
        frequency: natural frequency of the servo, rad/s.
        ratio: damping ratio.
        joint_damping: whether the damper is the joint's, or the actuator's.
    """
    spec = mujoco.MjSpec()
    method.configure(spec, dt_s)
    spec.option.gravity = [0.0, 0.0, 0.0]
    body = spec.worldbody.add_body()
    damping = 2.0 * ratio * frequency
    joint = body.add_joint(name="slide", type=mujoco.mjtJoint.mjJNT_SLIDE)
    joint.damping[0] = damping if joint_damping else 0.0
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0.0, 0.0], mass=1.0)
    servo = spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_JOINT, target="slide")
    servo.gainprm[0] = frequency**2
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.biasprm[1:3] = [-(frequency**2), 0.0 if joint_damping else -damping]
    return spec.compile()


def stays_small(model: mujoco.MjModel, steps: int) -> bool:
    """Say whether a motion that begins at `SMALL` never grows a million times."""
    data = mujoco.MjData(model)
    data.qpos[0] = SMALL
    return stays(model, data, steps, lambda: bool(abs(data.qpos[0]) < 1e6 * SMALL))


def _servo_holds(
    method: MujocoMethod, ratio: float, joint_damping: bool, steps: int, phase: float
) -> bool:
    frequency = phase / SERVO_DT_S
    model = servo_model(method, SERVO_DT_S, frequency, ratio, joint_damping=joint_damping)
    return stays_small(model, steps)


def _measure_servo(
    method: MujocoMethod, ratio: float, joint_damping: bool, predicted: float, effort: Effort
) -> Finding:
    holds = partial(_servo_holds, method, ratio, joint_damping, effort.steps)
    if math.isinf(predicted):
        return Finding.of(first_failure(holds, SERVO_SEARCH))
    return Finding.of(locate(holds, predicted, effort.tolerance))


_SERVOS: Final[
    tuple[tuple[str, MujocoIntegrator, bool, Callable[[float], float], str, str], ...]
] = (
    ("euler_actuator", "Euler", False, explicit_damping_limit, "2 sqrt(z²+1) - 2z", _JURY),
    ("euler_joint", "Euler", True, implicit_damping_limit, "2 sqrt(z²+1) + 2z", _JURY),
    ("implicitfast", "implicitfast", False, implicit_damping_limit, "2 sqrt(z²+1) + 2z", _JURY),
    ("rk4", "RK4", False, rk4_servo_limit, "R(h lambda) on the unit circle", _HAIRER),
    ("discrete", "discrete", False, lambda _: math.inf, "none: spring and damper implicit", _JURY),
)


def servo_cases() -> Iterator[Case]:
    """Yield the slide servos."""
    for key, integrator, joint_damping, limit, formula, source in _SERVOS:
        method = MujocoMethod(integrator)
        damper = "joint damping" if joint_damping else "actuator damping"
        for ratio in RATIOS:
            predicted = limit(ratio)
            yield Case(
                name=f"servo_{key}_{ratio:g}",
                group="servo",
                quantity=f"largest h w at damping ratio {ratio:g}",
                method=f"{method.name}, {damper}",
                predicted=predicted,
                formula=formula,
                source=source,
                criterion="grows a million times",
                measure=partial(_measure_servo, method, ratio, joint_damping, predicted),
                searched_to=float(SERVO_SEARCH[-1]) if math.isinf(predicted) else math.inf,
            )


# Drag on a free body -------------------------------------------------------------------------


def _our_drag_holds(method: Integrator, phase: float) -> bool:
    """Say whether a cube that drag brakes, c h / m = ``phase``, is slower in the end."""
    state = State.create(Body.cube(1.0, 1.0), velocity=(1.0, 0.0, 0.0))
    motion = trajectory(state, method, 1.0, OUR_STEPS, load=linear_drag(phase))
    return all(abs(reached.velocity[0, 0]) <= 1.0 for reached in motion)


def _mujoco_drag_holds(method: MujocoMethod, eulerdamp: bool, steps: int, phase: float) -> bool:
    spec = mujoco.MjSpec()
    method.configure(spec, SERVO_DT_S)
    spec.option.gravity = [0.0, 0.0, 0.0]
    if not eulerdamp:
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    body = spec.worldbody.add_body()
    joint = body.add_freejoint()
    joint.damping[0] = phase / SERVO_DT_S
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.5, 0.5, 0.5], mass=1.0)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[0] = SMALL
    small = stays(model, data, steps, lambda: bool(abs(data.qvel[0]) <= 1e3 * SMALL))
    return small and abs(float(data.qvel[0])) <= SMALL


def drag_limit(method: Integrator) -> float:
    """Return the largest h c / m at which the method's polynomial does not grow."""
    polynomial = stability_polynomial(method)
    return smallest_instability(lambda h: abs(float(polynomial(-h))), upper=40.0)


def drag_cases() -> Iterator[Case]:
    """Yield drag on a free body, for every method."""
    quantity = "largest h c / m of linear drag"
    for method in INTEGRATORS.values():
        predicted = drag_limit(method)
        holds = partial(_our_drag_holds, method)
        yield Case(
            name=f"drag_{method.name}",
            group="drag",
            quantity=quantity,
            method=f"ours {method.name}",
            predicted=predicted,
            formula="R(-h c/m) = ±1",
            source=_HAIRER,
            criterion=f"faster than at the start, within {OUR_STEPS} steps",
            measure=partial(_measure_bracketed, holds, predicted),
            quick=method.name in {"explicit_euler", "rk4"},
        )
    yield from _mujoco_drag_cases(quantity)


def _mujoco_drag_cases(quantity: str) -> Iterator[Case]:
    settings: tuple[tuple[str, MujocoIntegrator, bool, float, str], ...] = (
        ("mujoco_rk4", "RK4", True, drag_limit(INTEGRATORS["rk4"]), "R(-h c/m) = ±1"),
        ("mujoco_euler_explicit", "Euler", False, 2.0, "1 - h c/m = -1"),
        ("mujoco_euler", "Euler", True, math.inf, "none: 1/(1 + h c/m)"),
        ("mujoco_implicitfast", "implicitfast", True, math.inf, "none: 1/(1 + h c/m)"),
        ("mujoco_discrete", "discrete", True, math.inf, "none: 1/(1 + h c/m)"),
    )
    for key, integrator, eulerdamp, predicted, formula in settings:
        method = MujocoMethod(integrator)
        yield Case(
            name=f"drag_{key}",
            group="drag",
            quantity=quantity,
            method=method.name + ("" if eulerdamp else ", eulerdamp disabled"),
            predicted=predicted,
            formula=formula,
            source=_HAIRER,
            criterion="faster at the end than at the start",
            measure=partial(_measure_mujoco_drag, method, eulerdamp, predicted),
            searched_to=float(SERVO_SEARCH[-1]) if math.isinf(predicted) else math.inf,
        )


def _measure_mujoco_drag(
    method: MujocoMethod, eulerdamp: bool, predicted: float, effort: Effort
) -> Finding:
    holds = partial(_mujoco_drag_holds, method, eulerdamp, effort.steps // 4)
    if math.isinf(predicted):
        return Finding.of(first_failure(holds, SERVO_SEARCH))
    return _measure_bracketed(holds, predicted, effort)


def _measure_bracketed(holds: Callable[[float], bool], predicted: float, effort: Effort) -> Finding:
    """Look near the prediction first."""
    return Finding.of(locate(holds, predicted, effort.tolerance))


# Oscillation ---------------------------------------------------------------------------------


def _spring(state: State, _t: float) -> Wrench:
    """Return the pull of a spring of 1 N/m to the origin: w = 1 on 1 kg."""
    return Wrench(-state.position, np.zeros_like(state.position))


def _amplitude(state: State) -> float:
    return float(np.hypot(state.position[0, 0], state.velocity[0, 0]))


def _swing(method: Integrator, phase: float, steps: int) -> Iterator[float]:
    """Yield the amplitude, which is 1 at the start, after each step of h w = ``phase``."""
    state = State.create(Body.cube(1.0, 1.0), position=(1.0, 0.0, 0.0))
    return map(_amplitude, trajectory(state, method, phase, steps, load=_spring))


def _oscillation_holds(method: Integrator, phase: float) -> bool:
    """Say whether a swing stays; close to the limit a stable one may grow a thousand times."""
    return all(amplitude < 1e3 for amplitude in _swing(method, phase, 2 * OUR_STEPS))


def _explicit_euler_gain(phase: float) -> float:
    return float((1.0 + phase**2) ** (OUR_STEPS / 2))


def _measure_gain(phase: float, _effort: Effort) -> Finding:
    *_, last = _swing(INTEGRATORS["explicit_euler"], phase, OUR_STEPS)
    return Finding(last)


def oscillation_cases() -> Iterator[Case]:
    """Yield an undamped spring: explicit Euler never conserves it, the others do up to a limit."""
    for phase in (0.01, 0.1, 0.2):
        yield Case(
            name=f"oscillation_explicit_euler_{phase:g}",
            group="oscillation",
            quantity=f"growth of a swing in {OUR_STEPS} steps of h w = {phase:g}",
            method="ours explicit_euler",
            predicted=_explicit_euler_gain(phase),
            formula="(1 + (h w)²)^(n/2)",
            source="modulus of a step, 1 + i h w",
            criterion="amplitude at the end over that at the start",
            measure=partial(_measure_gain, phase),
            note="more than 1 at any h: explicit Euler has no stable step for an oscillation",
        )
    for name, predicted, formula in (
        ("semi_implicit_euler", 2.0, "2"),
        ("rk4", 2.0 * math.sqrt(2.0), "2 sqrt 2: R(i h w) on the unit circle"),
    ):
        yield Case(
            name=f"oscillation_{name}",
            group="oscillation",
            quantity="largest h w of an undamped spring",
            method=f"ours {name}",
            predicted=predicted,
            formula=formula,
            source=_HAIRER,
            criterion="grows a thousand times",
            measure=partial(
                _measure_bracketed, partial(_oscillation_holds, INTEGRATORS[name]), predicted
            ),
        )


# Spin ----------------------------------------------------------------------------------------


def _spinning(rate: float) -> State:
    return State.create(Body.cube(1.0, 1.0), angular_velocity=(0.0, 0.0, rate))


def _norm_holds(phase: float) -> bool:
    """Say whether the quaternion's norm has not grown, without renormalising."""
    raw = RungeKutta4(renormalise=False, renormalise_stages=False)
    motion = trajectory(_spinning(phase), raw, 1.0, OUR_STEPS)
    return all(float(np.linalg.norm(reached.orientation)) <= 1.0 for reached in motion)


def _turns_forward(method: Integrator, phase: float) -> bool:
    """Say whether a step, read as the shortest turn between two poses, has the spin's sense."""
    end = advance(_spinning(phase), method, 1.0, 1)
    w, z = end.rotation[0, 0], end.rotation[0, 3]
    return bool(w * z > 0.0)


def _mujoco_turns_forward(method: MujocoMethod, phase: float) -> bool:
    spec = mujoco.MjSpec()
    method.configure(spec, 1.0)
    spec.option.gravity = [0.0, 0.0, 0.0]
    body = spec.worldbody.add_body()
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.5, 0.5, 0.5], mass=1.0)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[5] = phase
    mujoco.mj_step(model, data)
    return bool(data.qpos[3] * data.qpos[6] > 0.0)


def rk4_aliasing() -> float:
    """Return h w at which the report's Runge-Kutta step, which is late, has turned half round.

    About a fixed axis the quaternion is a complex number, whose rate is i w/2 times itself; its
    points are scaled to 1 inside the step as well. It has turned a right angle where its real part
    is 0.
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


def spin_cases() -> Iterator[Case]:
    """Yield constant spin about a fixed axis."""
    limit = 4.0 * math.sqrt(2.0)
    yield Case(
        name="spin_rk4_norm",
        group="spin",
        quantity="largest h w without renormalising",
        method="ours rk4, not renormalised",
        predicted=limit,
        formula="4 sqrt 2: R(i h w/2) on the unit circle",
        source=_HAIRER,
        criterion=f"quaternion longer than 1 within {OUR_STEPS} steps",
        measure=partial(_measure_bracketed, _norm_holds, limit),
    )
    for name, predicted, formula in (
        ("lie_rk4", math.pi, "pi"),
        ("splitting2", math.pi, "pi"),
        ("rk4", rk4_aliasing(), "Re q = 0 after a step; pi for an exact turn"),
    ):
        yield _aliasing_case(
            f"ours {name}", name, predicted, formula, partial(_turns_forward, INTEGRATORS[name])
        )
    for integrator in ("Euler", "RK4"):
        method = MujocoMethod(integrator)
        holds = partial(_mujoco_turns_forward, method)
        yield _aliasing_case(method.name, f"mujoco_{integrator.lower()}", math.pi, "pi", holds)


def _aliasing_case(
    method: str, key: str, predicted: float, formula: str, holds: Callable[[float], bool]
) -> Case:
    return Case(
        name=f"spin_aliasing_{key}",
        group="spin",
        quantity="largest h w that is not taken for a turn the other way",
        method=method,
        predicted=predicted,
        formula=formula,
        source="sampling theorem: half a turn a step",
        criterion="the shortest turn between two poses has the wrong sense",
        measure=partial(_measure_bracketed, holds, predicted),
    )


def smooth_cases() -> Iterator[Case]:
    """Yield every case of this module."""
    yield from servo_cases()
    yield from drag_cases()
    yield from oscillation_cases()
    yield from spin_cases()
