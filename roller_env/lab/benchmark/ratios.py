"""The ratios that are required, measured, and how they stand to their goals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from roller_env.lab import chart, runner
from roller_env.lab.benchmark import cases
from roller_env.lab.benchmark.breakdown import where_the_time_goes
from roller_env.lab.benchmark.peers import Peer
from roller_env.lab.table import Frame, markdown
from roller_env.physics.presets import DEFAULT, MUJOCO_PRESETS, physics_preset
from roller_env.problems import listed
from roller_env.training.config import TrainingConfig

Sense = Literal["at least", "at most"]

FEW_ENVS: Final = 64
MANY_ENVS: Final = 1024

CASES: Final = (
    "Roller, vector",
    "Roller, vector, rigid",
    "Roller, vector, rigid, rays",
    "mujoco.batch.Batch alone, same balls",
    "Roller, gym.make",
    "Roller, gym.make, rigid",
    "mj_step loop alone, same ball",
    "EnvPool PointMaze_Large-v3",
    "gymnasium-robotics PointMaze_Large-v3",
    "SB3 PPO on RollerVecEnv",
    "SB3 PPO on SubprocVecEnv",
    "PPO of make train",
    f"Roller, {FEW_ENVS} environments",
    f"Roller, {MANY_ENVS} environments",
)
VECTOR, RIGID, _RAYS, _BATCH, _SINGLE, _RIGID_SINGLE, _LOOP, *_OTHERS = CASES
_ENVPOOL, _ROBOTICS, _ROLLER_PPO, _SUBPROC_PPO, TRAIN, _FEW, MANY = _OTHERS


class Goal(NamedTuple):
    """A number that is to be reached.

    It is taken round by round, from wall seconds by the case's name: those of an environment step,
    and those of a simulated second.
    """

    title: str
    sense: Sense
    bound: float
    of: Callable[[Frame, Frame], Any]


_COST: Final = f"cost an environment step, {MANY_ENVS:,} environments to {FEW_ENVS}"
_THOUSANDS: Final = "make train's PPO, thousand environment steps/s"
_PPO: Final = "PPO on RollerVecEnv to PPO on SubprocVecEnv"
_ROBOT: Final = "rigid: one environment to gymnasium-robotics"
_TO_DEFAULT: Final = "rigid: whole vector step to the same of MuJoCo"

GOALS: Final = (
    Goal("whole vector step to Batch alone", "at least", 0.85, lambda s, _: s[_BATCH] / s[VECTOR]),
    Goal(
        "one environment to a bare mj_step loop",
        "at least",
        0.35,
        lambda s, _: s[_LOOP] / s[_SINGLE],
    ),
    Goal(_TO_DEFAULT, "at least", 25.0, lambda s, _: s[VECTOR] / s[RIGID]),
    Goal(
        "rigid: environment steps to EnvPool", "at least", 8.0, lambda s, _: s[_ENVPOOL] / s[RIGID]
    ),
    Goal("rigid: simulated time to EnvPool", "at least", 40.0, lambda _, s: s[_ENVPOOL] / s[RIGID]),
    Goal(_ROBOT, "at least", 1.5, lambda s, _: s[_ROBOTICS] / s[_RIGID_SINGLE]),
    Goal(
        "rigid: cost of rays to that of a state", "at most", 2.0, lambda s, _: s[_RAYS] / s[RIGID]
    ),
    Goal(_PPO, "at least", 4.0, lambda s, _: s[_SUBPROC_PPO] / s[_ROLLER_PPO]),
    Goal(_COST, "at most", 1.1, lambda s, _: s[MANY] / s[_FEW]),
    Goal(_THOUSANDS, "at least", 20.0, lambda s, _: 1e-3 / s[TRAIN]),
)


def judge(comparison: str, sense: Sense, goal: float, values: Sequence[float]) -> dict[str, Any]:
    """Return the row of a goal, of values round by round; none where nothing was measured.

    Returns:
        ``comparison``, ``sense``, ``goal``, ``measured`` (median) with ``smallest`` and ``largest``
        of the ``rounds``, and the ``verdict``: met, missed or not measured.
    """
    rounds = pd.Series(values, dtype=float).dropna()
    value = rounds.median()
    met = value >= goal if sense == "at least" else value <= goal
    return {
        "comparison": comparison,
        "sense": sense,
        "goal": goal,
        "measured": value,
        "smallest": rounds.min(),
        "largest": rounds.max(),
        "rounds": len(rounds),
        "verdict": ("met" if met else "missed") if len(rounds) else "not measured",
    }


@dataclass(frozen=True, slots=True)
class Task:
    """What is run."""

    config: runner.Config
    options: Mapping[str, Any]  # of all our environments, see `roller_env.config.EnvConfig`
    num_envs: int  # of the vectors
    num_threads: int  # native threads of the vectors, EnvPool's among them
    training_envs: int  # of `RollerVecEnv` against `SubprocVecEnv`: that many processes
    training: TrainingConfig  # what ``make train`` trains
    peers: Path | None  # Python with the peers installed; None leaves them out

    def __post_init__(self) -> None:
        """Refuse options that no environment takes, and an engine without MuJoCo's physics."""
        cases.check_options(self.options)
        if physics_preset(self.options.get("physics", DEFAULT)).engine != "mujoco":
            found, known = self.options["physics"], listed(tuple(MUJOCO_PRESETS))
            raise ValueError(
                f"physics: found {found!r}; must be one of {known}, whose physics alone is "
                "measured; the rigid engine is beside it in every run"
            )

    def vector(self, name: str = VECTOR, num_envs: int = 0, **changes: Any) -> cases.VectorStep:
        """Return a vector, of many environments unless told otherwise."""
        options = {**self.options, **changes}
        return cases.VectorStep(name, num_envs or self.num_envs, self.num_threads, **options)

    def single(self, name: str = _SINGLE, **changes: Any) -> cases.SingleStep:
        """Return one environment."""
        return cases.SingleStep(name, **{**self.options, **changes})

    def make_train(self) -> cases.Training:
        """Return what ``make train`` does."""
        return cases.as_make_train_does(TRAIN, self.training)

    def _peer(self, name: str, **wanted: Any) -> list[runner.Case]:
        return [] if self.peers is None else [Peer(name, self.peers, **wanted)]

    def runs(self) -> dict[str, Callable[[], list[runner.Case]]]:
        """Return what makes the cases of each interleaved run, by what is said of it."""
        count, threads, options = self.training_envs, self.num_threads, self.options
        sizes = {"num_envs": self.num_envs, "num_threads": threads}
        few, many = (_FEW, FEW_ENVS), (MANY, MANY_ENVS)
        return {
            # First, while there are no threads that a fork could cut off.
            "training: RollerVecEnv, SubprocVecEnv": lambda: [
                cases.with_subproc_vec_env(_SUBPROC_PPO, count, **options),
                cases.with_roller_vec_env(_ROLLER_PPO, count, threads, **options),
            ],
            "vector steps": lambda: [
                (ours := self.vector()),
                cases.BatchAlone(_BATCH, ours),
                self.vector(RIGID, physics="rigid"),
                self.vector(_RAYS, physics="rigid", observation="rays"),
                *self._peer(_ENVPOOL, peer="envpool", **sizes),
            ],
            "one environment": lambda: [
                (ours := self.single()),
                cases.BareLoop(_LOOP, ours),
                self.single(_RIGID_SINGLE, physics="rigid"),
                *self._peer(_ROBOTICS, peer="gymnasium-robotics"),
            ],
            f"{FEW_ENVS} and {MANY_ENVS} environments": lambda: [
                self.vector(*few),
                self.vector(*many),
            ],
            "make train": lambda: [self.make_train()],
        }


def measure(task: Task, say: Callable[[str], None]) -> tuple[Frame, Frame, dict[str, str]]:
    """Run everything interleaved; ``say`` is told what begins.

    Returns:
        A row for each of `GOALS`, see `judge`; of every case ``case``, ``env_steps_per_s``
        (median), ``spread``, ``simulated_s_per_s`` and ``rounds``; and the versions of the peers'
        packages.
    """
    seconds, simulated_s, versions = Frame(), {}, dict[str, str]()
    for title, make in task.runs().items():
        say(title)
        with ExitStack() as stack:
            compared = make()
            for case in compared:
                stack.callback(case.close)
                simulated_s[case.name] = case.simulated_s
                versions |= getattr(case, "versions", {})
            seconds = seconds.join(runner.compare(compared, task.config), how="outer")
    per_s, whole = 1.0 / seconds, seconds.reindex(columns=CASES)
    goals = [judge(*one[:3], one.of(whole, whole / pd.Series(simulated_s))) for one in GOALS]
    speeds = Frame(
        {
            "env_steps_per_s": per_s.median(),
            "spread": (per_s.max() - per_s.min()) / per_s.median(),
            "simulated_s_per_s": per_s.median() * pd.Series(simulated_s),
            "rounds": per_s.count(),
        }
    )
    return Frame(goals), speeds.rename_axis("case").reset_index(), versions


def profile(task: Task, say: Callable[[str], None]) -> Frame:
    """Say where the time goes in a vector step, in a single one and in training."""
    found = []
    steps: dict[str, Callable[[], runner.Case]] = {
        "vector step": task.vector,
        "one environment": task.single,
        "make train": task.make_train,
    }
    for what, make in steps.items():
        say(f"where the time goes: {what}")
        case = make()
        case.prepare(task.config)
        count = task.config.rounds * case.steps_a_round
        found.append(where_the_time_goes(what, partial(case.run, count), count * case.env_steps))
        case.close()
    return pd.concat(found, ignore_index=True)


def draw_goals(goals: Frame, title: str) -> Figure:
    """Draw what was measured against its goal, better to the right."""
    rows = []
    for row in goals.itertuples():
        values = (row.measured, row.smallest, row.largest)
        most = row.sense == "at most"
        reached, *span = (row.goal / value if most else value / row.goal for value in values)
        bound = f"{'≤' if most else '≥'} {row.goal:g}"
        said = f"{row.measured:.3g}, {bound}" if row.rounds else f"not measured, {bound}"
        good = row.verdict == "met"
        rows.append(chart.Row(row.comparison, reached, tuple(span), good, said=said))
    note = "Green: the goal is reached. At the right what was measured, and the goal."
    xlabel = "times the goal, better to the right; grey: the range of the rounds"
    return chart.against_limits(rows, title, note, xlabel, (0.05, 20.0))


def goals_table(goals: Frame) -> str:
    """Return how the goals stand, as Markdown."""
    ranges = goals.smallest.map("{:.3g} to ".format) + goals.largest.map("{:.3g}".format)
    shown = {
        "": goals.comparison,
        "goal": goals.sense + goals.goal.map(" {:g}".format),
        "measured": goals.measured.map("{:.3g}".format).where(goals.rounds > 0, ""),
        "range": ranges.where(goals.rounds > 0, ""),
        "verdict": goals.verdict,
    }
    return markdown(Frame(shown))


def report(goals: Frame, speeds: Frame, parts: Frame) -> str:
    """Return the goals, the cases and where the time goes, a table each."""
    of_cases = {
        "case": speeds.case,
        "env steps/s": speeds.env_steps_per_s.map("{:,.0f}".format),
        "spread": speeds.spread.map("{:.0%}".format),
        "simulated s/s": speeds.simulated_s_per_s,
    }
    of_parts = {
        "step": parts.what,
        "part": parts.part,
        "share": parts.share.map("{:.1%}".format),
        "µs an env step": parts.us_per_env_step,
    }
    return "\n".join((goals_table(goals), markdown(Frame(of_cases)), markdown(Frame(of_parts))))
