"""What a level must mean, once every field of it is well formed.

Links lead somewhere, the ball starts in free space over the kill height, coins can be reached,
plates can be struck, gates and pads do what they are for. Pure functions of the `Level`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from roller_env.level.expand import expand
from roller_env.level.schema import BUILT_IN_MATERIALS, MAX_PIECES, Level
from roller_env.level.space import burying, inside, starts
from roller_env.level.words import InUnit, Unit, coin_groups
from roller_env.pieces.coin import MAX_COINS, Coins
from roller_env.pieces.gate import Gate
from roller_env.pieces.piece import TOUCHING_M, Float64, Solid, rotation_matrix
from roller_env.pieces.plate import PLATE_HIT_HEIGHT_M, Plate
from roller_env.problems import FieldPath, Problem, listed, quoted

_PIECES_WITH_NAMES: Final = (
    *("floors", "boxes", "ramps", "walls", "tubes"),
    *("plates", "gates", "lift_pads"),
)


def check_level(level: Level, unit: Unit = "metre") -> list[Problem]:
    """Return everything that is wrong with the meaning of a level.

    Args:
        level: the level.
        unit: the unit in which messages give lengths: the one the designer wrote.

    Returns:
        The problems, without places in a file; empty for a level that can be played.
    """
    in_unit = InUnit(unit)
    too_many = list(_totals(level))
    problems = [
        *too_many,
        *_materials(level),
        *_names(level),
        *_links(level),
        *_heights(level, in_unit),
        *_movers(level, in_unit),
        *_lift_pads(level),
    ]
    if too_many:  # expanding them could take all memory
        return problems
    everything = expand(level).at_the_start
    return [
        *problems,
        *_tubes(level, everything),
        *_start(level, everything, in_unit),
        *_finish(level),
        *_coins(level, in_unit),
    ]


def obstacles(level: Level) -> tuple[Solid, ...]:
    """Return what no ball may begin inside of: solids as they stand at first, and the finish."""
    finish = level.finish
    x, y, z = (edge / 2 for edge in finish.size)
    block = Solid(finish.at, (x, y, z), rotation_matrix(0.0), "default", "the finish")
    return (*expand(level).at_the_start, block)


def obstructions(level: Level, blocks: Sequence[Solid], positions: Float64) -> dict[int, str]:
    """Return what a ball at each of ``positions`` would be inside of; empty where all are free.

    Args:
        level: whose ball it is.
        blocks: its `obstacles`.
        positions: (n, 3) ball centres, metres.

    Returns:
        For the index of each position that is not free, the field of the level that is there.
    """
    margin = max(level.ball.radius - TOUCHING_M, 0.0)
    found = inside(blocks, positions, margin)
    return {int(index): block.source for block, indices in found for index in indices}


def _totals(level: Level) -> Iterator[Problem]:
    """Count without expanding."""
    cells = [Counter("".join(plan.rows).replace(".", "")) for plan in level.floors]
    coins, pieces = sum(map(_coin_count, level.coins)), 0
    for plan, counts in zip(level.floors, cells, strict=True):
        for character, number in counts.items():
            cell = plan.cells[character]
            coins += number * cell.coin
            pieces += number * (2 if cell.wall > 0.0 else 1)
    pieces += sum(tube.sides for tube in level.tubes)
    for kind in ("boxes", "ramps", "walls", "plates", "gates", "lift_pads", "camera_triggers"):
        pieces += len(getattr(level, kind))
    if coins > MAX_COINS:
        path = ("coins",) if level.coins else ("floors",)
        yield Problem(path, f"found {coins} coins in all; allowed are at most {MAX_COINS}")
    if pieces > MAX_PIECES:
        found = f"found {pieces} pieces in all (cells of floors and panels of tubes included)"
        yield Problem((), f"{found}; allowed are at most {MAX_PIECES}")


def _coin_count(coins: Coins) -> int:
    if coins.grid is not None:
        return coins.grid.count[0] * coins.grid.count[1]
    row = coins.line or coins.arc
    return row.count if row is not None else 1


def _materials(level: Level) -> Iterator[Problem]:
    known = tuple(dict.fromkeys((*level.materials, *BUILT_IN_MATERIALS)))
    for path, name in _materials_used(level):
        if name not in known:
            message = f"no material is called {quoted(name)}; there are {listed(known)}"
            yield Problem((*path, "material"), message, written=name, known=known)


def _materials_used(level: Level) -> Iterator[tuple[FieldPath, str]]:
    for index, plan in enumerate(level.floors):
        for character, cell in plan.legend.items():
            yield ("floors", index, "legend", character), cell.material
    for kind in ("boxes", "ramps", "walls", "tubes"):
        for index, piece in enumerate(getattr(level, kind)):
            yield (kind, index), piece.material


def _names(level: Level) -> Iterator[Problem]:
    taken: dict[str, str] = {}
    for kind in _PIECES_WITH_NAMES:
        for index, piece in enumerate(getattr(level, kind)):
            if piece.name is None:
                continue
            if piece.name in taken:
                message = f"{taken[piece.name]} already has this name; wanted one of its own"
                yield Problem((kind, index, "name"), message)
            taken.setdefault(piece.name, f"{kind}[{index}]")


def _links(level: Level) -> Iterator[Problem]:
    gates = tuple(gate.name for gate in level.gates)
    for index, plate in enumerate(level.plates):
        if not plate.opens:
            message = f"the plate opens nothing; name at least one gate of {listed(gates)}"
            yield Problem(("plates", index, "opens"), message if gates else _NO_GATES)
        for number, name in enumerate(plate.opens):
            if name not in gates:
                message = f"no gate is called {quoted(name)}; there are {listed(gates)}"
                message = message if gates else _NO_GATES
                path = ("plates", index, "opens", number)
                yield Problem(path, message, written=name, known=gates)
    opened = {name for plate in level.plates for name in plate.opens}
    for index, gate in enumerate(level.gates):
        if gate.name not in opened:
            message = f"no plate opens the gate {quoted(gate.name)}; name it in a plate's 'opens'"
            yield Problem(("gates", index, "name"), message)


_NO_GATES: Final = "the level has no gates that a plate could open"


def _heights(level: Level, in_unit: InUnit) -> Iterator[Problem]:
    points: list[tuple[FieldPath, str, float]] = [
        (("start", "at"), "the ball starts", level.start.at[2]),
        (("finish", "at"), "the finish is", level.finish.at[2]),
    ]
    if level.route is not None:
        for index, point in enumerate(level.route.points):
            points.append((("route", "points", index), "the waypoint is", point[2]))
    limit = in_unit.length(level.kill_height)
    for path, subject, height in points:
        if height <= level.kill_height:
            found = f"{subject} at the height {in_unit.length(height)}"
            yield Problem(path, f"{found}; wanted above the kill height, {limit}")


def _movers(level: Level, in_unit: InUnit) -> Iterator[Problem]:
    for index, plate in enumerate(level.plates):
        struck_at = level.ball.radius + plate.size[2] / 2
        if struck_at < PLATE_HIT_HEIGHT_M + TOUCHING_M:
            least = 2 * (PLATE_HIT_HEIGHT_M + TOUCHING_M - level.ball.radius)
            yield Problem(
                ("plates", index, "size", 2),
                f"a ball on the plate is {in_unit.length(struck_at)} over its centre, and only "
                f"hits from more than {in_unit.length(PLATE_HIT_HEIGHT_M)} count; "
                f"wanted a plate at least {in_unit.rounded_up(least)} high",
            )
        if plate.sinks_to > plate.at[2]:
            yield _rises(plate, ("plates", index, "sinks_to"), plate.sinks_to, in_unit)
    for index, gate in enumerate(level.gates):
        if gate.lowers_to > gate.at[2]:
            yield _rises(gate, ("gates", index, "lowers_to"), gate.lowers_to, in_unit)


def _rises(mover: Plate | Gate, path: FieldPath, target: float, in_unit: InUnit) -> Problem:
    found = "found" if path[-1] in mover.model_fields_set else "not given, so it is the original's"
    allowed = f"wanted at most the height of 'at', {in_unit.length(mover.at[2])}"
    return Problem(path, f"{found} {in_unit.length(target)}; {allowed}")


def _lift_pads(level: Level) -> Iterator[Problem]:
    weight = level.ball.mass_kg * level.gravity
    for index, pad in enumerate(level.lift_pads):
        if pad.force_n <= weight:
            found = f"found {pad.force_n:.6g} N, which never lifts the ball"
            path = ("lift_pads", index, "force_n")
            yield Problem(path, f"{found}; wanted more than its weight, {weight:.6g} N")


def _tubes(level: Level, everything: Sequence[Solid]) -> Iterator[Problem]:
    sources = {solid.source for solid in everything}
    for index in range(len(level.tubes)):
        if f"tubes[{index}]" not in sources:
            message = "the opening leaves no panel of the tube; wanted a smaller one"
            yield Problem(("tubes", index, "opening"), message)


def _start(level: Level, everything: Sequence[Solid], in_unit: InUnit) -> Iterator[Problem]:
    radius, jitter = level.ball.radius, level.start.jitter
    where = " somewhere within its jitter" if any(jitter) else ""
    ball = f"the ball, of radius {in_unit.length(radius)}, would start"
    margin = max(radius - TOUCHING_M, 0.0)
    hit = dict.fromkeys(solid.source for solid, _ in inside(everything, starts(level), margin))
    if hit:
        yield Problem(
            ("start", "at"),
            f"{ball} inside {', '.join(hit)}{where}; "
            "wanted free space around it (on a floor: one radius over its upper face)",
        )
    beyond = [
        max(abs(here - there) - edge / 2 - play, 0.0)
        for here, there, edge, play in zip(
            level.start.at, level.finish.at, level.finish.size, (*jitter, 0.0), strict=True
        )
    ]
    if math.hypot(*beyond) <= radius + TOUCHING_M:
        message = f"{ball} in the finish{where}; wanted outside, at least its radius away"
        yield Problem(("start", "at"), message)


def _finish(level: Level) -> Iterator[Problem]:
    solids = expand(level).solids
    around = burying(solids, level.finish.at, level.finish.size, level.ball.radius)
    if around:
        message = f"the finish is wholly inside {', '.join(around)}, where no ball can reach it"
        yield Problem(("finish", "at"), message)


def _coins(level: Level, in_unit: InUnit) -> Iterator[Problem]:
    positions, sources = expand(level).coins, expand(level).coin_sources
    low = np.flatnonzero(positions[:, 2] <= level.kill_height)
    limit = in_unit.length(level.kill_height)
    for path, text, _ in coin_groups(low, positions, sources, in_unit):
        yield Problem(path, f"{text} not above the kill height, {limit}; move it up")
