"""Prefabs, and what places them: groups of pieces written once, and put into a level many times.

One construct does what groups, arrays and prefabs do elsewhere: an entry of ``place`` puts pieces,
its own or those of a prefab, into a frame, and may repeat that. It is done to what was read, before
anything becomes a `Level`: each copy is a piece like any other, and nothing else knows of copies.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

from pydantic import Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from roller_env.level.errors import LevelError
from roller_env.level.messages import explain
from roller_env.level.schema import PIECE_FIELDS, Level
from roller_env.level.source import File, Origin, Source
from roller_env.pieces.fields import METRES_PER_UNIT, SCALE_KEY, Degrees, Name, Part, Point
from roller_env.pieces.placing import CannotTurn, Frame, naming
from roller_env.pieces.words import Unit
from roller_env.problems import MAX_PROBLEMS, FieldPath, Problem, field_name, listed, quoted
from roller_env.yaml_tree import MAX_DEPTH, MAX_VALUES, Node

MAX_COPIES: Final = 10_000

_PARAMETER: Final = re.compile(r"\$([A-Za-z][A-Za-z0-9_-]*)")
_SHARED: Final = ("include", "units", "materials", "prefabs", "place", *PIECE_FIELDS)
"""What an included file may have."""


class Repeat(Part):
    """Copies, each placed in the frame of the one before it: rows, stairs, rings, spirals."""

    count: Annotated[int, Field(strict=True, ge=1, le=MAX_COPIES)] = Field(
        description="How many copies."
    )
    step: Point = Field(
        (0.0, 0.0, 0.0), description="From each copy to the next, along the former's axes."
    )
    turn_deg: Degrees = Field(
        0.0, description="How far each is turned to the left against the one before it."
    )


class Placement(Part):
    """Pieces put somewhere, once or repeated: those of the prefab `of`, or its own `pieces`."""

    of: Name | None = Field(None, description="The prefab.")
    pieces: dict[str, Any] | None = Field(
        None, description="Instead of a prefab: the pieces themselves, as a prefab has them."
    )
    at: Point = Field((0.0, 0.0, 0.0), description="Where their origin is.")
    yaw_deg: Degrees = Field(0.0, description="Positive turns them to the left about it.")
    repeat: Repeat | None = Field(None, description="For more than one copy.")
    parameters: dict[Name, Any] = Field(
        default_factory=dict, description="Values of the prefab's parameters."
    )
    name: Name | None = Field(
        None,
        description="Begins the names of its pieces: `east` makes `east-door` of `door`, and "
        "`east-2-door` of the second copy. If left out, the prefab's name and a number.",
    )

    @model_validator(mode="after")
    def _has_pieces(self) -> Placement:
        if (self.of is None) == (self.pieces is None):
            raise PydanticCustomError("placement_ambiguous", "give exactly one of of, pieces")
        if self.parameters and self.of is None:
            raise PydanticCustomError("placement_ambiguous", "only a prefab has parameters")
        return self


class LevelFile(Level):
    """What a level's file may have: a level, and what is expanded while it is read."""

    include: tuple[str, ...] = Field(
        (), description="Files, in this folder or under it, whose pieces are this level's too."
    )
    prefabs: dict[Name, dict[str, Any]] = Field(
        default_factory=dict,
        description="Groups of pieces by name, for `place`: the fields of pieces, `place`, and "
        "`parameters` with the values that they have if nothing else is given.",
    )
    place: tuple[Placement, ...] = Field((), description=str(Placement.__doc__))


AUTHORING: Final = tuple(name for name in LevelFile.model_fields if name not in Level.model_fields)
"""The fields of a file that no level has."""


def expanded(files: Sequence[File], unit: Unit) -> Source:
    """Return the level that files say together, with every copy of every piece.

    Args:
        files: the level's, and those that it includes.
        unit: the unit of the first.

    Raises:
        LevelError: something is placed wrongly, or there is too much of it.
    """
    first, fields = files[0], files[0].root.plain()
    assert isinstance(fields, dict), "the root of a file is a mapping"
    if len(files) == 1 and not any(name in fields for name in AUTHORING):
        return Source(Origin(first, (), first.root), fields, {})
    expander = _Expander(files, unit)
    found = expander.level({key: value for key, value in fields.items() if key not in AUTHORING})
    if expander.problems:
        raise LevelError(dict.fromkeys(expander.problems))
    return found


@dataclass(frozen=True, slots=True)
class _Item:
    """A piece to be: where it was written, where it stands, and what it and others are called.

    Attributes:
        kind: the field of its kind.
        origin: where it was written.
        frame: where it is placed.
        name: its own, of those around it; None without.
        names: what the names that it gives stand for.
    """

    kind: str
    origin: Origin
    frame: Frame
    name: str | None
    names: Mapping[str, str]

    def in_copy(self, copy: str, note: str, frame: Frame, local: frozenset[str]) -> _Item:
        """Return it in a copy, whose own names are ``local``."""
        notes = ", ".join(part for part in (self.origin.note, note) if part)
        return replace(
            self,
            origin=replace(self.origin, note=notes),
            frame=frame.inner(self.frame),
            name=None if self.name is None else f"{copy}-{self.name}",
            names={
                written: f"{copy}-{name}" if name in local else name
                for written, name in self.names.items()
            },
        )

    def fields(self) -> object:
        """Return it as a file without copies would have it; what is no mapping as it is.

        Raises:
            CannotTurn: it cannot stand in its frame.
        """
        plain = self.origin.node.plain()
        if not isinstance(plain, dict):
            return plain
        kind = PIECE_FIELDS[self.kind]
        placed = kind.placed(plain, self.frame)
        if self.name is not None:
            placed["name"] = self.name
        return placed | {
            field: [self.names.get(str(name), name) for name in placed[field]]
            for field in naming(kind)
            if isinstance(placed.get(field), list)
        }


class _Expander:
    def __init__(self, files: Sequence[File], unit: Unit) -> None:
        self.problems: list[Problem] = []
        self._files, self._unit = files, unit
        self._left = MAX_VALUES - sum(file.root.values for file in files)
        self._prefabs = dict(self._read_prefabs())
        self._open: list[str] = []  # the prefabs that are being placed

    def level(self, fields: dict[str, Any]) -> Source:
        """Return the level of which the first file says ``fields``."""
        origins: dict[FieldPath, Origin] = {}
        own, *included = (Origin(file, (), file.root) for file in self._files)
        names: Counter[str] = Counter()  # of the copies that no piece contains
        items = list(self._placed(own, names))
        for root in included:
            if self._is_group(root, _SHARED):
                self._check_unit(root)
                self._add_materials(root, fields, origins)
                items += self._items(root, names)
        for item in items:
            self._add(item, fields, origins)
        return Source(own, fields, origins)

    def _add(self, item: _Item, fields: dict[str, Any], origins: dict[FieldPath, Origin]) -> None:
        pieces = fields.setdefault(item.kind, [])
        if not isinstance(pieces, list):  # which is told when the level is read
            return
        try:
            fields_of_piece = item.fields()
        except CannotTurn:
            found = f"it has edges along x and y, and is turned by {item.frame.yaw_deg:g} degrees"
            self._report(item.origin, f"{found}; wanted a multiple of 90")
            return
        origins[item.kind, len(pieces)] = item.origin
        pieces.append(fields_of_piece)

    def _check_unit(self, root: Origin) -> None:
        unit = _inner(root, "units")
        if (unit.node.value if unit else "metre") != self._unit:
            message = f"wanted units: {self._unit}, as the level has that includes this file"
            self._report(unit or root, message)

    def _add_materials(
        self, root: Origin, fields: dict[str, Any], origins: dict[FieldPath, Origin]
    ) -> None:
        materials, known = _inner(root, "materials"), fields.setdefault("materials", {})
        if materials is None or not isinstance(known, dict):
            return
        for name, material in self._fields(materials):
            if name in known:
                self._report(material, "another file has a material of this name")
            else:
                known[name] = material.node.plain()
                origins["materials", name] = material

    def _read_prefabs(self) -> Iterator[tuple[str, Origin]]:
        known: set[str] = set()
        for file in self._files:
            prefabs = _inner(Origin(file, (), file.root), "prefabs")
            for name, prefab in self._fields(prefabs) if prefabs else ():
                if name in known:
                    self._report(prefab, "another file has a prefab of this name")
                elif self._is_group(prefab, ("parameters", "place", *PIECE_FIELDS)):
                    known.add(name)
                    yield name, prefab

    def _fields(self, mapping: Origin) -> Iterator[tuple[str, Origin]]:
        """Yield what a mapping holds by name."""
        if not isinstance(mapping.node.value, dict):
            self._report(mapping, "wanted a mapping from names to what they stand for")
            return
        for name, node in mapping.node.value.items():
            yield name, replace(mapping, path=(*mapping.path, name), node=node)

    def _list(self, items: Origin) -> Iterator[Origin]:
        """Yield what a list holds."""
        if not isinstance(items.node.value, list):
            self._report(items, "wanted a list, each item after a '- '")
            return
        for index, node in enumerate(items.node.value):
            yield replace(items, path=(*items.path, index), node=node)

    def _is_group(self, group: Origin, known: tuple[str, ...]) -> bool:
        """Say whether something has fields, and none but those that it may have."""
        before = len(self.problems)
        for name, _ in self._fields(group):
            if name not in known:
                message = f"unknown field; allowed: {', '.join(known)}"
                problem = Problem((), message, written=name, known=known)
                self.problems.append(group.told(problem, (name,), of_key=True))
        return len(self.problems) == before

    def _items(self, group: Origin, names: Counter[str]) -> Iterator[_Item]:
        """Yield the pieces of a group or a file, its own and those that it places."""
        for kind in PIECE_FIELDS:
            pieces = _inner(group, kind)
            for piece in self._list(pieces) if pieces else ():
                name = piece.node.find(("name",))
                own = name.value if name and isinstance(name.value, str) else None
                given = {name: name for name in _names(kind, piece.node)}
                yield _Item(kind, piece, Frame(), own, given)
        yield from self._placed(group, names)

    def _placed(self, group: Origin, names: Counter[str]) -> Iterator[_Item]:
        """Yield the pieces of all copies that a group or a file places.

        Args:
            group: what has the entries.
            names: how many copies without a name each prefab has there.
        """
        entries = _inner(group, "place")
        for entry in self._list(entries) if entries else ():
            if len(self.problems) < MAX_PROBLEMS:
                yield from self._copies(entry, names)

    def _copies(self, entry: Origin, names: Counter[str]) -> Iterator[_Item]:
        """Yield the pieces of all copies of one entry."""
        placement = self._placement(entry)
        body = self._body(entry, placement) if placement else None
        if placement is None or body is None or not self._spend(entry, body.node.values):
            return
        self._open.append(placement.of or "")
        items = list(self._items(body, Counter()))
        self._open.pop()
        count = placement.repeat.count if placement.repeat else 1
        values = sum(item.origin.node.values for item in items)
        if not self._spend(entry, count * max(values, 1)):
            return
        local = frozenset(item.name for item in items if item.name is not None)
        prefix, where = placement.name or placement.of or "place", field_name(entry.path)
        for number, frame in enumerate(_frames(entry.node.plain(), count), start=1):
            names[prefix] += 1
            copy = prefix if placement.name and count == 1 else f"{prefix}-{names[prefix]}"
            note = f"in {where}" if count == 1 else f"in copy {number} of {where}"
            for item in items:
                yield item.in_copy(copy, note, frame, local)

    def _placement(self, entry: Origin) -> Placement | None:
        """Return what an entry says, if it is well formed."""
        scale = METRES_PER_UNIT[self._unit]
        try:
            return Placement.model_validate(entry.node.plain(), context={SCALE_KEY: scale})
        except ValidationError as error:
            self.problems += explain(error, Source(entry, {}, {}), Placement)
            return None

    def _body(self, entry: Origin, placement: Placement) -> Origin | None:
        """Return the pieces that an entry places, with the values of their parameters."""
        if len(self._open) == MAX_DEPTH:
            self._report(entry, f"placed in more than {MAX_DEPTH} others")
            return None
        if placement.of is None:
            own = _inner(entry, "pieces")
            known = ("place", *PIECE_FIELDS)
            return own if own and self._is_group(own, known) else None
        where, known = _inner(entry, "of") or entry, tuple(self._prefabs)
        if placement.of not in known:
            message = f"no prefab is called {quoted(placement.of)}; there are {listed(known)}"
            problem = Problem((), message, written=placement.of, known=known)
            self.problems.append(where.told(problem))
            return None
        if placement.of in self._open:
            self._report(where, f"the prefab {quoted(placement.of)} would be placed in itself")
            return None
        prefab = self._prefabs[placement.of]
        values = self._values(entry, prefab)
        if values is None:
            return None
        fields = prefab.node.value
        assert isinstance(fields, dict), "a prefab that is kept is a group"
        body = {name: node for name, node in fields.items() if name != "parameters"}
        filled = self._filled(replace(prefab, node=replace(prefab.node, value=body)), values)
        if filled.height > MAX_DEPTH:
            self._report(entry, f"with its parameters nested more than {MAX_DEPTH} levels deep")
            return None
        return replace(prefab, node=filled)

    def _values(self, entry: Origin, prefab: Origin) -> dict[str, Node] | None:
        """Return the values of a prefab's parameters, if all have one."""
        before = len(self.problems)
        defaults, given = _inner(prefab, "parameters"), _inner(entry, "parameters")
        values = {name: found.node for name, found in self._fields(defaults)} if defaults else {}
        for name, found in self._fields(given) if given else ():
            if name not in values:
                known = listed(tuple(values)) or "none"
                message = f"the prefab has no such parameter; there are {known}"
                problem = Problem((), message, written=name, known=tuple(values))
                self.problems.append(found.told(problem))
            values[name] = found.node
        for name, node in values.items():
            if node.value is None:
                self._report(entry, f"the parameter {quoted(name)} is missing, and has no default")
        return values if len(self.problems) == before else None

    def _filled(self, body: Origin, values: Mapping[str, Node]) -> Node:
        """Return a body with the values of its parameters in their places."""
        node, inner = body.node, body.node.value
        if isinstance(inner, str) and (found := _PARAMETER.fullmatch(inner)):
            value = values.get(found[1])
            if value is None:
                known = listed(tuple(values)) or "none"
                self._report(body, f"no parameter is called {quoted(found[1])}; there are {known}")
                return node
            return replace(value, line=node.line, column=node.column, is_block=False)
        children: dict[Any, Node] = {}
        if isinstance(inner, dict):
            children = dict(inner)
        elif isinstance(inner, list):
            children = dict(enumerate(inner))
        filled = {
            part: self._filled(replace(body, path=(*body.path, part), node=child), values)
            for part, child in children.items()
        }
        if all(new is old for new, old in zip(filled.values(), children.values(), strict=True)):
            return node
        grown = sum(new.values - children[part].values for part, new in filled.items())
        return replace(
            node,
            value=filled if isinstance(inner, dict) else list(filled.values()),
            values=node.values + grown,
            height=1 + max(new.height for new in filled.values()),
        )

    def _spend(self, entry: Origin, values: int) -> bool:
        """Take values from what there may be of them in all; say whether there are so many left."""
        was_left = self._left >= 0
        self._left -= values
        if was_left and self._left < 0:
            self._report(entry, f"with this there are more than {MAX_VALUES} values in all")
        return self._left >= 0

    def _report(self, origin: Origin, message: str) -> None:
        self.problems.append(origin.told(Problem((), message)))


def _inner(origin: Origin, name: str) -> Origin | None:
    """Return a field of something, or None if it has no such field."""
    node = origin.node.child(name)
    return replace(origin, path=(*origin.path, name), node=node) if node is not None else None


def _names(kind: str, piece: Node) -> Iterator[str]:
    """Yield the names that a piece gives of others."""
    for field in naming(PIECE_FIELDS[kind]):
        given = piece.child(field)
        for node in given.value if given is not None and isinstance(given.value, list) else ():
            if isinstance(node.value, str):
                yield node.value


def _frames(entry: Any, count: int) -> Iterator[Frame]:
    """Yield the frames of the copies of an entry that is well formed."""
    base = Frame(tuple(entry.get("at", (0, 0, 0))), entry.get("yaw_deg", 0))
    repeat = entry.get("repeat") or {}
    step, turn_deg = repeat.get("step", (0, 0, 0)), repeat.get("turn_deg", 0)
    x: float = 0
    y: float = 0
    for number in range(count):
        if not turn_deg:  # as exact as the numbers are
            x, y = number * step[0], number * step[1]
        own = Frame((x, y, number * step[2]), number * turn_deg)
        yield base.inner(own)
        dx, dy = own.direction(step[0], step[1])
        x, y = x + dx, y + dy
