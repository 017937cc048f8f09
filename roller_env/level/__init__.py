"""What a level is: the models, the loader of level files and the checker. Pure data, no physics."""

from __future__ import annotations

from roller_env.level.check import check_level
from roller_env.level.doubts import level_warnings
from roller_env.level.errors import LevelError, LevelWarning
from roller_env.level.json_schema import level_json_schema
from roller_env.level.load import (
    examine_level,
    files_of,
    is_path,
    levels_directory,
    load_level,
    parse_level,
    shipped_levels,
)
from roller_env.level.schema import Level
from roller_env.problems import Problem

__all__ = [
    "Level",
    "LevelError",
    "LevelWarning",
    "Problem",
    "check_level",
    "examine_level",
    "files_of",
    "is_path",
    "level_json_schema",
    "level_warnings",
    "levels_directory",
    "load_level",
    "parse_level",
    "shipped_levels",
]
