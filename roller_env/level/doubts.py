"""What a level may mean and hardly ever should: shown when it is loaded, and never fatal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from roller_env.level.check import starts, surroundings
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.pieces.piece import TOUCHING_M, Solid, path_of
from roller_env.pieces.space import held_up, inside
from roller_env.pieces.words import InUnit, Unit, coin_groups
from roller_env.problems import Problem

_STARTS = 5
"""Places tried along each axis of the jitter; its corners and middle are among them."""


def level_warnings(level: Level, unit: Unit = "metre") -> list[Problem]:
    """Return what is strange about a level that `check_level` finds nothing wrong with.

    Args:
        level: the level.
        unit: the unit in which messages give lengths: the one the designer wrote.

    Returns:
        The doubts, without places in a file; empty for a level without any.
    """
    in_unit, everything = InUnit(unit), expand(level).at_the_start
    around = surroundings(level, in_unit, expand(level).solids)
    return [
        *_start(level, everything, in_unit),
        *_coins(level, everything, in_unit),
        *(p for source, piece in level.pieces() for p in piece.doubts(path_of(source), around)),
    ]


def _start(level: Level, everything: Sequence[Solid], in_unit: InUnit) -> Iterator[Problem]:
    at, jitter = np.array([level.start.at]), level.start.jitter
    radius, lowest = level.ball.radius, level.kill_height
    if not held_up(everything, at, radius, lowest).all():
        limit = in_unit.length(lowest)
        message = f"nothing is under the middle of the ball down to the kill height, {limit}"
        yield Problem(("start", "at"), message)
    elif any(jitter):
        places = starts(level, _STARTS)
        past = ~held_up(everything, places, radius, lowest)
        if past.any():
            where = in_unit.point(places[past][0].tolist())
            message = f"takes the ball past an edge, as at {where}; wanted ground under all of it"
            yield Problem(("start", "jitter"), message)


def _coins(level: Level, everything: Sequence[Solid], in_unit: InUnit) -> Iterator[Problem]:
    positions, sources = expand(level).coins, expand(level).coin_sources
    around: dict[int, str] = {}
    for solid, indices in inside(everything, positions, -TOUCHING_M):
        around.update(dict.fromkeys(indices.tolist(), solid.source))
    buried = np.array(sorted(around), dtype=np.intp)
    for path, text, first in coin_groups(buried, positions, sources, in_unit):
        yield Problem(path, f"{text} inside {around[first]}; wanted in free space")
