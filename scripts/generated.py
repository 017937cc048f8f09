"""Generate levels by the dozen: how hard they are to win, and how varied.

Examples::

    python scripts/generated.py
    python scripts/generated.py --seeds 100
    python scripts/generated.py --prove 500 --difficulty 0.25
    python scripts/generated.py --compile 10000
    python scripts/generated.py --sheet docs/images/generated-v2.png
    python scripts/generated.py --quick --out runs/generated.csv
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro
from PIL import Image
from tqdm import tqdm

from roller_env.compile.compiled import compile_level
from roller_env.drawing.overview import render_overview
from roller_env.lab import generated
from roller_env.level.generate import LATEST, generate
from roller_env.level.proved import read_verdicts, verdicts_file, write_verdicts
from roller_env.simulation import Simulation
from roller_env.solver import won_level
from roller_env.solver.search import solver_config

SHEET_TILE = (220, 150)
"""Width and height of a level's picture on the sheet, pixels."""


@dataclass(frozen=True, slots=True)
class Arguments:
    """Generate levels, have the solver win them, and say how they differ."""

    seeds: int = 20
    """Of each of five difficulties."""

    out: Path = Path("docs/results/generated-v2.csv")
    """Rows that are there already are not made again."""

    show: bool = False
    """Only print the table of the rows there are."""

    prove: int | None = None
    """Prove so many levels of one difficulty instead, and add them to the table that is shipped."""

    difficulty: float = 0.25
    """Of what is proved."""

    first_seed: int = 0
    """Of what is proved."""

    version: int = LATEST
    """Of the generator."""

    compile: int | None = None
    """Compile so many levels, of 21 difficulties in turn, for both engines instead."""

    sheet: Path | None = None
    """Draw 64 levels, eight of each of eight difficulties, into this picture instead."""

    quick: bool = False
    """One seed of two difficulties."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    if arguments.prove is not None:
        prove(arguments.difficulty, arguments.first_seed, arguments.prove, arguments.version)
        return
    if arguments.sheet is not None:
        sheet(arguments.sheet, arguments.version)
        return
    if arguments.compile is not None:
        compile_levels(arguments.compile, arguments.version)
        return
    if not arguments.show:
        seeds = 1 if arguments.quick else arguments.seeds
        difficulties = (0.0, 0.25) if arguments.quick else generated.DIFFICULTIES
        generated.run(arguments.out, seeds, arguments.version, difficulties, _progress)
    print(generated.table(arguments.out))


def prove(difficulty: float, first_seed: int, count: int, version: int) -> None:
    """Add levels to the table of those that the solver has won; what is there already stays."""
    file = verdicts_file(version)
    table = read_verdicts(file) if file.exists() else {}
    known = table.setdefault(difficulty, {})
    seeds = [seed for seed in range(first_seed, first_seed + count) if seed not in known]
    for seed in _progress(seeds):
        known[seed] = won_level(seed, difficulty, version=version).attempts - 1
        write_verdicts(table, file)


def compile_levels(count: int, version: int) -> None:
    """Compile levels for both engines; a warning is an error."""
    begun = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for seed in _progress(list(range(count))):
            level = generate(seed, (seed % 21) / 20, version=version)
            compile_level(level)
            Simulation(solver_config(level)).reset()
    print(f"{count} levels compiled for both engines in {time.process_time() - begun:.0f} s of CPU")


def sheet(file: Path, version: int) -> None:
    """Draw the first eight seeds of eight difficulties, a row for each, the easiest above."""
    width, height = SHEET_TILE
    picture = Image.new("RGB", (8 * width, 8 * height))
    for number in _progress(list(range(64))):
        row, seed = divmod(number, 8)
        tile = render_overview(generate(seed, row / 7, version=version), width, height)
        picture.paste(Image.fromarray(tile), (seed * width, row * height))
    picture.quantize(256).save(file, optimize=True)


def _progress(levels: list[Any]) -> Iterable[Any]:
    return tqdm(levels, unit="level", dynamic_ncols=True)


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (OSError, RuntimeError, ValueError) as error:
        sys.exit(f"generated.py: {error}")
