"""The presets of both engines: what a simulated second costs, and how far off it ends."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from roller_env.lab.engines.courses import (
    KEY_N,
    REFERENCE,
    apart,
    rolled,
    simulated,
    wandering,
)
from roller_env.lab.engines.thrown import Thrown
from roller_env.lab.runner import interleaved, timed
from roller_env.level import load_level
from roller_env.physics.presets import DEFAULT, PRESETS, PhysicsPreset
from roller_env.physics.rigid.law import COULOMB

LEVEL: Final = "classic"
STEP_S: Final = 1 / 20
STEPS: Final = 20
"""Control steps of a course: one second, before chance has parted what differs by rounding."""

FINE_CAP_S: Final = 1 / 960

RATES: Final = (*(replace(DEFAULT, name=f"1/{hz}", dt_s=1 / hz) for hz in (60, 480, 1920, 7680)),)
"""MuJoCo at further steps, as `default` but for the step."""


@dataclass(frozen=True, slots=True)
class Point:
    """A preset on the chart.

    Attributes:
        preset: its name.
        engine: that it is of.
        ms_per_s: CPU milliseconds of a simulated second of one ball, median.
        from_rigid: distance over the way from the rigid ball (cap 1/960 s) after a second: mean.
        from_mujoco: the same from MuJoCo's RK4 at 1/15360 s.
    """

    preset: str
    engine: str
    ms_per_s: float
    from_rigid: float
    from_mujoco: float


def points(
    count: int,
    rounds: int,
    costed: int,
    reference: PhysicsPreset = REFERENCE,
    further: Sequence[PhysicsPreset] = RATES,
) -> list[Point]:
    """Return where all presets are, and MuJoCo at further steps.

    Args:
        count: balls whose ways are compared.
        rounds: turns over which a cost is the median.
        costed: balls of a turn.
        reference: MuJoCo's limit.
        further: MuJoCo besides the presets.
    """
    level = load_level(LEVEL)
    how = wandering(level, count, STEPS)
    presets = (*PRESETS.values(), *further)
    ends = {
        preset.name: _driven(Thrown(level, preset, count, STEP_S), how, STEPS) for preset in presets
    }
    rigid, mujoco = rolled(level, how, COULOMB, FINE_CAP_S), simulated(level, how, reference)
    cost = _costs(presets, rounds, costed)
    return [
        Point(
            preset=preset.name,
            engine=preset.engine,
            ms_per_s=cost[preset.name],
            from_rigid=float(apart(ends[preset.name], rigid).mean()),
            from_mujoco=float(apart(ends[preset.name], mujoco).mean()),
        )
        for preset in presets
    ]


def _driven(balls: Thrown, how: Any, steps: int) -> np.ndarray[Any, Any]:
    """Return (steps + 1, N, 3) where balls under given keys are after each step."""
    balls.put(how.position, how.velocity, how.spin(balls.level.ball.radius))
    places = [how.position.copy()]
    for force in how.force[:steps]:
        balls.bodies.force_n[:, :2] = force
        balls.step()
        places.append(balls.bodies.position.copy())
    return np.array(places)


def _costs(presets: Sequence[PhysicsPreset], rounds: int, count: int) -> dict[str, float]:
    """Return the CPU milliseconds of a simulated second of one ball, all taking turns."""
    level, steps = load_level(LEVEL), 10

    def course(preset: PhysicsPreset) -> Any:
        balls = Thrown(level, preset, count, STEP_S)
        random, start = np.random.default_rng(0), np.asarray(level.start.at)

        def turn() -> float:
            def drive() -> None:
                for _ in range(steps):
                    balls.step()

            balls.bodies.force_n[:, :2] = KEY_N * random.choice([-1.0, 0.0, 1.0], (count, 2))
            fallen = balls.bodies.position[:, 2] < level.kill_height
            balls.bodies.position[fallen], balls.bodies.velocity[fallen] = start, 0.0
            return timed(drive, time.process_time)

        for _ in range(6):
            turn()
        return turn

    taken = interleaved({preset.name: course(preset) for preset in presets}, rounds)
    return {
        name: 1e3 * float(np.median(own)) / (steps * STEP_S * count) for name, own in taken.items()
    }
