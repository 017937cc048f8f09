"""Text of a `.map` file -> entities with their keys, and brushes of planes, each with its line.

Quake's format in two dialects, which differ in how a face says where its texture lies: Standard
(five numbers) and Valve 220 (two axes in brackets and three numbers). Where a texture lies is of no
matter here and is read over. Coordinates are in map units, x forward, y left, z up.
"""

from __future__ import annotations

import bisect
import math
import re
from dataclasses import dataclass
from typing import Final, NoReturn

from roller_env.level.errors import LevelError
from roller_env.problems import Problem, quoted

MAX_BYTES: Final = 4 * 1024 * 1024
MAX_ENTITIES: Final = 20_000
MAX_BRUSHES: Final = 20_000
MAX_PLANES: Final = 128
"""Faces of one brush: the work that a brush can make grows with their cube."""

MAX_COORDINATE: Final = 200_000.0
"""Map units: a little more than a level may be large."""

Triple = tuple[float, float, float]

# Every repetition ends at a character that it cannot hold itself: matching takes linear time.
_BLANK: Final = re.compile(r"(?:\s++|//[^\n]*+)*+")
_STRING: Final = re.compile(r'"((?:[^"\\\n]|\\[^\n])*)"')
_POINT: Final = r"\(\s*([^\s()]+)\s+([^\s()]+)\s+([^\s()]+)\s*\)\s*"
_AXIS: Final = r"\[\s*([^\s\[\]]+)\s+([^\s\[\]]+)\s+([^\s\[\]]+)\s+([^\s\[\]]+)\s*\]\s*"
_FACE: Final = re.compile(_POINT * 3)
_TEXTURE: Final = re.compile(r'"([^"\n]*)"|([^\s"]+)')
_AXES: Final = re.compile(r"\s*" + _AXIS * 2)
_NUMBERS: Final = re.compile(r"(?:[^\S\n]+[^\s()\[\]{}/]+){0,8}")
_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_WORD: Final = re.compile(r"\S{1,64}")
_ESCAPE: Final = re.compile(r'\\(["\\n])')

_STANDARD: Final = (5, 8)
_VALVE: Final = (3, 6)
"""How many numbers end a face: with those of Quake 2, three more, which are read over."""


@dataclass(frozen=True, slots=True)
class Face:
    """A side of a brush.

    Attributes:
        points: three points of its plane, map units; seen from outside they go round clockwise.
        texture: the name of what is painted on it.
        line: of the file, from 1.
    """

    points: tuple[Triple, Triple, Triple]
    texture: str
    line: int


@dataclass(frozen=True, slots=True)
class Brush:
    """A convex body: what is behind all of its faces.

    Attributes:
        faces: at least four.
        line: where it begins, from 1.
    """

    faces: tuple[Face, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Entity:
    """A thing of the map: keys with their values, and its brushes, if it has a body.

    Attributes:
        keys: the values by their keys.
        key_lines: the line of each key, from 1.
        brushes: its body.
        line: where it begins, from 1.
    """

    keys: dict[str, str]
    key_lines: dict[str, int]
    brushes: tuple[Brush, ...]
    line: int

    @property
    def classname(self) -> str:
        """What it is; empty if it does not say."""
        return self.keys.get("classname", "")

    def line_of(self, key: str) -> int:
        """Return the line of a key; of one that it does not have, where it begins itself."""
        return self.key_lines.get(key, self.line)


def parse_entities(text: str, filename: str) -> tuple[Entity, ...]:
    """Return the entities of a map in the order of the file.

    Args:
        text: of the file.
        filename: what errors call it.

    Raises:
        LevelError: it is no map, or too much of one; says at which line.
    """
    if len(text) > MAX_BYTES:
        message = f"the map is too large; allowed are at most {MAX_BYTES} bytes"
        raise LevelError([Problem((), message, filename)])
    return _Reader(text, filename).entities()


class _Reader:
    """Reads a text from the beginning to the end, once."""

    def __init__(self, text: str, filename: str) -> None:
        self._text, self._filename, self._at = text, filename, 0
        self._ends = [match.start() for match in re.finditer("\n", text)]
        self._brushes = 0
        self._skip()

    def entities(self) -> tuple[Entity, ...]:
        found: list[Entity] = []
        while self._at < len(self._text):
            if len(found) == MAX_ENTITIES:
                self._refuse(f"found more than {MAX_ENTITIES} entities; allowed are that many")
            found.append(self._entity())
        return tuple(found)

    def _entity(self) -> Entity:
        line = self._line()
        self._expect("{", "wanted '{', which begins an entity")
        keys: dict[str, str] = {}
        key_lines: dict[str, int] = {}
        brushes: list[Brush] = []
        while not self._take("}"):
            if self._sees("{"):
                brushes.append(self._brush())
                continue
            key_line, at = self._line(), self._at
            key = self._string("wanted a key in quotes, a brush's '{' or the entity's '}'")
            if key in keys:
                self._refuse(f"found the key {quoted(key)} of this entity a second time", at)
            keys[key] = self._string(f"wanted the value of {quoted(key)}, in quotes on one line")
            key_lines[key] = key_line
        return Entity(keys, key_lines, tuple(brushes), line)

    def _brush(self) -> Brush:
        line, begin = self._line(), self._at
        self._brushes += 1
        if self._brushes > MAX_BRUSHES:
            self._refuse(f"found more than {MAX_BRUSHES} brushes; allowed are that many")
        self._expect("{", "wanted '{', which begins a brush")
        faces: list[Face] = []
        while not self._take("}"):
            if len(faces) == MAX_PLANES:
                self._refuse(f"found a brush of more than {MAX_PLANES} faces; allowed are so many")
            faces.append(self._face())
        if len(faces) < 4:
            self._refuse(f"found a brush of {len(faces)} faces; wanted at least 4", begin)
        return Brush(tuple(faces), line)

    def _face(self) -> Face:
        line, begin = self._line(), self._at
        points = _FACE.match(self._text, begin)
        if points is None:
            self._refuse_word(
                "wanted a face, ( x y z ) ( x y z ) ( x y z ) TEXTURE and numbers, or the brush's "
                "'}'; only the formats Standard and Valve 220 are read"
            )
        corners = [self._coordinate(word) for word in points.groups()]
        self._at = points.end()
        name = _TEXTURE.match(self._text, self._at)
        if name is None:
            self._refuse_word("wanted the name of the face's texture")
        self._at = name.end()
        axes = _AXES.match(self._text, self._at)
        if axes is not None:
            for word in axes.groups():
                self._number(word)
            # Back to the bracket's end: the numbers stand on its line.
            self._at = self._text.rindex("]", 0, axes.end()) + 1
        rest = _NUMBERS.match(self._text, self._at)
        words = rest.group().split() if rest is not None else []
        for word in words:
            self._number(word)
        wanted = _STANDARD if axes is None else _VALVE
        if len(words) not in wanted:
            self._refuse(
                f"found {len(words)} numbers after the texture {quoted(name.group())}; wanted "
                f"{wanted[0]}, on the line of the face",
                begin,
            )
        self._at += len(rest.group()) if rest is not None else 0
        self._skip()
        first, second, third = ((corners[k], corners[k + 1], corners[k + 2]) for k in (0, 3, 6))
        texture = name.group(1) if name.group(1) is not None else name.group(2)
        return Face((first, second, third), texture, line)

    def _number(self, word: str) -> float:
        value = float(word) if _NUMBER.fullmatch(word) else math.nan
        if not math.isfinite(value):
            self._refuse(f"found {quoted(word)}; wanted a number")
        return value

    def _coordinate(self, word: str) -> float:
        value = self._number(word)
        if abs(value) > MAX_COORDINATE:
            self._refuse(
                f"a coordinate of {value:g} is out of this world; allowed is "
                f"-{MAX_COORDINATE:g} to {MAX_COORDINATE:g}"
            )
        return value

    def _string(self, wanted: str) -> str:
        found = _STRING.match(self._text, self._at)
        if found is None:
            self._refuse_word(wanted)
        self._at = found.end()
        self._skip()
        return _ESCAPE.sub(lambda mark: mark.group(1).replace("n", "\n"), found.group(1))

    def _sees(self, mark: str) -> bool:
        return self._text.startswith(mark, self._at)

    def _take(self, mark: str) -> bool:
        """Go over a mark if it is there."""
        if not self._sees(mark):
            return False
        self._at += len(mark)
        self._skip()
        return True

    def _expect(self, mark: str, wanted: str) -> None:
        if not self._take(mark):
            self._refuse_word(wanted)

    def _skip(self) -> None:
        """Go over white space and comments."""
        blank = _BLANK.match(self._text, self._at)
        self._at = blank.end() if blank is not None else self._at

    def _line(self, at: int | None = None) -> int:
        return bisect.bisect_left(self._ends, self._at if at is None else at) + 1

    def _refuse_word(self, wanted: str) -> NoReturn:
        """Refuse what stands here."""
        word = _WORD.match(self._text, self._at)
        found = "the end of the file" if word is None else quoted(word.group())
        self._refuse(f"found {found}; {wanted}")

    def _refuse(self, message: str, at: int | None = None) -> NoReturn:
        at = self._at if at is None else at
        line = self._line(at)
        column = at - (self._ends[line - 2] if line > 1 else -1)
        raise LevelError([Problem((), message, self._filename, line, column)])
