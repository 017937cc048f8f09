"""A level as it was read: plain data, and where each part of it was written.

What placings and included files bring stands among the level's other pieces, as if it had been
written there; only this module still knows better, so that problems are told where their cause is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from roller_env.problems import FieldPath, Problem, field_name
from roller_env.yaml_tree import Node

_PIECE: Final = re.compile(r"\b([a-z_]+)\[([0-9]+)\]")
"""A piece as messages name it."""


@dataclass(frozen=True, slots=True)
class File:
    """A file that was read.

    Attributes:
        name: what errors call it.
        text: what is in it; empty for plain data.
        root: its tree.
    """

    name: str
    text: str
    root: Node


@dataclass(frozen=True, slots=True)
class Origin:
    """Where something was written.

    Attributes:
        file: in which file.
        path: its path there.
        node: it as it was written, parameters filled in.
        note: which copy of that it is; empty for what is none.
    """

    file: File
    path: FieldPath
    node: Node
    note: str = ""

    def told(self, problem: Problem, rest: FieldPath = (), of_key: bool = False) -> Problem:
        """Return a problem of it, or of its field ``rest``, with its place in the file."""
        line, column = self.node.position(rest, of_key=of_key)
        told = replace(problem, path=(*self.path, *rest), note=self.note)
        if line == 0:  # plain data, not a text
            return told
        return replace(told, filename=self.file.name, line=line, column=column)


@dataclass(frozen=True, slots=True)
class Source:
    """A level as it was read.

    Attributes:
        own: what its own file says; of a part of a level, that part.
        fields: all fields of the level.
        origins: of what ``own`` does not hold at the same path, by path.
    """

    own: Origin
    fields: dict[str, Any]
    origins: Mapping[FieldPath, Origin]

    def origin(self, path: FieldPath) -> tuple[Origin, FieldPath]:
        """Return where what holds the field at ``path`` was written, and its path in that."""
        found = self.origins.get(path[:2])
        return (found, path[2:]) if found else (self.own, path)

    def find(self, path: FieldPath) -> Node | None:
        """Return the value at ``path`` as it was written, or None if no file says it."""
        origin, rest = self.origin(path)
        return origin.node.find(rest)

    def told(self, problem: Problem, of_key: bool = False) -> Problem:
        """Return a problem of the level with its place in the file that has its cause."""
        origin, rest = self.origin(problem.path)
        message = _PIECE.sub(self._as_written, problem.message) if self.origins else problem.message
        return origin.told(replace(problem, message=message), rest, of_key)

    def _as_written(self, found: re.Match[str]) -> str:
        origin = self.origins.get((found[1], int(found[2])))
        if origin is None:
            return found[0]
        return " ".join(part for part in (field_name(origin.path), origin.note) if part)
