"""Baselines: the recipe on every level that comes with Roller, judged by the protocol.

Their rows are trainings' (`roller_env.lab.trainings`). The five oldest levels have theirs in
``seeds.csv`` already, and only one training each is made again, for a policy to ship.
"""

from __future__ import annotations

import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from roller_env.assets import LEVELS
from roller_env.lab import trainings
from roller_env.lab.table import Frame
from roller_env.lab.trainings import RECIPE, Experiment, Trial

SEEDS: Final = range(50, 55)
"""Nobody tuned on them."""

TOTAL_STEPS: Final = 4_000_000
"""The most that a training may take, which the recipe alone does not say."""

_OLD: Final = trainings.LEVELS
_IN_ORDER: Final = (*(level for level in LEVELS if level not in _OLD), *_OLD)

EXPERIMENT: Final = Experiment(
    # Every level has its first training before one has its second.
    tuple(
        Trial(RECIPE, level, seed)
        for seed in SEEDS
        for level in _IN_ORDER
        if level not in _OLD or seed == SEEDS[0]
    ),
    # One thread each, so that CPU time is that of one core wherever they are made.
    (f"total_steps={TOTAL_STEPS}", "environment.num_threads=1"),
    on_record=True,
)


def compile_once(recipe: Path, stem: Path) -> None:
    """Train for a second in a process of its own, so that Numba keeps what others then load.

    Args:
        recipe: configuration of what follows.
        stem: of files that are made and not kept.
    """
    first = Experiment(
        trainings.QUICK.trials[:1], (*trainings.QUICK.changes, *EXPERIMENT.changes[1:])
    )
    trainings.run(first, recipe, stem, jobs=1)


def ship(rows: Frame, policies: Path, out: Path) -> Iterator[str]:
    """Write the best agent of each level, and say which: by finished games times coins.

    Args:
        rows: trainings, with ``is_cut``; those that were cut off are not shipped.
        policies: tar file with ``LEVEL-SEED/policy.json`` and ``.safetensors``.
        out: directory of a directory a level.
    """
    with tarfile.open(policies) as archive:
        kept = {Path(name).parent.name for name in archive.getnames()}
        for level in LEVELS:
            row = max(
                (row for row in _rows_of(rows, level) if f"{level}-{row.seed}" in kept),
                key=lambda row: (row.finish * row.coins, row.coins, -row.seed),
            )
            directory = out / level
            directory.mkdir(parents=True, exist_ok=True)
            for part in ("policy.json", "policy.safetensors"):
                content = archive.extractfile(f"{level}-{row.seed}/{part}")
                assert content is not None
                (directory / part).write_bytes(content.read())
            yield f"{level}: seed {row.seed}, {row.finish:.0%} at the finish, {row.coins:.1%} coins"


def _rows_of(rows: Frame, level: str) -> Iterator[Any]:
    yield from rows[(rows.level == level) & ~rows.is_cut].itertuples(index=False)
