"""Generate levels by the dozen: how hard they are to win, and how varied.

Examples::

    python scripts/generated.py
    python scripts/generated.py --seeds 100
    python scripts/generated.py --quick --out runs/generated.csv
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro
from tqdm import tqdm

from roller_env.lab import generated


@dataclass(frozen=True, slots=True)
class Arguments:
    """Generate levels, have the solver win them, and say how they differ."""

    seeds: int = 20
    """Of each of five difficulties."""

    out: Path = Path("docs/results/generated.csv")
    """Rows that are there already are not made again."""

    show: bool = False
    """Only print the table of the rows there are."""

    quick: bool = False
    """One seed of two difficulties."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    if not arguments.show:
        seeds = 1 if arguments.quick else arguments.seeds
        difficulties = (0.0, 0.25) if arguments.quick else generated.DIFFICULTIES
        generated.run(arguments.out, seeds, difficulties, _progress)
    print(generated.table(arguments.out))


def _progress(levels: list[Any]) -> Iterable[Any]:
    return tqdm(levels, unit="level", dynamic_ncols=True)


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"generated.py: {error}")
