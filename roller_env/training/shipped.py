"""The agents that come with Roller: one of each shipped level, trained by the recipe.

How each was trained and how well it plays is in docs/baselines.md; not all of them finish.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from roller_env.assets import LEVELS, SHIPPED, asset_directory
from roller_env.config import LevelSource
from roller_env.level import Level
from roller_env.problems import listed, quoted
from roller_env.training.files import RunError

DEFAULT_LEVEL: Final = "classic"


def run_of(run: Path, level: LevelSource | None) -> Path:
    """Return a run's directory: itself, or that of the agent of a level.

    Args:
        run: directory, or `roller_env.assets.SHIPPED`.
        level: that is to be played; None for `DEFAULT_LEVEL`.

    Raises:
        RunError: no agent of that level comes with Roller.
    """
    if run != SHIPPED:
        return run
    level = level or DEFAULT_LEVEL
    if level not in LEVELS:
        found = quoted(level.name if isinstance(level, Level) else str(level))
        raise RunError(f"shipped: no agent of {found} comes with Roller; of {listed(LEVELS)} do")
    return asset_directory("policies") / str(level)
