"""Levels without end: the same seed and difficulty give the same level for ever, under a version.

Whether a level can be won is not asked here: `roller_env.solver.won_level` hands out those that
were. Version 1 joins decks of one size by planks, ramps, steps, gaps and gates. Version 2 has the
other pieces too, and loops, decoys and errands; see `version_2`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from roller_env import checks
from roller_env.level.generate import version_1, version_2
from roller_env.level.load import load_level
from roller_env.level.schema import Level

Fields = dict[str, Any]

VERSIONS: Final[dict[int, Callable[[float, np.random.Generator], Fields]]] = {
    1: version_1.fields,
    2: version_2.fields,
}
"""What makes a level's fields of a difficulty and a random generator, by version. A version never
changes: anything that would change a level is another one."""

LATEST: Final = max(VERSIONS)


def generate(
    seed: int, difficulty: float = 0.5, attempt: int = 0, *, version: int = LATEST
) -> Level:
    """Return a level.

    Args:
        seed: which one, a whole number from 0 on.
        difficulty: 0 to 1; see the version's knobs.
        attempt: another level for the same seed, where the first could not be won.
        version: of the generator, one of `VERSIONS`.

    Raises:
        ValueError: the seed is no whole number from 0 on, the difficulty none from 0 to 1, or there
            is no such version.
    """
    seed = checks.whole("seed", seed, 0, 2**63 - 1)
    difficulty = checks.number("difficulty", difficulty, 0.0, 1.0, "a number from 0 to 1")
    version = checks.whole("version", version, min(VERSIONS), LATEST)
    rng = np.random.default_rng([version, seed, round(1e6 * difficulty), attempt])
    name = f"generated-v{version}-{seed}-{round(1000 * difficulty)}"
    return load_level(
        Level.model_validate(
            {
                "name": name if attempt == 0 else f"{name}-{attempt}",
                "title": f"Level {seed}",
                "description": f"Made by the generator, difficulty {difficulty:g}.",
                **VERSIONS[version](difficulty, rng),
            }
        )
    )
