"""Errors beside costs, and which settings nothing else beats in both."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Final

from roller_env.lab.methods import without_warnings
from roller_env.lab.presets.catalogue import FEW, SETTINGS
from roller_env.lab.presets.cost import GAMES, ROUNDS, Cost, Runner, costs
from roller_env.lab.presets.errors import REFERENCE_HZ, Errors, broken, errors_of
from roller_env.lab.presets.setting import Setting
from roller_env.level import load_level


@dataclass(frozen=True, slots=True)
class SettingRow(Errors):
    """One setting: its errors, see `Errors`, and its cost.

    Attributes:
        setting: its name.
        knob: what it varies.
        dt_s: time step.
        us_per_step: CPU microseconds of a physics step on the classic level.
        cpu_s_per_s: CPU seconds of a simulated second of one game.
        spread: of the cost: (largest - smallest) / median.
        breaks: labels of the criteria that it does not meet, joined by semicolons.
        front: whether it meets all, and none that does is both cheaper and truer on the course.
    """

    setting: str
    knob: str
    dt_s: float
    us_per_step: float
    cpu_s_per_s: float
    spread: float
    breaks: str
    front: bool


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


def measure(effort: Effort, watched: Callable[[Sequence[str]], Iterable[str]]) -> list[SettingRow]:
    """Measure all settings.

    Args:
        effort: how much.
        watched: goes over names while showing progress.
    """
    chosen = {name: SETTINGS[name] for name in effort.settings}
    with without_warnings():
        errors = {
            name: errors_of(chosen[name], effort.reference_hz) for name in watched(list(chosen))
        }
        taken = costs(_runners(chosen, effort.games), effort.rounds)
    return rows_of(chosen, errors, taken)


def _runners(settings: Mapping[str, Setting], games: int) -> dict[str, Runner]:
    level = load_level("classic")
    return {
        name: Runner(setting.compile(level).model, level.start.at, games)
        for name, setting in settings.items()
    }


def rows_of(
    settings: Mapping[str, Setting], errors: Mapping[str, Errors], taken: Mapping[str, Cost]
) -> list[SettingRow]:
    """Return a row for each setting, the cheapest first."""
    sound = [name for name in settings if not broken(errors[name])]
    best = front({name: (taken[name].cpu_s_per_s, errors[name].course) for name in sound})
    rows = [
        SettingRow(
            **asdict(errors[name]),
            **asdict(taken[name]),
            setting=name,
            knob=setting.knob,
            dt_s=setting.preset.dt_s,
            breaks="; ".join(one.title for one in broken(errors[name])),
            front=name in best,
        )
        for name, setting in settings.items()
    ]
    return sorted(rows, key=lambda row: row.cpu_s_per_s)


def front(points: Mapping[str, tuple[float, float]]) -> set[str]:
    """Return the names of the points that no other is below in one and not above in the other."""
    return {
        name
        for name, (x, y) in points.items()
        if not any(a <= x and b <= y and (a, b) != (x, y) for a, b in points.values())
    }


FULL: Final = Effort(tuple(SETTINGS), REFERENCE_HZ, ROUNDS, (60, 100, 200, 300, 600), GAMES)
QUICK: Final = Effort(FEW, reference_hz=1920, rounds=2, boxes=(60, 200), games=4)
