"""What changes the view."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.pieces.fields import Point, PositiveLength, Size
from roller_env.pieces.look import ACTIVE, DONE, IDLE, Paint, Run, Shape, part
from roller_env.pieces.piece import Piece, Region, half_of
from roller_env.units import quants

PANE_COLOUR: Final = "#0101c8"
PANE_ALPHA: Final = 0.70
"""`camch2`: red, green and blue, and the opacity, of a retreat trigger's pane."""

BAND_SPACING_M: Final = quants(32.0)
"""Distance between the bands that run up a retreat trigger's pane."""

BAND_SPEED_M_S: Final = quants(5.0 * 60.0)
"""`camch2` scrolls its texture by 5 units a frame: read, as the tube's, as quants."""

_PANE: Final = (Paint("trigger/", PANE_COLOUR, emission=0.4, opacity=PANE_ALPHA),)
_BAND: Final = (Paint("band/", "#6f8bffa0", emission=0.6),)


class CameraTrigger(Piece):
    """A box without substance that changes the camera when the ball touches it.

    ``overhead`` (the original's ``camch``): on every entry, 1.667 s later, mode 2.
    ``retreat`` (``camch2``): on the first entry only, at once, mode 1.
    ``first_person`` (``cam_switcher``): mode 4 when the ball's centre is within ``reach`` of
    ``at``, and from then on until something else changes it; it has no box.
    """

    kind: Literal["overhead", "retreat", "first_person"] = Field(
        description="When it fires, and what the camera does then."
    )
    at: Point = Field(description="Its centre.")
    size: Size | None = Field(
        None, description="Full edge lengths, for `overhead` and `retreat`, which need it."
    )
    reach: PositiveLength = Field(
        quants(10.0), description="For `first_person`, which is a ball and has no size."
    )

    @model_validator(mode="after")
    def _shape_fits_kind(self) -> CameraTrigger:
        if self.kind == "first_person" and self.size is not None:
            raise PydanticCustomError(
                "trigger_shape", "a first_person trigger has a reach, not a size"
            )
        if self.kind != "first_person" and self.size is None:
            raise PydanticCustomError(
                "trigger_shape", "a trigger of kind {kind} needs a size", {"kind": self.kind}
            )
        return self

    def region(self, touch: float) -> Region:
        """Return where the ball touches its box, or where its centre is within reach."""
        if self.size is None:
            return Region(self.at, (0.0, 0.0, 0.0), self.reach)
        return Region(self.at, half_of(self.size), touch)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield the blue pane of a retreat, as `camch2` shows it; the others are unseen.

        Bands of a lighter blue show that the pane's texture scrolls.
        """
        if self.kind != "retreat" or self.size is None:
            return
        x, y, z = half_of(self.size)
        alive = (IDLE, ACTIVE)
        yield Shape(part("trigger", number), "box", _PANE, (x, y, z), self.at, seen_in=alive)
        proud, bands = quants(0.2), max(1, int(self.size[2] / BAND_SPACING_M))
        half = (x + proud, y + proud, min(quants(3.0), 0.5 * z))
        height = 2.0 * (z - half[2])
        at = (self.at[0], self.at[1], self.at[2] - height / 2.0)
        for band in range(bands):
            run = Run((0.0, 0.0, height), BAND_SPEED_M_S, band / bands * height)
            name = part("band", number, band)
            yield Shape(name, "box", _BAND, half, at, seen_in=alive, motion=run)

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it can fire no more."""
        return DONE if state.trigger_spent[row, number] else IDLE
