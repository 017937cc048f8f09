"""What a piece may know of its level when it says what is wrong with it, or strange."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from roller_env.pieces.ground import Ground
from roller_env.pieces.piece import TOUCHING_M, Mover, Piece, Region, Solid, Vector
from roller_env.pieces.words import InUnit
from roller_env.problems import FieldPath, Problem


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The level around a piece.

    Attributes:
        pieces: all that the level has.
        start: where the ball's centre begins, metres.
        jitter: by how much that varies in x and y, metres.
        solids: what stands still; none of a level that has too many.
        ball_radius: metres.
        weight_n: of the ball, newtons.
        kill_height: metres.
        in_unit: writes lengths in the unit of the level's file.
    """

    pieces: Sequence[Piece]
    start: Vector
    jitter: tuple[float, float]
    solids: Sequence[Solid]
    ball_radius: float
    weight_n: float
    kill_height: float
    in_unit: InUnit

    @cached_property
    def names(self) -> dict[type[Piece], tuple[str, ...]]:
        """The names of the pieces, by their kind."""
        found: dict[type[Piece], list[str]] = defaultdict(list)
        for piece in self.pieces:
            name = getattr(piece, "name", None)
            if name is not None:
                found[type(piece)].append(name)
        return {kind: tuple(names) for kind, names in found.items()}

    @cached_property
    def told(self) -> frozenset[str]:
        """The names of the pieces that some other one tells something."""
        return frozenset(name for piece in self.pieces for name in piece.signals())

    def receivers(self) -> tuple[str, ...]:
        """Return the names of the pieces that can be told something."""
        return tuple(str(getattr(piece, "name", "")) for piece in self.pieces if piece.receives)

    @cached_property
    def ground(self) -> Ground:
        """What pieces stand on."""
        return Ground(lambda: self.solids)

    def too_low(self, path: FieldPath, subject: str, height: float) -> Iterator[Problem]:
        """Yield a problem if what the subject says is not above the kill height."""
        if height <= self.kill_height:
            found = f"{subject} at the height {self.in_unit.length(height)}"
            limit = self.in_unit.length(self.kill_height)
            yield Problem(path, f"{found}; wanted above the kill height, {limit}")

    def starts_in(self, region: Region) -> bool:
        """Say whether the ball may begin in a region."""
        gap = [
            max(abs(here - there) - half - play, 0.0)
            for here, there, half, play in zip(
                self.start, region.centre, region.half, (*self.jitter, 0.0), strict=True
            )
        ]
        return math.hypot(*gap) <= region.radius + TOUCHING_M

    def rises(self, piece: Piece, path: FieldPath, mover: Mover) -> Iterator[Problem]:
        """Yield a problem if a piece would move upwards to where ``path`` says that it stops."""
        length, top, end = self.in_unit.length, mover.solid.centre[2], mover.end.centre[2]
        if mover.stop <= 0.0:
            return
        found = f"found {length(end)}"
        if path[-1] not in piece.model_fields_set:
            face = self.ground.under(mover.solid)
            found = "not given, and it stands on nothing that would tell it"
            if face is not None:
                found = f"not given, so on ground at {length(face)} it is {length(end)}"
        yield Problem(path, f"{found}; wanted at most the height of 'at', {length(top)}")
