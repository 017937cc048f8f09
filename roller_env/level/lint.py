"""What a designer wants to be told and that takes seconds to find out: ``roller level check``.

Beside the doubts that every loading of a level shows (`roller_env.level.doubts`): what is out of
reach, a gate that opens and still stands in the way, a floor that is too thin for the falls of its
level, a ball that MuJoCo cannot roll well, no floor at all. A warning is given only where it is
sure.
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

_SLIPS: Final = 3.5
"""A push of so many times what friction holds lets MuJoCo's soft contact lift the ball."""

_LIFTS_M_S2: Final = 1.0
"""Friction coefficient times the push's acceleration from which on that is seen. Two keys held for
3 s with `default`: 0.2 lifts a ball by 1 cm, 0.7 by 4 cm, 7 by 2 m, 240 by 50 m."""

_GRIPS: Final = 1.0
"""Friction coefficient from which on MuJoCo's presets end a skid late: at 1 ``default`` takes 1.4
times as long as Coulomb's law, at 0.6 1.04 times."""


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
    misrolled = _misrolled(level, play) if play.dt_s > 0.0 else ()
    around = surroundings(level, in_unit, expand(level).solids)
    problems = [
        problem
        for source, piece in level.pieces()
        for problem in piece.slow_doubts(path_of(source), around)
    ]
    problems += misrolled
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


def _misrolled(level: Level, play: Play) -> Iterator[Problem]:
    """Yield on which materials MuJoCo rolls the ball far from Coulomb's law."""
    ball = level.ball
    for name in sorted({solid.material for solid in expand(level).solids}):
        material = level.materials.get(name)
        friction = ball.friction * (material.friction if material else 1.0)
        holds_n, push_m_s2 = friction * ball.mass_kg * level.gravity, play.push_n / ball.mass_kg
        where = f" on {name}" if name else ""
        if friction > 0.0 and play.push_n > _SLIPS * holds_n and friction * push_m_s2 > _LIFTS_M_S2:
            yield Problem(
                ("ball", "mass_kg"),
                f"two keys push with {play.push_n:.2g} N and friction{where} holds "
                f"{holds_n:.2g} N: the ball slips, and MuJoCo throws a ball as light as this one "
                "up from level ground; wanted more mass, or physics: rigid",
            )
        if friction >= _GRIPS:
            yield Problem(
                ("ball", "friction"),
                f"the coefficient of friction{where} is {friction:g}: with MuJoCo's presets a skid "
                f"takes longer than it should from {_GRIPS:g} on; wanted less, or physics: rigid",
            )


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
