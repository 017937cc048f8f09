"""Baselines: the recipe on every level that comes with Roller, judged by the protocol.

Their rows are trainings' (`roller_env.lab.trainings`). The five oldest levels have theirs in
``seeds.csv`` already, and only one training each is made again, for a policy to ship.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from roller_env.assets import LEVELS
from roller_env.lab import trainings
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
