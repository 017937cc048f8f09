"""Entities of a map -> the fields of a level file, in quants.

One map unit is one quant, and the axes are the same, so coordinates stay as they are written.
"""

from __future__ import annotations

import math
import os
import re
import warnings
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NoReturn

import numpy as np

from roller_env.arrays import Float64
from roller_env.level.doubts import level_warnings
from roller_env.level.errors import LevelError, LevelWarning
from roller_env.level.load import load_level
from roller_env.level.maps.brushes import Block, BrushError, Hull, body_of
from roller_env.level.maps.entities import (
    BALL,
    EDITOR_KEYS,
    EDITOR_PREFIX,
    FINISH,
    FINISH_KEYS,
    KINDS,
    MATERIAL_KEY,
    MATERIALS,
    NO_TEXTURE,
    QUAKE_NAMES,
    ROUTE_KEYS,
    SOLIDS,
    SPOTS,
    START,
    START_KEYS,
    WAYPOINT,
    WORLD,
    Key,
    Kind,
    read_point,
    tidy,
)
from roller_env.level.maps.parse import MAX_BYTES, Brush, Entity, parse_entities
from roller_env.level.schema import Level
from roller_env.level.text import decoded
from roller_env.pieces.fields import NAME_PATTERN
from roller_env.problems import MAX_PROBLEMS, FieldPath, Problem, listed, quoted
from roller_env.regular_files import read_regular_file

MAX_MATERIALS: Final = 1_000

MAX_LINKS: Final = 100_000
"""Targets of plates and switches in all: each of many can have a name that many share."""

_TARGET: Final = re.compile(r"target[0-9]*")
_NO_NAME: Final = re.compile(r"[^A-Za-z0-9_-]")

_MOST_PROBLEMS: Final = 100
"""Faults that are looked for: a brush that is none takes the longest to see through."""

_LONGEST_NAME: Final = 56
"""Characters of a name, without a number that makes it one of its own."""


@dataclass(frozen=True)
class ImportedMap:
    """What a map says of a level.

    Attributes:
        fields: of a level file, as `load_level` takes them; lengths in quants.
        notes: what of the map is not in them, and what was taken otherwise than written, each
            with its line; in the order of the file.
        filename: the map.
        lines: of the map, by the field that comes from there.
    """

    fields: dict[str, Any]
    notes: tuple[Problem, ...]
    filename: str
    lines: Mapping[FieldPath, int]

    def level(self) -> tuple[Level, tuple[Problem, ...]]:
        """Return the level, lengths in metres, and what is strange about it.

        Raises:
            LevelError: the level cannot be played; each problem is placed at the line of the map
                that it comes from.
        """
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", LevelWarning)  # they are returned, with places
                level = load_level(self.fields)
        except LevelError as error:
            raise LevelError(map(self._placed, error.problems)) from None
        return level, tuple(map(self._placed, level_warnings(level, "quant")))

    def _placed(self, problem: Problem) -> Problem:
        ways = [problem.path[:depth] for depth in range(len(problem.path), 0, -1)]
        line = next((self.lines[way] for way in ways if way in self.lines), None)
        return replace(problem, filename=self.filename, line=line, column=None)


def read_map(path: str | os.PathLike[str]) -> ImportedMap:
    """Read a `.map` file of Quake's formats Standard or Valve 220.

    Args:
        path: the file; its name, without what no name may hold, is the level's.

    Raises:
        LevelError: it cannot be read, is no map, or says what no level can be.
    """
    path = Path(path)
    try:
        content = read_regular_file(path, MAX_BYTES)
    except OSError as error:
        problem = Problem((), f"it cannot be read: {error.strerror}", str(path))
        raise LevelError([problem]) from None
    return parse_map(decoded(content, str(path)), str(path))


def parse_map(text: str, filename: str = "map.map") -> ImportedMap:
    """Read the text of a `.map` file, as `read_map` does a file.

    Args:
        text: of the file.
        filename: what errors call it; its stem, without what no name may hold, is the level's name.

    Raises:
        LevelError: it is no map, or says what no level can be.
    """
    return _Importer(parse_entities(text, filename), filename).imported()


class _Importer:
    """Makes one level of a map's entities, and gathers what it cannot make of them."""

    def __init__(self, entities: Sequence[Entity], filename: str) -> None:
        self._entities, self._filename = entities, filename
        self._problems: list[Problem] = []
        self._notes: dict[str, list[int]] = {}
        self._lines: dict[FieldPath, int] = {}
        self._materials: dict[str, dict[str, Any]] = {
            name: dict(fields) for name, fields in MATERIALS.items() if fields
        }
        self._used: set[str] = set()
        self._world: dict[str, Any] = {}
        self._fields: dict[str, list[dict[str, Any]]] = defaultdict(list)
        self._single: dict[str, dict[str, Any]] = {}
        self._names: dict[int, str] = {}
        self._taken: set[str] = set()
        self._numbers: dict[str, int] = {}
        self._links = 0
        self._receivers: dict[str, list[str]] = defaultdict(list)
        self._spots: dict[tuple[str, str], list[list[float]]] = defaultdict(list)
        self._waypoints: list[list[float]] = []
        self._route: dict[str, Any] = {}
        self._by_class: dict[str, list[Entity]] = defaultdict(list)

    def imported(self) -> ImportedMap:
        for entity in self._entities:
            self._by_class[QUAKE_NAMES.get(entity.classname, entity.classname)].append(entity)
        for entity in self._by_class["worldspawn"]:
            self._read_world(entity)
        self._read_spots()
        self._give_names()
        for index, entity in enumerate(self._entities):
            self._read(entity, self._names.get(index))
        self._require()
        if self._problems:
            self._refuse()
        used = {name: self._materials[name] for name in self._materials if name in self._used}
        fields = {
            "name": _level_name(self._filename),
            "units": "quant",
            **self._world,
            **({"materials": used} if used else {}),
            **self._single,
            **self._fields,
        }
        if self._waypoints or self._route:
            fields["route"] = {**self._route, "points": self._waypoints}
        notes = (
            Problem((), f"{message}{_times(lines)}", self._filename, min(lines))
            for message, lines in self._notes.items()
        )
        ordered = tuple(sorted(notes, key=lambda note: note.line or 0))
        return ImportedMap(fields, ordered, self._filename, self._lines)

    # What is said of the map ----------------------------------------------------------------------

    def _problem(self, line: int, message: str, *path: str, **names: Any) -> None:
        self._problems.append(Problem(path, message, self._filename, line, **names))
        if len(self._problems) == _MOST_PROBLEMS:
            message = f"more may be wrong; these are the first {_MOST_PROBLEMS} problems"
            self._refuse(Problem((), message, self._filename))

    def _refuse(self, *more: Problem) -> NoReturn:
        ordered = sorted(self._problems, key=lambda problem: problem.line or 0)
        raise LevelError([*ordered, *more])

    def _note(self, line: int, message: str) -> None:
        if message not in self._notes and len(self._notes) >= MAX_PROBLEMS:
            message = "more than can be told is left out as well"
        self._notes.setdefault(message, []).append(line)

    def _require(self) -> None:
        """Say what every level needs and the map does not have."""
        for classname, what in ((START, "where the ball starts"), (FINISH, "the finish")):
            if not self._by_class[classname]:
                self._problem(1, f"the map has no {classname}, {what}; wanted one")
        for classname in (START, FINISH, "worldspawn"):
            for entity in self._by_class[classname][1:]:
                self._problem(entity.line, f"found a second {classname}; wanted one")

    # Names ----------------------------------------------------------------------------------------

    def _give_names(self) -> None:
        """Name the pieces that have or need a name, each its own; those that have one go first."""
        pieces = [
            (index, entity, kind)
            for index, entity in enumerate(self._entities)
            if (kind := _kind_of(entity)) is not None and kind.shape != "point"
        ]
        for index, entity, kind in pieces:
            target = entity.keys.get("targetname", "")
            if not target:
                continue
            wanted = target if re.fullmatch(NAME_PATTERN, target) else _proper(target)
            name = self._names[index] = self._own_name(wanted, numbered=False)
            if name != target:
                line = entity.line_of("targetname")
                self._note(line, f"the targetname {quoted(target)} is now {name}")
            if kind.receives:
                self._receivers[target].append(name)
        for index, entity, kind in pieces:
            if kind.is_named and index not in self._names:
                stem = entity.classname.removeprefix("roller_")
                self._names[index] = self._own_name(stem, numbered=True)

    def _own_name(self, wanted: str, *, numbered: bool) -> str:
        """Return a name that no other piece has: as wanted, or with a number."""
        name = wanted
        self._numbers.setdefault(wanted, 0 if numbered else 1)
        while numbered or name in self._taken:
            self._numbers[wanted] += 1
            name, numbered = f"{wanted[:_LONGEST_NAME]}_{self._numbers[wanted]}", False
        self._taken.add(name)
        return name

    def _targets(self, entity: Entity) -> Iterator[tuple[str, str]]:
        return ((key, value) for key, value in entity.keys.items() if _TARGET.fullmatch(key))

    # Entities -------------------------------------------------------------------------------------

    def _read(self, entity: Entity, name: str | None) -> None:
        classname = entity.classname
        kind = _kind_of(entity)
        if kind is not None:
            self._read_piece(entity, kind, name)
        elif classname in SOLIDS:
            self._read_solids(entity)
        elif classname == START:
            place = {"at": self._origin(entity), **self._values(entity, START_KEYS, "origin")}
            self._single["start"] = place
            self._remember(entity, ("start",), START_KEYS)
        elif classname == FINISH:
            self._single["finish"] = {
                **self._box(entity, "upright"),
                **self._values(entity, FINISH_KEYS),
            }
            self._remember(entity, ("finish",), FINISH_KEYS)
        elif classname == WAYPOINT:
            self._values(entity, {}, "origin")
            self._lines["route", "points", len(self._waypoints)] = entity.line
            self._waypoints.append(self._origin(entity))
        elif classname.startswith("light"):
            self._note(entity.line, "lights are left out: the light of a level is its own")
        elif not classname:
            self._problem(entity.line, "the entity has no 'classname'; wanted one")
        elif classname not in SPOTS:
            body = ", with its brushes" if entity.brushes else ""
            self._note(entity.line, f"unknown classname {quoted(classname)} is left out{body}")

    def _read_world(self, entity: Entity) -> None:
        """Read what concerns the whole level, and the materials that it defines."""
        materials = [key for key in entity.keys if key.startswith(MATERIAL_KEY)]
        if len(materials) > MAX_MATERIALS:
            message = f"found {len(materials)} materials; allowed are at most {MAX_MATERIALS}"
            self._problem(entity.line, message, entity.classname)
        for key in materials[:MAX_MATERIALS]:
            self._read_material(entity, key)
        self._note_unknown(entity, [*WORLD, *BALL, *ROUTE_KEYS, *materials])
        self._world = self._known(entity, WORLD)
        if "title" in self._world:
            self._world["title"] = self._world["title"].replace("\n", " ")
        ball = self._known(entity, BALL)
        if ball:
            self._world["ball"] = ball
        self._route = self._known(entity, ROUTE_KEYS)
        self._remember(entity, (), WORLD)
        self._remember(entity, ("ball",), BALL)

    def _read_material(self, entity: Entity, key: str) -> None:
        name, words = key.removeprefix(MATERIAL_KEY), entity.keys[key].split()
        line = entity.line_of(key)
        number = Key("", "number")
        try:
            friction, elasticity, colour, pattern = words
            fields = {
                "friction": number.read(friction),
                "elasticity": number.read(elasticity),
                "colour": colour,
                "pattern": pattern,
            }
        except ValueError:
            found = quoted(entity.keys[key])
            wanted = "friction, elasticity, colour and pattern, such as '1 1 #8fa3b8 grid'"
            self._problem(line, f"found {found}; wanted {wanted}", entity.classname, key)
            return
        self._materials[name] = fields
        self._used.add(name)
        self._lines["materials", name] = line

    def _read_spots(self) -> None:
        for classname in SPOTS:
            for entity in self._by_class[classname]:
                self._values(entity, {}, "origin", "targetname")
                name = entity.keys.get("targetname", "")
                self._spots[classname, name].append(self._origin(entity))

    def _read_solids(self, entity: Entity) -> None:
        if entity.classname != "worldspawn":
            self._values(entity, {})
        for brush in entity.brushes:
            body = self._body(brush)
            if body is None:
                continue
            fields: dict[str, Any]
            if isinstance(body, Block):
                field = "boxes"
                turns = zip(("yaw_deg", "pitch_deg", "roll_deg"), body.angles, strict=True)
                fields = {
                    "at": _tidy(body.at),
                    "size": _tidy(body.size),
                    **{turn: angle for turn, angle in turns if angle != 0.0},
                }
            else:
                field = "hulls"
                fields = {"points": [_tidy(corner) for corner in body.corners.tolist()]}
            fields |= self._made_of(brush)
            self._lines[field, len(self._fields[field])] = brush.line
            self._fields[field].append(fields)

    def _read_piece(self, entity: Entity, kind: Kind, name: str | None) -> None:
        path = (kind.field, len(self._fields[kind.field]))
        fields: dict[str, Any] = {} if name is None else {"name": name}
        if kind.shape == "point":
            fields["at"] = self._origin(entity)
        else:
            fields |= self._box(entity, kind.shape)
        known = ["targetname"] if kind.shape != "point" else ["origin"]
        if kind.targets or kind.spot:
            known += [key for key, _ in self._targets(entity)]
        if kind.targets:
            fields[kind.targets] = self._told(entity)
            self._lines[(*path, kind.targets)] = entity.line_of("target")
        if kind.spot:
            fields["to"] = self._spot(entity, kind.spot)
            self._lines[(*path, "to")] = entity.line_of("target")
        if kind.field == "springs" and "velocity" not in entity.keys and "speed" in entity.keys:
            fields["velocity"] = self._push(entity)
            known += ["speed", "angle"]
        if kind.has_material and entity.brushes:
            fields |= self._made_of(entity.brushes[0])
        fields |= self._values(entity, kind.keys, *known)
        self._remember(entity, path, kind.keys)
        self._fields[kind.field].append(fields)

    def _remember(self, entity: Entity, path: FieldPath, keys: Mapping[str, Key]) -> None:
        """Remember where the fields at a path come from."""
        if path:
            self._lines[path] = entity.line
        for text, key in keys.items():
            if text in entity.keys:
                self._lines[(*path, key.field)] = entity.line_of(text)

    # Keys -----------------------------------------------------------------------------------------

    def _values(self, entity: Entity, keys: Mapping[str, Key], *known: str) -> dict[str, Any]:
        """Return the fields that keys say; note the keys that neither these nor others read."""
        self._note_unknown(entity, [*keys, *known])
        return self._known(entity, keys)

    def _known(self, entity: Entity, keys: Mapping[str, Key]) -> dict[str, Any]:
        values = {
            key.field: self._value(entity, name, key.read)
            for name, key in keys.items()
            if name in entity.keys
        }
        return {field: value for field, value in values.items() if value is not None}

    def _note_unknown(self, entity: Entity, known: Iterable[str]) -> None:
        understood = {*known, *EDITOR_KEYS}
        for name in entity.keys:
            if not (name in understood or name.startswith(EDITOR_PREFIX)):
                what = f"unknown key {quoted(name)} of {quoted(entity.classname)} is left out"
                self._note(entity.line_of(name), what)

    def _value(self, entity: Entity, name: str, read: Any) -> Any:
        try:
            return read(entity.keys[name])
        except ValueError as error:
            found = f"found {quoted(entity.keys[name])}; wanted {error}"
            self._problem(entity.line_of(name), found, entity.classname, name)
            return None

    def _origin(self, entity: Entity) -> list[float]:
        if entity.brushes:
            self._problem(entity.line, "found brushes; wanted a point", entity.classname)
        if "origin" not in entity.keys:
            self._problem(entity.line, "missing; wanted 3 numbers", entity.classname, "origin")
            return [0.0, 0.0, 0.0]
        return self._value(entity, "origin", read_point) or [0.0, 0.0, 0.0]

    def _told(self, entity: Entity) -> list[str]:
        """Return the names of the pieces that an entity targets."""
        names: list[str] = []
        for key, target in self._targets(entity):
            if target in self._receivers:
                names += self._receivers[target]
                self._links += len(self._receivers[target])
                if self._links > MAX_LINKS:
                    self._problem(
                        entity.line, f"more than {MAX_LINKS} targets; allowed are so many"
                    )
                    self._refuse()
                continue
            known = tuple(self._receivers)
            there = f"there are {listed(known)}" if known else "there is none"
            message = f"no gate, platform or fan has the targetname {quoted(target)}; {there}"
            line, path = entity.line_of(key), (entity.classname, key)
            self._problem(line, message, *path, written=target, known=known)
        if not any(True for _ in self._targets(entity)):
            message = "missing; wanted the targetname of a gate, a platform or a fan"
            self._problem(entity.line, message, entity.classname, "target")
        return list(dict.fromkeys(names))

    def _spot(self, entity: Entity, classname: str) -> list[float]:
        """Return the place that an entity targets."""
        targets = [target for _, target in self._targets(entity)]
        places = [
            self._spots[classname, name] for name in targets if (classname, name) in self._spots
        ]
        count = sum(map(len, places))
        if count != 1:
            known = tuple(name for kind, name in self._spots if kind == classname and name)
            written = targets[0] if targets and not places else ""
            message = f"found {count} {classname} of the targetname; wanted one"
            line, path = entity.line_of("target"), (entity.classname, "target")
            self._problem(line, message, *path, written=written, known=known)
            return [0.0, 0.0, 0.0]
        return [*places[0][0]]  # of its own, or YAML would write an alias

    def _push(self, entity: Entity) -> list[float]:
        """Return the velocity of Quake's ``speed`` and ``angle``: a yaw, or -1 up, or -2 down."""
        number = Key("", "number").read
        speed = self._value(entity, "speed", number) or 0.0
        angle = self._value(entity, "angle", number) if "angle" in entity.keys else 0.0
        if angle in (-1, -2):
            return [0.0, 0.0, speed if angle == -1 else -speed]
        yaw = math.radians(angle or 0.0)
        return [tidy(speed * math.cos(yaw)), tidy(speed * math.sin(yaw)), 0]

    # Brushes --------------------------------------------------------------------------------------

    def _body(self, brush: Brush) -> Block | Hull | None:
        try:
            return body_of(brush)
        except BrushError as error:
            self._problem(brush.line, str(error))
            return None

    def _box(self, entity: Entity, shape: str) -> dict[str, Any]:
        """Return ``at``, ``size`` and perhaps ``yaw_deg`` of an entity with brushes."""
        bodies = [body for brush in entity.brushes if (body := self._body(brush)) is not None]
        if not entity.brushes:
            self._problem(entity.line, "found no brush; wanted at least one", entity.classname)
        if not bodies:
            return {}
        if len(bodies) == 1 and isinstance(bodies[0], Block):
            block = bodies[0]
            yaw, *others = block.angles
            if others == [0.0, 0.0] and (yaw == 0.0 or shape == "turned"):
                turn = {"yaw_deg": yaw} if yaw != 0.0 else {}
                return {"at": _tidy(block.at), "size": _tidy(block.size), **turn}
        what = "no box that at most a yaw turns" if shape == "turned" else "no upright box"
        self._note(
            entity.line,
            f"the body of {quoted(entity.classname)} is {what}: it is the box round it",
        )
        corners: Float64 = np.concatenate([body.corners for body in bodies])
        low, high = corners.min(axis=0), corners.max(axis=0)
        return {"at": _tidy(((low + high) / 2).tolist()), "size": _tidy((high - low).tolist())}

    def _made_of(self, brush: Brush) -> dict[str, str]:
        """Return the field ``material``, if it is not by default."""
        material = self._material(brush)
        return {} if material == "default" else {"material": material}

    def _material(self, brush: Brush) -> str:
        """Return the material of the face that looks up most, where the ball would roll."""
        texture = max(brush.faces, key=lambda face: _upwards(face.points)).texture
        if len({face.texture for face in brush.faces}) > 1:
            what = "brushes with several textures are of the material of their upper face"
            self._note(brush.line, what)
        name = texture.replace("\\", "/").rpartition("/")[2]
        for known in (name, name.lower()):
            if known in self._materials or known in MATERIALS:
                self._used.add(known)
                return known
        if texture != NO_TEXTURE:
            self._note(brush.line, f"unknown texture {quoted(texture)} is of the material default")
        return "default"


def _kind_of(entity: Entity) -> Kind | None:
    return KINDS.get(QUAKE_NAMES.get(entity.classname, entity.classname))


def _upwards(points: Sequence[tuple[float, float, float]]) -> float:
    """Return how much the face through three points looks up: -1 to 1."""
    (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = points
    ax, ay, az, bx, by, bz = x0 - x1, y0 - y1, z0 - z1, x2 - x1, y2 - y1, z2 - z1
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return z / max(math.hypot(x, y, z), 1e-300)


def _tidy(values: Sequence[float]) -> list[float]:
    return [tidy(value) for value in values]


def _times(lines: Sequence[int]) -> str:
    return f" ({len(lines)} times)" if len(lines) > 1 else ""


def _level_name(filename: str) -> str:
    stem = Path(filename).stem
    return stem if re.fullmatch(NAME_PATTERN, stem) else _proper(stem)


def _proper(text: str) -> str:
    """Return a name as like a text as names can be."""
    name = _NO_NAME.sub("_", text)[:_LONGEST_NAME]
    return name if name[:1].isalpha() else f"m{name}"
