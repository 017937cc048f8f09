"""Train by the dozen: the recipe on seeds that nobody tuned on, and what each part of it is worth.

Every finished training is a row of a CSV, so that an experiment can be stopped and gone on with.

Examples::

    python scripts/experiments.py seeds
    python scripts/experiments.py factors --jobs 8
    python scripts/experiments.py seeds --show
    python scripts/experiments.py --quick --out runs/experiments
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

# One each is what trainings side by side want, and is read when a package is first imported.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import tyro
from tqdm import tqdm

from roller_env.lab import chart, trainings
from roller_env.lab.runner import provenance


@dataclass(frozen=True, slots=True)
class Arguments:
    """Make the trainings of an experiment that are missing, and print its tables."""

    experiment: Annotated[Literal["seeds", "factors", "transfer"], tyro.conf.Positional] = "seeds"
    """seeds: the recipe on every level with the seeds 50 to 59; factors: what is left of it when
    one thing is changed, on flat and bridge; transfer: agents trained on one physics, judged on
    four, on classic and flat."""

    show: bool = False
    """Print the tables and draw the charts of what is there; train nothing."""

    quick: bool = False
    """Two trainings of a second each, to see that all of it works."""

    jobs: int = os.cpu_count() or 1
    """Trainings at a time."""

    seeds: int | None = None
    """Only so many seeds of the experiment."""

    recipe: Path = Path("configs/ppo.yaml")
    """Configuration that is tried."""

    out: Path = Path("docs/results")
    """Directory of the rows and charts."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    experiment = trainings.EXPERIMENTS[arguments.experiment]
    if arguments.quick:
        experiment = trainings.QUICK
    if arguments.seeds is not None:
        few = sorted({trial.seed for trial in experiment.trials})[: arguments.seeds]
        kept = tuple(trial for trial in experiment.trials if trial.seed in few)
        experiment = replace(experiment, trials=kept)
    stem = arguments.out / arguments.experiment
    if not arguments.show:
        bar = lambda trials, count: tqdm(trials, total=count, dynamic_ncols=True)  # noqa: E731
        trainings.run(experiment, arguments.recipe, stem, arguments.jobs, bar)
    if arguments.experiment == "factors":
        print(trainings.factors_table(stem))
        return
    if arguments.experiment == "transfer":
        print(trainings.transfer_table(stem))
        return
    print(trainings.seeds_table(stem))
    print(trainings.each_seed_table(stem))
    figure = trainings.draw_curves(
        stem,
        "Share of the coins and of the games at the finish, of whole games from the start in "
        "training (sampled actions, not the deterministic ones of the evaluation); line: median of "
        "the seeds, band: all of them; dashed: 95 %.",
    )
    print(chart.save(figure, provenance(), stem)[0])


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except KeyboardInterrupt:
        sys.exit("\nstopped; the same command goes on")
