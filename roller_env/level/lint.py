"""lint."""

from __future__ import annotations

from roller_env.level.check import Unit
from roller_env.level.schema import Level
from roller_env.problems import Problem


def lint(level: Level, dt_s: float, unit: Unit = "metre") -> list[Problem]:
    return []
