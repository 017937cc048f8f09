"""lint."""

from __future__ import annotations

from typing import NamedTuple

from roller_env.level.schema import Level
from roller_env.level.words import Unit
from roller_env.problems import Problem


class Play(NamedTuple):
    """How a level is to be played."""

    dt_s: float
    push_n: float


def lint(level: Level, play: Play, unit: Unit = "metre") -> list[Problem]:
    """Lint."""
    return []
