"""What a designer wants to be told and that takes seconds to find out: ``roller level check``.

Beside the doubts that every loading of a level shows (`roller_env.level.doubts`): what is out of
reach, a gate that opens and still stands in the way, a floor that is too thin for the falls of its
level, no floor at all. A warning is given only where it is sure.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from roller_env.level.check import surroundings
from roller_env.level.expand import expand
from roller_env.level.reach import Landing, Play, Reach, reach
from roller_env.level.schema import Level
from roller_env.pieces.piece import path_of
from roller_env.pieces.words import InUnit, Unit, coin_groups
from roller_env.problems import Problem

_DEEPER: Final = 1.1
"""How much farther than a step of its speed a ball comes into what it falls on. With ``fast`` it
passes a deck of 16 quants from 70 m/s on (docs/presets.md), where without this it were 73."""


def lint(level: Level, play: Play, unit: Unit = "metre") -> list[Problem]:
    """Return what is strange about a level beyond what `level_warnings` finds.

    Args:
        level: the level; `check_level` finds nothing wrong with it.
        play: how it is to be played.
        unit: the unit in which messages give lengths: the one the designer wrote.

    Returns:
        The warnings, without places in a file.
    """
    in_unit = InUnit(unit)
    if not expand(level).solids:
        message = (
            "there is no floor, nothing solid that stands still; wanted floors, boxes or ramps"
        )
        return [Problem((), message)]
    found = reach(level, play)
    around = surroundings(level, in_unit, expand(level).solids)
    problems = [
        problem
        for source, piece in level.pieces()
        for problem in piece.slow_doubts(path_of(source), around)
    ]
    if found is not None:
        problems += [
            *_out_of_reach(level, found, in_unit),
            *_thin(level, play, found, in_unit),
        ]
    return problems


def _out_of_reach(level: Level, found: Reach, in_unit: InUnit) -> Iterator[Problem]:
    why = "out of reach of a ball from the start, however it is pushed"
    if not found.finish:
        yield Problem(("finish", "at"), f"the finish is {why}")
    positions, sources = expand(level).coins, expand(level).coin_sources
    for path, text, _ in coin_groups(np.flatnonzero(~found.coins), positions, sources, in_unit):
        yield Problem(path, f"{text} {why}")
    for index in np.flatnonzero(~found.plates).tolist():
        yield Problem(("plates", index, "at"), f"the plate is {why}")


def _thin(level: Level, play: Play, found: Reach, in_unit: InUnit) -> Iterator[Problem]:
    """Yield the pieces through which the ball can fall."""
    radius = level.ball.radius
    for source, landing in found.landings.items():
        speed = math.sqrt(2.0 * level.gravity * max(landing.drop, 0.0))
        needed = 2.0 * (_depth(landing, speed, play) - radius)
        if landing.thickness < needed:
            yield Problem(
                path_of(source),
                f"the ball can fall onto it from {in_unit.length(landing.drop)} up, comes in at "
                f"{speed:.0f} m/s and may pass through its {in_unit.length(landing.thickness)} "
                f"in a physics step of {1000.0 * play.dt_s:.3g} ms; wanted at least "
                f"{in_unit.rounded_up(needed)} of thickness, or a finer physics preset",
            )


def _depth(landing: Landing, speed: float, play: Play) -> float:
    return _DEEPER * play.dt_s * speed * landing.straight
