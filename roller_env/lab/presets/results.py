"""Errors beside costs, and which settings nothing else beats in both.

A setting's cost is the CPU time of `mujoco.batch.Batch` on one thread; all take turns. As in the
game's own steps MuJoCo's profiler is off, a seventh of what the default costs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
from mujoco.batch import Batch

from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab import runner
from roller_env.lab.methods import without_warnings
from roller_env.lab.presets.catalogue import FEW, SETTINGS
from roller_env.lab.presets.errors import REFERENCE_HZ, Float64, errors_of, violations
from roller_env.lab.table import Frame
from roller_env.level import load_level
from roller_env.physics.profiler import profiler_off
from roller_env.physics.stepper import keeps_poses

ROUND_S: Final = 0.25
"""Game time of one turn."""
WARM_UP_ROUNDS: Final = 8


class Games:
    """Games of one model under random keys; equal seeds make equal keys at equal times.

    Attributes:
        geoms: of the model.
    """

    def __init__(self, model: mujoco.MjModel, start: Sequence[float], games: int) -> None:
        """Put every game's ball, the model's first joint, at ``start`` in metres."""
        self.geoms = int(model.ngeom)
        self._steps = max(1, round(ROUND_S / float(model.opt.timestep)))
        self._batch = Batch(model, games, 1, persistent=keeps_poses(model))
        self._ball: Float64 = self._batch.bind("qpos")[:, :7]
        self._ball[:, :3] = start
        self._ctrl = self._batch.bind("ctrl")
        self._random = np.random.default_rng(0)
        for _ in range(WARM_UP_ROUNDS):
            self.turn()

    @property
    def ball(self) -> Float64:
        """(games, 7) copy of where the balls are, metres, and how they lie."""
        return self._ball.copy()

    def turn(self) -> float:
        """Play one round and return the CPU seconds of a physics step."""
        push = self._random.choice([-KEY_FORCE_N, 0.0, KEY_FORCE_N], (len(self._ctrl), 2))
        self._ctrl[:, :2] = push
        with profiler_off():
            seconds = runner.timed(lambda: self._batch.step(nstep=self._steps), time.process_time)
        return seconds / (self._steps * len(self._ctrl))


def costs(games: Mapping[str, Games], rounds: int) -> dict[str, dict[str, float]]:
    """Let all take turns; return ``us_per_step`` (CPU, median) and ``spread`` of each."""
    turns = {name: one.turn for name, one in games.items()}
    taken = runner.interleaved(turns, rounds, shuffled=True)
    return {
        name: {"us_per_step": 1e6 * float(np.median(own)), "spread": runner.spread(own)}
        for name, own in taken.items()
    }


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is measured."""

    settings: tuple[str, ...]  # names in the catalogue
    reference_hz: int  # steps a second of the converged model
    rounds: int  # turns over which costs are medians
    boxes: tuple[int, ...]  # of the levels of boxes
    games: int  # that are stepped together where costs are measured


FULL: Final = Effort(tuple(SETTINGS), REFERENCE_HZ, 15, (60, 100, 200, 300, 600), 64)
QUICK: Final = Effort(FEW, reference_hz=1920, rounds=2, boxes=(60, 200), games=4)


def measure(effort: Effort, watched: Callable[[Sequence[str]], Iterable[str]]) -> Frame:
    """Measure all settings.

    Args:
        effort: how much.
        watched: goes over names while showing progress.

    Returns:
        A row a setting, the cheapest first: the errors of `roller_env.lab.presets.errors`;
        ``setting``, ``knob``, ``dt_s``; ``us_per_step`` (CPU, on the classic level) and
        ``cpu_s_per_s`` (of a simulated second of one game) with their ``spread``; ``violations``,
        the requirements that it does not meet; ``front``: whether it meets all, and none that does
        is both cheaper and truer on the course.
    """
    settings, level = {name: SETTINGS[name] for name in effort.settings}, load_level("classic")
    with without_warnings():
        errors = {
            name: errors_of(settings[name], effort.reference_hz) for name in watched(list(settings))
        }
        games = {
            name: Games(setting.compile(level).model, level.start.at, effort.games)
            for name, setting in settings.items()
        }
        taken = costs(games, effort.rounds)
    rows = Frame([errors[name] | taken[name] for name in settings])
    rows["setting"] = list(settings)
    rows["knob"] = [setting.knob for setting in settings.values()]
    rows["dt_s"] = [setting.preset.dt_s for setting in settings.values()]
    rows["cpu_s_per_s"] = 1e-6 * rows.us_per_step / rows.dt_s
    found = [violations(errors[name]) for name in settings]
    rows["violations"] = ["; ".join(one.title for one in own) for own in found]
    sound = rows[rows.violations == ""]
    best = front({row.setting: (row.cpu_s_per_s, row.course) for row in sound.itertuples()})
    rows["front"] = rows.setting.isin(best)
    return rows.sort_values("cpu_s_per_s", ignore_index=True)


def front(points: Mapping[str, tuple[float, float]]) -> set[str]:
    """Return the names of the points that no other is below in one and not above in the other."""
    return {
        name
        for name, (x, y) in points.items()
        if not any(a <= x and b <= y and (a, b) != (x, y) for a, b in points.values())
    }
