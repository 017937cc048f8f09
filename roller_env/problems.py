"""What is said when a file is wrong: one `Problem` a fault, all of them in one `ProblemsError`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from roller_env import names

FieldPath = tuple[str | int, ...]
"""Where in a file something stands, as pydantic writes it: ``("coins", 3, "line", "count")``."""

MAX_PROBLEMS: Final = 1_000
"""Faults that are looked for; a file of the wrong kind altogether could have a million."""

MAX_PROBLEMS_PRINTED: Final = 50
"""The others are in `ProblemsError.problems`."""

_PLAIN_KEY: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,63}")
_LONG_TEXT: Final = 64
_LONG_LIST: Final = 20


@dataclass(frozen=True, slots=True)
class Problem:
    """One fault.

    Attributes:
        path: the field at fault; empty for the whole file.
        message: what was found; what is allowed.
        filename: the file, or None for what was built in Python.
        line: line in the file, from 1; None where there is none.
        column: column in the file, from 1; None where there is none.
        written: the name that was written, when names are what is at fault.
        known: the names that could have been meant.
        note: of several things that are written in that place, which; problems that differ in
            nothing else are equal.
    """

    path: FieldPath
    message: str
    filename: str | None = None
    line: int | None = None
    column: int | None = None
    written: str = ""
    known: tuple[str, ...] = ()
    note: str = field(default="", compare=False)

    @property
    def field(self) -> str:
        """The path as people write it, such as ``coins[3].line.count``."""
        return field_name(self.path)

    @property
    def nearest(self) -> str | None:
        """The known name that is nearest to the written one, if any is near."""
        return names.nearest(self.written, self.known)

    @property
    def where(self) -> str:
        """The place as editors read it, ``file:line:column``, as far as there is one."""
        filename = None if self.filename is None else shown(self.filename)
        place = [filename, self.line, self.column]
        return ":".join(str(part) for part in place if part is not None)

    @property
    def what(self) -> str:
        """Everything but the place."""
        said = ": ".join(part for part in (self.field, self.message) if part)
        if self.nearest is not None:
            said += f" (did you mean '{self.nearest}'?)"
        return f"{said} ({self.note})" if self.note else said

    def __str__(self) -> str:
        return ": ".join(part for part in (self.where, self.what) if part)


class ProblemsError(ValueError):
    """A file, or what stands for one, that cannot be used.

    Attributes:
        problems: everything that is wrong with it, in the order of the file.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        return printed(self.problems)


def printed(problems: Sequence[Problem]) -> str:
    """Return the problems, one a line; of more than `MAX_PROBLEMS_PRINTED` the first."""
    lines = [str(problem) for problem in problems[:MAX_PROBLEMS_PRINTED]]
    more = len(problems) - len(lines)
    return "\n".join([*lines, f"... and {more} more problems"] if more else lines)


def field_name(path: FieldPath) -> str:
    """Return ``coins[3].line.count`` for ``("coins", 3, "line", "count")``."""
    name = ""
    for part in path:
        if isinstance(part, int):
            name += f"[{part}]"
        elif _PLAIN_KEY.fullmatch(part):
            name += f".{part}" if name else part
        else:
            name += f"[{quoted(part)}]"
    return name


def quoted(text: str) -> str:
    """Return the text in quotes on one line, shortened when it is long."""
    return repr(text if len(text) <= _LONG_TEXT else text[: _LONG_TEXT - 3] + "...")


def shown(name: object) -> str:
    """Return a name as it is if all of it can be printed, else in quotes with the rest escaped.

    A file's name may hold what a terminal takes for commands.
    """
    text = str(name)
    return text if text.isprintable() else repr(text)


def printable(text: object) -> str:
    """Return lines with every character that cannot be printed escaped, for a terminal."""
    return "".join(
        character if character.isprintable() or character == "\n" else repr(character)[1:-1]
        for character in str(text)
    )


def listed(names: Sequence[str]) -> str:
    """Return the names in quotes, with commas between them; a long list is cut short."""
    first = ", ".join(quoted(name) for name in names[:_LONG_LIST])
    more = len(names) - _LONG_LIST
    return f"{first} and {more} more" if more > 0 else first
