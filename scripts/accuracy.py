"""Measure every method on motions with a known answer: what it costs, and how wrong it is.

Examples::

    python scripts/accuracy.py
    python scripts/accuracy.py --quick
    python scripts/accuracy.py --scene complex-box drag --out runs/boxes
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import tyro
from tqdm import tqdm

from roller_env.lab import accuracy


@dataclass(frozen=True, slots=True)
class Arguments:
    """Measure every method's error and cost; charts and tables go into a directory."""

    quick: bool = False
    """A few scenes, short motions and large time steps: under a minute instead of ten."""

    scene: tuple[str, ...] = ()
    """Only these."""

    out: Path = Path("runs/accuracy")
    """Directory of the charts (PNG, SVG) and the tables (CSV, JSON, Markdown)."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    effort = accuracy.QUICK if arguments.quick else accuracy.FULL
    scenes = accuracy.scenes_named(arguments.scene, effort)
    results = accuracy.run(scenes, effort, partial(tqdm, dynamic_ncols=True))
    files = accuracy.write(results, arguments.out)
    print(accuracy.orders_section(results))
    print(accuracy.cheapest_section(results))
    print(f"{len(files)} files in {arguments.out}; start with {files[-1]}")


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except ValueError as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        sys.exit("\nstopped; nothing was written")
