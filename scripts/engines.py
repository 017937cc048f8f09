"""Measure both engines side by side: what each preset gets right, where, and at what cost.

Examples::

    python scripts/engines.py
    python scripts/engines.py --quick
    python scripts/engines.py --docs docs
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import tyro

from roller_env.lab.engines import report
from roller_env.lab.runner import provenance, watched


@dataclass(frozen=True, slots=True)
class Arguments:
    """Measure both engines against closed forms, DOP853 and each other."""

    quick: bool = False
    """Fewer balls and steps, and a coarser MuJoCo: under a minute instead of ten."""

    out: Path = Path("runs/engines")
    """Directory of the tables and the picture."""

    docs: Path | None = None
    """Documentation whose engines.md and picture are brought up to date; full runs only."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    if arguments.docs and arguments.quick:
        raise ValueError("--docs: publishes full runs; leave out --quick")
    effort = report.QUICK if arguments.quick else report.FULL
    measured = report.measure(effort, partial(watched, unit="part"))
    files = report.write(measured, provenance(), arguments.out)
    print(*report.summary(measured), sep="\n")
    print(f"{len(files)} files in {arguments.out}")
    if arguments.docs:
        print("brought up to date:", *report.publish(arguments.out, arguments.docs))


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except ValueError as error:
        sys.exit(f"engines.py: {error}")
