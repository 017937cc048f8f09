"""Train other learners than PPO on two levels: SAC with forces, QR-DQN with directions.

QR-DQN comes from sb3-contrib, which Roller does not depend on: ``pip install sb3-contrib``.
Every finished training is a row, so that the command can be stopped and gone on with.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass
from pathlib import Path

import tyro
from tqdm import tqdm

from roller_env.lab import learners
from roller_env.training import load_config


@dataclass(frozen=True, slots=True)
class Arguments:
    """Add the rows that are missing, and print all."""

    learners: tuple[str, ...] = ("SAC", "QR-DQN")
    """Which."""

    levels: tuple[str, ...] = ("bridge", "flat")
    """On which."""

    seeds: int = 1
    """Trainings of each on each."""

    steps: int = 500_000
    """Environment steps of each."""

    out: Path = Path("docs/results/learners.csv")
    """The rows."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    recipe = load_config("configs/ppo.yaml")
    rows = []
    if arguments.out.exists():
        with arguments.out.open(encoding="utf-8", newline="") as text:
            rows = list(csv.DictReader(text))
    done = {(row["learner"], row["level"], int(row["seed"])) for row in rows}
    wanted = [
        (learner, level, seed)
        for seed in range(arguments.seeds)
        for level in arguments.levels
        for learner in arguments.learners
    ]
    for one in tqdm([one for one in wanted if one not in done], unit="training"):
        rows.append(learners.row(*one, arguments.steps, recipe))
        with arguments.out.open("w", encoding="utf-8", newline="") as text:
            writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    print(arguments.out.read_text(encoding="utf-8"))


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (ImportError, OSError, ValueError) as error:
        sys.exit(f"learners.py: {error}")
