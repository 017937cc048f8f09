"""Chart physics settings by their error and their cost: where the presets come from.

Examples::

    python scripts/presets.py
    python scripts/presets.py --quick
    python scripts/presets.py --only fast default accurate "RK4 1/480"
    python scripts/presets.py --docs docs
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import tyro

from roller_env.lab.presets import report
from roller_env.lab.presets.costs import ablations
from roller_env.lab.presets.report import FULL, QUICK
from roller_env.lab.presets.settings import SETTINGS
from roller_env.lab.runner import known, provenance, watched


@dataclass(frozen=True, slots=True)
class Arguments:
    """Measure physics settings: errors on the game's own scenes, and CPU time."""

    quick: bool = False
    """Few settings, a coarser converged model, costs that mean little: under 40 s."""

    only: tuple[str, ...] = ()
    """Names of settings; all of the catalogue, if none."""

    out: Path = Path("runs/presets")
    """Directory of the tables and pictures."""

    docs: Path | None = None
    """Documentation whose presets.md and pictures are brought up to date; full runs only."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    if arguments.docs and (arguments.quick or arguments.only):
        raise ValueError("--docs: publishes all settings; leave out --quick and --only")
    effort = QUICK if arguments.quick else FULL
    if arguments.only:
        effort = replace(effort, settings=_checked(arguments.only))
    rows = report.measure(effort, partial(watched, unit="setting"))
    modelled = ablations(effort.rounds, effort.boxes, effort.games)
    files = report.write(rows, modelled, provenance(), arguments.out)
    print(*report.summary(rows, modelled), sep="\n")
    print(f"{len(files)} files in {arguments.out}")
    if arguments.docs:
        print("brought up to date:", *report.publish(arguments.out, arguments.docs))


def _checked(names: Sequence[str]) -> tuple[str, ...]:
    for name in names:
        known("setting", name, list(SETTINGS))
    return tuple(dict.fromkeys(names))


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except ValueError as error:
        sys.exit(f"presets.py: {error}")
