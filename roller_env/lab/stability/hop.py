"""Why a skidding ball hops, as a number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Final

import mujoco

from roller_env.compile.compiled import compile_level
from roller_env.lab.stability.cases import Case, Effort, Finding
from roller_env.lab.stability.failures import skid_level, soft_friction_model
from roller_env.lab.stability.scenes import SETTLE_S
from roller_env.physics.materials import DAMPING_STEPS
from roller_env.physics.presets import PRESETS, PhysicsPreset

SPEED_M_S: Final = 4.0


def hop_speed(preset: PhysicsPreset, share: float) -> float:
    """Return the speed, m/s, with which a skidding ball leaves the ground in its first step.

    MuJoCo's contact impulse p minimises 1/2 p A p - p (v_wanted - v) over the cone: normal A = 1/m,
    tangential A = 7/2 / m on a sphere that can roll. The contact wants to remove ``share`` of the
    slip, and gravity. On the cone p_t = mu p_n, so that p_n / m = (g h + mu s) / (1 + 7/2 mu²)
    with s = share · slip, of which gravity takes g h. It does not depend on the step otherwise.

    Source: Anitescu 2006, "Optimization-based simulation of nonsmooth rigid multibody dynamics".
    """
    level = skid_level()
    mu, weight = level.ball.friction, level.gravity * preset.dt_s
    return (weight + mu * share * SPEED_M_S) / (1.0 + 3.5 * mu**2) - weight


def first_step(model: mujoco.MjModel) -> float:
    """Return the upward speed, m/s, after the first step of a resting ball's skid."""
    data = mujoco.MjData(model)
    data.qpos[2] = skid_level().ball.radius
    data.qpos[:2] = 0.0
    mujoco.mj_step(model, data, round(SETTLE_S / model.opt.timestep))
    data.qvel[0] = SPEED_M_S
    mujoco.mj_step(model, data)
    return float(data.qvel[2])


def _measure(preset: PhysicsPreset, share: float | None, _effort: Effort) -> Finding:
    if share is None:
        return Finding(first_step(compile_level(skid_level(), preset).model))
    return Finding(first_step(soft_friction_model(preset, share)))


def hop_cases() -> Iterator[Case]:
    """Yield the hop of the game's ball: at three steps, and with softer friction."""
    default = PRESETS["default"]
    settings: list[tuple[str, PhysicsPreset, float | None]] = [
        (f"hop_{rate}hz", replace(default, dt_s=1 / rate), None) for rate in (120, 240, 960)
    ]
    settings += [(f"hop_friction_{share:g}", default, share) for share in (0.5, 0.3)]
    for name, preset, share in settings:
        own = "" if share is None else f", friction's own B h = {share:g}"
        yield Case(
            name=name,
            group="hop",
            quantity="upward speed after the first step of a skid at 4 m/s, m/s",
            method=f"implicitfast, h = 1/{round(1 / preset.dt_s)} s{own}",
            predicted=hop_speed(preset, DAMPING_STEPS if share is None else share),
            formula="(g h + mu B h v) / (1 + 7/2 mu²) - g h",
            source="the convex relaxation of the friction cone, solved for a sphere",
            criterion="upward speed",
            measure=partial(_measure, preset, share),
        )
