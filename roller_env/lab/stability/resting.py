"""Contacts that last: pushing, resting, crushing, rolling over seams.

tau is ``solref[0]``, d the impedance, h the time step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Final

import mujoco
import numpy as np

from roller_env.lab.methods import MujocoIntegrator, MujocoMethod
from roller_env.lab.simulate import Float64, record, stays
from roller_env.lab.stability.bisection import locate
from roller_env.lab.stability.cases import Case, Effort, Finding
from roller_env.lab.stability.scenes import (
    COARSE_S,
    EULER,
    GRAVITY,
    RADIUS_M,
    SETTLE_S,
    STATICS,
    TAU_S,
    Contact,
    add_ball,
    add_box,
    add_floor,
    new_spec,
)
from roller_env.lab.stability.smooth import explicit_damping_limit, rk4_servo_limit


def sink_of_a_pushed_ball(method: MujocoMethod, dt_s: float, tau_s: float) -> float:
    """Return how deep, m, a wall that is moved by mocap at 1 m/s gets into the ball it pushes."""
    contact = Contact(solref=(tau_s, 1.0))
    spec = new_spec(method, dt_s)
    add_ball(spec, contact)
    face = -RADIUS_M
    wall = spec.worldbody.add_body(name="wall", mocap=True, pos=(face - 0.1, 0.0, RADIUS_M))
    wall.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 2.0, 2.0], **contact.attributes)
    model = spec.compile()
    data = mujoco.MjData(model)
    start = float(data.mocap_pos[0, 0])

    def move(step: int) -> None:
        data.mocap_pos[0, 0] = start + step * dt_s

    record(model, data, 200 + math.ceil(60.0 * tau_s / dt_s), before=move)
    return float(data.mocap_pos[0, 0] - start - data.qpos[0])


def _measure_sink(method: MujocoMethod, dt_s: float, tau_s: float, _effort: Effort) -> Finding:
    return Finding(sink_of_a_pushed_ball(method, dt_s, tau_s))


def mocap_cases() -> Iterator[Case]:
    """Yield how deep a wall without a velocity sinks into what it pushes; and refsafe's clamp."""
    settings: tuple[tuple[MujocoIntegrator, float, float, float, str], ...] = (
        ("Euler", COARSE_S, TAU_S, 2.0 * TAU_S, "2 tau v"),
        ("implicitfast", COARSE_S, TAU_S, 2.0 * TAU_S, "2 tau v"),
        ("discrete", COARSE_S, TAU_S, 2.0 * TAU_S + COARSE_S, "(2 tau + h) v"),
        ("Euler", 0.008, 0.005, 4.0 * 0.008, "2 (2 h) v: refsafe takes tau = 2 h"),
        ("Euler", 0.004, 0.005, 4.0 * 0.004, "2 (2 h) v: refsafe takes tau = 2 h"),
    )
    for integrator, dt_s, tau_s, predicted, formula in settings:
        clamped = tau_s < 2.0 * dt_s
        name = f"refsafe_{1e3 * dt_s:g}ms" if clamped else f"mocap_{integrator.lower()}"
        yield Case(
            name=name,
            group="pushing",
            quantity="depth of a mocap wall in a ball that it pushes at 1 m/s, m",
            method=f"{MujocoMethod(integrator).name}, h = {1e3 * dt_s:g} ms, tau = {tau_s:g} s",
            predicted=predicted,
            formula=formula,
            source="the wall counts as at rest: spring x/tau² against damper 2v/tau",
            criterion="depth when it no longer changes",
            measure=partial(_measure_sink, MujocoMethod(integrator), dt_s, tau_s),
            note="judged at the end of the step, when the wall has moved on by h v"
            if integrator == "discrete"
            else "",
        )


def resting_stays(integrator: MujocoIntegrator, steps: int, share: float) -> bool:
    """Say whether a resting ball calms down when h / tau is ``share`` and refsafe is off."""
    dt_s = share * TAU_S
    spec = new_spec(MujocoMethod(integrator), dt_s, GRAVITY)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_REFSAFE
    contact = Contact()
    add_ball(spec, contact)
    add_floor(spec, contact)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] = -(1.0 - contact.impedance) * GRAVITY * TAU_S**2
    data.qvel[2] = kick = 1e-9
    return stays(model, data, steps, lambda: bool(abs(data.qvel[2]) < 1e3 * kick))


def _measure_resting(integrator: MujocoIntegrator, predicted: float, effort: Effort) -> Finding:
    holds = partial(resting_stays, integrator, effort.steps // 2)
    return Finding.of(locate(holds, predicted, effort.tolerance))


def crush_depth(mass_ratio: float, tau_s: float) -> float:
    """Return how far, m, a block of ``mass_ratio`` times its mass sinks onto a ball on the floor.

    Both contacts are counted: the block's into the ball and the ball's into the floor.
    """
    contact = Contact(solref=(tau_s, 1.0))
    dt_s = tau_s / 40.0
    spec = new_spec(EULER, dt_s, GRAVITY)
    add_ball(spec, contact, radius=10.0)
    add_floor(spec, contact)
    block = spec.worldbody.add_body(name="block", pos=(0.0, 0.0, 25.0))
    block.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, 1.0])
    block.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[5.0, 5.0, 5.0], mass=mass_ratio, **contact.attributes
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    # The soft pair settles with the time constant 2 (1 - d) tau M/m; it is given twelve of them.
    seconds = tau_s * (20.0 + 24.0 * (1.0 - contact.impedance) * mass_ratio)
    mujoco.mj_step(model, data, round(seconds / dt_s))
    return -float(data.qpos[3])


def _measure_crush(mass_ratio: float, tau_s: float, _effort: Effort) -> Finding:
    return Finding(crush_depth(mass_ratio, tau_s))


def resting_cases() -> Iterator[Case]:
    """Yield resting contacts whose step is too long, and loads that are too heavy."""
    settings: tuple[tuple[MujocoIntegrator, float, str], ...] = (
        ("Euler", explicit_damping_limit(1.0), "2 sqrt 2 - 2"),
        ("implicitfast", explicit_damping_limit(1.0), "2 sqrt 2 - 2"),
        ("RK4", rk4_servo_limit(1.0), "R(-h/tau) = ±1"),
    )
    for integrator, predicted, formula in settings:
        yield Case(
            name=f"resting_{integrator.lower()}",
            group="resting",
            quantity="largest h / tau of a resting contact",
            method=f"{MujocoMethod(integrator).name}, refsafe disabled",
            predicted=predicted,
            formula=formula,
            source="as the servo's of damping ratio 1: no integrator of these takes a contact "
            "implicitly",
            criterion="a tiny kick grows a thousand times",
            measure=partial(_measure_resting, integrator, predicted),
        )
    for ratio, tau_s in ((1.0, TAU_S), (1000.0, TAU_S), (1000.0, TAU_S / 10)):
        sink = 2.0 * (1.0 - Contact().impedance) * (1.0 + ratio) * GRAVITY * tau_s**2
        yield Case(
            name=f"crush_1_to_{ratio:g}_tau_{1e3 * tau_s:g}ms",
            group="resting",
            quantity=f"sinking of a block of {ratio:g} kg onto a ball of 1 kg, m",
            method=f"{EULER.name}, tau = {tau_s:g} s",
            predicted=sink,
            formula="2 (1 - d) (1 + M/m) g tau²",
            source=STATICS + "; a contact is as stiff as its lighter body",
            criterion="depth of both contacts when at rest",
            measure=partial(_measure_crush, ratio, tau_s),
        )


# Seams ---------------------------------------------------------------------------------------

TILE_M: Final = 1.0
SEAMS: Final = 4


def roll_over_seams(
    dt_s: float, speed: float, phase: float, *, merged: bool
) -> tuple[Float64, Float64, float]:
    """Roll a ball over the seams of coplanar tiles.

    Args:
        dt_s: time step, s.
        speed: m/s.
        phase: share of a step's way by which the start is moved.
        merged: whether the tiles are one box.

    Returns:
        Way along the tiles (steps,), height of the ball's lowest point over its rest (steps,),
        both m, and the change of speed as a share.
    """
    contact = Contact(friction=1.0)
    spec = new_spec(EULER, dt_s, GRAVITY)
    add_ball(spec, contact, rolls=True)
    count = 1 if merged else SEAMS + 1
    length = (SEAMS + 1) * TILE_M / count
    for index in range(count):
        middle = (index + 0.5) * length - 0.5 * TILE_M
        add_box(spec, contact, (middle, 0.0, -0.5), (length / 2, 2.0, 0.5))
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[0] = phase * speed * dt_s
    mujoco.mj_step(model, data, round(SETTLE_S / dt_s))
    rest = float(data.qpos[2])
    data.qvel[0], data.qvel[4] = speed, speed / RADIUS_M
    path = record(model, data, round(SEAMS * TILE_M / (speed * dt_s))).qpos[1:]
    return path[:, 0], path[:, 2] - rest, float(data.qvel[0]) / speed - 1.0


def rest_depth(contact: Contact) -> float:
    """Return how deep a ball rests in the floor, m."""
    return (1.0 - contact.impedance) * GRAVITY * contact.solref[0] ** 2


def _measure_bump(dt_s: float, merged: bool, effort: Effort) -> Finding:
    phases = np.linspace(0.0, 1.0, max(2, effort.phases // 4), endpoint=False)
    bumps = [roll_over_seams(dt_s, 5.0, float(p), merged=merged)[1].max() for p in phases]
    return Finding(float(np.median(bumps)), len(bumps))


def seam_cases() -> Iterator[Case]:
    """Yield the bump of a ball that rolls over coplanar tiles."""
    predicted = 2.0 * rest_depth(Contact()) / math.e
    for dt_s, band, note in (
        (
            0.00002,
            (0.96, 1.02),
            "the kick lasts 2 ms, a tenth of tau, and some of it is damped meanwhile",
        ),
        (
            COARSE_S,
            (0.5, 1.8),
            "a step of 10 mm meets the 9 mm before a seam, where both tiles touch, once or not",
        ),
    ):
        yield Case(
            name=f"seam_bump_{1e3 * dt_s:g}ms",
            group="seams",
            quantity="bump at the seam of two tiles at 5 m/s, m",
            method=f"{EULER.name}, h = {1e3 * dt_s:g} ms",
            predicted=predicted,
            formula="2 delta / e, delta = (1 - d) g tau² the depth of rest",
            source="the next tile's edge pushes against the ball rolling onto it: kick 2 delta/tau",
            criterion="greatest height over the rest, median over phases",
            measure=partial(_measure_bump, dt_s, False),
            band=band,
            note=note,
        )
