"""What the ball must not touch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np
from pydantic import Field

from roller_env.pieces.fields import OptionalName, Point, Size
from roller_env.pieces.look import Paint, Shape, part
from roller_env.pieces.piece import Piece, Region, Vector, half_of
from roller_env.pieces.rules import (
    Own,
    Rules,
    Seen,
    fraction_entry,
    nearest_in_box,
    no_state,
    no_table,
    place_entry,
)
from roller_env.problems import FieldPath, Problem

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

_LAVA: Final = (Paint("hazard/", "#ff4a1cd0", emission=0.75),)


class Hazard(Piece):
    """A box without substance, such as lava or spikes: who touches it has fallen."""

    at: Point = Field(description="Its centre.")
    size: Size = Field(description="Full edge lengths.")
    name: OptionalName = None

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that the ball would start in it."""
        if around.starts_in(self.region(around.ball_radius)):
            message = "the ball would touch it at the start; wanted at least its radius away"
            yield Problem((*path, "at"), message)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield it, glowing."""
        yield Shape(part("hazard", number), "box", _LAVA, half_of(self.size), self.at)

    def label(self) -> tuple[str, Vector]:
        """Return what it is."""
        return self.name or "hazard", self.at


# Rules: that it counts as a fall is said in `roller_env.game.step` --------------------------------


def _show(now: Seen, table: None, state: None, own: Own) -> None:
    """Write the nearest place of the nearest hazard."""
    best2 = np.inf
    for region in range(own.region, own.region + own.regions):
        x, y, z = nearest_in_box(now.centre[region], now.half[region], now.ball)
        new2 = x * x + y * y + z * z
        if now.real[region] and new2 < best2:
            best2 = new2
            now.out[own.entry], now.out[own.entry + 1], now.out[own.entry + 2] = x, y, z
            now.out[own.entry + 3] = 1.0


HAZARD: Final = Rules(
    name="hazard",
    table=no_table,
    state=no_state,
    entries=(
        place_entry("hazard", "nearest place of the nearest hazard; 0 if none"),
        fraction_entry("hazard_present", "1 where `hazard` shows one"),
    ),
    show=_show,
)
Hazard.rules = HAZARD
