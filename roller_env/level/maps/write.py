"""Level -> the text of a `.map` file that TrenchBroom opens and `read_map` reads back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.level.expand import expand
from roller_env.level.maps.entities import (
    BALL,
    FINISH,
    FINISH_KEYS,
    KINDS,
    MATERIAL_KEY,
    ROUTE_KEYS,
    START,
    START_KEYS,
    TEXTURES,
    TRIGGER,
    WAYPOINT,
    WORLD,
    Key,
    Kind,
    length_text,
    number_text,
)
from roller_env.level.schema import PIECE_FIELDS, Level
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.fields import Part
from roller_env.pieces.piece import Matrix, Piece, Solid, Vector, rotation_matrix
from roller_env.problems import Problem
from roller_env.units import METRES_PER_QUANT

Keys = dict[str, str]

_DECIMALS: Final = 12
"""Of map units: more than is read, so that a box's centre is as if it had been written itself."""

_ARM: Final = 64.0
"""Map units between the points of a plane: so far that their last decimals do not tilt it."""

_SIDES: Final = [(axis, sign) for axis in range(3) for sign in (-1.0, 1.0)]


@dataclass(frozen=True)
class ExportedMap:
    """A level as a map.

    Attributes:
        text: of the file, in the format Valve 220.
        notes: what of the level is not in it.
    """

    text: str
    notes: tuple[Problem, ...]


def export_map(level: Level) -> ExportedMap:
    """Return a level as a map that `read_map` makes a level of with equal solids and pieces.

    Floors, ramps, walls and tubes become the boxes that they consist of, wedges and curved floors
    become hulls; coins come one by one.

    Args:
        level: the level, lengths in metres.
    """
    solids = [_solid(solid) for solid in expand(level).ground]
    entities = [
        _entity("worldspawn", {"mapversion": "220", **_world(level)}, solids),
        _entity(START, {"origin": _point(level.start.at), **_keys(level.start, START_KEYS)}),
        _piece(FINISH, level.finish, _keys(level.finish, FINISH_KEYS)),
        *(_entity("roller_coin", {"origin": _point(coin)}) for coin in expand(level).coins),
    ]
    for classname, kind in KINDS.items():
        if kind.shape != "point":
            for number, piece in enumerate(getattr(level, kind.field)):
                entities += _machine(classname, kind, piece, number)
    for point in level.route.points if level.route else ():
        entities.append(_entity(WAYPOINT, {"origin": _point(point)}))
    head = "// Game: Roller\n// Format: Valve\n"
    numbered = [f"// entity {number}\n{entity}" for number, entity in enumerate(entities)]
    return ExportedMap(head + "".join(numbered), tuple(_left_out(level)))


def _left_out(level: Level) -> Iterator[Problem]:
    """Yield the fields that a map cannot say."""
    said = {kind.field for kind in KINDS.values()}
    for field in PIECE_FIELDS:
        pieces = getattr(level, field)
        if field not in said and pieces and not any(True for _ in pieces[0].solids("")):
            yield Problem((field,), "maps have none of these; they are left out")


def _world(level: Level) -> Keys:
    materials = {
        f"{MATERIAL_KEY}{name}": " ".join(
            (
                number_text(material.friction),
                number_text(material.elasticity),
                material.colour,
                material.pattern,
            )
        )
        for name, material in level.materials.items()
    }
    route = _keys(level.route, ROUTE_KEYS) if level.route else {}
    return {**_keys(level, WORLD), **_keys(level.ball, BALL), **route, **materials}


def _machine(classname: str, kind: Kind, piece: Any, number: int) -> Iterator[str]:
    """Yield the entity of a piece, and that of the point which it targets."""
    keys: Keys = {"targetname": piece.name} if piece.name else {}
    if kind.targets:
        targets = enumerate(getattr(piece, kind.targets), start=1)
        keys |= {"target" if index == 1 else f"target{index}": name for index, name in targets}
    if kind.spot:
        spot = f"{kind.field}_{number}_{kind.spot}"
        keys["target"] = spot
        yield _entity(kind.spot, {"targetname": spot, "origin": _point(piece.to)})
    yield _piece(classname, piece, keys | _keys(piece, kind.keys))


def _piece(classname: str, piece: Any, keys: Keys) -> str:
    rotation = rotation_matrix(getattr(piece, "yaw_deg", 0.0))
    texture = getattr(piece, "material", TRIGGER)
    return _entity(classname, keys, [_brush(piece.at, piece.size, rotation, texture)])


def _keys(part: Part | Piece, keys: Mapping[str, Key]) -> Keys:
    """Return the keys for what of a part is given, and not by default."""
    fields, given = type(part).model_fields, part.model_fields_set
    return {
        name: key.written(value)
        for name, key in keys.items()
        if key.field in given and (value := getattr(part, key.field)) != fields[key.field].default
    }


def _entity(classname: str, keys: Keys, brushes: Iterable[str] = ()) -> str:
    lines = [f'"{key}" "{_escaped(value)}"\n' for key, value in keys.items()]
    bodies = [f"// brush {number}\n{brush}" for number, brush in enumerate(brushes)]
    return "".join(["{\n", f'"classname" "{classname}"\n', *lines, *bodies, "}\n"])


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


def _solid(solid: Solid) -> str:
    """Return a solid as a brush."""
    if not isinstance(solid, ConvexSolid):
        size = [2 * half for half in solid.half_size]
        return _brush(solid.centre, size, solid.rotation, solid.material)
    lines = []
    for side in solid.sides:
        corners, normal = np.array(side.corners), np.array(side.normal)
        edge = corners[1] - corners[0]
        edge -= (edge @ normal) * normal
        along = edge / np.linalg.norm(edge)
        lines.append(_face(corners[0] / METRES_PER_QUANT, normal, along, solid.material))
    return "".join(["{\n", *lines, "}\n"])


def _brush(at: Vector, size: Iterable[float], rotation: Matrix, texture: str) -> str:
    """Return a box, in metres, as a brush."""
    centre = np.array(at) / METRES_PER_QUANT
    half = np.array(list(size)) / METRES_PER_QUANT / 2
    axes = np.array(rotation).T
    lines = []
    for axis, sign in _SIDES:
        normal = sign * axes[axis]
        lines.append(_face(centre + half[axis] * normal, normal, axes[(axis + 1) % 3], texture))
    return "".join(["{\n", *lines, "}\n"])


def _face(point: Float64, normal: Float64, along: Float64, texture: str) -> str:
    """Return the line of a face.

    Args:
        point: (3,) on its plane, map units.
        normal: (3,) unit vector, outwards.
        along: (3,) unit vector in the plane.
        texture: the last part of its texture's name.
    """
    across = np.cross(normal, along)
    # Clockwise for whoever looks at the outside.
    corners = (point + _ARM * along, point, point + _ARM * across)
    plane = " ".join(f"( {_numbers(corner)} )" for corner in corners)
    axes = f"[ {_numbers(along)} 0 ] [ {_numbers(across)} 0 ]"
    return f"{plane} {TEXTURES}{texture} {axes} 0 1 1\n"


def _point(at: Iterable[float]) -> str:
    return " ".join(map(length_text, at))


def _numbers(values: Float64) -> str:
    return " ".join(number_text(round(float(value), _DECIMALS)) for value in values)
