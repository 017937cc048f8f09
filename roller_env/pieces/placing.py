"""Pieces elsewhere: the fields of one, as a file has them, moved and turned about z.

What becomes of a field is said by its type (`roller_env.pieces.fields.Role`). Fields that are not
what their type allows stay as they are written, so that reading them says what is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, get_args

from roller_env.pieces.fields import Part, Role

_QUARTERS: Final = {0.0: (1, 0), 90.0: (0, 1), 180.0: (-1, 0), 270.0: (0, -1)}
"""Cosine and sine of whole quarter turns: whole numbers, so that they keep every digit."""


class CannotTurn(ValueError):
    """Something whose edges lie along the level's axes would lie across them."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Where pieces are placed.

    Attributes:
        at: of their origin, in any unit of length.
        yaw_deg: by how much they are turned about it, from +x towards +y.
    """

    at: tuple[float, float, float] = (0, 0, 0)
    yaw_deg: float = 0

    def direction(self, x: float, y: float) -> tuple[float, float]:
        """Return a level vector turned."""
        turn = self.yaw_deg % 360.0
        if turn == 0.0:
            return x, y
        angle = math.radians(turn)
        cos, sin = _QUARTERS.get(turn, (math.cos(angle), math.sin(angle)))
        return cos * x - sin * y, sin * x + cos * y

    def inner(self, frame: Frame) -> Frame:
        """Return a frame that is given in this one."""
        x, y = self.direction(*frame.at[:2])
        at = (self.at[0] + x, self.at[1] + y, self.at[2] + frame.at[2])
        return Frame(at, self.yaw_deg + frame.yaw_deg)


def place_fields(kind: type[Part], fields: Mapping[str, Any], frame: Frame) -> dict[str, Any]:
    """Return the fields of a piece, or of a part of one, in a frame.

    Args:
        kind: its model.
        fields: as a file has them.
        frame: where to, in the unit of the file.

    Raises:
        CannotTurn: what lies along the level's axes would have to be turned by other than whole
            quarter turns.
    """
    roles = _roles(kind)
    angles = {name: 0.0 for name, role in roles.items() if role is Role.ANGLE}
    placed = {
        name: _placed(roles.get(name), value, frame, bool(angles)) for name, value in fields.items()
    }
    if not angles or not frame.yaw_deg:
        return placed
    for name in angles:
        # What has to be given and is not is told when the piece is read.
        value = fields.get(name, kind.model_fields[name].get_default())
        angles[name] = value if _is_number(value) else math.nan
    turn = _turn([angle for angle in angles.values() if not math.isnan(angle)], frame.yaw_deg)
    return placed | {n: angle + turn for n, angle in angles.items() if not math.isnan(angle)}


def _placed(role: Role | type[Part] | None, value: Any, frame: Frame, has_angle: bool) -> Any:
    if isinstance(value, list) and value and all(isinstance(v, list | Mapping) for v in value):
        return [_placed(role, item, frame, has_angle) for item in value]
    if isinstance(role, type):
        return place_fields(role, value, frame) if isinstance(value, Mapping) else value
    if role is Role.HEIGHT and _is_number(value):
        return value + frame.at[2]
    if isinstance(value, list) and len(value) in (2, 3) and all(map(_is_number, value)):
        return _vector(role, value, frame, has_angle)
    return value


def _vector(role: Role | None, value: list[Any], frame: Frame, has_angle: bool) -> list[Any]:
    (x, y), up = frame.direction(*value[:2]), value[2:]
    if role is Role.PLACE:
        return [x + frame.at[0], y + frame.at[1], *(z + frame.at[2] for z in up)]
    if role is Role.DIRECTION:
        return [x, y, *up]
    if role is not Role.EXTENT or has_angle or frame.yaw_deg % 180.0 == 0.0:
        return value
    if frame.yaw_deg % 90.0 != 0.0:
        raise CannotTurn
    return [value[1], value[0], *up]


def _turn(angles: Sequence[float], yaw_deg: float) -> float:
    """Return how far to turn angles, all of them by whole turns less, so that files allow them."""
    least = math.remainder(yaw_deg, 360.0)
    turns = (yaw_deg, least, least - 360.0, least + 360.0)
    return next((t for t in turns if all(abs(a + t) <= 360.0 for a in angles)), least)


def naming(kind: type[Part]) -> list[str]:
    """Return the fields of a model that hold names of other pieces."""
    return [name for name, role in _roles(kind).items() if role is Role.NAMES]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


@cache
def _roles(kind: type[Part]) -> dict[str, Role | type[Part]]:
    """Return what becomes of the fields of a model; of those that are parts, their models."""
    found = {}
    for name, field in kind.model_fields.items():
        role = _role([field.annotation, *field.metadata])
        if role is not None:
            found[name] = role
    return found


def _role(types: Sequence[Any]) -> Role | type[Part] | None:
    """Return the first role, or part, among types and what they consist of."""
    for kind in types:
        if isinstance(kind, Role) or (isinstance(kind, type) and issubclass(kind, Part)):
            return kind
        role = _role([*getattr(kind, "__metadata__", ()), *get_args(kind)])
        if role is not None:
            return role
    return None
