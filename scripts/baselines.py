"""Train the recipe on every level that comes with Roller, and make the page of its results.

What a deadline cuts off is a row all the same, and made again by the next run.

Examples::

    python scripts/baselines.py run --jobs 8
    python scripts/baselines.py run --deadline-s 440 --out runs/baselines
    python scripts/baselines.py run --quick --out runs/quick
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

# One each is what trainings side by side want, and is read when a package is first imported.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import tyro
from tqdm import tqdm

from roller_env.lab import baselines, trainings

NAME = "baselines"
RESULTS = Path("docs/results")


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
    beside = Path("runs") if out == RESULTS else out
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
        policies=arguments.policies or beside / f"{NAME}_policies.tar",
    )


def main(arguments: Annotated[Run, tyro.conf.subcommand("run")]) -> None:
    """Do what the command line says."""
    run(arguments)


if __name__ == "__main__":
    try:
        main(tyro.cli(Run, description=__doc__, args=sys.argv[2:]))
    except KeyboardInterrupt:
        sys.exit("\nstopped; the same command goes on")
