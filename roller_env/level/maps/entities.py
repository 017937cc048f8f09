"""What the entities of a map stand for: the one table that import, export and tests read.

`assets/trenchbroom/Roller.fgd` says the same to the editor; a test holds it to this table.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from roller_env.units import METRES_PER_QUANT

Value = float | int | bool | str | list[float]

_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_FLAGS: Final = {"0": False, "1": True}


@dataclass(frozen=True, slots=True)
class Key:
    """How a key of an entity is a field of a piece.

    Attributes:
        field: the field's name.
        kind: what the text is; a length is in map units, and so are the three of ``lengths``.
    """

    field: str
    kind: Literal["number", "length", "lengths", "numbers", "jitter", "whole", "flag", "word"]

    def read(self, text: str) -> Value:
        """Return the value that a text says.

        Raises:
            ValueError: it says none; the text of the error is what would be right.
        """
        return _READERS[self.kind](text)

    def written(self, value: Any) -> str:
        """Return the text of a field of a `Level`, whose lengths are in metres."""
        if self.kind in ("lengths", "jitter"):
            return " ".join(map(length_text, value))
        if self.kind == "numbers":
            return " ".join(map(number_text, value))
        if self.kind == "length":
            return length_text(value)
        if self.kind == "flag":
            return "1" if value else "0"
        return value if isinstance(value, str) else number_text(value)


@dataclass(frozen=True, slots=True)
class Kind:
    """What a classname stands for.

    Attributes:
        field: the field of a level for the pieces of this kind.
        shape: ``point`` for an entity with an origin; of those with brushes ``upright`` are taken
            for the box round their brushes, ``turned`` also for one that a yaw turns.
        keys: its keys besides ``classname``, ``origin``, ``targetname`` and targets.
        targets: the field for the names of what it targets; empty if it targets nothing.
        spot: the classname of the point that it targets; empty if it targets none.
        is_named: whether the piece must have a name.
        receives: whether others target it.
        has_material: whether its brush's texture is its material.
    """

    field: str
    shape: Literal["point", "upright", "turned"] = "upright"
    keys: Mapping[str, Key] = dataclasses.field(default_factory=dict)
    targets: str = ""
    spot: str = ""
    is_named: bool = False
    receives: bool = False
    has_material: bool = False


WORLD: Final[dict[str, Key]] = {
    "message": Key("title", "word"),
    "description": Key("description", "word"),
    "gravity": Key("gravity", "length"),
    "kill_height": Key("kill_height", "length"),
    "falls": Key("falls", "word"),
    "time_limit_s": Key("time_limit_s", "number"),
    "par_time_s": Key("par_time_s", "number"),
}
"""Keys of ``worldspawn``."""

BALL: Final[dict[str, Key]] = {
    "ball_radius": Key("radius", "length"),
    "ball_mass_kg": Key("mass_kg", "number"),
    "ball_friction": Key("friction", "number"),
    "ball_elasticity": Key("elasticity", "number"),
}
"""Keys of ``worldspawn`` for fields of the ball."""

MATERIAL_KEY: Final = "material_"
"""A key of ``worldspawn`` that begins so defines a material: friction, elasticity, colour and
pattern."""

START: Final = "info_player_start"
START_KEYS: Final[dict[str, Key]] = {"jitter": Key("jitter", "jitter")}

FINISH: Final = "roller_finish"
FINISH_KEYS: Final[dict[str, Key]] = {"needs_coins": Key("needs_coins", "whole")}

WAYPOINT: Final = "roller_waypoint"
"""A point of the route, in the order of the file."""

ROUTE_KEYS: Final[dict[str, Key]] = {"route_radius": Key("radius", "length")}
"""Keys of ``worldspawn`` for fields of the route."""

_NEEDS: Final = Key("needs", "word")

KINDS: Final[dict[str, Kind]] = {
    "roller_coin": Kind("coins", "point"),
    "roller_plate": Kind(
        "plates",
        keys={"speed": Key("speed", "length"), "sinks_to": Key("sinks_to", "length")},
        targets="opens",
        is_named=True,
    ),
    "roller_switch": Kind(
        "switches",
        keys={"mode": Key("mode", "word"), "duration_s": Key("duration_s", "number")},
        targets="sets",
    ),
    "roller_gate": Kind(
        "gates",
        "turned",
        keys={
            "speed": Key("speed", "length"),
            "lowers_to": Key("lowers_to", "length"),
            "needs": _NEEDS,
            "closes": Key("closes", "flag"),
        },
        is_named=True,
        receives=True,
    ),
    "roller_platform": Kind(
        "platforms",
        "turned",
        keys={
            "speed": Key("speed", "length"),
            "wait": Key("wait_s", "number"),
            "returns": Key("returns", "flag"),
            "needs": _NEEDS,
        },
        spot="path_corner",
        is_named=True,
        receives=True,
        has_material=True,
    ),
    "roller_fan": Kind(
        "fans",
        keys={
            "force_n": Key("force_n", "numbers"),
            "blows": Key("blows", "flag"),
            "needs": _NEEDS,
        },
        receives=True,
    ),
    "roller_lift_pad": Kind(
        "lift_pads",
        keys={"force_n": Key("force_n", "number"), "duration_s": Key("duration_s", "number")},
    ),
    "roller_spring": Kind("springs", keys={"velocity": Key("velocity", "lengths")}),
    "roller_bumper": Kind("bumpers", keys={"speed": Key("speed", "length")}),
    "roller_teleporter": Kind("teleporters", spot="info_teleport_destination"),
    "roller_hazard": Kind("hazards"),
    "roller_checkpoint": Kind("checkpoints"),
}
"""By classname."""

QUAKE_NAMES: Final = {
    "trigger_hurt": "roller_hazard",
    "trigger_teleport": "roller_teleporter",
    "trigger_push": "roller_spring",
}
"""What Quake calls a thing, and what it is here."""

SOLIDS: Final = ("worldspawn", "func_detail", "func_wall", "func_group")
"""Classnames whose brushes are solid and stand still. ``func_group`` is how TrenchBroom writes its
groups and layers."""

SPOTS: Final = ("path_corner", "info_teleport_destination")

EDITOR_KEYS: Final = ("classname", "mapversion", "wad")
EDITOR_PREFIX: Final = "_tb_"
"""Keys that are the editor's own, of no meaning to a level."""

MATERIALS: Final[dict[str, dict[str, Value]]] = {
    "default": {},
    "glass": {},
    "hall": {"colour": "#2a9d8f", "pattern": "checker"},
    "wall": {"colour": "#46566e", "pattern": "grid"},
    "brick": {"colour": "#9c5a3c", "pattern": "grid"},
    "ice": {"friction": 0.1, "colour": "#dff4ff"},
    "sand": {"friction": 2.0, "colour": "#d9b26f"},
}
"""Materials by the names of textures; what every level has needs no fields."""

TEXTURES: Final = "roller/"
"""Where ``assets/trenchbroom`` has the textures: what their names begin with in a map. Reading one,
only what follows the last slash counts."""

TRIGGER: Final = "trigger"
"""Texture of what is not solid, or is no material."""

NO_TEXTURE: Final = "__TB_empty"
"""What TrenchBroom calls a face without a texture: of the material ``default``."""


def number_text(value: float) -> str:
    """Return a number as text that reads as the same one, without a point if it is whole."""
    whole = round(value)
    return str(whole) if value == whole else repr(float(value))


def length_text(metres: float) -> str:
    """Return a length in map units, to 9 decimals."""
    return number_text(round(metres / METRES_PER_QUANT, 9) + 0.0)


def tidy(value: float) -> float | int:
    """Return a number for a level file: a whole one without a point."""
    rounded = round(value, 9)
    return int(rounded) if rounded == int(rounded) else rounded


def _number(text: str) -> float:
    if not _NUMBER.fullmatch(text.strip()) or abs(float(text)) > 1e9:
        raise ValueError("a number")
    value = float(text)
    return int(value) if value == int(value) else value


def _numbers(count: int) -> Callable[[str], list[float]]:
    def read(text: str) -> list[float]:
        words = text.split(maxsplit=count)
        if len(words) != count:
            raise ValueError(f"{count} numbers")
        return [_number(word) for word in words]

    return read


def _whole(text: str) -> int:
    value = _number(text)
    if not isinstance(value, int):
        raise ValueError("a whole number")
    return value


def _flag(text: str) -> bool:
    if text not in _FLAGS:
        raise ValueError("0 or 1")
    return _FLAGS[text]


_READERS: Final[dict[str, Callable[[str], Value]]] = {
    "number": _number,
    "length": _number,
    "lengths": _numbers(3),
    "numbers": _numbers(3),
    "jitter": _numbers(2),
    "whole": _whole,
    "flag": _flag,
    "word": str,
}

read_point: Final = _numbers(3)
"""Read an ``origin``, map units."""
