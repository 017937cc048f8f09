"""What the friction cones do to a push and to a slide, and how softness creeps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Final

import mujoco
import numpy as np

from roller_env.lab.methods import Cone, MujocoMethod
from roller_env.lab.simulate import settled
from roller_env.lab.stability.bisection import locate
from roller_env.lab.stability.cases import Case, Effort, Finding
from roller_env.lab.stability.scenes import (
    COARSE_S,
    GRAVITY,
    SETTLE_S,
    STATICS,
    Contact,
    add_ball,
    add_floor,
    new_spec,
)

MU: Final = 0.5


def _on_the_floor(
    cone: Cone, dt_s: float, impratio: float = 1.0, mu: float = MU
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a point mass that has come to rest on the floor."""
    contact = Contact(friction=mu)
    spec = new_spec(MujocoMethod("Euler", cone), dt_s, GRAVITY)
    spec.option.impratio = impratio
    add_ball(spec, contact)
    add_floor(spec, contact)
    model = spec.compile()
    return model, settled(model, SETTLE_S)


def pushed_speed(
    cone: Cone, angle_deg: float, share: float, seconds: float, impratio: float = 1.0
) -> float:
    """Return the speed, m/s, after pushing a resting mass with ``share`` of its friction."""
    model, data = _on_the_floor(cone, COARSE_S, impratio)
    angle = math.radians(angle_deg)
    force = share * MU * GRAVITY
    data.qfrc_applied[:2] = force * math.cos(angle), force * math.sin(angle)
    mujoco.mj_step(model, data, round(seconds / COARSE_S))
    return float(np.hypot(*data.qvel[:2]))


def heading_after(cone: Cone, angle_deg: float, speed: float, seconds: float) -> float:
    """Return the heading, degrees, of a mass that slid with ``speed`` m/s at ``angle_deg``."""
    model, data = _on_the_floor(cone, COARSE_S)
    angle = math.radians(angle_deg)
    data.qvel[:2] = speed * math.cos(angle), speed * math.sin(angle)
    mujoco.mj_step(model, data, round(seconds / COARSE_S))
    return math.degrees(math.atan2(data.qvel[1], data.qvel[0]))


PUSH_S: Final = 4.0
SLIP_M_S: Final = 0.03
"""Speed after `PUSH_S` that is called slipping: it takes 0.15 % more than the friction."""


def _measure_friction(cone: Cone, angle_deg: float, predicted: float, effort: Effort) -> Finding:
    def holds(share: float) -> bool:
        return pushed_speed(cone, angle_deg, share, PUSH_S, impratio=10.0) < SLIP_M_S

    return Finding.of(locate(holds, predicted, effort.tolerance))


def _measure_heading(cone: Cone, _effort: Effort) -> Finding:
    return Finding(heading_after(cone, 22.5, 2.0, 0.2))


def _measure_hold(cone: Cone, impratio: float, _effort: Effort) -> Finding:
    return Finding(pushed_speed(cone, 45.0, 0.9, 2.0, impratio))


def creep_speed(share: float, impratio: float, contact: Contact) -> float:
    """Return the speed, m/s, with which a mass creeps under ``share`` of its friction.

    Friction is a damper of 2 / (d tau) of the acceleration, made soft by (1 - d) / d / impratio.
    """
    damping = 2.0 / (contact.impedance * contact.solref[0])
    softness = (1.0 - contact.impedance) / contact.impedance
    return softness * share * MU * GRAVITY / (damping * impratio)


def friction_cases() -> Iterator[Case]:
    """Yield what the pyramidal cone does to friction, and what softness does."""
    diamond = "the pyramid's cut is a square with its corners on the axes"
    settings: tuple[tuple[Cone, float, float, str], ...] = (
        ("elliptic", 0.0, 1.0, "1"),
        ("elliptic", 45.0, 1.0, "1"),
        ("pyramidal", 0.0, 1.0, "1"),
        ("pyramidal", 45.0, math.sqrt(0.5), "1 / sqrt 2"),
    )
    for cone, angle, predicted, formula in settings:
        yield Case(
            name=f"friction_{cone}_{angle:g}deg",
            group="friction",
            quantity=f"push at {angle:g}° that begins to slide, of mu m g",
            method=MujocoMethod("Euler", cone).name,
            predicted=predicted,
            formula=formula,
            source=diamond if cone == "pyramidal" else "Coulomb",
            criterion=f"faster than {SLIP_M_S:g} m/s after {PUSH_S:g} s",
            measure=partial(_measure_friction, cone, angle, predicted),
        )
    angle = math.radians(22.5)
    lost = MU * GRAVITY * 0.2
    bent = math.degrees(math.atan2(2.0 * math.sin(angle), 2.0 * math.cos(angle) - lost))
    headings: tuple[tuple[Cone, float, str, tuple[float, float]], ...] = (
        ("elliptic", 22.5, "unchanged", (0.999, 1.001)),
        ("pyramidal", bent, "atan2(v sin a, v cos a - mu g T)", (0.92, 1.01)),
    )
    for cone, predicted, formula, band in headings:
        yield Case(
            name=f"heading_{cone}",
            group="friction",
            quantity="heading of a slide at 22.5° and 2 m/s after 0.2 s, degrees",
            method=MujocoMethod("Euler", cone).name,
            predicted=predicted,
            formula=formula,
            source=diamond + ": a corner brakes along one axis only",
            criterion="direction of the velocity",
            measure=partial(_measure_heading, cone),
            band=band,
            note="the mass hops while it slides, so that friction acts in a few touches"
            if cone == "pyramidal"
            else "",
        )
    yield from _hold_cases()


def _hold_cases() -> Iterator[Case]:
    slip = (0.9 - math.sqrt(0.5)) * MU * GRAVITY * 2.0
    settings: tuple[tuple[Cone, float, float, str, str], ...] = (
        ("elliptic", 1.0, creep_speed(0.9, 1.0, Contact()), "(1-d)/d a0 / b", STATICS),
        ("elliptic", 10.0, creep_speed(0.9, 10.0, Contact()), "(1-d)/d a0 / (10 b)", STATICS),
        ("pyramidal", 1.0, slip, "(0.9 - 1/sqrt 2) mu g T", "Newton: it slips"),
    )
    for cone, impratio, predicted, formula, source in settings:
        yield Case(
            name=f"hold_{cone}_impratio_{impratio:g}",
            group="friction",
            quantity="speed after 2 s of a push with 0.9 mu m g at 45°, m/s",
            method=f"{MujocoMethod('Euler', cone).name}, impratio {impratio:g}",
            predicted=predicted,
            formula=formula,
            source=source,
            criterion="speed",
            measure=partial(_measure_hold, cone, impratio),
        )
