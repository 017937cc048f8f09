"""Errors beside costs, and which settings nothing else beats in both.

A setting's cost is the CPU time of `mujoco.batch.Batch` on one thread; all take turns. As in the
game's own steps MuJoCo's profiler is off, a seventh of what the default costs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.methods import without_warnings
from roller_env.lab.presets.catalogue import FEW, SETTINGS
from roller_env.lab.presets.errors import REFERENCE_HZ, Errors, errors_of, violations
from roller_env.lab.presets.setting import Setting
from roller_env.lab.runner import Median, interleaved, timed
from roller_env.lab.table import Frame, frame
from roller_env.level import load_level
from roller_env.physics.profiler import profiler_off
from roller_env.physics.stepper import keeps_poses

ROUND_S: Final = 0.25
"""Game time of one turn."""
WARM_UP_ROUNDS: Final = 8


class Games:
    """Games of one model under random keys; equal seeds make equal keys at equal times."""

    def __init__(
        self, model: mujoco.MjModel, start: tuple[float, float, float], games: int
    ) -> None:
        """Put every game's ball, the model's first joint, at ``start`` in metres."""
        self.dt_s = float(model.opt.timestep)
        self._steps = max(1, round(ROUND_S / self.dt_s))
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
            seconds = timed(lambda: self._batch.step(nstep=self._steps), time.process_time)
        return seconds / (self._steps * len(self._ctrl))


def costs(games: Mapping[str, Games], rounds: int) -> dict[str, Median]:
    """Let all take turns, and return the CPU seconds of a physics step of each."""
    taken = interleaved({name: one.turn for name, one in games.items()}, rounds, shuffled=True)
    return {name: Median.of(seconds) for name, seconds in taken.items()}


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is measured.

    Attributes:
        settings: names in the catalogue.
        reference_hz: steps a second of the converged model.
        rounds: turns over which costs are medians.
        boxes: sizes of the levels of boxes.
        games: that are stepped together where costs are measured.
    """

    settings: tuple[str, ...]
    reference_hz: int
    rounds: int
    boxes: tuple[int, ...]
    games: int


FULL: Final = Effort(tuple(SETTINGS), REFERENCE_HZ, 15, (60, 100, 200, 300, 600), 64)
QUICK: Final = Effort(FEW, reference_hz=1920, rounds=2, boxes=(60, 200), games=4)


def measure(effort: Effort, watched: Callable[[Sequence[str]], Iterable[str]]) -> Frame:
    """Measure all settings.

    Args:
        effort: how much.
        watched: goes over names while showing progress.

    Returns:
        A row a setting, the cheapest first: the errors by the names of
        `roller_env.lab.presets.errors.MEANINGS`; ``setting``, ``knob``, ``dt_s``; ``us_per_step``
        (CPU, on the classic level), ``cpu_s_per_s`` (of a simulated second of one game) and their
        ``spread``; ``violations``, the requirements that it does not meet; ``front``: whether it
        meets all, and none that does is both cheaper and truer on the course.
    """
    chosen = {name: SETTINGS[name] for name in effort.settings}
    level = load_level("classic")
    with without_warnings():
        errors = {
            name: errors_of(chosen[name], effort.reference_hz) for name in watched(list(chosen))
        }
        games = {
            name: Games(setting.compile(level).model, level.start.at, effort.games)
            for name, setting in chosen.items()
        }
        taken = costs(games, effort.rounds)
    return _frame(chosen, errors, taken)


def _frame(
    settings: Mapping[str, Setting], errors: Mapping[str, Errors], taken: Mapping[str, Median]
) -> Frame:
    per_s = {name: taken[name].value / setting.preset.dt_s for name, setting in settings.items()}
    sound = [name for name in settings if not violations(errors[name])]
    best = front({name: (per_s[name], errors[name]["course"]) for name in sound})
    rows: list[dict[str, Any]] = [
        errors[name]
        | {
            "setting": name,
            "knob": setting.knob,
            "dt_s": setting.preset.dt_s,
            "us_per_step": 1e6 * taken[name].value,
            "cpu_s_per_s": per_s[name],
            "spread": taken[name].spread,
            "violations": "; ".join(one.title for one in violations(errors[name])),
            "front": name in best,
        }
        for name, setting in settings.items()
    ]
    return frame(rows).sort_values("cpu_s_per_s", ignore_index=True)


def front(points: Mapping[str, tuple[float, float]]) -> set[str]:
    """Return the names of the points that no other is below in one and not above in the other."""
    return {
        name
        for name, (x, y) in points.items()
        if not any(a <= x and b <= y and (a, b) != (x, y) for a, b in points.values())
    }
