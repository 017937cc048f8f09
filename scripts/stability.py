"""Predict where methods of simulation break, find where they do, and show it.

Examples::

    python scripts/stability.py
    python scripts/stability.py --quick
    python scripts/stability.py --only servo tunnelling --out runs/some
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro
from tqdm import tqdm

from roller_env.lab.runner import provenance
from roller_env.lab.stability import run
from roller_env.lab.stability.limits import FULL, QUICK


@dataclass(frozen=True, slots=True)
class Arguments:
    """Find the limits of stability, draw each way to fail, and try the game's own hard cases."""

    quick: bool = False
    """Coarser and with fewer starts: under a minute."""

    only: tuple[str, ...] = ()
    """Names: limits, failures, hard_cases, a group of limits such as servo, or single cases."""

    out: Path = Path("runs/stability")
    """Directory of the tables and pictures."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    effort = QUICK if arguments.quick else FULL
    try:
        selection = run.select(arguments.only, effort)
    except ValueError as error:
        sys.exit(f"error: {error}")
    results = run.run(selection, effort, _progress)
    written = run.write(results, provenance(), arguments.out)
    for section, table in results.tables.items():
        print(run.page(section, table))
    print(*run.summary(results), sep="\n")
    print(f"{len(written)} files in {arguments.out}")


def _progress(names: Sequence[str]) -> Iterable[str]:
    with tqdm(names, unit="case", dynamic_ncols=True) as bar:
        for name in bar:
            bar.set_postfix_str(name)
            yield name


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
