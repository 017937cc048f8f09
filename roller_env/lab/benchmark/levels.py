"""Levels of any size in which the same game is played, so that only the size makes a difference.

The ball is in a walled yard that it cannot leave. What is added lies outside or hangs out of
reach, so whatever the level's size the ball meets the same walls.
"""

from __future__ import annotations

import math
from typing import Any, Final

from roller_env.level import Level

PITCH_M: Final = 3.0
"""Between the middles of neighbouring pillars: room for the ball of 0.81 m, and much to hit."""

YARD_PILLARS: Final = 54
"""Pillars in the yard: with its floor, its four walls and the ball's own they make 60 geoms."""

_ROWS, _COLUMNS = 6, 9
_PILLAR_M: Final = 1.0
_WALL_M: Final = 3.0
_WALL_THICKNESS_M: Final = 0.5
_RADIUS_M: Final = 0.4064
_COIN_SPACING_M: Final = 1.0

YARD_BOXES: Final = YARD_PILLARS + 5
"""Boxes of the smallest `level_of_boxes`: pillars, floor and four walls."""


def level_of_boxes(boxes: int) -> Level:
    """Return the yard with pillars, and further pillars beyond its walls, ``boxes`` in all.

    Raises:
        ValueError: fewer than `YARD_BOXES`.
    """
    if boxes < YARD_BOXES:
        raise ValueError(f"boxes: found {boxes}; the yard alone has {YARD_BOXES}")
    inside = [_pillar(row, column) for row in range(_ROWS) for column in range(_COLUMNS)]
    outside = [
        _pillar(_ROWS + 1 + number // _COLUMNS, number % _COLUMNS)
        for number in range(boxes - YARD_BOXES)
    ]
    return _level(f"boxes-{boxes}", boxes=[*_yard(), *inside, *outside])


def level_of_coins(coins: int) -> Level:
    """Return the yard without pillars and a square of coins, a metre apart, round its middle.

    Args:
        coins: a square number, or 0.

    Raises:
        ValueError: no square number.
    """
    side = math.isqrt(coins)
    if side * side != coins:
        raise ValueError(f"coins: found {coins}; must be a square number such as {side * side}")
    x, y = _middle()
    # Beside the lines on which the walls stand.
    grid = {
        "centre": (x + 0.5 * _COIN_SPACING_M, y + 0.5 * _COIN_SPACING_M, _RADIUS_M),
        "spacing": (_COIN_SPACING_M, _COIN_SPACING_M),
        "count": (side, side),
    }
    return _level(f"coins-{coins}", boxes=_yard(), coins=[{"grid": grid}] if coins else [])


def _level(name: str, **pieces: Any) -> Level:
    x, y = _start()
    return Level.model_validate(
        {
            "name": name,
            "start": {"at": (x, y, _RADIUS_M), "jitter": (0.5, 0.5)},
            # Over the yard, where no ball comes.
            "finish": {"at": (x, y, 100.0), "size": (1.0, 1.0, 1.0)},
            "time_limit_s": 20.0,
            **pieces,
        }
    )


def _middle() -> tuple[float, float]:
    return 0.5 * (_ROWS - 1) * PITCH_M, 0.5 * (_COLUMNS - 1) * PITCH_M


def _start() -> tuple[float, float]:
    """Return a place between four pillars."""
    return (_ROWS // 2 - 0.5) * PITCH_M, (_COLUMNS // 2 - 0.5) * PITCH_M


def _pillar(row: int, column: int) -> dict[str, Any]:
    return {
        "at": (row * PITCH_M, column * PITCH_M, 0.5 * _PILLAR_M),
        "size": (_PILLAR_M, _PILLAR_M, _PILLAR_M),
    }


def _yard() -> list[dict[str, Any]]:
    """Return the floor and the walls round all pillars of the yard."""
    x, y = _middle()
    length, width = _ROWS * PITCH_M, _COLUMNS * PITCH_M
    half_x, half_y = 0.5 * (length + _WALL_THICKNESS_M), 0.5 * (width + _WALL_THICKNESS_M)
    along_x = (length + 2.0 * _WALL_THICKNESS_M, _WALL_THICKNESS_M, _WALL_M)
    along_y = (_WALL_THICKNESS_M, width, _WALL_M)
    z = 0.5 * _WALL_M
    return [
        {"at": (x, y, -0.5), "size": (length + 2.0, width + 2.0, 1.0)},
        {"at": (x, y - half_y, z), "size": along_x},
        {"at": (x, y + half_y, z), "size": along_x},
        {"at": (x - half_x, y, z), "size": along_y},
        {"at": (x + half_x, y, z), "size": along_y},
    ]
