"""Train on 1, 10, 100 and 500 generated levels, and judge on levels that were never seen.

Examples::

    python scripts/generalise.py
    python scripts/generalise.py --seeds 3
    python scripts/generalise.py --quick --out runs/generalise.csv
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import tyro
from tqdm import tqdm

from roller_env.lab import chart, generalisation
from roller_env.lab.runner import provenance


@dataclass(frozen=True, slots=True)
class Arguments:
    """Show how success on unseen levels grows with the number of levels learnt on."""

    seeds: int = 1
    """Trainings for each number of levels."""

    steps: int = 2_000_000
    """Environment steps of each."""

    out: Path = Path("docs/results/generalise.csv")
    """Rows that are there already are not made again; the chart lies beside it."""

    quick: bool = False
    """Two numbers of levels and some thousand steps, which show nothing."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    steps = arguments.steps
    numbers: tuple[int, ...] = generalisation.NUMBERS
    if arguments.quick:
        steps, numbers = 8192, numbers[:2]
    watched = partial(tqdm, unit="training", dynamic_ncols=True)
    generalisation.run(arguments.out, arguments.seeds, steps, numbers, watched)
    facts = provenance()
    chart.save(generalisation.draw(arguments.out), facts, arguments.out.with_suffix(""))
    print(arguments.out.read_text(encoding="utf-8"))


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (OSError, ValueError) as error:
        sys.exit(f"generalise.py: {error}")
