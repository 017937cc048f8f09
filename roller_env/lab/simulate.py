"""MuJoCo's steps: the one loop of the laboratory that looks at every step of a simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from roller_env.arrays import Float64

Start = Callable[[mujoco.MjData], None]
"""Puts freshly reset data where a motion begins."""


@dataclass(frozen=True, slots=True)
class Path:
    """What a simulation did, sampled before the first step and after every step or few steps."""

    time: Float64  # (S + 1,) s
    qpos: Float64  # (S + 1, nq) MuJoCo's positions
    qvel: Float64  # (S + 1, nv) MuJoCo's velocities

    @property
    def finite(self) -> bool:
        """Whether every number of it is."""
        return bool(np.isfinite(self.qpos).all() and np.isfinite(self.qvel).all())


def record(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    steps: int,
    *,
    every: int = 1,
    before: Callable[[int], None] | None = None,
    goes_on: Callable[[], bool] | None = None,
) -> Path:
    """Simulate ``steps`` steps from where ``data`` stands, and keep the path.

    Args:
        model: what is simulated.
        data: its state, which moves on.
        steps: physics steps, a multiple of ``every``.
        every: steps between two samples.
        before: is told the number of the step that comes next: sets controls, or looks.
        goes_on: asked after every sample; where it says no the path ends.
    """
    count = steps // every
    qpos, qvel = np.empty((count + 1, model.nq)), np.empty((count + 1, model.nv))
    begin = data.time
    last = 0
    for sample in range(count + 1):
        qpos[sample], qvel[sample], last = data.qpos, data.qvel, sample
        if before is not None:
            before(sample * every)
        if sample == count or (goes_on is not None and not goes_on()):
            break
        mujoco.mj_step(model, data, every)
    time = begin + np.arange(last + 1, dtype=np.float64) * every * model.opt.timestep
    return Path(time, qpos[: last + 1], qvel[: last + 1])


def started(model: mujoco.MjModel, start: Start | None = None) -> mujoco.MjData:
    """Return fresh data of a model, put where its motion begins."""
    data = mujoco.MjData(model)
    if start is not None:
        start(data)
    return data


def settled(model: mujoco.MjModel, seconds: float, start: Start | None = None) -> mujoco.MjData:
    """Return data of a model after so many seconds."""
    data = started(model, start)
    mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
    return data


def stays(
    model: mujoco.MjModel, data: mujoco.MjData, steps: int, holds: Callable[[], bool]
) -> bool:
    """Say whether something holds while ``steps`` steps are simulated, looked at every eighth."""
    return (
        len(record(model, data, steps, every=8, goes_on=holds).time) == steps // 8 + 1 and holds()
    )
