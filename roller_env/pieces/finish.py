"""The end of a level."""

from __future__ import annotations

from typing import Final

from roller_env.pieces.fields import Point, Size
from roller_env.pieces.piece import Piece, Region, half_of
from roller_env.pieces.rules import Own, Rules, Seen, no_state, no_table, place_entry, show_place


class Finish(Piece):
    """The end of the level: a box without substance."""

    at: Point
    size: Size

    def region(self, touch: float) -> Region:
        """Return where the ball touches it."""
        return Region(self.at, half_of(self.size), touch)


# Rules: that it ends the game is said in `roller_env.game.step` -----------------------------------


def _show(now: Seen, table: None, state: None, own: Own) -> None:
    show_place(now.out, own.entry, now.centre[own.region], now.ball)


FINISH: Final = Rules(
    name="finish",
    table=no_table,
    state=no_state,
    entries=(place_entry("finish", "centre of the finish"),),
    show=_show,
)
Finish.rules = FINISH
