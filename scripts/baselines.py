"""Train the recipe on every level that comes with Roller, and make the page of its results.

What a deadline cuts off is a row all the same, and made again by the next run.

Examples::

    python scripts/baselines.py run --jobs 8
    python scripts/baselines.py run --deadline-s 440 --out runs/baselines
    python scripts/baselines.py run --quick --out runs/quick
    python scripts/baselines.py tables
    python scripts/baselines.py ship
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Final

# One each is what trainings side by side want, and is read when a package is first imported.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import tyro
from tqdm import tqdm

from roller_env.lab import baselines, baselines_page, chart, pages, trainings

NAME: Final = "baselines"
RESULTS: Final = Path("docs/results")
POLICIES: Final = Path("runs") / f"{NAME}_policies.tar"


@dataclass(frozen=True, slots=True)
class Run:
    """Make the trainings that are missing."""

    jobs: int = os.cpu_count() or 1
    """Trainings at a time, one thread each."""

    deadline_s: float | None = None
    """Seconds from now after which all is to be over."""

    levels: tuple[str, ...] = ()
    """Only these."""

    seeds: int | None = None
    """Only so many seeds."""

    recipe: Path = Path("configs/ppo.yaml")
    """Configuration."""

    out: Path = RESULTS
    """Directory of baselines.csv and baselines_curves.csv."""

    policies: Path | None = None
    """Tar file of the policies; by default baselines_policies.tar in runs, or in another --out."""

    quick: bool = False
    """Trainings of a second, to see that all of it works."""


def run(arguments: Run) -> None:
    """Make the trainings that are missing."""
    started_s = time.time()
    experiment = baselines.EXPERIMENT
    few = sorted({trial.seed for trial in experiment.trials})[: arguments.seeds]
    wanted = arguments.levels or {trial.level for trial in experiment.trials}
    kept = tuple(t for t in experiment.trials if t.seed in few and t.level in wanted)
    experiment = replace(experiment, trials=kept)
    if arguments.quick:
        experiment = replace(experiment, changes=(*experiment.changes, *trainings.QUICK.changes))
    out = arguments.out
    beside = POLICIES if out == RESULTS else out / POLICIES.name
    with TemporaryDirectory() as directory:
        baselines.compile_once(arguments.recipe, Path(directory) / NAME)
    print(f"compiled after {time.time() - started_s:.0f} s", flush=True)
    trainings.run(
        experiment,
        arguments.recipe,
        out / NAME,
        arguments.jobs,
        lambda trials, count: tqdm(trials, total=count, dynamic_ncols=True),
        deadline_s=None if arguments.deadline_s is None else started_s + arguments.deadline_s,
        policies=arguments.policies or beside,
    )


@dataclass(frozen=True, slots=True)
class Tables:
    """Make the tables and charts of the page from the rows."""

    results: Path = RESULTS
    """Directory of the rows, where the charts go, too."""

    page: Path = Path("docs/baselines.md")
    """Where the tables go."""


def tables(arguments: Tables) -> None:
    """Make the tables and charts of the page from the rows."""
    told, charts, facts = baselines_page.page(arguments.results)
    for name, figure in charts.items():
        chart.save(figure, facts, arguments.results / name)
    with TemporaryDirectory() as directory:
        measured = Path(directory) / "tables.md"
        measured.write_text(told, encoding="utf-8")
        pages.publish(arguments.page, "python scripts/baselines.py tables", measured, {})
    print(told)


@dataclass(frozen=True, slots=True)
class Ship:
    """Put the best-documented agent of each level where Roller looks for those that it ships."""

    policies: Path = POLICIES
    """Tar file that the trainings left."""

    results: Path = RESULTS
    """Directory of the rows."""

    out: Path = Path("assets/policies")
    """A directory a level goes here."""


def ship(arguments: Ship) -> None:
    """Put the best-documented agent of each level where Roller looks for those that it ships."""
    rows = baselines_page.trainings_of(arguments.results)
    for name in baselines.ship(rows, arguments.policies, arguments.out):
        print(name)


def main(
    arguments: Annotated[Run, tyro.conf.subcommand("run")]
    | Annotated[Tables, tyro.conf.subcommand("tables")]
    | Annotated[Ship, tyro.conf.subcommand("ship")],
) -> None:
    """Do what the command line says."""
    if isinstance(arguments, Run):
        run(arguments)
    elif isinstance(arguments, Tables):
        tables(arguments)
    else:
        ship(arguments)


if __name__ == "__main__":
    try:
        tyro.cli(main, description=__doc__, config=(tyro.conf.OmitArgPrefixes,))
    except KeyboardInterrupt:
        sys.exit("\nstopped; the same command goes on")
