"""YAML text -> a tree of plain values that remember where they were written.

PyYAML only splits the text into events; everything else happens here, so that nothing in a file can
construct an object, that the work a file may ask for is bounded, and that every later error can
name a line and a column. Scalars are read by YAML 1.2's core rules, as editors do: ``yes``, ``on``
and ``12:30`` are text, ``1e3`` is a number.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Protocol

import numpy as np
import yaml

from roller_env.level.errors import FieldPath, LevelError, Problem, quoted

MAX_BYTES: Final = 1024 * 1024
MAX_VALUES: Final = 500_000
"""Values (numbers, texts, lists, mappings and keys) once every alias stands for what it repeats:
enough for `schema.MAX_PIECES` boxes written out one by one."""
MAX_DEPTH: Final = 32

Scalar = str | int | float | bool | None


class _Mark(Protocol):
    """A place in the text: PyYAML has one such class in Python and one in C."""

    line: int
    column: int


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
_LARGEST_EXACT_INTEGER: Final = 2**53
_SURROGATE: Final = re.compile("[\ud800-\udfff]")
_HINTS: Final = {
    "found character '\\t' that cannot start any token": "found a tab; indent with spaces",
    "mapping values are not allowed here": "found ': ' where no field can start; put text that "
    "contains ': ' into quotes, and begin a list or a mapping on its own line",
}


@dataclass(frozen=True, slots=True)
class Node:
    """A value of the file.

    Attributes:
        value: the scalar, or the list's items, or the mapping's values by their keys.
        line: line where it begins, from 1.
        column: column where it begins, from 1.
        text: a scalar as it is written, without quotes; None for lists and mappings.
        is_block: whether it is text in literal style (``|``), beginning on the next line.
        keys: line and column of each key of a mapping.
        values: how many values it stands for, itself included.
        height: levels of nesting, 1 for a scalar.
    """

    value: Scalar | list[Node] | dict[str, Node]
    line: int
    column: int
    text: str | None = None
    is_block: bool = False
    keys: dict[str, tuple[int, int]] = field(default_factory=dict)
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
            if of_key and number == len(path) and part in node.keys:
                return node.keys[str(part)]
            inner = node.child(part)
            if inner is None:
                break
            node = inner
        return node.line, node.column


def read_tree(text: str, filename: str) -> Node:
    """Read the one mapping that the text of a level is.

    Raises:
        LevelError: the text is no YAML, holds a tag, a repeated key, a merge key, several
            documents or no mapping, or is larger than the limits above.
    """
    return _Reader(text, filename).document()


def plain_tree(mapping: Mapping[Any, Any]) -> Node:
    """Return the tree of a level that is given as plain data instead of as text.

    It has no lines and columns.

    Raises:
        LevelError: a key is no text, or it is larger than the limits above.
    """
    return _node_of(mapping, (), 1)


def _node_of(value: Any, path: FieldPath, depth: int) -> Node:
    if depth > MAX_DEPTH:
        raise LevelError([Problem(path[:1], f"nested more than {MAX_DEPTH} levels deep")])
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    inner: list[Node] | dict[str, Node]
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                message = f"found {key!r} as the name of a field; wanted text"
                raise LevelError([Problem(path, message)])
        inner = {key: _node_of(item, (*path, key), depth + 1) for key, item in value.items()}
        nodes = list(inner.values())
    elif isinstance(value, list | tuple):
        nodes = [_node_of(item, (*path, index), depth + 1) for index, item in enumerate(value)]
        inner = nodes
    else:
        return Node(value, 0, 0, text=str(value))
    return Node(inner, 0, 0, height=1 + max((node.height for node in nodes), default=0))


class _Reader:
    def __init__(self, text: str, filename: str) -> None:
        self._filename = filename
        self._problems: list[Problem] = []
        self._anchors: dict[str, Node | None] = {}
        size = len(text.encode("utf-8", "surrogatepass"))
        if size > MAX_BYTES:
            raise self._fatal(f"the file has {size} bytes; allowed are at most {MAX_BYTES}")
        self._text = text
        self._events = yaml.parse(text, Loader=yaml.SafeLoader)
        self._last = (1, 1)

    def document(self) -> Node:
        self._next()  # the start of the stream
        if isinstance(self._next(), yaml.StreamEndEvent):
            raise self._fatal("the file is empty; wanted the fields of a level", 1, 1)
        node = self._node(self._next(), (), 1)
        self._next()  # the end of the document
        end = self._next()
        if not isinstance(end, yaml.StreamEndEvent):
            message = "a second document starts here; a file holds one level"
            self._report((), message, *_place(end))
        if not isinstance(node.value, dict):
            found = "nothing" if node.value is None else _kind(node)
            message = f"found {found}; wanted a mapping of a level's fields, such as 'name: tower'"
            self._report((), message, node.line, node.column)
        if self._problems:
            raise LevelError(self._problems)
        return node

    def _next(self) -> yaml.Event:
        try:
            event = next(self._events)
        except yaml.reader.ReaderError as error:
            before = self._text[: error.position]
            line, column = before.count("\n") + 1, error.position - before.rfind("\n")
            found = f"found the character U+{ord(self._text[error.position]):04X}"
            raise self._fatal(f"{found}; allowed is printable text", line, column) from None
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            problem = _HINTS.get(error.problem or "", error.problem or "found something unexpected")
            context = f" ({error.context})" if error.context and problem == error.problem else ""
            message = f"not valid YAML: {problem}{context}"
            raise self._fatal(message, *(_counted(mark) if mark else self._last)) from None
        except (ValueError, OverflowError):
            # PyYAML hands escapes such as "\UFFFFFFFF" and directives to chr() and int() unchecked.
            message = "not valid YAML: an escape or a directive holds an impossible number"
            raise self._fatal(message, *self._last) from None
        self._last = _counted(event.end_mark)
        return event

    def _node(self, event: yaml.Event, path: FieldPath, depth: int) -> Node:
        if isinstance(event, yaml.AliasEvent):
            return self._alias(event, depth)
        if depth > MAX_DEPTH:
            raise self._fatal(f"nested more than {MAX_DEPTH} levels deep", *_place(event))
        assert isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent), "a node begins"
        if event.tag is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            message = f"found the tag {quoted(tag)}; a level has plain values only: remove it"
            self._report(path, message, *_place(event))
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        if isinstance(event, yaml.ScalarEvent):
            node = self._scalar(event, path)
        elif isinstance(event, yaml.SequenceStartEvent):
            node = self._list(event, path, depth)
        else:
            node = self._mapping(event, path, depth)
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

    def _scalar(self, event: yaml.ScalarEvent, path: FieldPath) -> Node:
        line, column = _place(event)
        if _SURROGATE.search(event.value):
            message = "found an escape for half a character; write the character itself"
            self._report(path, message, line, column)
        value = _plain_scalar(event.value) if event.style is None else event.value
        return Node(value, line, column, text=event.value, is_block=event.style == "|")

    def _list(self, event: yaml.Event, path: FieldPath, depth: int) -> Node:
        items: list[Node] = []
        values, height = 1, 0
        while not isinstance(inner := self._next(), yaml.SequenceEndEvent):
            node = self._node(inner, (*path, len(items)), depth + 1)
            items.append(node)
            values, height = values + node.values, max(height, node.height)
            self._bound(values, inner)
        return Node(items, *_place(event), values=values, height=height + 1)

    def _mapping(self, event: yaml.Event, path: FieldPath, depth: int) -> Node:
        fields: dict[str, Node] = {}
        keys: dict[str, tuple[int, int]] = {}
        values, height = 1, 0
        while not isinstance(key_event := self._next(), yaml.MappingEndEvent):
            key = self._node(key_event, path, depth + 1)
            name = self._checked_key(key, path, keys)
            inner = self._next()
            node = self._node(inner, path if name is None else (*path, name), depth + 1)
            values, height = values + 1 + node.values, max(height, node.height)
            self._bound(values, inner)
            if name is not None:
                fields[name] = node
                keys[name] = (key.line, key.column)
        return Node(fields, *_place(event), keys=keys, values=values, height=height + 1)

    def _checked_key(
        self, key: Node, path: FieldPath, taken: dict[str, tuple[int, int]]
    ) -> str | None:
        """Return the field's name, or None after reporting that it cannot be one."""
        if key.text is None:
            message = f"found {_kind(key)} as the name of a field; wanted text"
        elif key.text == "<<":
            message = "merge keys ('<<') are not supported; write the fields out"
        elif key.text in taken:
            path = (*path, key.text)
            message = f"given twice, first on line {taken[key.text][0]}; keep one of the two"
        else:
            return key.text
        self._report(path, message, key.line, key.column)
        return None

    def _bound(self, values: int, event: yaml.Event) -> None:
        if values > MAX_VALUES:
            message = f"more than {MAX_VALUES} values, counting what aliases repeat"
            raise self._fatal(message, *_place(event))

    def _report(self, path: FieldPath, message: str, line: int, column: int) -> None:
        self._problems.append(Problem(path, message, self._filename, line, column))

    def _fatal(
        self, message: str, line: int | None = None, column: int | None = None
    ) -> LevelError:
        """Return the error that ends the reading: what came before, and this."""
        return LevelError([*self._problems, Problem((), message, self._filename, line, column)])


def _place(event: yaml.Event) -> tuple[int, int]:
    return _counted(event.start_mark)


def _counted(mark: _Mark | None) -> tuple[int, int]:
    """Return line and column of a mark, both from 1."""
    assert mark is not None, "PyYAML marks every event"
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
    value = float(text)
    if _INTEGER.fullmatch(text) and abs(value) < _LARGEST_EXACT_INTEGER:
        return int(value)
    return value
