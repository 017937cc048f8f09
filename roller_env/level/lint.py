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

from roller_env.level.expand import expand
from roller_env.level.reach import Landing, Play, Reach, reach
from roller_env.level.schema import Level
from roller_env.level.spans import EDGE, free_spans
from roller_env.level.words import InUnit, Unit, coin_groups
from roller_env.pieces.piece import path_of
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
    problems = [*_gates(level, in_unit)]
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


def _gates(level: Level, in_unit: InUnit) -> Iterator[Problem]:
    """Yield the gates that stand in the way of a ball on the ground also when they are open."""
    static, radius = expand(level).solids, level.ball.radius
    for index, gate in enumerate(level.gates):
        wide = math.hypot(gate.size[0], gate.size[1]) / 2 + 2.0 * radius
        near = [solid for solid in static if _is_near(solid.centre, solid.half_size, gate.at, wide)]
        spans = free_spans(near, radius, np.array([gate.at[:2]]))
        if spans is None:
            continue
        low, high = (gate.at[k] - wide for k in (0, 1)), (gate.at[k] + wide for k in (0, 1))
        around = spans.window(tuple(low), tuple(high))
        around = around[spans.is_support[around] & (spans.kind[around] != EDGE)]
        ground = spans.floor[around] - radius
        half = gate.size[2] / 2
        in_the_way = (ground < gate.at[2] + half) & (ground + 2 * radius > gate.at[2] - half)
        if not in_the_way.any():
            continue
        # The ground on which most of it stands out.
        level_of_it = float(np.median(ground[in_the_way]))
        left = gate.lowers_to + half - level_of_it
        if left < radius or gate.lowers_to - half > level_of_it + 2 * radius:
            continue
        found = "found" if "lowers_to" in gate.model_fields_set else "not given, so it is found"
        yield Problem(
            ("gates", index, "lowers_to"),
            f"{found} {in_unit.length(gate.lowers_to)}, where the open gate still stands "
            f"{in_unit.length(left)} over the ground; wanted at most "
            f"{in_unit.length(level_of_it - half)}, which leaves the way free",
        )


def _is_near(
    centre: tuple[float, ...], half: tuple[float, ...], at: tuple[float, ...], wide: float
) -> bool:
    away = math.dist(centre[:2], at[:2])
    return away <= wide + math.hypot(*half)


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
