"""Level -> the plain shapes that its pieces stand for: solids, coins, movers, regions.

Whatever asks what is where in a level reads it here: the checks, both engines, the rules, pictures
and maps.
"""

from __future__ import annotations

import weakref
from collections import defaultdict
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.pieces.coin import coin_shapes
from roller_env.pieces.look import Shape
from roller_env.pieces.piece import ExpandedLevel, Mover, Piece, Region, Solid, number_of

if TYPE_CHECKING:
    from roller_env.level.schema import Level

TOUCH_TOLERANCE_M: Final = 1e-4
"""Soft contacts hold surfaces this near to each other; nearer counts as touching."""


_EXPANDED: Final[dict[int, ExpandedLevel]] = {}
"""By the level's identity, as long as the level lives: it never changes."""


def expand(level: Level) -> ExpandedLevel:
    """Return what a level consists of; the same object whenever it is asked for again."""
    known = _EXPANDED.get(id(level))
    if known is None:
        known = _EXPANDED[id(level)] = _expand(level)
        weakref.finalize(level, _EXPANDED.pop, id(level), None)
    return known


def _expand(level: Level) -> ExpandedLevel:
    touch = level.ball.radius + TOUCH_TOLERANCE_M
    solids: list[Solid] = []
    decks: list[Solid] = []
    pipes: list[Solid] = []
    movers: list[Mover] = []
    mover_kinds: list[type[Piece]] = []
    coins: list[Float64] = [np.zeros((0, 3))]
    coin_sources: list[str] = []
    regions: dict[type[Piece], list[Region]] = defaultdict(list)
    pieces: dict[type[Piece], list[Piece]] = defaultdict(list)
    for source, piece in level.pieces():
        pieces[type(piece)].append(piece)
        still = list(piece.solids(source))
        solids += still
        (pipes if piece.is_pipe else decks).extend(solid for solid in still if solid.material)
        mover, region, own = piece.mover(source), piece.region(touch), piece.coins()
        if mover is not None:
            movers.append(mover)
            mover_kinds.append(type(piece))
        if region is not None:
            regions[type(piece)].append(region)
        coins.append(own)
        coin_sources += [source] * len(own)
    return ExpandedLevel(
        solids=tuple(solids),
        movers=tuple(movers),
        mover_kinds=tuple(mover_kinds),
        decks=tuple(decks),
        pipes=tuple(pipes),
        coins=np.concatenate(coins).astype(np.float64),
        coin_sources=tuple(coin_sources),
        regions={kind: tuple(found) for kind, found in regions.items()},
        pieces={kind: tuple(found) for kind, found in pieces.items()},
    )


def shapes(level: Level) -> Iterator[Shape]:
    """Yield what is seen of a level besides its solids: of every piece, and the coins."""
    for source, piece in level.pieces():
        yield from piece.looks(number_of(source))
    yield from coin_shapes(expand(level).coins)
