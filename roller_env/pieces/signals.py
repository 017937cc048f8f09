"""Signals: what plates and switches tell gates, platforms and fans.

A source that is on counts as one vote for each piece that it names. A receiver makes of its votes
whether it is told to go on: with one of them, or only with those of all its sources.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, Literal

import numpy as np

from roller_env.arrays import Bool, Int64
from roller_env.pieces.piece import ExpandedLevel, Piece
from roller_env.problems import FieldPath, Problem, listed, quoted

Needs = Literal["any", "all"]
"""How many of the pieces that name a receiver have to be on."""

NEVER: Final = 10**6
"""More votes than there can be: of what nobody tells anything."""


def first_signals(levels: Sequence[ExpandedLevel]) -> dict[type[Piece], int]:
    """Return at which signal each kind of receiver begins, and under `Piece` how many there are."""
    widths: dict[type[Piece], int] = {}
    for level in levels:
        for kind, pieces in level.pieces.items():
            if kind.receives:
                widths[kind] = max(widths.get(kind, 0), len(pieces))
    first, count = dict[type[Piece], int](), 0
    # Gates first, so that theirs are known by their own numbers.
    for kind in sorted(widths, key=lambda kind: (kind.__name__ != "Gate", kind.__name__)):
        first[kind], count = count, count + widths[kind]
    return first | {Piece: count}


def votes_of(kind: type[Piece], levels: Sequence[ExpandedLevel]) -> Bool:
    """Return (L, P, S) to which signals each of a kind of source gives its vote."""
    first = first_signals(levels)
    most = max((len(level.pieces.get(kind, ())) for level in levels), default=0)
    votes = np.zeros((len(levels), most, first[Piece]), dtype=bool)
    for number, level in enumerate(levels):
        names = {
            getattr(piece, "name", ""): first[receiver] + index
            for receiver in first
            for index, piece in enumerate(level.pieces.get(receiver, ()))
        }
        for row, piece in zip(votes[number], level.pieces.get(kind, ()), strict=False):
            row[[names[name] for name in piece.signals() if name in names]] = True
    return votes


def needed_by(kind: type[Piece], levels: Sequence[ExpandedLevel]) -> Int64:
    """Return (L, P) how many votes each of a kind of receiver needs to be told to go on."""
    most = max((len(level.pieces.get(kind, ())) for level in levels), default=0)
    needed = np.full((len(levels), most), NEVER)
    for number, level in enumerate(levels):
        told = [
            name for pieces in level.pieces.values() for p in pieces for name in set(p.signals())
        ]
        for index, piece in enumerate(level.pieces.get(kind, ())):
            sources = told.count(getattr(piece, "name", ""))
            if sources:
                needed[number, index] = 1 if getattr(piece, "needs", "any") == "any" else sources
    return needed


def unknown_receivers(
    path: FieldPath, subject: str, names: Sequence[str], known: Sequence[str]
) -> Iterator[Problem]:
    """Yield a problem for what a source names that cannot be told anything.

    Args:
        path: of the source's field.
        subject: the source in words.
        names: that it gives.
        known: the receivers of the level.
    """
    none = "the level has nothing that it could tell: no gate, no platform, no fan with a name"
    if not names:
        message = f"the {subject} tells nothing; name at least one of {listed(known)}"
        yield Problem(path, message if known else none)
    for number, name in enumerate(names):
        if name not in known:
            message = (
                f"nothing that can be told is called {quoted(name)}; there are {listed(known)}"
            )
            where = (*path, number)
            yield Problem(where, message if known else none, written=name, known=tuple(known))
