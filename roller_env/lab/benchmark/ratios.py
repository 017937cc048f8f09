"""The ratios that are required, measured, and how they stand to their goals."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal

import pandas as pd
from matplotlib.figure import Figure

from roller_env.lab import chart
from roller_env.lab.benchmark.breakdown import where_the_time_goes
from roller_env.lab.benchmark.cases import (
    BareLoop,
    BatchAlone,
    SingleStep,
    Training,
    VectorStep,
    as_make_train_does,
    check_options,
    with_roller_vec_env,
    with_subproc_vec_env,
)
from roller_env.lab.benchmark.peers import Peer
from roller_env.lab.runner import (
    Case,
    Config,
    Median,
    Result,
    compare,
    simulated_ratio,
    speed_ratio,
)
from roller_env.lab.table import Frame, frame, markdown
from roller_env.training.config import TrainingConfig

Sense = Literal["at least", "at most"]

NOT_MEASURED: Final = Median(math.nan, math.nan, math.nan)

FEW_ENVS: Final = 64
MANY_ENVS: Final = 1024

_VECTOR: Final = "Roller, vector"
_BATCH: Final = "mujoco.batch.Batch alone, same balls"
_SINGLE: Final = "Roller, gym.make"
_LOOP: Final = "mj_step loop alone, same ball"
_ENVPOOL: Final = "EnvPool PointMaze_Large-v3"
_ROBOTICS: Final = "gymnasium-robotics PointMaze_Large-v3"
_ROLLER_PPO: Final = "SB3 PPO on RollerVecEnv"
_SUBPROC_PPO: Final = "SB3 PPO on SubprocVecEnv"
_MAKE_TRAIN: Final = "PPO of make train"
_FEW: Final = f"Roller, {FEW_ENVS} environments"
_MANY: Final = f"Roller, {MANY_ENVS} environments"


def judge(
    comparison: str, sense: Sense, goal: float, measured: Median, rounds: int = 1
) -> dict[str, Any]:
    """Return the row of a goal; `NOT_MEASURED` is no failure, but no success either.

    Returns:
        ``comparison``, ``sense``, ``goal``, ``measured`` with ``smallest`` and ``largest`` of the
        ``rounds``, and the ``verdict``: met, missed or not measured.
    """
    value = measured.value
    verdict = "met" if (value >= goal if sense == "at least" else value <= goal) else "missed"
    return {
        "comparison": comparison,
        "sense": sense,
        "goal": goal,
        "measured": value,
        "smallest": measured.low,
        "largest": measured.high,
        "rounds": 0 if math.isnan(value) else rounds,
        "verdict": "not measured" if math.isnan(value) else verdict,
    }


@dataclass(frozen=True, slots=True)
class Goal:
    """A number that is to be reached.

    Attributes:
        title: what is compared, for a table.
        bound: the goal.
        sense: on which side of it.
        ours: the case whose number is to be good.
        theirs: the one that it is measured against; none for a number of its own.
        measure: of the two results.
    """

    title: str
    bound: float
    sense: Sense
    ours: str
    theirs: str | None
    measure: Callable[[Result, Result], Median] = speed_ratio

    def row(self, results: Mapping[str, Result]) -> dict[str, Any]:
        """Return the row of what was measured."""
        ours, theirs = results[self.ours], results.get(self.theirs or self.ours)
        measured = NOT_MEASURED if theirs is None else self.measure(ours, theirs)
        return judge(self.title, self.sense, self.bound, measured, len(ours.seconds))


def _cost_ratio(ours: Result, theirs: Result) -> Median:
    return speed_ratio(theirs, ours)


def _thousands_a_second(ours: Result, _: Result) -> Median:
    return ours.env_steps_per_s.times(1e-3)


_SIZES: Final = f"cost an environment step, {MANY_ENVS:,} environments to {FEW_ENVS}"
_TRAIN: Final = "make train's PPO, thousand environment steps/s"

GOALS: Final = (
    Goal("whole vector step to Batch alone", 0.85, "at least", _VECTOR, _BATCH),
    Goal("one environment to a bare mj_step loop", 0.35, "at least", _SINGLE, _LOOP),
    Goal("simulated time to EnvPool", 8.0, "at least", _VECTOR, _ENVPOOL, simulated_ratio),
    Goal("environment steps to EnvPool", 2.0, "at least", _VECTOR, _ENVPOOL),
    Goal("one environment to gymnasium-robotics", 1.0, "at least", _SINGLE, _ROBOTICS),
    Goal("PPO on RollerVecEnv to PPO on SubprocVecEnv", 4.0, "at least", _ROLLER_PPO, _SUBPROC_PPO),
    Goal(_SIZES, 1.1, "at most", _MANY, _FEW, _cost_ratio),
    Goal(_TRAIN, 20.0, "at least", _MAKE_TRAIN, None, _thousands_a_second),
)


@dataclass(frozen=True, slots=True)
class Task:
    """What is run.

    Attributes:
        config: how long.
        options: of all our environments, see `roller_env.config.EnvConfig`.
        num_envs: of the vectors.
        num_threads: native threads of the vectors, EnvPool's among them.
        training_envs: of the PPO that compares `RollerVecEnv` with `SubprocVecEnv`: that many
            processes.
        training: what ``make train`` trains.
        peers: Python with the peers installed; None leaves them out.
    """

    config: Config
    options: Mapping[str, Any]
    num_envs: int
    num_threads: int
    training_envs: int
    training: TrainingConfig
    peers: Path | None

    def __post_init__(self) -> None:
        """Refuse options that no environment takes."""
        check_options(self.options)

    def vector(self, _: ExitStack) -> VectorStep:
        """Return the vector of many environments."""
        return VectorStep(_VECTOR, self.num_envs, self.num_threads, **self.options)

    def single(self, _: ExitStack) -> SingleStep:
        """Return one environment."""
        return SingleStep(_SINGLE, **self.options)

    def make_train(self, stack: ExitStack) -> Training:
        """Return what ``make train`` does."""
        return stack.enter_context(as_make_train_does(_MAKE_TRAIN, self.training))

    def _peer(self, stack: ExitStack, name: str, **wanted: Any) -> list[Case]:
        if self.peers is None:
            return []
        return [stack.enter_context(Peer(name, self.peers, **wanted))]

    def runs(self) -> dict[str, Callable[[ExitStack], list[Case]]]:
        """Return what opens the cases of each interleaved run, by what is said of it."""

        def trainings(stack: ExitStack) -> list[Case]:
            count, threads = self.training_envs, self.num_threads
            theirs = with_subproc_vec_env(_SUBPROC_PPO, count, **self.options)
            ours = with_roller_vec_env(_ROLLER_PPO, count, threads, **self.options)
            return [stack.enter_context(theirs), stack.enter_context(ours)]

        def vectors(stack: ExitStack) -> list[Case]:
            ours = self.vector(stack)
            sizes = {"num_envs": self.num_envs, "num_threads": self.num_threads}
            peer = self._peer(stack, _ENVPOOL, peer="envpool", **sizes)
            return [ours, BatchAlone(_BATCH, ours), *peer]

        def singles(stack: ExitStack) -> list[Case]:
            ours = self.single(stack)
            peer = self._peer(stack, _ROBOTICS, peer="gymnasium-robotics")
            return [ours, BareLoop(_LOOP, ours), *peer]

        def sizes(_: ExitStack) -> list[Case]:
            return [
                VectorStep(name, count, self.num_threads, **self.options)
                for name, count in ((_FEW, FEW_ENVS), (_MANY, MANY_ENVS))
            ]

        return {
            # First, while there are no threads that a fork could cut off.
            "training: RollerVecEnv, SubprocVecEnv": trainings,
            "vector steps": vectors,
            "one environment": singles,
            f"{FEW_ENVS} and {MANY_ENVS} environments": sizes,
            "make train": lambda stack: [self.make_train(stack)],
        }


@dataclass(frozen=True, slots=True)
class Ratios:
    """All that was measured.

    Attributes:
        goals: a row for each of `GOALS`, in their order; see `judge`.
        speeds: of every case: ``case``, ``env_steps_per_s`` (median), ``spread``,
            ``simulated_s_per_s`` and ``rounds``.
        versions: of the peers' packages.
    """

    goals: Frame
    speeds: Frame
    versions: dict[str, str]


def measure(task: Task, say: Callable[[str], None]) -> Ratios:
    """Run everything interleaved; ``say`` is told what begins."""
    results: dict[str, Result] = {}
    versions: dict[str, str] = {}
    for title, enter in task.runs().items():
        say(title)
        with ExitStack() as stack:
            cases = enter(stack)
            results |= compare(cases, task.config)
            for case in cases:
                versions |= case.versions if isinstance(case, Peer) else {}
    return Ratios(
        goals=frame([goal.row(results) for goal in GOALS]),
        speeds=frame([_speed(result) for result in results.values()]),
        versions=versions,
    )


def _speed(result: Result) -> dict[str, Any]:
    speed = result.env_steps_per_s
    return {
        "case": result.case.name,
        "env_steps_per_s": speed.value,
        "spread": speed.spread,
        "simulated_s_per_s": speed.value * result.case.simulated_s,
        "rounds": len(result.seconds),
    }


def profile(task: Task, say: Callable[[str], None]) -> Frame:
    """Say where the time goes in a vector step, in a single one and in training."""
    found = []
    steps: dict[str, Callable[[ExitStack], Case]] = {
        "vector step": task.vector,
        "one environment": task.single,
        "make train": task.make_train,
    }
    for what, enter in steps.items():
        say(f"where the time goes: {what}")
        with ExitStack() as stack:
            case = enter(stack)
            count = task.config.rounds * case.prepare(task.config)
            work = partial(case.run, count)
            found.append(where_the_time_goes(what, work, count * case.env_steps))
    return pd.concat(found, ignore_index=True)


# --- pictures and tables ---------------------------------------------------------------------


def draw_goals(goals: Frame, title: str) -> Figure:
    """Draw what was measured against its goal, better to the right."""

    def reached(row: Any, value: float) -> float:
        return float(value / row.goal if row.sense == "at least" else row.goal / value)

    rows = [
        chart.Row(
            row.comparison,
            reached(row, row.measured),
            (reached(row, row.smallest), reached(row, row.largest)),
            row.verdict == "met",
            said=f"{row.measured:.3g}, {'≥' if row.sense == 'at least' else '≤'} {row.goal:g}",
        )
        for row in goals.itertuples()
    ]
    note = "Green: the goal is reached. At the right what was measured, and the goal."
    xlabel = "times the goal, better to the right; grey: the range of the rounds"
    return chart.against_limits(rows, title, note, xlabel, (0.05, 20.0))


def goals_table(goals: Frame) -> str:
    """Return how the goals stand, as Markdown."""
    cells = [
        (
            row.comparison,
            f"{row.sense} {row.goal:g}",
            f"{row.measured:.3g}" if row.rounds else "",
            f"{row.smallest:.3g} to {row.largest:.3g}" if row.rounds else "",
            row.verdict,
        )
        for row in goals.itertuples()
    ]
    return markdown(("", "goal", "measured", "range", "verdict"), cells)


def report(measured: Ratios, parts: Frame) -> str:
    """Return the goals, the cases and where the time goes, a table each."""
    speeds = [
        (row.case, f"{row.env_steps_per_s:,.0f}", f"{row.spread:.0%}", row.simulated_s_per_s)
        for row in measured.speeds.itertuples()
    ]
    shares = [
        (row.what, row.part, f"{row.share:.1%}", row.us_per_env_step) for row in parts.itertuples()
    ]
    return "\n".join(
        (
            goals_table(measured.goals),
            markdown(("case", "env steps/s", "spread", "simulated s/s"), speeds),
            markdown(("step", "part", "share", "µs an env step"), shares),
        )
    )
