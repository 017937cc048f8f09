"""How cost and memory grow with what there is more of."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from roller_env.lab.benchmark.contestants import VectorStep, check_options
from roller_env.lab.benchmark.footprint import Footprint, Stay, watch
from roller_env.lab.benchmark.goals import NOT_MEASURED, GoalRow, Sense, judge
from roller_env.lab.benchmark.levels import level_of_boxes, level_of_coins
from roller_env.lab.benchmark.race import Median, Pace, Result, race, speed_ratio
from roller_env.physics.presets import physics_preset

GIGABYTE: Final = 10**9

BOXES_COMPARED: Final = (60, 600)
MEMORY_ENVS: Final = 1000

_Promise = tuple[str, Sense, float]
BOXES_GOAL: Final[_Promise] = ("environment step on 600 boxes to 60", "at most", 1.15)
MEMORY_GOAL: Final[_Promise] = ("GB resident with 1,000 environments", "at most", 1.0)
LEAK_GOAL: Final[_Promise] = ("memory after the long run to after its first tenth", "at most", 1.02)

_LOOKS: Final = 50
"""At memory during the long run, so that the fifth is at the end of the first tenth."""

_MEMORY_STEPS: Final = 20
"""Steps of every environment before its memory is read."""


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
class ScaleRow:
    """The cost of one environment step at one place of an axis.

    Attributes:
        axis: what there is more of.
        value: how much.
        us_per_env_step: wall microseconds, median over the rounds.
        smallest: of any round.
        largest: of any round.
        rounds: how many.
        environments: of the vector.
        threads: of its physics.
        substeps: physics steps of an environment step.
    """

    axis: str
    value: int
    us_per_env_step: float
    smallest: float
    largest: float
    rounds: int
    environments: int
    threads: int
    substeps: int


@dataclass(frozen=True, slots=True)
class MemoryRow:
    """Memory of a fresh process.

    Attributes:
        environments: of its vector.
        env_steps: environment steps done.
        resident_gb: resident set, 10^9 bytes.
    """

    environments: int
    env_steps: int
    resident_gb: float


@dataclass(frozen=True, slots=True)
class Task:
    """What is measured.

    Attributes:
        pace: of every race.
        sizes: of every axis.
        options: of the environments where an axis does not say otherwise; ``level`` is a name.
        num_envs: likewise.
        num_threads: likewise.
        leak_steps: environment steps of the long run.
    """

    pace: Pace
    sizes: Sizes
    options: Mapping[str, Any]
    num_envs: int
    num_threads: int
    leak_steps: int

    def __post_init__(self) -> None:
        """Refuse options that no environment takes."""
        check_options(self.options)


@dataclass(frozen=True, slots=True)
class _Place:
    """What is measured at one place of an axis."""

    value: int
    num_envs: int
    num_threads: int
    options: Mapping[str, Any]


def measure_cost(task: Task, say: Callable[[str], None]) -> tuple[list[ScaleRow], GoalRow]:
    """Measure all axes; return their rows, and that of the goal for boxes.

    Args:
        task: what is measured.
        say: is told what begins.
    """
    rows: list[ScaleRow] = []
    boxes_goal = judge(*BOXES_GOAL, NOT_MEASURED)
    for axis, places in _axes(task).items():
        say(axis)
        contestants = [
            VectorStep(str(place.value), place.num_envs, place.num_threads, **place.options)
            for place in places
        ]
        results = race(contestants, task.pace)
        rows += [_row(axis, place, results[str(place.value)]) for place in places]
        if axis == "boxes" and {str(size) for size in BOXES_COMPARED} <= results.keys():
            few, many = (results[str(size)] for size in BOXES_COMPARED)
            boxes_goal = judge(*BOXES_GOAL, speed_ratio(few, many), len(few.seconds))
    return rows, boxes_goal


def measure_memory(task: Task) -> tuple[list[MemoryRow], GoalRow]:
    """Measure fresh processes of different sizes, and judge the one of a thousand."""
    rows = []
    for count in task.sizes.memory:
        stay = Stay(count, _MEMORY_STEPS * count, 1, _portable(task))
        rows += [_memory_row(count, footprint) for footprint in watch(stay)]
    thousand = [row.resident_gb for row in rows if row.environments == MEMORY_ENVS]
    return rows, judge(*MEMORY_GOAL, Median.of(thousand) if thousand else NOT_MEASURED)


def measure_leak(task: Task) -> Iterator[MemoryRow]:
    """Run one vector for long, and yield its memory as it goes."""
    stay = Stay(task.num_envs, task.leak_steps, _LOOKS, _portable(task))
    for footprint in watch(stay):
        yield _memory_row(task.num_envs, footprint)


def judge_leak(rows: Sequence[MemoryRow]) -> GoalRow:
    """Judge a long run by its end against its first tenth."""
    after_a_tenth = rows[len(rows) // 10 - 1]
    return judge(*LEAK_GOAL, Median.of([rows[-1].resident_gb / after_a_tenth.resident_gb]))


def _axes(task: Task) -> dict[str, list[_Place]]:
    sizes, count, threads, options = task.sizes, task.num_envs, task.num_threads, task.options
    dt_s = physics_preset(options["physics"]).dt_s
    axes = {
        "environments": [_Place(n, n, threads, options) for n in sizes.environments],
        "substeps": [
            _Place(n, count, threads, {**options, "control_dt_s": n * dt_s}) for n in sizes.substeps
        ],
        "boxes": [
            _Place(n, count, threads, {**options, "level": level_of_boxes(n)}) for n in sizes.boxes
        ],
        "coins": [
            _Place(n, count, threads, {**options, "level": level_of_coins(n)}) for n in sizes.coins
        ],
    }
    for num_envs in sizes.threads_environments:
        axis = f"threads of {num_envs:,} environment{'s' if num_envs > 1 else ''}"
        axes[axis] = [_Place(n, num_envs, n, options) for n in sizes.threads]
    return axes


def _row(axis: str, place: _Place, result: Result) -> ScaleRow:
    cost = Median.of([1e6 * seconds for seconds in result.seconds])
    contestant = result.contestant
    assert isinstance(contestant, VectorStep)
    return ScaleRow(
        axis=axis,
        value=place.value,
        us_per_env_step=cost.value,
        smallest=cost.low,
        largest=cost.high,
        rounds=len(result.seconds),
        environments=place.num_envs,
        threads=place.num_threads,
        substeps=contestant.simulation.config.substeps,
    )


def _memory_row(environments: int, footprint: Footprint) -> MemoryRow:
    return MemoryRow(environments, footprint.env_steps, footprint.resident_bytes / GIGABYTE)


def _portable(task: Task) -> dict[str, Any]:
    return {"num_threads": task.num_threads, **task.options}
