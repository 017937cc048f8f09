"""The ratios that the project promises, measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from roller_env.lab.benchmark.breakdown import PartRow, where_the_time_goes
from roller_env.lab.benchmark.contestants import (
    BareLoop,
    BatchAlone,
    SingleStep,
    VectorStep,
    check_options,
)
from roller_env.lab.benchmark.goals import NOT_MEASURED, GoalRow, Sense, judge
from roller_env.lab.benchmark.peers import Peer
from roller_env.lab.benchmark.race import (
    Contestant,
    Median,
    Pace,
    Result,
    race,
    simulated_ratio,
    speed_ratio,
)
from roller_env.lab.benchmark.training import (
    Training,
    as_make_train_does,
    with_roller_vec_env,
    with_subproc_vec_env,
)
from roller_env.training.config import TrainingConfig

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


@dataclass(frozen=True, slots=True)
class Goal:
    """A number that is to be reached.

    Attributes:
        title: what is compared, for a table.
        bound: the goal.
        sense: on which side of it.
        ours: the contestant whose number is to be good.
        theirs: the one that it is measured against; none for a number of its own.
        measure: of the two results.
    """

    title: str
    bound: float
    sense: Sense
    ours: str
    theirs: str | None
    measure: Callable[[Result, Result], Median] = speed_ratio


def _cost_ratio(ours: Result, theirs: Result) -> Median:
    return speed_ratio(theirs, ours)


def _thousands_a_second(ours: Result, _: Result) -> Median:
    return Median.of([1e-3 / seconds for seconds in ours.seconds])


GOALS: Final = (
    Goal("whole vector step to Batch alone", 0.85, "at least", _VECTOR, _BATCH),
    Goal("one environment to a bare mj_step loop", 0.35, "at least", _SINGLE, _LOOP),
    Goal("simulated time to EnvPool", 8.0, "at least", _VECTOR, _ENVPOOL, simulated_ratio),
    Goal("environment steps to EnvPool", 2.0, "at least", _VECTOR, _ENVPOOL),
    Goal("one environment to gymnasium-robotics", 1.0, "at least", _SINGLE, _ROBOTICS),
    Goal("PPO on RollerVecEnv to PPO on SubprocVecEnv", 4.0, "at least", _ROLLER_PPO, _SUBPROC_PPO),
    Goal(
        f"cost an environment step, {MANY_ENVS:,} environments to {FEW_ENVS}",
        1.1,
        "at most",
        _MANY,
        _FEW,
        _cost_ratio,
    ),
    Goal(
        "make train's PPO, thousand environment steps/s",
        20.0,
        "at least",
        _MAKE_TRAIN,
        None,
        _thousands_a_second,
    ),
)


@dataclass(frozen=True, slots=True)
class SpeedRow:
    """How fast one contestant was.

    Attributes:
        contestant: who.
        env_steps_per_s: environment steps a wall second, median over the rounds.
        spread: (largest - smallest) / median.
        simulated_s_per_s: simulated seconds a wall second.
        rounds: how many.
    """

    contestant: str
    env_steps_per_s: float
    spread: float
    simulated_s_per_s: float
    rounds: int


@dataclass(frozen=True, slots=True)
class Task:
    """What is raced.

    Attributes:
        pace: how long.
        options: of all our environments, see `roller_env.config.EnvConfig`.
        num_envs: of the vectors.
        num_threads: native threads of the vectors, EnvPool's among them.
        training_envs: of the PPO that compares `RollerVecEnv` with `SubprocVecEnv`: that many
            processes.
        training: what ``make train`` trains.
        peers: Python with the peers installed; None leaves them out.
    """

    pace: Pace
    options: Mapping[str, Any]
    num_envs: int
    num_threads: int
    training_envs: int
    training: TrainingConfig
    peers: Path | None

    def __post_init__(self) -> None:
        """Refuse options that no environment takes."""
        check_options(self.options)


@dataclass(frozen=True, slots=True)
class Ratios:
    """All that was measured.

    Attributes:
        rows: a row for each of `GOALS`, in their order.
        speeds: of every contestant.
        versions: of the peers' packages.
    """

    rows: tuple[GoalRow, ...]
    speeds: tuple[SpeedRow, ...]
    versions: dict[str, str]


def measure(task: Task, say: Callable[[str], None]) -> Ratios:
    """Run all races.

    Args:
        task: what is raced.
        say: is told what begins.
    """
    results: dict[str, Result] = {}
    versions: dict[str, str] = {}
    for title, enter in _RACES.items():
        say(title)
        with ExitStack() as open_contestants:
            contestants = enter(task, open_contestants)
            results |= race(contestants, task.pace)
            for contestant in contestants:
                if isinstance(contestant, Peer):
                    versions |= contestant.versions
    return Ratios(
        rows=tuple(_row(goal, results) for goal in GOALS),
        speeds=tuple(_speed(result) for result in results.values()),
        versions=versions,
    )


def profile(task: Task, say: Callable[[str], None]) -> list[PartRow]:
    """Say where the time goes in a vector step, in a single one and in training."""
    rows: list[PartRow] = []
    for what, enter in _PROFILES.items():
        say(f"where the time goes: {what}")
        with ExitStack() as stack:
            contestant = enter(task, stack)
            steps = task.pace.rounds * contestant.prepare(task.pace)
            work = partial(contestant.run, steps)
            rows += where_the_time_goes(what, work, steps * contestant.env_steps)
    return rows


def _vector(task: Task, _: ExitStack) -> VectorStep:
    return VectorStep(_VECTOR, task.num_envs, task.num_threads, **task.options)


def _single(task: Task, _: ExitStack) -> SingleStep:
    return SingleStep(_SINGLE, **task.options)


def _make_train(task: Task, stack: ExitStack) -> Training:
    return stack.enter_context(as_make_train_does(_MAKE_TRAIN, task.training))


def _enter_vectors(task: Task, stack: ExitStack) -> list[Contestant]:
    ours = _vector(task, stack)
    entered: list[Contestant] = [ours, BatchAlone(_BATCH, ours)]
    if task.peers is not None:
        sizes = {"num_envs": task.num_envs, "num_threads": task.num_threads}
        entered.append(stack.enter_context(Peer(_ENVPOOL, task.peers, peer="envpool", **sizes)))
    return entered


def _enter_singles(task: Task, stack: ExitStack) -> list[Contestant]:
    ours = _single(task, stack)
    entered: list[Contestant] = [ours, BareLoop(_LOOP, ours)]
    if task.peers is not None:
        peer = Peer(_ROBOTICS, task.peers, peer="gymnasium-robotics")
        entered.append(stack.enter_context(peer))
    return entered


def _enter_sizes(task: Task, _: ExitStack) -> list[Contestant]:
    return [
        VectorStep(name, num_envs, task.num_threads, **task.options)
        for name, num_envs in ((_FEW, FEW_ENVS), (_MANY, MANY_ENVS))
    ]


def _enter_trainings(task: Task, stack: ExitStack) -> list[Contestant]:
    count, options = task.training_envs, task.options
    trainings = [
        with_subproc_vec_env(_SUBPROC_PPO, count, **options),
        with_roller_vec_env(_ROLLER_PPO, count, task.num_threads, **options),
    ]
    return [stack.enter_context(training) for training in trainings]


def _enter_make_train(task: Task, stack: ExitStack) -> list[Contestant]:
    return [_make_train(task, stack)]


_RACES: Final[dict[str, Callable[[Task, ExitStack], list[Contestant]]]] = {
    # First, while there are no threads that a fork could cut off.
    "training: RollerVecEnv, SubprocVecEnv": _enter_trainings,
    "vector steps": _enter_vectors,
    "one environment": _enter_singles,
    f"{FEW_ENVS} and {MANY_ENVS} environments": _enter_sizes,
    "make train": _enter_make_train,
}


_PROFILES: Final[dict[str, Callable[[Task, ExitStack], Contestant]]] = {
    "vector step": _vector,
    "one environment": _single,
    "make train": _make_train,
}


def _row(goal: Goal, results: Mapping[str, Result]) -> GoalRow:
    ours, theirs = results[goal.ours], results.get(goal.theirs or goal.ours)
    measured = NOT_MEASURED if theirs is None else goal.measure(ours, theirs)
    return judge(goal.title, goal.sense, goal.bound, measured, len(ours.seconds))


def _speed(result: Result) -> SpeedRow:
    speed = result.env_steps_per_s
    return SpeedRow(
        contestant=result.contestant.name,
        env_steps_per_s=speed.value,
        spread=speed.spread,
        simulated_s_per_s=speed.value * result.contestant.simulated_s,
        rounds=len(result.seconds),
    )
