"""YAML, or plain data -> `Level`. A level that comes out of here is right in shape and in meaning.

A file is judged in three stages: what YAML says (`yaml_tree`), whether every field is what its
model allows (`schema`), what the level as a whole must mean (`check`). All problems of a stage are
reported together; a later stage needs the earlier one to have found none, because a gate that could
not be read would make every plate that names it look wrong.
"""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from roller_env.assets import LEVELS, asset_directory
from roller_env.level.check import check_level
from roller_env.level.doubts import level_warnings
from roller_env.level.errors import LevelError, LevelWarning
from roller_env.level.include import SUFFIXES, with_included
from roller_env.level.lint import lint
from roller_env.level.messages import explain
from roller_env.level.prefab import LevelFile, expanded
from roller_env.level.reach import Play
from roller_env.level.schema import Level
from roller_env.level.source import File, Source
from roller_env.level.text import decoded
from roller_env.pieces.fields import METRES_PER_UNIT, SCALE_KEY
from roller_env.pieces.words import Unit
from roller_env.problems import Problem, listed, quoted
from roller_env.regular_files import read_regular_file
from roller_env.yaml_tree import MAX_BYTES, Node, YamlError, plain_tree, read_tree, uncollected


def load_level(source: str | os.PathLike[str] | Level | Mapping[str, Any]) -> Level:
    """Load and check a level; what is strange about it is a `LevelWarning`.

    Args:
        source: the name of a shipped level ("classic"), the path of a .yaml file, the fields of a
            level file as a mapping, such as ``level.model_dump(mode="json")``, or a `Level`, which
            is checked and returned as it is. A string is a path if it ends in .yaml or .yml or
            holds a directory separator.

    Returns:
        The level, lengths in metres.

    Raises:
        LevelError: there is no such level, or it has problems; all of them are in ``problems``.
        TypeError: ``source`` is none of these.
    """
    if isinstance(source, Level):
        _refuse(check_level(source))
        _warn(level_warnings(source), stacklevel=3)
        return source
    if isinstance(source, Mapping):
        root = _tree(lambda: plain_tree(source))
        level, doubts = _examined(_source(with_included(File("", "", root), None)))
        _warn(doubts, stacklevel=3)
        return level
    level, doubts = _examined(_source(_files(_path_of(source))))
    _warn(doubts, stacklevel=3)
    return level


def examine_level(source: str | os.PathLike[str], play: Play) -> tuple[Level, tuple[Problem, ...]]:
    """Load and check a level, and look long for what a designer hardly meant.

    Args:
        source: the name of a shipped level, or a path, as for `load_level`.
        play: how it is to be played.

    Returns:
        The level, and the warnings in the order of the file: those that `load_level` shows, and
        those of `roller_env.level.lint`.

    Raises:
        LevelError: it cannot be played.
    """
    read = _source(_files(_path_of(source)))
    level, doubts = _examined(read)
    return level, tuple(_in_file_order((*doubts, *_told(lint(level, play, _unit(read)), read))))


def files_of(path: Path) -> tuple[Path, ...]:
    """Return a level's file, and those that it includes, if all of them can be read."""
    try:
        _, *included = _files(path)
    except LevelError:
        return (path,)
    return (path, *(Path(file.name) for file in included))


def is_path(source: str) -> bool:
    """Say whether `load_level` takes a text for a path, not for the name of a shipped level."""
    separators = [mark for mark in (os.sep, os.altsep) if mark]
    return source.endswith(SUFFIXES) or any(mark in source for mark in separators)


def parse_level(text: str, filename: str = "<text>") -> Level:
    """Load and check a level from the text of a level file, as `load_level` does a file.

    Args:
        text: YAML; the format is described in docs/levels.md.
        filename: what error messages call it.

    Returns:
        The level, lengths in metres.

    Raises:
        LevelError: the level has problems; all of them are in ``problems``.
    """
    root = _tree(lambda: read_tree(text, filename))
    level, doubts = _examined(_source(with_included(File(filename, text, root), None)))
    _warn(doubts, stacklevel=3)
    return level


@uncollected()
def _files(path: Path) -> list[File]:
    filename, text = str(path), decoded(_read(path), str(path))
    return with_included(File(filename, text, _tree(lambda: read_tree(text, filename))), path)


@uncollected()
def _source(files: Sequence[File]) -> Source:
    """Return what a file says together with those that it includes, all copies made."""
    return expanded(files, _unit_of(files[0].root))


def _tree(read: Callable[[], Node]) -> Node:
    """Return what ``read`` reads; what is wrong with its YAML is wrong with a level."""
    try:
        return read()
    except YamlError as error:
        raise LevelError(error.problems) from None


@uncollected()
def _examined(source: Source) -> tuple[Level, list[Problem]]:
    """Return the level that was read, if it is right in shape and in meaning, and its doubts."""
    unit = _unit(source)
    try:
        level = Level.model_validate(source.fields, context={SCALE_KEY: METRES_PER_UNIT[unit]})
    except ValidationError as error:
        raise LevelError(_in_file_order(explain(error, source, LevelFile))) from None
    _refuse(_told(check_level(level, unit), source))
    return level, _told(level_warnings(level, unit), source)


def shipped_levels() -> tuple[str, ...]:
    """Return the names of the levels that come with the package, the easy ones first."""
    return LEVELS


def levels_directory() -> Path:
    """Return the directory of the shipped levels.

    Raises:
        FileNotFoundError: the installation has lost it.
    """
    return asset_directory("levels")


def _path_of(source: str | os.PathLike[str]) -> Path:
    is_name = isinstance(source, str) and not is_path(source)
    return _shipped_path(str(source)) if is_name else Path(source)


def _shipped_path(name: str) -> Path:
    known = shipped_levels()
    if name not in known:
        shipped = listed(known) or "no levels"
        message = f"no level is called {quoted(name)}; there are {shipped}, and paths end in .yaml"
        raise LevelError([Problem((), message, written=name, known=known)])
    return levels_directory() / f"{name}.yaml"


def _read(path: Path) -> bytes:
    try:
        return read_regular_file(path, MAX_BYTES)
    except FileNotFoundError:
        levels = [other.name for suffix in SUFFIXES for other in path.parent.glob(f"*{suffix}")]
        problem = Problem((), "there is no such file", written=path.name, known=tuple(levels))
    except OSError as error:
        problem = Problem((), f"it cannot be read: {error.strerror}")
    raise LevelError([replace(problem, filename=str(path))])


def _unit(source: Source) -> Unit:
    return _unit_of(source.own.node)


def _unit_of(root: Node) -> Unit:
    """Return the unit that the file names; metres if it names none, or none there is."""
    node = root.find(("units",))
    return "quant" if node is not None and node.value == "quant" else "metre"


def _told(problems: Iterable[Problem], source: Source) -> list[Problem]:
    """Return problems of a level with their places; of those of many copies one."""
    return list(dict.fromkeys(map(source.told, problems)))


def _in_file_order(problems: Iterable[Problem]) -> list[Problem]:
    return sorted(problems, key=lambda problem: (problem.line or math.inf, problem.column or 0))


def _refuse(problems: Iterable[Problem]) -> None:
    found = _in_file_order(problems)
    if found:
        raise LevelError(found)


def _warn(problems: Iterable[Problem], stacklevel: int) -> None:
    """Show all problems in one warning, at the caller that many calls up."""
    found = tuple(_in_file_order(problems))
    if found:
        warnings.warn(LevelWarning(found), stacklevel=stacklevel)
