"""How cost and memory grow with what there is more of.

In every level that is made here the same game is played, so that only the size makes a difference:
the ball is in a walled yard that it cannot leave, and what is added lies outside or hangs out of
reach. Memory is that of a process of its own, which is this module.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import psutil
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator
from pandas import concat

from roller_env.envs.vector import RollerVectorEnv
from roller_env.lab import chart
from roller_env.lab.benchmark.cases import SEED, VectorStep, check_options, random_actions
from roller_env.lab.benchmark.ratios import Sense, goals_table, judge
from roller_env.lab.game import RADIUS_M
from roller_env.lab.runner import Config, compare
from roller_env.lab.table import Frame, markdown
from roller_env.level import Level
from roller_env.physics.presets import physics_preset

BOXES_COMPARED: Final = (60, 600)
MEMORY_ENVS: Final = 1000

_Requirement = tuple[str, Sense, float]
BOXES_GOAL: Final[_Requirement] = ("environment step on 600 boxes to 60", "at most", 1.15)
MEMORY_GOAL: Final[_Requirement] = ("GB resident with 1,000 environments", "at most", 1.0)
_LEAK: Final = "memory after the long run to after its first tenth"

_SAMPLES: Final = 50
"""Of memory during the long run, so that the fifth is at the end of the first tenth."""

_MEMORY_STEPS: Final = 20
"""Steps of every environment before its memory is read."""

SIZES: Final[Mapping[str, tuple[int, ...]]] = {
    "environments": (1, 4, 16, 64, 256, 1024, 4096),
    "substeps": (1, 2, 4, 8, 16, 32),
    "boxes": (60, 200, 600, 2000),
    "coins": (0, 100, 1024, 10_000),
    "threads": (1, 2, 4, 8, 16),
    "threads_environments": (1, 256, 4096),
    "memory": (1, 1000, 4000),
}
"""What is tried on each axis; the threads with each of those numbers of environments."""

# --- levels of any size ----------------------------------------------------------------------

PITCH_M: Final = 3.0
"""Between the middles of neighbouring pillars: room for the ball of 0.81 m, and much to hit."""

_ROWS, _COLUMNS = 6, 9
_THICK_M, _WALL_M = 0.5, 3.0
_MIDDLE: Final = 0.5 * (_ROWS - 1) * PITCH_M, 0.5 * (_COLUMNS - 1) * PITCH_M

YARD_BOXES: Final = _ROWS * _COLUMNS + 5
"""Boxes of the smallest `level_of_boxes`: pillars, floor and four walls; with the ball's own 60
geoms."""


def level_of_boxes(boxes: int) -> Level:
    """Return the yard with pillars, and more beyond its walls: ``boxes``, at least `YARD_BOXES`."""
    if boxes < YARD_BOXES:
        raise ValueError(f"boxes: found {boxes}; the yard alone has {YARD_BOXES}")
    # A row is left free where the wall stands.
    numbers = [*range(YARD_BOXES - 5), *range(YARD_BOXES - 5 + _COLUMNS, boxes - 5 + _COLUMNS)]
    places = [(n // _COLUMNS * PITCH_M, n % _COLUMNS * PITCH_M, 0.5) for n in numbers]
    return _yard(f"boxes-{boxes}", [{"at": at, "size": (1.0, 1.0, 1.0)} for at in places])


def level_of_coins(coins: int) -> Level:
    """Return the yard without pillars and a square of coins, a metre apart, round its middle."""
    side = math.isqrt(coins)
    if side * side != coins:
        raise ValueError(f"coins: found {coins}; must be a square number such as {side * side}")
    # Beside the lines on which the walls stand.
    centre = (_MIDDLE[0] + 0.5, _MIDDLE[1] + 0.5, RADIUS_M)
    grid = {"centre": centre, "spacing": (1.0, 1.0), "count": (side, side)}
    return _yard(f"coins-{coins}", coins=[{"grid": grid}] if coins else [])


def _yard(name: str, pillars: Sequence[dict[str, Any]] = (), **pieces: Any) -> Level:
    """Return the floor and the walls round all pillars of the yard, with what is in it."""
    (x, y), length, width = _MIDDLE, _ROWS * PITCH_M, _COLUMNS * PITCH_M
    half_x, half_y = 0.5 * (length + _THICK_M), 0.5 * (width + _THICK_M)
    along_x, along_y = (length + 2.0 * _THICK_M, _THICK_M, _WALL_M), (_THICK_M, width, _WALL_M)
    floor = {"at": (x, y, -0.5), "size": (length + 2.0, width + 2.0, 1.0)}
    walls = [
        {"at": (*at, 0.5 * _WALL_M), "size": size}
        for at, size in (
            ((x, y - half_y), along_x),
            ((x, y + half_y), along_x),
            ((x - half_x, y), along_y),
            ((x + half_x, y), along_y),
        )
    ]
    # Between four pillars; the finish is over the yard, where no ball comes.
    x, y = (_ROWS // 2 - 0.5) * PITCH_M, (_COLUMNS // 2 - 0.5) * PITCH_M
    plain = {
        "name": name,
        "start": {"at": (x, y, RADIUS_M), "jitter": (0.5, 0.5)},
        "finish": {"at": (x, y, 100.0), "size": (1.0, 1.0, 1.0)},
        "time_limit_s": 20.0,
        "boxes": [floor, *walls, *pillars],
    }
    return Level.model_validate(plain | pieces)


# --- memory ----------------------------------------------------------------------------------


def watch(num_envs: int, env_steps: int, samples: int, **options: Any) -> Frame:
    """Return ``environments``, ``env_steps`` and ``resident_gb`` of a fresh process as it goes.

    It is read in samples, evenly over all steps, the last time at the end. The options are of
    `roller_env.config.EnvConfig`; a process that fails is a RuntimeError.
    """
    wanted = json.dumps([num_envs, env_steps, samples, options])
    command = [sys.executable, "-m", "roller_env.lab.benchmark.scale", wanted]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"the probe ended with code {done.returncode}; see its message")
    return Frame([{"environments": num_envs, **json.loads(x)} for x in done.stdout.splitlines()])


def _probe(
    num_envs: int, env_steps: int, samples: int, options: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    env = RollerVectorEnv(num_envs, **options)
    env.reset(seed=SEED)
    actions, done = random_actions(num_envs), 0
    for sample in range(1, samples + 1):
        while done < env_steps * sample / samples:
            env.step(next(actions))
            done += num_envs
        yield {"env_steps": done, "resident_gb": resident_gb()}


def resident_gb() -> float:
    """Return this process's resident set, all libraries included, 10^9 bytes."""
    return float(psutil.Process().memory_info().rss) / 1e9


# --- what is measured ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Task:
    """What is measured."""

    config: Config  # of every interleaved run
    sizes: Mapping[str, tuple[int, ...]]  # as in `SIZES`
    # Where an axis does not say otherwise; ``level`` is a name.
    options: Mapping[str, Any]
    num_envs: int
    num_threads: int
    leak_steps: int  # environment steps of the long run

    def __post_init__(self) -> None:
        """Refuse options that no environment takes."""
        check_options(self.options)

    def watch(self, num_envs: int, env_steps: int, samples: int) -> Frame:
        """Return the memory of a process with these options; see `watch`."""
        return watch(num_envs, env_steps, samples, num_threads=self.num_threads, **self.options)

    def axes(self) -> dict[str, dict[int, Callable[[], VectorStep]]]:
        """Return what makes the case of every size of every axis."""
        dt_s, sizes = physics_preset(self.options["physics"]).dt_s, self.sizes

        def case(size: int, envs: int = 0, threads: int = 0, **options: Any) -> VectorStep:
            count, options = envs or self.num_envs, {**self.options, **options}
            return VectorStep(str(size), count, threads or self.num_threads, **options)

        axes: dict[str, dict[int, Callable[[], VectorStep]]] = {
            "environments": {n: partial(case, n, n) for n in sizes["environments"]},
            "substeps": {n: partial(case, n, control_dt_s=n * dt_s) for n in sizes["substeps"]},
            "boxes": {n: partial(case, n, level=level_of_boxes(n)) for n in sizes["boxes"]},
            "coins": {n: partial(case, n, level=level_of_coins(n)) for n in sizes["coins"]},
        }
        for count in sizes["threads_environments"]:
            name = f"threads of {count:,} environment{'s' if count > 1 else ''}"
            axes[name] = {n: partial(case, n, count, n) for n in sizes["threads"]}
        return axes


def measure_cost(task: Task, say: Callable[[str], None]) -> tuple[Frame, dict[str, Any]]:
    """Measure all axes; ``say`` is told what begins.

    Returns:
        A row an axis and size: ``axis``, ``value``, ``us_per_env_step`` (wall, median) with
        ``smallest`` and ``largest`` of the ``rounds``, ``environments``, ``threads``,
        ``substeps``; and the row of the goal for boxes.
    """
    rows: list[dict[str, Any]] = []
    boxes_goal = judge(*BOXES_GOAL, [])
    for axis, sizes in task.axes().items():
        say(axis)
        cases = {size: make() for size, make in sizes.items()}
        us = 1e6 * compare(list(cases.values()), task.config).rename(columns=int)
        rows += [
            {
                "axis": axis,
                "value": size,
                "us_per_env_step": us[size].median(),
                "smallest": us[size].min(),
                "largest": us[size].max(),
                "rounds": len(us),
                "environments": case.env_steps,
                "threads": case.options["num_threads"],
                "substeps": case.simulation.config.substeps,
            }
            for size, case in cases.items()
        ]
        if axis == "boxes" and {*BOXES_COMPARED} <= cases.keys():
            few, many = BOXES_COMPARED
            boxes_goal = judge(*BOXES_GOAL, us[many] / us[few])
    return Frame(rows), boxes_goal


def measure_memory(task: Task) -> tuple[Frame, dict[str, Any]]:
    """Measure fresh processes of different sizes, and judge the one of a thousand."""
    probes = [task.watch(n, _MEMORY_STEPS * n, 1) for n in task.sizes["memory"]]
    rows = concat(probes, ignore_index=True)
    return rows, judge(*MEMORY_GOAL, rows[rows.environments == MEMORY_ENVS].resident_gb)


def measure_leak(task: Task) -> Frame:
    """Run one vector for long, and return its memory as it goes."""
    return task.watch(task.num_envs, task.leak_steps, _SAMPLES)


def judge_leak(rows: Frame) -> dict[str, Any]:
    """Judge a long run by its end against its first tenth."""
    resident = rows.resident_gb.tolist()
    return judge(_LEAK, "at most", 1.02, [resident[-1] / resident[len(resident) // 10 - 1]])


def report(goals: Frame, costs: Frame, memory: Frame) -> str:
    """Return the goals, the cost on every axis and the memory, a table each."""
    us = costs.us_per_env_step
    shown = {
        "axis": costs.axis,
        "size": costs.value.map("{:,}".format),
        "µs an env step": us,
        "range": costs.smallest.map("{:.3g} to ".format) + costs.largest.map("{:.3g}".format),
        "env steps/s": (1e6 / us).map("{:,.0f}".format),
    }
    processes = {
        "environments": memory.environments.map("{:,}".format),
        "GB resident": memory.resident_gb.map("{:.3f}".format),
    }
    return "\n".join((goals_table(goals), markdown(Frame(shown)), markdown(Frame(processes))))


# --- the picture -----------------------------------------------------------------------------

_LABELS: Final = {
    "environments": "environments",
    "substeps": "physics steps of an environment step",
    "boxes": "boxes of the level",
    "coins": "coins of the level",
}
_THREADS: Final = ("#9ec5ea", "#2f6db3", "#173a61")


@chart.styled
def draw(costs: Frame, memory: Frame, leak: Frame) -> Figure:
    """Draw cost against every axis, and memory."""
    usual = costs[costs.axis == "boxes"].iloc[0]
    note = (
        "Wall µs of one environment step, median and range of the rounds. Where the axis does not "
        f"say otherwise: {usual.environments} environments, {usual.threads} threads, "
        f"{usual.substeps} physics steps."
    )
    figure, panels = chart.grid((2, 4), "How cost and memory grow", note, panel=(3.2, 2.9))
    *for_costs, threads, megabytes, long_run, none = panels.ravel()
    for axes, (axis, title) in zip(for_costs, _LABELS.items(), strict=True):
        _draw_costs(axes, title, {"": costs[costs.axis == axis]}, chart.SERIES)
    of_threads = {
        axis.removeprefix("threads of "): rows
        for axis, rows in costs.groupby("axis", sort=False)
        if axis.startswith("threads")
    }
    _draw_costs(threads, "threads of the physics", of_threads, _THREADS)
    threads.legend(fontsize=8)
    blue = chart.SERIES[0]
    megabytes.plot(memory.environments, 1e3 * memory.resident_gb, "o-", color=blue)
    megabytes.axhline(1e3 * MEMORY_GOAL[2], color=chart.PREDICTION, ls="--")
    _title(megabytes, f"MB resident; line: goal for {MEMORY_ENVS:,}")
    long_run.plot(leak.env_steps / 1e6, 1e3 * leak.resident_gb, color=blue)
    long_run.set_ylim(0.0, 1.3e3 * leak.resident_gb.max())
    _title(long_run, f"MB resident of {leak.environments[0]}, by million steps")
    none.set_visible(False)
    return figure


def _draw_costs(
    axes: Axes, title: str, curves: Mapping[str, Frame], colours: tuple[str, ...]
) -> None:
    """Draw curves, on an axis wide enough that a machine's noise does not look like growth."""
    for (label, rows), colour in zip(curves.items(), colours, strict=False):
        middle = rows.us_per_env_step
        errors = (middle - rows.smallest, rows.largest - middle)
        style: dict[str, Any] = {"fmt": "o-", "ms": 4, "capsize": 2, "label": label}
        axes.errorbar(rows.value, middle, errors, color=colour, **style)
    sizes = rows.value
    # A level may have no coins: the axis is then straight up to the first size.
    axes.set_xscale("symlog", linthresh=max(1, sizes[sizes > 0].min()))
    axes.set_xticks(sizes.tolist())
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    widen = max(1.0, 10.0 / (high / low)) ** 0.5
    axes.set_ylim(low / widen, high * widen)
    axes.yaxis.set_major_locator(LogLocator(base=10.0, subs=(1.0, 2.0, 5.0)))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())
        chart.plain(axis)
    axes.tick_params(axis="x", labelsize=8)
    _title(axes, title)


def _title(axes: Axes, title: str) -> None:
    axes.set_title(title, loc="left", fontsize=9, weight="bold")


if __name__ == "__main__":
    for row in _probe(*json.loads(sys.argv[1])):
        print(json.dumps(row), flush=True)
