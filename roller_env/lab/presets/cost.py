"""What a setting costs: CPU time of `mujoco.batch.Batch` on one thread, taking turns.

As in the game's own steps MuJoCo's profiler is off, a seventh of what the default costs.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from roller_env.game.actions import KEY_FORCE_N
from roller_env.physics.profiler import profiler_off
from roller_env.physics.stepper import keeps_poses

GAMES: Final = 64
ROUNDS: Final = 15
ROUND_S: Final = 0.25
"""Game time of one turn."""
WARM_UP_ROUNDS: Final = 8


@dataclass(frozen=True, slots=True)
class Cost:
    """What it costs to simulate one game.

    Attributes:
        us_per_step: CPU microseconds of a physics step, median over the rounds.
        cpu_s_per_s: CPU seconds of a simulated second.
        spread: (largest - smallest) / median.
    """

    us_per_step: float
    cpu_s_per_s: float
    spread: float


class Runner:
    """Games of one model under random keys; equal seeds make equal keys at equal times."""

    def __init__(
        self, model: mujoco.MjModel, start: tuple[float, float, float], games: int = GAMES
    ):
        """Put every game's ball, the model's first joint, at ``start`` in metres."""
        self.dt_s = float(model.opt.timestep)
        self.steps = max(1, round(ROUND_S / self.dt_s))
        self._batch = Batch(model, games, 1, persistent=keeps_poses(model))
        self._ball: npt.NDArray[np.float64] = self._batch.bind("qpos")[:, :7]
        self._ball[:, :3] = start
        self._ctrl = self._batch.bind("ctrl")
        self._random = np.random.default_rng(0)
        for _ in range(WARM_UP_ROUNDS):
            self.turn()

    @property
    def ball(self) -> npt.NDArray[np.float64]:
        """(games, 7) copy of where the balls are, metres, and how they lie."""
        return self._ball.copy()

    def turn(self) -> float:
        """Play one round and return the CPU seconds of a physics step."""
        push = self._random.choice([-KEY_FORCE_N, 0.0, KEY_FORCE_N], (len(self._ctrl), 2))
        self._ctrl[:, :2] = push
        with profiler_off():
            begin = time.process_time()
            self._batch.step(nstep=self.steps)
            return (time.process_time() - begin) / (self.steps * len(self._ctrl))


def costs(runners: Mapping[str, Runner], rounds: int = ROUNDS) -> dict[str, Cost]:
    """Let all take turns, and return what each costs.

    In another order every round: who comes after the dearest, or while the machine is slow, would
    otherwise be the same every time.
    """
    seconds: dict[str, list[float]] = {name: [] for name in runners}
    order, random = list(runners), np.random.default_rng(0)
    for _ in range(rounds):
        random.shuffle(order)
        for name in order:
            seconds[name].append(runners[name].turn())
    return {name: _cost(runners[name], taken) for name, taken in seconds.items()}


def _cost(runner: Runner, seconds: list[float]) -> Cost:
    median = statistics.median(seconds)
    return Cost(1e6 * median, median / runner.dt_s, (max(seconds) - min(seconds)) / median)
