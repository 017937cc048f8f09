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
    """A small training that does not go to its end, and few updates measured."""

    level: str = "bridge"
    """That is trained."""

    updates: int = 10
    """Measured with one runner, and with two."""

    runs: Path = Path("runs")
    """Directory of the runs."""

    out: Path = Path("runs")
    """Directory of cluster.csv, the results."""


SMALL = ("num_envs=64", "ppo.epochs=2", "checkpoint_interval_s=2")


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    torch.set_num_threads(1)
    settings = SMALL if arguments.quick else ("checkpoint_interval_s=10",)
    rows: list[cluster.Row] = []
    with cluster.two_nodes() as nodes:
        with cluster.connected():
            costs = []
            for runners in (1, 2):
                asked = (f"level={arguments.level}", *settings, f"cluster.runners={runners}")
                config = load_config(recipe(), asked)
                updates = 2 if arguments.quick else arguments.updates
                costs.append(cluster.measure(config, updates))
                rows += cluster.measured(costs[-1])
        for cores, learners in ((8, 1), (8, 4), (64, 1), (64, 24)):
            rows.append(cluster.reckoned(costs[-1], cores, learners, bytes_per_s=1.25e8))
        training = cluster.Training(arguments.runs, arguments.level, settings)
        try:
            rows += cluster.trial(nodes, training, to_the_end=not arguments.quick)
        finally:
            training.kill()
    arguments.out.mkdir(parents=True, exist_ok=True)
    cluster.write(rows, arguments.out / "cluster.csv")
    print(cluster.shown(rows))


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except cluster.TrialError as error:
        sys.exit(f"error: {error}")
