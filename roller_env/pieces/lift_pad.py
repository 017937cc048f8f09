"""A pad that throws the ball up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from pydantic import Field

from roller_env.pieces.fields import Number, OptionalName, Point, Seconds, Size
from roller_env.pieces.look import ACTIVE, IDLE, LIGHT, Shape, part, states
from roller_env.pieces.piece import TOUCHING_M, UNTURNED, Piece, Region, Solid, Vector, half_of
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

_PAINT: Final = states("pad", ("#27b5e8", 0.25), ("#8decff", 0.7))


class LiftPad(Piece):
    """A solid pad that throws whatever enters it upwards with a steady force for a while."""

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths.")
    force_n: Annotated[Number, Field(gt=0.0, le=1e6)] = Field(
        quants(500.0), description="Newtons, upwards; more than the ball's weight (9.8 N)."
    )
    duration_s: Seconds = Field(
        5.0, description="How long it pushes, once entered; it cannot fire again until then."
    )
    name: OptionalName = None

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield itself."""
        yield Solid(self.at, half_of(self.size), UNTURNED, "", source)

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield a disc that lights up, and a column of light to rise in."""
        x, y, z = self.at
        radius, top = 0.42 * min(self.size[:2]), z + self.size[2] / 2
        size, glow = (radius, quants(0.5), 0.0), (radius, quants(48.0), 0.0)
        yield Shape(part("pad", number), "cylinder", _PAINT, size, (x, y, top))
        at = (x, y, top + glow[1])
        name = part("glow", number)
        yield Shape(name, "cylinder", (LIGHT,), glow, at, seen_in=(ACTIVE,))

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it pushes."""
        return ACTIVE if state.thrust_s[row, number] > 0.0 else IDLE

    def label(self) -> tuple[str, Vector]:
        """Return what it does."""
        return "lift", self.at

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that it is too weak for the ball."""
        if self.force_n <= around.weight_n:
            found = f"found {self.force_n:.6g} N, which never lifts the ball"
            wanted = f"wanted more than its weight, {around.weight_n:.6g} N"
            yield Problem((*path, "force_n"), f"{found}; {wanted}")


def pad_groups(pads: Sequence[LiftPad]) -> list[int]:
    """Return, for each lift pad, the number of the first pad of those that push as one with it.

    Pads that overlap or touch, if only by way of others between them, are one pad to the ball.
    """
    middle = np.array([pad.at for pad in pads]).reshape(-1, 3)
    half = np.array([pad.size for pad in pads]).reshape(-1, 3) / 2
    low, high = middle - half, middle + half + TOUCHING_M
    first = list(range(len(pads)))
    in_x = np.argsort(low[:, 0], kind="stable")
    for place, number in enumerate(in_x.tolist()):
        beside = in_x[place + 1 : np.searchsorted(low[in_x, 0], high[number, 0], "right")]
        near = (low[beside] <= high[number]) & (low[number] <= high[beside])
        for other in beside[near.all(axis=1)].tolist():
            one, two = sorted((_root(first, number), _root(first, other)))
            first[two] = one
    return [_root(first, number) for number in range(len(pads))]


def _root(first: list[int], number: int) -> int:
    """Follow ``first`` to a number that is its own, and shorten the way for the next time."""
    while first[number] != number:
        first[number] = first[first[number]]
        number = first[number]
    return number
