"""Try trainings on a cluster: two Ray nodes on this machine, which come and go, and what they cost.

Needs Ray, and so an environment of its own: `make cluster` makes it and runs this.

Examples::

    python scripts/cluster.py --quick
    python scripts/cluster.py --out docs/results
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path

# What learns and what plays have a CPU each; read when a package is first imported.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import torch
import tyro

from roller_env.cli.train import recipe
from roller_env.lab import cluster
from roller_env.training import load_config


@dataclass(frozen=True, slots=True)
class Arguments:
    """Start two nodes, measure on them, let them come and go under a training."""

    quick: bool = False
    """A small training that does not go to its end, and one round measured."""

    level: str = "bridge"
    """That is trained."""

    rounds: int = 3
    """In which each number of runners is measured."""

    runs: Path = Path("runs")
    """Directory of the runs."""

    out: Path = Path("runs")
    """Directory of cluster.csv, the results."""


SMALL = ("num_envs=64", "ppo.epochs=2", "checkpoint_interval_s=2")


GIGABIT = 1.25e8
"""Bytes a second of the network of the machines that are reckoned with."""


def measured(arguments: Arguments, settings: tuple[str, ...]) -> list[cluster.Costs]:
    """Return what updates cost with one runner, with two, and with two and larger batches."""
    asked = (
        ("cluster.runners=1",),
        ("cluster.runners=2",),
        ("cluster.runners=2", "ppo.batch_size=2048"),
    )
    # They take turns, since a machine that others use is not the same for all.
    rounds: list[list[cluster.Costs]] = [[] for _ in asked]
    for _ in range(1 if arguments.quick else arguments.rounds):
        for costs, words in zip(rounds, asked, strict=True):
            config = load_config(recipe(), (f"level={arguments.level}", *settings, *words))
            costs.append(cluster.measure(config, updates=4))
            print(costs[-1], flush=True)
    return [cluster.middle(costs) for costs in rounds]


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    torch.set_num_threads(1)
    settings = SMALL if arguments.quick else ("checkpoint_interval_s=10",)
    rows: list[cluster.Row] = []
    with cluster.two_nodes() as nodes:
        with cluster.connected():
            one, two, large = measured(arguments, settings)
        model = cluster.Model.of(two, large)
        rows += [*cluster.measured(one), *cluster.measured(two), *model.parts()]
        for runners, learners, scale in ((7, 1, 1), (7, 1, 4), (63, 1, 1), (56, 8, 16)):
            rows.append(model.speed(runners, learners, scale, bytes_per_s=GIGABIT))
        # What is measured is kept, whatever becomes of the trial.
        arguments.out.mkdir(parents=True, exist_ok=True)
        cluster.write(rows, arguments.out / "cluster.csv")
        training = cluster.Training(arguments.runs, arguments.level, settings)
        try:
            rows += cluster.trial(nodes, training, to_the_end=not arguments.quick)
        finally:
            training.kill()
    cluster.write(rows, arguments.out / "cluster.csv")
    print(cluster.shown(rows))


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except cluster.TrialError as error:
        sys.exit(f"error: {error}")
