"""Measure every method on motions with a known answer: what it costs, and how wrong it is.

Examples::

    python scripts/accuracy.py
    python scripts/accuracy.py --quick
    python scripts/accuracy.py --scene complex-box drag --out runs/boxes
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro
from tqdm import tqdm

from roller_env.lab.accuracy import (
    FULL,
    QUICK,
    cheapest_section,
    orders_section,
    pieces,
    run,
    scenes_named,
    write,
)


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
    effort = QUICK if arguments.quick else FULL
    scenes = scenes_named(arguments.scene, effort)
    with tqdm(total=pieces(scenes, effort), unit="piece", dynamic_ncols=True) as bar:

        def progress(done: str) -> None:
            bar.set_postfix_str(done, refresh=False)
            bar.update()

        results = run(scenes, effort, progress)
    files = write(results, arguments.out)
    print(orders_section(results))
    print(cheapest_section(results))
    print(f"{len(files)} files in {arguments.out}; start with {files[-1]}")


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except ValueError as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        sys.exit("\nstopped; nothing was written")
