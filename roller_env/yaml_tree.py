"""YAML text -> a tree of plain values that remember where they were written.

The one reader of all YAML here, be it a level or a training's configuration. libyaml, or PyYAML
where it was built without, only splits the text into events; everything else happens here, so that
nothing in a file can construct an object, that the work a file may ask for is bounded, and that
every later error can name a line and a column. Scalars are read by YAML 1.2's core rules, as
editors do: ``yes``, ``on``, ``12:30`` and ``2026-11-26`` are text, ``1e3`` is a number.
"""

from __future__ import annotations

import gc
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import yaml

from roller_env.problems import MAX_PROBLEMS, FieldPath, Problem, ProblemsError, quoted

MAX_BYTES: Final = 1024 * 1024
MAX_VALUES: Final = 250_000
"""Values (numbers, texts, lists, mappings and keys) once every alias stands for what it repeats:
enough for 20,000 boxes of a level written out one by one, and read in a second."""
MAX_DEPTH: Final = 32

_LOADER: Final = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml's parser, five times as fast as the one in Python; their marks are the same."""

Scalar = str | int | float | bool | None


_INTEGER: Final = re.compile(r"[-+]?[0-9]+")
_FLOAT: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL: Final[dict[str, Scalar]] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), float("inf")),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), float("-inf")),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}
_MOST_DIGITS: Final = 40
"""A longer whole number is a float: Python takes quadratic time for its digits."""

_UNPRINTABLE: Final = re.compile("[^\t\n\r -~\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_SURROGATE: Final = re.compile("[\ud800-\udfff]")
_COLON: Final = (
    "found ': ' where no field can start; put text that contains ': ' into quotes, and begin a "
    "list or a mapping on its own line"
)
_HALF: Final = "found an escape that stands for no character; write the character itself"
_HINTS: Final = {
    "mapping values are not allowed in this context": _COLON,
    "mapping values are not allowed here": _COLON,  # as the parser in Python says it
    "found invalid Unicode character escape code": _HALF,
}


@dataclass(slots=True)
class Node:
    """A value of the file. Not to be written to; frozen, it would take twice the time to make.

    Attributes:
        value: the scalar, or the list's items, or the mapping's values by their keys.
        line: line where it begins, from 1.
        column: column where it begins, from 1.
        text: a scalar as it is written, without quotes; None for lists and mappings.
        is_block: whether it is text in literal style (``|``), beginning on the next line.
        keys: line and column of each key of a mapping; None for what is none.
        values: how many values it stands for, itself included.
        height: levels of nesting, 1 for a scalar.
    """

    value: Scalar | list[Node] | dict[str, Node]
    line: int
    column: int
    text: str | None = None
    is_block: bool = False
    keys: dict[str, tuple[int, int]] | None = None
    values: int = 1
    height: int = 1

    def plain(self) -> object:
        """Return the value as plain Python data."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, list):
            return [node.plain() for node in self.value]
        return self.value

    def child(self, part: str | int) -> Node | None:
        """Return the item or field called ``part``, or None if there is none."""
        if isinstance(self.value, dict) and isinstance(part, str):
            return self.value.get(part)
        if isinstance(self.value, list) and isinstance(part, int) and part < len(self.value):
            return self.value[part]
        return None

    def find(self, path: FieldPath) -> Node | None:
        """Return the value at ``path``, or None if the file does not say it."""
        node: Node | None = self
        for part in path:
            node = node.child(part) if node is not None else None
        return node

    def position(self, path: FieldPath, *, of_key: bool = False) -> tuple[int, int]:
        """Return line and column of the value at ``path``, or of what it is missing from.

        Args:
            path: the field.
            of_key: point at the field's name instead of its value.
        """
        node = self
        for number, part in enumerate(path, start=1):
            if of_key and number == len(path) and node.keys and part in node.keys:
                return node.keys[str(part)]
            inner = node.child(part)
            if inner is None:
                break
            node = inner
        return node.line, node.column


class YamlError(ProblemsError):
    """A text that is not the YAML wanted here; ``problems`` says all that is wrong, and where."""


@contextmanager
def uncollected() -> Iterator[None]:
    """Let Python's collector rest while very many objects are made, none of them in a cycle.

    With each ten thousand or so it would look through all objects of the process again, which in a
    large one takes longer than what is done here.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def read_tree(text: str, filename: str) -> Node:
    """Read the one mapping that a file's text is.

    Args:
        text: the text.
        filename: what error messages call it.

    Raises:
        YamlError: the text is no YAML, holds a tag, a repeated key, a merge key, several
            documents or no mapping, or is larger than the limits above.
    """
    with uncollected():
        return _Reader(text, filename).document(of_fields=True)


def read_value(text: str, filename: str) -> Node:
    """Read the one value, of whatever kind, that a text is: ``read_value("[1, 2]", "--set")``.

    Raises:
        YamlError: as for `read_tree`, but that it need not be a mapping.
    """
    with uncollected():
        return _Reader(text, filename).document(of_fields=False)


def plain_tree(mapping: Mapping[Any, Any]) -> Node:
    """Return the tree of what is given as plain data instead of as text.

    It has no lines and columns.

    Raises:
        YamlError: a key is no text, or it is nested deeper than the limits above.
    """
    return _node_of(mapping, (), 1)


def _node_of(value: Any, path: FieldPath, depth: int) -> Node:
    if depth > MAX_DEPTH:
        raise YamlError([Problem(path[:1], f"nested more than {MAX_DEPTH} levels deep")])
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    inner: list[Node] | dict[str, Node]
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                message = f"found {key!r} as the name of a field; wanted text"
                raise YamlError([Problem(path, message)])
        inner = {key: _node_of(item, (*path, key), depth + 1) for key, item in value.items()}
        nodes = list(inner.values())
    elif isinstance(value, list | tuple):
        nodes = [_node_of(item, (*path, index), depth + 1) for index, item in enumerate(value)]
        inner = nodes
    else:
        return Node(value, 0, 0, text=str(value))
    values = 1 + sum(node.values for node in nodes)
    return Node(inner, 0, 0, values=values, height=1 + max((n.height for n in nodes), default=0))


class _Reader:
    def __init__(self, text: str, filename: str) -> None:
        self._text, self._filename = text, filename
        self._problems: list[Problem] = []
        self._anchors: dict[str, Node | None] = {}
        size = len(text.encode("utf-8", "surrogatepass"))
        if size > MAX_BYTES:
            raise self._fatal(f"the file has {size} bytes; allowed are at most {MAX_BYTES}")
        if strange := _UNPRINTABLE.search(text):
            place = strange.start()
            line, column = text.count("\n", 0, place) + 1, place - text.rfind("\n", 0, place)
            found = f"found the character U+{ord(text[place]):04X}"
            raise self._fatal(f"{found}; allowed is printable text", line, column)
        self._events: Iterator[Any] = yaml.parse(text, Loader=_LOADER)
        self._last = (1, 1)
        self._path: list[str | int] = []  # of the value that is being read

    def document(self, of_fields: bool) -> Node:
        self._next()  # the start of the stream
        if isinstance(self._next(), yaml.StreamEndEvent):
            raise self._fatal(f"the file is empty; wanted {_WANTED[of_fields]}", 1, 1)
        node = self._node(self._next(), 1)
        self._next()  # the end of the document
        end = self._next()
        if not isinstance(end, yaml.StreamEndEvent):
            self._report("a second document starts here; wanted one only", *_place(end))
        if of_fields and not isinstance(node.value, dict):
            found = "nothing" if node.value is None else _kind(node)
            self._report(f"found {found}; wanted {_WANTED[True]}", node.line, node.column)
        if self._problems:
            raise YamlError(self._problems)
        return node

    def _next(self) -> Any:
        try:
            event = next(self._events)
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line, column = (mark.line + 1, mark.column + 1) if mark else self._last
            message = f"not valid YAML: {self._hint(error, line, column)}"
            raise self._fatal(message, line, column) from None
        except (ValueError, OverflowError):
            # The parser in Python hands escapes such as "\UFFFFFFFF" and directives to chr() and
            # int() unchecked.
            message = "not valid YAML: an escape or a directive holds an impossible number"
            raise self._fatal(message, *self._last) from None
        end = event.end_mark
        self._last = end.line + 1, end.column + 1
        return event

    def _hint(self, error: yaml.MarkedYAMLError, line: int, column: int) -> str:
        """Return what is wrong in words that help, or in the parser's."""
        problem = error.problem or "found something unexpected"
        if "cannot start any token" in problem:
            character = self._text.splitlines()[line - 1][column - 1]
            if character == "\t":
                return "found a tab; indent with spaces"
            return f"no text without quotes can begin with {quoted(character)}; put it in quotes"
        context = f" ({error.context})" if error.context else ""
        return _HINTS.get(problem, f"{problem}{context}")

    def _node(self, event: Any, depth: int) -> Node:
        if isinstance(event, yaml.AliasEvent):
            return self._alias(event, depth)
        if depth > MAX_DEPTH:
            raise self._fatal(f"nested more than {MAX_DEPTH} levels deep", *_place(event))
        if event.tag is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            message = f"found the tag {quoted(tag)}; only plain values are read: remove it"
            self._report(message, *_place(event))
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        if isinstance(event, yaml.ScalarEvent):
            node = self._scalar(event)
        elif isinstance(event, yaml.SequenceStartEvent):
            node = self._list(event, depth)
        else:
            node = self._mapping(event, depth)
        if event.anchor is not None:
            self._anchors[event.anchor] = node
        return node

    def _alias(self, event: yaml.AliasEvent, depth: int) -> Node:
        name = f"the alias '*{event.anchor}'"
        if event.anchor not in self._anchors:
            message = f"{name} repeats nothing; write '&{event.anchor}' before what it repeats"
            raise self._fatal(message, *_place(event))
        node = self._anchors[event.anchor]
        if node is None:
            raise self._fatal(f"{name} stands inside what it repeats", *_place(event))
        if depth + node.height - 1 > MAX_DEPTH:
            raise self._fatal(f"{name} nests more than {MAX_DEPTH} levels deep", *_place(event))
        line, column = _place(event)
        return replace(node, line=line, column=column, is_block=False)

    def _scalar(self, event: yaml.ScalarEvent) -> Node:
        text, style = event.value, event.style
        line, column = _place(event)
        if not style:  # "" to libyaml, None to the parser in Python: without quotes
            return Node(_plain_scalar(text), line, column, text)
        if _SURROGATE.search(text):
            self._report(_HALF, line, column)
        return Node(text, line, column, text, is_block=style == "|")

    def _list(self, event: yaml.Event, depth: int) -> Node:
        items: list[Node] = []
        values, height = 1, 0
        while not isinstance(inner := self._next(), yaml.SequenceEndEvent):
            self._path.append(len(items))
            node = self._node(inner, depth + 1)
            self._path.pop()
            items.append(node)
            values, height = values + node.values, max(height, node.height)
            self._bound(values, inner)
        return Node(items, *_place(event), values=values, height=height + 1)

    def _mapping(self, event: yaml.Event, depth: int) -> Node:
        fields: dict[str, Node] = {}
        keys: dict[str, tuple[int, int]] = {}
        values, height = 1, 0
        while not isinstance(inner := self._next(), yaml.MappingEndEvent):
            key = self._node(inner, depth + 1)
            name = self._checked_key(key, keys)
            inner = self._next()
            if name is None:
                node = self._node(inner, depth + 1)
            else:
                self._path.append(name)
                fields[name] = node = self._node(inner, depth + 1)
                self._path.pop()
                keys[name] = key.line, key.column
            values, height = values + key.values + node.values, max(height, node.height)
            self._bound(values, inner)
        return Node(fields, *_place(event), keys=keys, values=values, height=height + 1)

    def _checked_key(self, key: Node, taken: dict[str, tuple[int, int]]) -> str | None:
        """Return the field's name, or None after reporting that it cannot be one."""
        if key.text is None:
            message = f"found {_kind(key)} as the name of a field; wanted text"
        elif key.text == "<<":
            message = "merge keys ('<<') are not supported; write the fields out"
        elif key.text in taken:
            message = f"given twice, first on line {taken[key.text][0]}; keep one of the two"
            self._report(message, key.line, key.column, key.text)
            return None
        else:
            return key.text
        self._report(message, key.line, key.column)
        return None

    def _bound(self, values: int, event: yaml.Event) -> None:
        if values > MAX_VALUES:
            message = f"more than {MAX_VALUES} values, counting what aliases repeat"
            raise self._fatal(message, *_place(event))

    def _report(self, message: str, line: int, column: int, *inner: str) -> None:
        path = (*self._path, *inner)
        self._problems.append(Problem(path, message, self._filename, line, column))
        if len(self._problems) == MAX_PROBLEMS:
            raise self._fatal("this much is wrong; the rest was not read", line, column)

    def _fatal(self, message: str, line: int | None = None, column: int | None = None) -> YamlError:
        """Return the error that ends the reading: what came before, and this."""
        return YamlError([*self._problems, Problem((), message, self._filename, line, column)])


_WANTED: Final = {True: "a mapping of fields, such as 'name: tower'", False: "a value"}


def _place(event: Any) -> tuple[int, int]:
    """Return line and column of where an event begins, both from 1."""
    mark = event.start_mark
    return mark.line + 1, mark.column + 1


def _kind(node: Node) -> str:
    if isinstance(node.value, list):
        return "a list"
    if isinstance(node.value, dict):
        return "a mapping"
    return f"only {quoted(node.text or '')}"


def _plain_scalar(text: str) -> Scalar:
    if text in _SPECIAL:
        return _SPECIAL[text]
    if not _FLOAT.fullmatch(text):
        return text
    if len(text) <= _MOST_DIGITS and _INTEGER.fullmatch(text):
        return int(text)
    return float(text)
