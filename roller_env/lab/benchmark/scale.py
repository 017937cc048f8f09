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
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any, Final

import psutil
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from roller_env.envs.vector import RollerVectorEnv
from roller_env.lab import chart
from roller_env.lab.benchmark.cases import SEED, VectorStep, check_options, random_actions
from roller_env.lab.benchmark.ratios import NOT_MEASURED, Sense, goals_table, judge
from roller_env.lab.game import RADIUS_M
from roller_env.lab.runner import Config, Median, Result, compare, speed_ratio
from roller_env.lab.table import Frame, frame, markdown
from roller_env.level import Level
from roller_env.physics.presets import physics_preset

BOXES_COMPARED: Final = (60, 600)
MEMORY_ENVS: Final = 1000

_Requirement = tuple[str, Sense, float]
BOXES_GOAL: Final[_Requirement] = ("environment step on 600 boxes to 60", "at most", 1.15)
MEMORY_GOAL: Final[_Requirement] = ("GB resident with 1,000 environments", "at most", 1.0)
LEAK_GOAL: Final[_Requirement] = (
    "memory after the long run to after its first tenth",
    "at most",
    1.02,
)

_SAMPLES: Final = 50
"""Of memory during the long run, so that the fifth is at the end of the first tenth."""

_MEMORY_STEPS: Final = 20
"""Steps of every environment before its memory is read."""

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
    """Return the yard with pillars, and further pillars beyond its walls, ``boxes`` in all.

    Raises:
        ValueError: fewer than `YARD_BOXES`.
    """
    if boxes < YARD_BOXES:
        raise ValueError(f"boxes: found {boxes}; the yard alone has {YARD_BOXES}")
    # A row is left free where the wall stands.
    numbers = [*range(YARD_BOXES - 5), *range(YARD_BOXES - 5 + _COLUMNS, boxes - 5 + _COLUMNS)]
    pillars = [
        {"at": (n // _COLUMNS * PITCH_M, n % _COLUMNS * PITCH_M, 0.5), "size": (1.0, 1.0, 1.0)}
        for n in numbers
    ]
    return _level(f"boxes-{boxes}", boxes=[*_yard(), *pillars])


def level_of_coins(coins: int) -> Level:
    """Return the yard without pillars and a square of coins, a metre apart, round its middle.

    Args:
        coins: a square number, or 0.

    Raises:
        ValueError: no square number.
    """
    side = math.isqrt(coins)
    if side * side != coins:
        raise ValueError(f"coins: found {coins}; must be a square number such as {side * side}")
    # Beside the lines on which the walls stand.
    centre = (_MIDDLE[0] + 0.5, _MIDDLE[1] + 0.5, RADIUS_M)
    grid = {"centre": centre, "spacing": (1.0, 1.0), "count": (side, side)}
    return _level(f"coins-{coins}", boxes=_yard(), coins=[{"grid": grid}] if coins else [])


def _level(name: str, **pieces: Any) -> Level:
    # Between four pillars; the finish is over the yard, where no ball comes.
    x, y = (_ROWS // 2 - 0.5) * PITCH_M, (_COLUMNS // 2 - 0.5) * PITCH_M
    return Level.model_validate(
        {
            "name": name,
            "start": {"at": (x, y, RADIUS_M), "jitter": (0.5, 0.5)},
            "finish": {"at": (x, y, 100.0), "size": (1.0, 1.0, 1.0)},
            "time_limit_s": 20.0,
            **pieces,
        }
    )


def _yard() -> list[dict[str, Any]]:
    """Return the floor and the walls round all pillars of the yard."""
    (x, y), length, width = _MIDDLE, _ROWS * PITCH_M, _COLUMNS * PITCH_M
    half_x, half_y = 0.5 * (length + _THICK_M), 0.5 * (width + _THICK_M)
    along_x = (length + 2.0 * _THICK_M, _THICK_M, _WALL_M)
    along_y = (_THICK_M, width, _WALL_M)
    floor = {"at": (x, y, -0.5), "size": (length + 2.0, width + 2.0, 1.0)}
    walls = [((x, y + side * half_y), along_x) for side in (-1, 1)]
    walls += [((x + side * half_x, y), along_y) for side in (-1, 1)]
    return [floor, *({"at": (*at, 0.5 * _WALL_M), "size": size} for at, size in walls)]


# --- memory ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Probe:
    """What a process does while its memory is watched.

    Attributes:
        num_envs: environments of the vector.
        env_steps: environment steps in all.
        samples: how often memory is read, evenly over the steps, the last time at the end.
        options: of `roller_env.config.EnvConfig` that JSON can carry.
    """

    num_envs: int
    env_steps: int
    samples: int
    options: dict[str, Any] = field(default_factory=dict)


def watch(probe: Probe) -> Iterator[dict[str, Any]]:
    """Yield ``environments``, ``env_steps`` and ``resident_gb`` of a fresh process as it goes.

    Raises:
        RuntimeError: the process failed; its message is on standard error.
    """
    command = [sys.executable, "-m", "roller_env.lab.benchmark.scale", json.dumps(asdict(probe))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            yield {"environments": probe.num_envs, **json.loads(line)}
    if process.returncode:
        raise RuntimeError(f"the probe ended with code {process.returncode}; see its message")


def _probe_here(probe: Probe) -> Iterator[dict[str, Any]]:
    env = RollerVectorEnv(probe.num_envs, **probe.options)
    env.reset(seed=SEED)
    actions, done = random_actions(probe.num_envs), 0
    for sample in range(1, probe.samples + 1):
        while done < probe.env_steps * sample / probe.samples:
            env.step(next(actions))
            done += probe.num_envs
        yield {"env_steps": done, "resident_gb": resident_gb()}


def resident_gb() -> float:
    """Return this process's resident set, all libraries included, 10^9 bytes."""
    return float(psutil.Process().memory_info().rss) / 1e9


# --- what is measured ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Sizes:
    """What is tried on each axis."""

    environments: tuple[int, ...] = (1, 4, 16, 64, 256, 1024, 4096)
    substeps: tuple[int, ...] = (1, 2, 4, 8, 16, 32)
    boxes: tuple[int, ...] = (60, 200, 600, 2000)
    coins: tuple[int, ...] = (0, 100, 1024, 10_000)
    threads: tuple[int, ...] = (1, 2, 4, 8, 16)
    threads_environments: tuple[int, ...] = (1, 256, 4096)
    memory: tuple[int, ...] = (1, 1000, 4000)


@dataclass(frozen=True, slots=True)
class Task:
    """What is measured.

    Attributes:
        config: of every interleaved run.
        sizes: of every axis.
        options: of the environments where an axis does not say otherwise; ``level`` is a name.
        num_envs: likewise.
        num_threads: likewise.
        leak_steps: environment steps of the long run.
    """

    config: Config
    sizes: Sizes
    options: Mapping[str, Any]
    num_envs: int
    num_threads: int
    leak_steps: int

    def __post_init__(self) -> None:
        """Refuse options that no environment takes."""
        check_options(self.options)

    @property
    def portable(self) -> dict[str, Any]:
        """The options of a probe."""
        return {"num_threads": self.num_threads, **self.options}

    def axes(self) -> dict[str, dict[int, Callable[[], VectorStep]]]:
        """Return what makes the case of every size of every axis."""
        dt_s = physics_preset(self.options["physics"]).dt_s

        def case(size: int, envs: int = 0, threads: int = 0, **options: Any) -> VectorStep:
            count, options = envs or self.num_envs, {**self.options, **options}
            return VectorStep(str(size), count, threads or self.num_threads, **options)

        sizes = self.sizes
        axes: dict[str, dict[int, Callable[[], VectorStep]]] = {
            "environments": {n: partial(case, n, n) for n in sizes.environments},
            "substeps": {n: partial(case, n, control_dt_s=n * dt_s) for n in sizes.substeps},
            "boxes": {n: partial(case, n, level=level_of_boxes(n)) for n in sizes.boxes},
            "coins": {n: partial(case, n, level=level_of_coins(n)) for n in sizes.coins},
        }
        for count in sizes.threads_environments:
            name = f"threads of {count:,} environment{'s' if count > 1 else ''}"
            axes[name] = {n: partial(case, n, count, n) for n in sizes.threads}
        return axes


def measure_cost(task: Task, say: Callable[[str], None]) -> tuple[Frame, dict[str, Any]]:
    """Measure all axes; ``say`` is told what begins.

    Returns:
        A row an axis and size: ``axis``, ``value``, ``us_per_env_step`` (wall, median) with
        ``smallest`` and ``largest`` of the ``rounds``, ``environments``, ``threads``,
        ``substeps``; and the row of the goal for boxes.
    """
    rows: list[dict[str, Any]] = []
    boxes_goal = judge(*BOXES_GOAL, NOT_MEASURED)
    for axis, sizes in task.axes().items():
        say(axis)
        results = compare([make() for make in sizes.values()], task.config)
        rows += [_row(axis, size, results[str(size)]) for size in sizes]
        if axis == "boxes" and {str(size) for size in BOXES_COMPARED} <= results.keys():
            few, many = (results[str(size)] for size in BOXES_COMPARED)
            boxes_goal = judge(*BOXES_GOAL, speed_ratio(few, many), len(few.seconds))
    return frame(rows), boxes_goal


def _row(axis: str, size: int, result: Result) -> dict[str, Any]:
    cost, case = Median.of([1e6 * seconds for seconds in result.seconds]), result.case
    assert isinstance(case, VectorStep)
    return {
        "axis": axis,
        "value": size,
        "us_per_env_step": cost.value,
        "smallest": cost.low,
        "largest": cost.high,
        "rounds": len(result.seconds),
        "environments": case.env_steps,
        "threads": case.options["num_threads"],
        "substeps": case.simulation.config.substeps,
    }


def measure_memory(task: Task) -> tuple[Frame, dict[str, Any]]:
    """Measure fresh processes of different sizes, and judge the one of a thousand."""
    probes = [Probe(n, _MEMORY_STEPS * n, 1, task.portable) for n in task.sizes.memory]
    rows = frame([row for probe in probes for row in watch(probe)])
    thousand = rows[rows.environments == MEMORY_ENVS].resident_gb.tolist()
    return rows, judge(*MEMORY_GOAL, Median.of(thousand) if thousand else NOT_MEASURED)


def measure_leak(task: Task) -> Frame:
    """Run one vector for long, and return its memory as it goes."""
    return frame(list(watch(Probe(task.num_envs, task.leak_steps, _SAMPLES, task.portable))))


def judge_leak(rows: Frame) -> dict[str, Any]:
    """Judge a long run by its end against its first tenth."""
    resident = rows.resident_gb.tolist()
    ratio = resident[-1] / resident[len(resident) // 10 - 1]
    return judge(*LEAK_GOAL, Median.of([ratio]))


def report(goals: Frame, costs: Frame, memory: Frame) -> str:
    """Return the goals, the cost on every axis and the memory, a table each."""
    places = [
        (
            row.axis,
            f"{row.value:,}",
            row.us_per_env_step,
            f"{row.smallest:.3g} to {row.largest:.3g}",
            f"{1e6 / row.us_per_env_step:,.0f}",
        )
        for row in costs.itertuples()
    ]
    processes = [(f"{row.environments:,}", f"{row.resident_gb:.3f}") for row in memory.itertuples()]
    return "\n".join(
        (
            goals_table(goals),
            markdown(("axis", "size", "µs an env step", "range", "env steps/s"), places),
            markdown(("environments", "GB resident"), processes),
        )
    )


# --- the picture -----------------------------------------------------------------------------

_LABELS: Final = {
    "environments": "environments",
    "substeps": "physics steps of an environment step",
    "boxes": "boxes of the level",
    "coins": "coins of the level",
}
_THREADS: Final = ("#9ec5ea", "#2f6db3", "#173a61")


def draw(costs: Frame, memory: Frame, leak: Frame) -> Figure:
    """Draw cost against every axis, and memory."""
    usual = costs[costs.axis == "boxes"].iloc[0]
    figure, panels = chart.grid(
        (2, 4),
        "How cost and memory grow",
        "Wall µs of one environment step, median and range of the rounds. Where the axis does not "
        f"say otherwise: {usual.environments} environments, {usual.threads} threads, "
        f"{usual.substeps} physics steps.",
        panel=(3.2, 2.9),
    )
    *for_costs, threads, megabytes, long_run, none = panels.ravel()
    for axes, (axis, title) in zip(for_costs, _LABELS.items(), strict=True):
        _draw_costs(axes, costs[costs.axis == axis], chart.SERIES[0])
        _finish(axes, title)
    of_threads = [axis for axis in dict.fromkeys(costs.axis) if axis.startswith("threads")]
    for axis, colour in zip(of_threads, _THREADS, strict=False):
        _draw_costs(threads, costs[costs.axis == axis], colour, axis.removeprefix("threads of "))
    _finish(threads, "threads of the physics")
    threads.legend(fontsize=8)
    megabytes.plot(memory.environments, 1e3 * memory.resident_gb, "o-", color=chart.SERIES[0])
    megabytes.axhline(1e3 * MEMORY_GOAL[2], color=chart.PREDICTION, ls="--")
    _title(megabytes, f"MB resident; line: goal with {MEMORY_ENVS:,} environments")
    long_run.plot(leak.env_steps / 1e6, 1e3 * leak.resident_gb, color=chart.SERIES[0])
    long_run.set_ylim(0.0, 1.3e3 * leak.resident_gb.max())
    _title(long_run, f"MB resident of {leak.environments[0]}, by million steps")
    none.set_visible(False)
    return figure


def _draw_costs(axes: Axes, rows: Frame, colour: str, label: str = "") -> None:
    middle = rows.us_per_env_step
    errors = (middle - rows.smallest, rows.largest - middle)
    axes.errorbar(rows.value, middle, errors, color=colour, fmt="o-", ms=4, capsize=2, label=label)
    # A level may have no coins: the axis is then straight up to the first size.
    axes.set_xscale("symlog", linthresh=max(1, rows.value[rows.value > 0].min()))
    axes.set_xticks(rows.value.tolist())


def _finish(axes: Axes, title: str) -> None:
    """Set a logarithmic axis, wide enough that the noise of a machine does not look like growth."""
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
    for row in _probe_here(Probe(**json.loads(sys.argv[1]))):
        print(json.dumps(row), flush=True)
