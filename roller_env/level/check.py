"""What a level must mean, once every field of it is well formed.

What each piece says of itself, and what concerns the whole: names are taken once, materials are
known, the ball starts in free space over the kill height. Pure functions of the `Level`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from roller_env.arrays import Float64
from roller_env.level.expand import expand
from roller_env.level.schema import BUILT_IN_MATERIALS, MAX_PIECES, PIECE_FIELDS, Level
from roller_env.pieces.coin import MAX_COINS
from roller_env.pieces.piece import TOUCHING_M, Solid, path_of, rotation_matrix
from roller_env.pieces.space import MAX_SAMPLES, inside, samples
from roller_env.pieces.surroundings import Surroundings
from roller_env.pieces.words import InUnit, Unit, coin_groups
from roller_env.problems import Problem, listed, quoted


def check_level(level: Level, unit: Unit = "metre") -> list[Problem]:
    """Return everything that is wrong with the meaning of a level.

    Args:
        level: the level.
        unit: the unit in which messages give lengths: the one the designer wrote.

    Returns:
        The problems, without places in a file; empty for a level that can be played.
    """
    in_unit, too_many = InUnit(unit), list(_totals(level))
    # Expanding too many could take all memory.
    around = surroundings(level, in_unit, () if too_many else expand(level).solids)
    problems = [
        *too_many,
        *_materials(level),
        *_names(level),
        *around.too_low(("start", "at"), "the ball starts", level.start.at[2]),
        *(p for source, piece in level.pieces() for p in piece.problems(path_of(source), around)),
        *_route(level, around),
    ]
    if too_many:
        return problems
    everything = expand(level).at_the_start
    return [
        *problems,
        *_start(level, everything, in_unit),
        *_coins(level, in_unit),
    ]


def surroundings(level: Level, in_unit: InUnit, solids: Sequence[Solid]) -> Surroundings:
    """Return what a piece may know of its level, in which ``solids`` stand still."""
    return Surroundings(
        pieces=[piece for _, piece in level.pieces()],
        start=level.start.at,
        jitter=level.start.jitter,
        solids=solids,
        ball_radius=level.ball.radius,
        weight_n=level.ball.mass_kg * level.gravity,
        kill_height=level.kill_height,
        in_unit=in_unit,
    )


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
    counts = [piece.count() for field in PIECE_FIELDS for piece in getattr(level, field)]
    solids, coins = sum(count.solids for count in counts), sum(count.coins for count in counts)
    if coins > MAX_COINS:
        path = ("coins",) if level.coins else ("floors",)
        yield Problem(path, f"found {coins} coins in all; allowed are at most {MAX_COINS}")
    if solids > MAX_PIECES:
        found = f"found {solids} pieces in all (cells of floors and panels of tubes included)"
        yield Problem((), f"{found}; allowed are at most {MAX_PIECES}")


def _materials(level: Level) -> Iterator[Problem]:
    known = tuple(dict.fromkeys((*level.materials, *BUILT_IN_MATERIALS)))
    for source, piece in level.pieces():
        for path, name in piece.materials():
            if name not in known:
                message = f"no material is called {quoted(name)}; there are {listed(known)}"
                where = (*path_of(source), *path)
                yield Problem(where, message, written=name, known=known)


def _names(level: Level) -> Iterator[Problem]:
    taken: dict[str, str] = {}
    for source, piece in level.pieces():
        name = getattr(piece, "name", None)
        if name in taken:
            message = f"{taken[name]} already has this name; wanted one of its own"
            yield Problem((*path_of(source), "name"), message)
        elif name is not None:
            taken[name] = source


def _route(level: Level, around: Surroundings) -> Iterator[Problem]:
    for index, point in enumerate(level.route.points if level.route is not None else ()):
        yield from around.too_low(("route", "points", index), "the waypoint is", point[2])


def starts(level: Level, most: int = MAX_SAMPLES) -> Float64:
    """Return places, (n, 3) metres, where the ball may start, a radius apart if ``most`` allow."""
    x, y = (samples(half, level.ball.radius, most) for half in level.start.jitter)
    xs, ys = np.meshgrid(x, y, indexing="ij")
    offsets = np.stack([xs, ys, np.zeros_like(xs)], axis=-1).reshape(-1, 3)
    places: Float64 = np.array(level.start.at) + offsets
    return places


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


def _coins(level: Level, in_unit: InUnit) -> Iterator[Problem]:
    positions, sources = expand(level).coins, expand(level).coin_sources
    low = np.flatnonzero(positions[:, 2] <= level.kill_height)
    limit = in_unit.length(level.kill_height)
    for path, text, _ in coin_groups(low, positions, sources, in_unit):
        yield Problem(path, f"{text} not above the kill height, {limit}; move it up")
