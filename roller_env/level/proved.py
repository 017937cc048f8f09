"""Generated levels that are known to be winnable: a table that comes with Roller.

A seed's first level may be one that the solver does not win; then the next attempt for that seed is
taken. Which attempt that was is what the table holds, so that nobody has to search again.
`scripts/generated.py --prove` makes it.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Final

from roller_env.assets import asset_directory
from roller_env.checks import number, whole
from roller_env.level.generate import LATEST, VERSIONS, generate
from roller_env.level.schema import Level

Verdicts = dict[float, dict[int, int]]
"""By difficulty and seed, the number of the attempt that was won, from 0."""

MOST_LEVELS: Final = 100_000


def proved_levels(
    count: int, first_seed: int = 0, difficulty: float = 0.25, *, version: int = LATEST
) -> list[Level]:
    """Return generated levels, each of which the solver has won.

    Args:
        count: how many.
        first_seed: seed of the first; the others follow.
        difficulty: one of those in the table.
        version: of the generator.

    Raises:
        ValueError: a seed is not in the table; the message says which are.
    """
    version = whole("version", version, min(VERSIONS), LATEST)
    whole("num_levels", count, 1, MOST_LEVELS)
    whole("start_level", first_seed, 0, 2**63 - 1)
    number("difficulty", difficulty, 0.0, 1.0, "a number from 0 to 1")
    table = verdicts(version)
    known = table.get(float(difficulty), {})
    seeds = range(first_seed, first_seed + count)
    missing = [seed for seed in seeds if seed not in known]
    if missing:
        there = "; ".join(
            f"difficulty {each:g}: {_ranges(sorted(attempts))}" for each, attempts in table.items()
        )
        raise ValueError(
            f"start_level, num_levels, difficulty: found seed {missing[0]} at difficulty "
            f"{difficulty:g}, which nobody has proved winnable; of version {version} there are "
            f"{there} (roller_env.solver.won_level proves others)"
        )
    return [generate(seed, difficulty, known[seed], version=version) for seed in seeds]


@cache
def verdicts(version: int = LATEST) -> Verdicts:
    """Return the table of a version of the generator."""
    return read_verdicts(verdicts_file(version))


def verdicts_file(version: int = LATEST) -> Path:
    """Return the file of that table."""
    return asset_directory("generated") / f"proved-v{version}.csv"


def read_verdicts(file: Path) -> Verdicts:
    """Return the table of a file."""
    table: Verdicts = {}
    with file.open(encoding="utf-8", newline="") as text:
        for row in csv.DictReader(text):
            known = table.setdefault(float(row["difficulty"]), {})
            first = int(row["first_seed"])
            known |= {first + n: int(digit, 36) for n, digit in enumerate(row["attempts"])}
    return table


def write_verdicts(table: Verdicts, file: Path) -> None:
    """Write a table: a row for each run of seeds, a digit (of base 36) for each seed."""
    with file.open("w", encoding="utf-8", newline="") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["difficulty", "first_seed", "attempts"])
        for difficulty, known in sorted(table.items()):
            for first, last in _runs(sorted(known)):
                digits = "".join(_digit(known[seed]) for seed in range(first, last + 1))
                writer.writerow([f"{difficulty:g}", first, digits])


def _digit(attempt: int) -> str:
    return "0123456789abcdefghijklmnopqrstuvwxyz"[attempt]


def _runs(seeds: Sequence[int]) -> list[tuple[int, int]]:
    """Return the first and last of each run of numbers that follow each other."""
    runs: list[tuple[int, int]] = []
    for seed in seeds:
        if runs and seed == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], seed)
        else:
            runs.append((seed, seed))
    return runs


def _ranges(seeds: Sequence[int]) -> str:
    return ", ".join(f"{first} to {last}" for first, last in _runs(seeds))
