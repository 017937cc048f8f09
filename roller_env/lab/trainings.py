"""What becomes of trainings: the recipe on seeds that nobody tuned on, and what each part is worth.

A trial is one training of a level with one seed, and its evaluation. Its row is kept as soon as it
is there, so that an experiment of hours can be stopped and gone on with.
"""

from __future__ import annotations

import csv
import io
import os
import tarfile
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import pandas
from matplotlib.figure import Figure

from roller_env import __version__
from roller_env.game.result import EpisodeResult
from roller_env.lab import chart
from roller_env.lab.runner import provenance
from roller_env.lab.table import Frame, markdown
from roller_env.training import TrainingConfig, load_config
from roller_env.training.checkpoint import Progress
from roller_env.training.files import RunFiles
from roller_env.training.logs import STEPS, read_progress
from roller_env.training.policy import load_policy
from roller_env.training.run import evaluate_policy, learn_to_mastery
from roller_env.training.schedule import has_spent_all

RECIPE: Final = "recipe"
"""The variant in which nothing is changed."""

LEVELS: Final = ("classic", "bridge", "flat", "gate", "lift")

GOOD: Final = 0.95
"""Share of the games at the finish, and of the coins, from which on a level counts as learnt."""

FACTORS: Final[Mapping[str, tuple[str, ...]]] = {
    RECIPE: (),
    "no practice: every game from the start": ("start_state_curriculum=0",),
    "practice in a quarter of the games": ("start_state_curriculum=0.25",),
    "the finish paid in full, whatever is left": ("environment.reward_weights.completeness=0",),
    "no shaping": ("environment.reward=points",),
    "shaped along the route instead": (
        "environment.reward=shaped",
        "environment.reward_weights.progress=20",
    ),
    "gamma 0.99": ("ppo.gamma=0.99",),
    "4 epochs": ("ppo.epochs=4",),
    "batches of 2048": ("ppo.batch_size=2048", "ppo.learning_rate=1e-3"),
    "128 units a layer": ("ppo.hidden_sizes=[128,128]",),
    "rays seen as well": ("environment.observation=rays",),
    "20 decisions a second": (
        "environment.control_dt_s=0.05",
        "environment.max_episode_steps=1200",
    ),
    "no entropy penalty at the end": ("ppo.final_entropy_coefficient=0.0",),
    "rewards as they are": ("normalise_rewards=false",),
}
"""Variants of the recipe by their names, and what each changes: one thing."""


PHYSICS: Final = ("rigid", "relaxed", "fast", "default")
"""Engines of which an agent is trained on one and judged on all."""

TRANSFER: Final[Mapping[str, tuple[str, ...]]] = {
    f"trained on {physics}": (f"environment.physics={physics}",) for physics in PHYSICS
}

VARIANTS: Final = {**FACTORS, **TRANSFER}


@dataclass(frozen=True, slots=True)
class Trial:
    """One training: which variant of the recipe, on which level, with which seed."""

    variant: str
    level: str
    seed: int

    @property
    def key(self) -> tuple[str, str, int]:
        """What its row is found by."""
        return self.variant, self.level, self.seed


@dataclass(frozen=True, slots=True)
class Experiment:
    """Trials that belong together.

    Attributes:
        trials: in the order in which they are made.
        changes: overrides of the recipe for all of them.
        judged_on: physics presets on which the agents play besides the evaluation's own.
        on_record: whether rows say how their training ended, where and with which versions.
    """

    trials: tuple[Trial, ...]
    changes: tuple[str, ...] = ()
    judged_on: tuple[str, ...] = ()
    on_record: bool = False


EXPERIMENTS: Final[Mapping[str, Experiment]] = {
    "seeds": Experiment(
        tuple(Trial(RECIPE, level, seed) for seed in range(50, 60) for level in LEVELS)
    ),
    "factors": Experiment(
        tuple(
            Trial(variant, level, seed)
            for seed in range(5)
            for level in ("flat", "bridge")
            for variant in FACTORS
        ),
        ("total_steps=1000000",),
    ),
    "transfer": Experiment(
        tuple(
            Trial(variant, level, seed)
            for seed in range(3)
            for level in ("classic", "flat")
            for variant in TRANSFER
        ),
        ("total_steps=2500000",),
        PHYSICS,
    ),
}

QUICK: Final = Experiment(
    (Trial(RECIPE, "flat", 0), Trial("gamma 0.99", "gate", 1)),
    (
        "total_steps=2048",
        "num_envs=16",
        "ppo.rollout_steps=32",
        "ppo.epochs=1",
        "evaluation_episodes=4",
        "environment.max_episode_steps=100",
    ),
    ("fast", "rigid"),
)
"""An experiment of seconds that shows nothing but that it works."""


UNFINISHED: Final = "unfinished"
"""How a training ended that its deadline cut off; it is made again when there is time."""

EVALUATION_S: Final = 45.0
"""Kept free before a deadline: an agent may be judged twice after its last step."""

SHORTEST_S: Final = 60.0
"""A training that has less than this left is not begun."""


class Tried(NamedTuple):
    """What a trial leaves: its row, its learning curve, and its policy's files by their names."""

    row: dict[str, Any]
    curve: list[dict[str, Any]]
    policy: dict[str, bytes]


def run(
    experiment: Experiment,
    recipe: Path,
    stem: Path,
    jobs: int,
    progress: Callable[[Iterable[Any], int], Iterable[Any]] = lambda rows, _: rows,
    *,
    deadline_s: float | None = None,
    policies: Path | None = None,
) -> None:
    """Make the trials of which there is no row yet, or only one of an unfinished training.

    Args:
        experiment: what to try.
        recipe: configuration that its variants change.
        stem: the rows go into ``stem.csv``, the learning curves into ``stem_curves.csv``.
        jobs: trainings at a time.
        progress: wraps the trials as they are done, given their number.
        deadline_s: moment, as `time.time` has it, at which all is to be over: trainings end before
            it, and count as unfinished if they are.
        policies: tar file to which ``LEVEL-SEED/policy.json`` and ``.safetensors`` are added.

    Raises:
        BaseExceptionGroup: trials failed; the others are there.
    """
    forget_unfinished(stem)
    done = {(row["variant"], row["level"], int(row["seed"])) for row in _rows(_results(stem))}
    missing = [trial for trial in experiment.trials if trial.key not in done]
    stem.parent.mkdir(parents=True, exist_ok=True)
    failed: list[BaseException] = []
    trials = _finished(missing, experiment, recipe, jobs, deadline_s)
    for trial in progress(trials, len(missing)):
        fault = trial.exception()
        if fault is not None:
            failed.append(fault)
            continue
        tried: Tried = trial.result()
        # The row last: a trial whose row is there is whole.
        if policies is not None:
            _keep(policies, f"{tried.row['level']}-{tried.row['seed']}", tried.policy)
        _append(_curves(stem), tried.curve)
        _append(_results(stem), [tried.row])
    if failed:
        raise BaseExceptionGroup(f"{len(failed)} trials failed", failed)


def _finished(
    trials: Iterable[Trial],
    experiment: Experiment,
    recipe: Path,
    jobs: int,
    deadline_s: float | None,
) -> Iterator[Future[Tried]]:
    """Yield trials as they are done; begin none that could not end in time."""
    waiting, running = iter(trials), set[Future[Tried]]()
    # A process for each: what one leaves behind in PyTorch or Numba is not the next one's.
    with ProcessPoolExecutor(jobs, get_context("spawn"), max_tasks_per_child=1) as pool:
        while True:
            while len(running) < jobs and _left_s(deadline_s) >= SHORTEST_S:
                trial = next(waiting, None)
                if trial is None:
                    break
                running.add(pool.submit(_tried, trial, experiment, recipe, deadline_s))
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            yield from done


def _left_s(deadline_s: float | None) -> float:
    """Return for how long a training may go on so that it is judged before a deadline."""
    return np.inf if deadline_s is None else deadline_s - EVALUATION_S - time.time()


def _keep(file: Path, name: str, content: Mapping[str, bytes]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    with tarfile.open(file, "a") as archive:
        for part, data in content.items():
            member = tarfile.TarInfo(f"{name}/{part}")
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))


def forget_unfinished(stem: Path) -> None:
    """Take out the rows and curves of trainings that a deadline cut off."""
    rows = list(_rows(_results(stem)))
    kept = [row for row in rows if row.get("ended") != UNFINISHED]
    if len(kept) == len(rows):
        return
    keys = {(row["level"], row["seed"]) for row in kept}
    curves = [row for row in _rows(_curves(stem)) if (row["level"], row["seed"]) in keys]
    for file, content in ((_curves(stem), curves), (_results(stem), kept)):
        file.unlink()
        if content:
            _append(file, content)


def _results(stem: Path) -> Path:
    return stem.with_name(f"{stem.name}.csv")


def _curves(stem: Path) -> Path:
    return stem.with_name(f"{stem.name}_curves.csv")


def _rows(file: Path) -> Iterator[dict[str, str]]:
    if file.exists():
        with file.open(encoding="utf-8", newline="") as text:
            yield from csv.DictReader(text)


def _append(file: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    is_new = not file.exists()
    with file.open("a", encoding="utf-8", newline="") as text:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerows(rows)


def _tried(trial: Trial, experiment: Experiment, recipe: Path, deadline_s: float | None) -> Tried:
    own = (f"level={trial.level}", f"seed={trial.seed}", "checkpoint_interval_s=1e9")
    config = load_config(recipe, (*own, *experiment.changes, *VARIANTS[trial.variant]))
    if deadline_s is not None:
        left_s = max(_left_s(deadline_s), 1.0)
        config = config.model_copy(update={"wall_clock_budget_s": left_s})
    names = {"variant": trial.variant, "level": trial.level, "seed": trial.seed}
    with tempfile.TemporaryDirectory() as directory:
        files = RunFiles(Path(directory))
        start_s, cpu_s = time.monotonic(), time.process_time()
        progress = learn_to_mastery(config, files)
        wall_s, cpu_s = time.monotonic() - start_s, time.process_time() - cpu_s
        policy = load_policy(files.directory)
        evaluation = evaluate_policy(policy, config, config.evaluation_episodes)
        elsewhere: dict[str, float] = {}
        for physics in experiment.judged_on:
            changed = replace(config.evaluation_environment, physics=physics)
            there = config.model_copy(update={"evaluation_environment": changed})
            others = evaluate_policy(policy, there, config.evaluation_episodes).results
            finish, coins = shares(others)
            elsewhere |= {f"finish on {physics}": finish, f"coins on {physics}": coins}
        curve = list(_thinned(read_progress(files.progress), evaluation.coins_in_level))
        kept = {file.name: file.read_bytes() for file in (files.policy, files.weights)}
    results = evaluation.results
    finish, coins = shares(results)
    row = names | {
        "steps": progress.steps,
        "finish": finish,
        "coins": coins,
        "falls": round(float(np.mean([result.fall for result in results])), 4),
        "time_s": round(float(np.mean([result.time_s for result in results])), 2),
        "train_wall_s": round(wall_s, 1),
        "train_cpu_s": round(cpu_s, 1),
        "roller": __version__,
        "processors": os.cpu_count(),
    }
    if experiment.on_record:
        facts = provenance(("mujoco", "torch", "numpy"))
        del facts["command"], facts["roller"]
        row |= {"ended": _ended(config, progress)} | facts
    return Tried(row | elsewhere, [names | point for point in curve], kept)


def _ended(config: TrainingConfig, progress: Progress) -> str:
    if progress.steps >= config.total_steps:
        return "all steps"
    return UNFINISHED if has_spent_all(config, progress) else "mastered"


def shares(results: Sequence[EpisodeResult]) -> tuple[float, float]:
    """Return the shares of the games at the finish, and of the coins."""
    finish = float(np.mean([result.success for result in results]))
    coins = float(np.mean([result.score_percent for result in results])) / 100
    return round(finish, 4), round(coins, 4)


_POINTS: Final = 30
"""Of a learning curve that is kept."""


def _thinned(rows: Sequence[Mapping[str, str]], coins: int) -> Iterator[dict[str, Any]]:
    """Yield means over equal stretches of a training's log, weighted by episodes."""
    for part in np.array_split(np.arange(len(rows)), min(_POINTS, len(rows))):
        log = [rows[at] for at in part]
        weights = np.array([float(row["rollout/episodes"]) for row in log])

        def mean(column: str, log: Any = log, weights: Any = weights) -> float | str:
            values = np.array([float(row[column]) for row in log])
            known = weights > 0
            if not known.any():
                return ""
            return round(float(np.average(values[known], weights=weights[known])), 4)

        taken = mean("rollout/coins")
        yield {
            "steps": log[-1][STEPS],
            "finish": mean("rollout/success_rate"),
            "coins": round(taken / max(coins, 1), 4) if isinstance(taken, float) else "",
        }


# Tables and charts -------------------------------------------------------------------------------


def seeds_table(stem: Path) -> str:
    """Return, as Markdown, what became of the recipe: a row a level."""
    results = _frame(_results(stem))
    results["learnt"] = (results.finish >= GOOD) & (results.coins >= GOOD)
    rows = []
    for level in [level for level in LEVELS if level in set(results.level)]:
        own = results[results.level == level]
        rows.append(
            {
                "level": level,
                "learnt": f"{own.learnt.sum()} of {len(own)}",
                "at the finish, mean": _percent(own.finish.mean()),
                "worst": _percent(own.finish.min()),
                "coins, mean": _percent(own.coins.mean()),
                "worst seed": _percent(own.coins.min()),
                "time of a game": f"{own.time_s.median():.1f} s",
                "training, CPU": f"{own.train_cpu_s.median():.0f} s",
            }
        )
    return markdown(Frame(rows))


def each_seed_table(stem: Path) -> str:
    """Return, as Markdown, the share at the finish and of the coins of every seed."""
    results = _frame(_results(stem)).sort_values("seed")
    told = [
        f"{_percent(row.finish)} / {_percent(row.coins)}" for row in results.itertuples(index=False)
    ]
    wide = results.assign(told=told).pivot_table("told", "seed", "level", aggfunc="first")
    wide = wide[[level for level in LEVELS if level in wide]]
    return markdown(wide.reset_index().astype(str))


def factors_table(stem: Path) -> str:
    """Return, as Markdown, what each variant of the recipe comes to, means over the seeds."""
    results = _frame(_results(stem))
    rows = []
    for variant in [name for name in FACTORS if name in set(results.variant)]:
        row: dict[str, Any] = {"variant": variant}
        for level, own in results[results.variant == variant].groupby("level", sort=True):
            row[f"{level}: at the finish"] = _percent(own.finish.mean())
            row[f"{level}: coins"] = _percent(own.coins.mean())
            row[f"{level}: seeds"] = str(len(own))
        rows.append(row)
    return markdown(Frame(rows).fillna("-"))


def transfer_table(stem: Path) -> str:
    """Return, as Markdown, how agents of each physics play on every other, means of the seeds."""
    results = _frame(_results(stem))
    judged = [column.removeprefix("finish on ") for column in results if "finish on" in column]
    rows = []
    for (level, variant), own in results.groupby(["level", "variant"], sort=False):
        row = {"level": level, "": variant, "seeds": str(len(own))}
        for physics in judged:
            finish, coins = own[f"finish on {physics}"].mean(), own[f"coins on {physics}"].mean()
            row[f"on {physics}"] = f"{_percent(finish)} / {_percent(coins)}"
        rows.append(row)
    return markdown(Frame(rows))


def _frame(file: Path) -> Frame:
    return pandas.read_csv(file)


def _percent(share: float) -> str:
    return f"{100 * share:.4g} %"


@chart.styled
def draw_curves(stem: Path, note: str) -> Figure:
    """Draw how coins and finishes grow with the steps, a panel a level, over all seeds."""
    curves = _frame(_curves(stem))
    title = f"One recipe on every level, seeds {curves.seed.min()} to {curves.seed.max()}"
    levels = [level for level in LEVELS if level in set(curves.level)]
    figure, panels = chart.grid(
        (1, len(levels)), title, note, panel=(2.5, 2.3), margins=(0.7, 0.3, 1.15, 0.8), sharey=True
    )
    shares = (("coins", "coins", chart.SERIES[2]), ("finish", "at the finish", chart.SERIES[0]))
    for axes, level in zip(panels[0], levels, strict=True):
        own = curves[curves.level == level]
        for column, label, colour in shares:
            # Where no whole game ended in a stretch, the one before still stands.
            wide = own.pivot_table(column, "steps", "seed", dropna=False).ffill()
            steps = wide.index.to_numpy() / 1e6
            axes.fill_between(steps, wide.min(axis=1), wide.max(axis=1), color=colour, alpha=0.18)
            axes.plot(steps, wide.median(axis=1), color=colour, lw=2, label=label)
        axes.axhline(GOOD, color="#555555", lw=0.8, ls="--")
        axes.set(ylim=(-0.03, 1.03), xlim=(0, None), xlabel="million steps")
        axes.set_title(level, fontsize=10, loc="left")
    panels[0, 0].set_yticks([0, 0.5, 1.0], ["0", "50 %", "100 %"])
    chart.legend_of(figure, panels[0, 0])
    return figure
