"""How deep an impact goes, how much of it comes back, and what becomes of a bounce.

A contact is a spring and a damper of the acceleration (see `scenes.Contact`), so that each of
these has a formula. tau is ``solref[0]``, h the time step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Final

import mujoco
import numpy as np

from roller_env.lab.methods import MujocoIntegrator, MujocoMethod
from roller_env.lab.simulate import Float64, record
from roller_env.lab.stability.cases import Case, Effort, Finding
from roller_env.lab.stability.scenes import (
    EULER,
    FINE_S,
    GRAVITY,
    MAP,
    SPRING,
    TAU_S,
    Contact,
    add_ball,
    add_floor,
    new_spec,
)


def impact(
    method: MujocoMethod, dt_s: float, contact: Contact, phase: float
) -> tuple[float, float]:
    """Throw a weightless ball at 1 m/s at a floor.

    Args:
        method: integrator.
        dt_s: time step, s.
        contact: of ball and floor.
        phase: the share of a step's way, 0 to 1, that it is in the floor when first seen there.

    Returns:
        Greatest depth, m, and speed with which it comes back, m/s.
    """
    spec = new_spec(method, dt_s)
    add_ball(spec, contact)
    add_floor(spec, contact)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] = (1.0 - phase) * dt_s
    data.qvel[2] = -1.0
    path = record(model, data, 2 + math.ceil(10.0 * TAU_S / dt_s))
    return max(0.0, -float(path.qpos[:, 2].min())), float(data.qvel[2])


ARRIVALS: Final = 2001
"""Phases of arrival of the predicted greatest return."""


def worst_return(phase_step: float, ratio: float) -> float:
    """Return how much faster than it came a ball can leave a contact, at any phase of arrival.

    The Euler step of the unilateral spring, written out: while the ball is in the floor,
    v += h max(0, w² x - 2 z w v) downwards, x -= h v.

    Args:
        phase_step: h w, w = 1 / (tau z) being the contact's natural frequency.
        ratio: its damping ratio z.
    """
    depth = phase_step * np.linspace(0.0, 1.0, ARRIVALS)
    speed = np.ones_like(depth)
    while True:
        push = phase_step * (depth + 2.0 * ratio * speed)
        pushed = (depth > 0.0) & (push > 0.0)
        if not pushed.any():
            return float(-speed.min())
        speed -= np.where(pushed, push, 0.0)
        depth += np.where(pushed, phase_step * speed, 0.0)


def _measure_penetration(method: MujocoMethod, _effort: Effort) -> Finding:
    return Finding(impact(method, FINE_S, Contact(), 0.5)[0])


def _measure_return(method: MujocoMethod, _effort: Effort) -> Finding:
    return Finding(impact(method, FINE_S, Contact(), 0.5)[1])


def _measure_worst_return(dt_s: float, ratio: float, effort: Effort) -> Finding:
    phases = np.linspace(1e-6, 1.0 - 1e-6, 4 * effort.phases)
    contact = Contact(solref=(TAU_S, ratio))
    speeds = [impact(EULER, dt_s, contact, float(phase))[1] for phase in phases]
    return Finding(max(speeds), len(speeds))


def impact_cases() -> Iterator[Case]:
    """Yield how deep an impact goes and how much of its speed comes back."""
    integrators: tuple[MujocoIntegrator, ...] = ("Euler", "implicitfast", "RK4", "discrete")
    for integrator in integrators:
        method = MujocoMethod(integrator)
        yield Case(
            name=f"penetration_{integrator.lower()}",
            group="impact",
            quantity="depth of an impact at 1 m/s, m",
            method=f"{method.name}, h = tau/400",
            predicted=TAU_S / math.e,
            formula="v tau / e",
            source=SPRING,
            criterion="greatest depth",
            measure=partial(_measure_penetration, method),
        )
        yield Case(
            name=f"restitution_{integrator.lower()}",
            group="impact",
            quantity="restitution of a contact of damping ratio 1",
            method=f"{method.name}, h = tau/400",
            predicted=math.exp(-2.0),
            formula="exp(-2)",
            source=SPRING + "; it lets go at 2 tau",
            criterion="speed afterwards over speed before",
            measure=partial(_measure_return, method),
        )
    for dt_s, ratio in ((1 / 120, 0.1), (1 / 120, 0.2), (1 / 240, 0.1), (1 / 960, 0.1)):
        step = dt_s / (TAU_S * ratio)
        yield Case(
            name=f"return_{round(1 / dt_s)}hz_ratio_{ratio:g}",
            group="impact",
            quantity=f"greatest speed of return, damping ratio {ratio:g}",
            method=f"{EULER.name}, h = 1/{round(1 / dt_s)} s",
            predicted=worst_return(step, ratio),
            formula=f"(h w)² + 2 z h w - 1 in a one-step contact; h w = {step:.3g}",
            source=MAP,
            criterion="speed afterwards over speed before, greatest of all phases of arrival",
            measure=partial(_measure_worst_return, dt_s, ratio),
            note="stiffness is 1/(tau z)²: a bouncier contact in this form is a stiffer one",
        )


# Bouncing for long ---------------------------------------------------------------------------

STIFFNESS: Final = 1e5
DROP_M: Final = 1.0
BOUNCE_S: Final = 10.0


def bounce_path(
    integrator: MujocoIntegrator, dt_s: float, drop: float, contact: Contact
) -> Float64:
    """Return the heights, m, (steps,), of a ball's lowest point that bounces for `BOUNCE_S`."""
    spec = new_spec(MujocoMethod(integrator), dt_s, GRAVITY)
    add_ball(spec, contact)
    add_floor(spec, contact)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] = drop
    return record(model, data, round(BOUNCE_S / dt_s)).qpos[1:, 2]


def _measure_bounce(integrator: MujocoIntegrator, dt_s: float, effort: Effort) -> Finding:
    contact = Contact(solref=(-STIFFNESS, 0.0), impedance=0.99)
    drops = DROP_M * np.linspace(1.0, 1.05, effort.phases // 2)
    last = round(2.2 / dt_s)
    ratios = [
        bounce_path(integrator, dt_s, float(drop), contact)[-last:].max() / drop for drop in drops
    ]
    return Finding(float(np.median(ratios)), len(ratios))


def bounce_cases() -> Iterator[Case]:
    """Yield what becomes of an elastic ball's height in ten seconds."""
    gain = (
        "what one spring step too many or too few gives is kept: a random walk, up more than down"
    )
    settings: tuple[tuple[MujocoIntegrator, float, tuple[float, float], str], ...] = (
        ("Euler", 0.004, (1.0, 4.0), gain + "; h w = 1.26"),
        ("Euler", 0.001, (0.9, 1.1), gain),
        ("Euler", 0.00025, (0.98, 1.02), gain),
        ("RK4", 0.004, (0.0, 0.7), "stages that are out of the floor see no spring: it loses"),
        ("RK4", 0.001, (0.99, 1.01), ""),
        ("discrete", 0.001, (0.0, 0.01), "discrete makes the contact implicit: nothing bounces"),
    )
    for integrator, dt_s, band, note in settings:
        yield Case(
            name=f"bounce_{integrator.lower()}_{1e3 * dt_s:g}ms",
            group="bouncing",
            quantity="height after 10 s over height before, stiffness 1e5/s², no damping",
            method=f"{MujocoMethod(integrator).name}, h = {1e3 * dt_s:g} ms",
            predicted=1.0,
            formula="1",
            source="energy",
            criterion="highest in the last 2.2 s, median over drops of 1 to 1.05 m",
            measure=partial(_measure_bounce, integrator, dt_s),
            band=band,
            note=note,
            quick=dt_s >= 0.001,
        )
