"""Baselines: the recipe on every level that comes with Roller, judged by the protocol.

Their rows are trainings' (`roller_env.lab.trainings`). The five oldest levels have theirs in
``seeds.csv`` already, and only one training each is made again, for a policy to ship.
"""

from __future__ import annotations

import json
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from roller_env.assets import LEVELS
from roller_env.lab import trainings
from roller_env.lab.table import Frame
from roller_env.lab.trainings import RECIPE, Experiment, Trial
from roller_env.training.files import RunFiles

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

    One that is there already stays unless another is better.

    Args:
        rows: trainings, with ``is_cut``; those that were cut off are not shipped.
        policies: tar file with ``LEVEL-SEED/policy.json`` and ``.safetensors``.
        out: directory of a directory a level.
    """
    with tarfile.open(policies) as archive:
        kept = set(archive.getnames())
        for level in LEVELS:
            files = RunFiles(out / level)
            shipped = _seed_of(files.policy)
            own = [
                row
                for row in rows[(rows.level == level) & ~rows.is_cut].itertuples(index=False)
                if row.seed == shipped or f"{level}-{row.seed}/{files.policy.name}" in kept
            ]
            best = max(own, key=lambda row: (row.finish * row.coins, row.coins, -row.seed))
            if best.seed != shipped:
                files.directory.mkdir(parents=True, exist_ok=True)
                for file in (files.policy, files.weights):
                    content = archive.extractfile(f"{level}-{best.seed}/{file.name}")
                    assert content is not None
                    file.write_bytes(content.read())
            shares = f"{best.finish:.0%} at the finish, {best.coins:.1%} coins"
            yield f"{level}: seed {best.seed}, {shares}"


def _seed_of(policy: Path) -> int | None:
    """Return the seed of an agent's training, if there is an agent."""
    if not policy.exists():
        return None
    return int(json.loads(policy.read_text(encoding="utf-8"))["training"]["seed"])
