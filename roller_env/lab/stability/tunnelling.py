"""When a ball passes through a wall."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Final

import mujoco
import numpy as np

from roller_env.lab.stability.bisection import first_failure, locate
from roller_env.lab.stability.cases import EXACT, Case, Effort, Finding
from roller_env.lab.stability.scenes import (
    COARSE_S,
    EULER,
    MAP,
    RADIUS_M,
    SPRING,
    TAU_S,
    Contact,
    add_ball,
    add_box,
    new_spec,
)

WALL_M: Final = 0.1
"""Thickness of the wall that the ball is shot at."""


def shoot(dt_s: float, speed: float, phase: float, *, speculative: bool, tau_s: float) -> bool:
    """Say whether a wall stops a ball of `RADIUS_M` that comes at ``speed`` m/s."""
    spec = new_spec(EULER, dt_s)
    if speculative:
        spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_SPECULATIVE
    contact = Contact(solref=(tau_s, 1.0))
    add_ball(spec, contact)
    add_box(spec, contact, (0.0, 0.0, -WALL_M / 2), (50.0, 50.0, WALL_M / 2))
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] = (2.0 - phase) * speed * dt_s
    data.qvel[2] = -speed
    mujoco.mj_step(model, data, 3 + math.ceil(20.0 * max(tau_s, 2 * dt_s) / dt_s))
    return bool(data.qpos[2] + RADIUS_M > -WALL_M / 2)


def wall_stops(dt_s: float, speculative: bool, tau_s: float, phases: int, speed: float) -> bool:
    """Say whether the wall stops the ball whenever within a step it arrives."""
    # Not 0 nor 1: see the case of the ball that a step ends exactly touching.
    shares = np.linspace(1e-4, 1.0 - 1e-4, phases)
    return all(
        shoot(dt_s, speed, float(share), speculative=speculative, tau_s=tau_s) for share in shares
    )


def tunnelling_speed(dt_s: float, tau_s: float = TAU_S) -> float:
    """Return the speed at which the ball's centre reaches the middle of the wall.

    There the nearest face is the far one, and the contact pushes it out behind. The depth is
    v tau / e if the step resolves the contact. If refsafe clamps tau to 2 h, the ball first seen a
    whole step's way deep is stopped in that step: v h.
    """
    depth = RADIUS_M + WALL_M / 2
    return depth / dt_s if 2.0 * dt_s >= tau_s else math.e * depth / tau_s


def _measure_tunnelling(
    dt_s: float, speculative: bool, predicted: float, effort: Effort
) -> Finding:
    holds = partial(wall_stops, dt_s, speculative, TAU_S, effort.phases)
    if math.isinf(predicted):
        return Finding.of(first_failure(holds, np.geomspace(5.0, 200.0, effort.phases)))
    tolerance = max(effort.tolerance, 1e-3)
    return Finding.of(locate(holds, predicted, tolerance))


def _sweep_covers(phases: int, rate_hz: float) -> bool:
    """Say whether a speculative contact stops every ball; argument 1/h, so that more is worse."""
    speeds = np.linspace(1.02 * tunnelling_speed(1 / rate_hz), 120.0, phases)
    return all(wall_stops(1 / rate_hz, True, TAU_S, phases, float(speed)) for speed in speeds)


def _measure_sweep(predicted: float, effort: Effort) -> Finding:
    holds = partial(_sweep_covers, effort.phases)
    found = locate(holds, predicted, max(effort.tolerance, 5e-3))
    return Finding.of(found)


def _share_that_tunnels_from_touching(_effort: Effort) -> Finding:
    """Shoot so that a step ends exactly touching: 1 is a tunnelling ball, infinity none."""
    # Binary fractions, so that the floating-point way to the wall is exact.
    stopped = shoot(1 / 512, 256.0, 0.0, speculative=True, tau_s=TAU_S)
    return Finding(math.inf if stopped else 256.0)


def tunnelling_cases() -> Iterator[Case]:
    """Yield the speeds at which a ball of 0.2 m passes a wall of 0.1 m."""
    quantity = "speed at which a ball of 0.2 m passes a wall of 0.1 m, m/s"
    criterion = "the centre ends behind the wall, at any of the phases of arrival"
    for dt_s in (0.0005, COARSE_S, 0.01, 0.02):
        clamped = 2.0 * dt_s >= TAU_S
        predicted = tunnelling_speed(dt_s)
        yield Case(
            name=f"tunnelling_{1e3 * dt_s:g}ms",
            group="tunnelling",
            quantity=quantity,
            method=f"{EULER.name}, h = {1e3 * dt_s:g} ms",
            predicted=predicted,
            formula="(R + t/2) / h" if clamped else "e (R + t/2) / tau",
            source=SPRING if not clamped else MAP,
            criterion=criterion,
            measure=partial(_measure_tunnelling, dt_s, False, predicted),
            band=(0.95, 1.01) if dt_s == COARSE_S else EXACT,
            note="35 to 40 m/s for some phases of arrival only; the worst phase is the limit"
            if dt_s == COARSE_S
            else "",
        )
    for dt_s in (COARSE_S, 0.005):
        yield Case(
            name=f"speculative_{1e3 * dt_s:g}ms",
            group="tunnelling",
            quantity=quantity,
            method=f"{EULER.name}, speculative, h = {1e3 * dt_s:g} ms",
            predicted=math.inf,
            formula="none",
            source="MuJoCo's manual, Speculative contacts",
            criterion=criterion,
            measure=partial(_measure_tunnelling, dt_s, True, math.inf),
            searched_to=200.0,
        )
    yield Case(
        name="speculative_0.5ms",
        group="tunnelling",
        quantity=quantity,
        method=f"{EULER.name}, speculative, h = 0.5 ms",
        predicted=tunnelling_speed(0.0005),
        formula="e (R + t/2) / tau, as without",
        source=SPRING,
        criterion=criterion,
        measure=partial(_measure_tunnelling, 0.0005, True, tunnelling_speed(0.0005)),
        note="a speculative contact is made only for what moves farther in a step than the wall's "
        "half thickness, t/2 / h = 100 m/s here; slower balls are left to the soft contact, which "
        "stops none above 34 m/s",
    )
    rate = tunnelling_speed(1e-4) / (WALL_M / 2)
    yield Case(
        name="speculative_needs_large_steps",
        group="tunnelling",
        quantity="greatest step rate 1/h at which speculative contacts stop every ball, 1/s",
        method=f"{EULER.name}, speculative",
        predicted=rate,
        formula="v / (t/2) with v = e (R + t/2) / tau",
        source="the sweep ignores v h < t/2; the soft contact stops v < e (R + t/2) / tau",
        criterion=criterion,
        measure=partial(_measure_sweep, rate),
        band=(0.9, 1.1),
        note="smaller steps make this failure, larger ones cure it",
    )
    yield Case(
        name="speculative_exactly_touching",
        group="tunnelling",
        quantity="speed at which a ball passes that a step ends exactly touching, m/s",
        method=f"{EULER.name}, speculative, h = 1/512 s",
        predicted=math.inf,
        formula="none",
        source="MuJoCo's manual, Speculative contacts",
        criterion="the centre ends behind the wall",
        measure=_share_that_tunnels_from_touching,
        searched_to=256.0,
        note="the sweep counts times of impact 0 < t < 1 and the ordinary contact depths > 0: a "
        "ball exactly on the surface is seen by neither. It takes an exact floating-point hit; a "
        "contact margin of 1 um cures it",
    )
