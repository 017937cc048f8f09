"""What changes the view."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.pieces.fields import Point, PositiveLength, Size
from roller_env.pieces.piece import Piece, Region, half_of
from roller_env.units import quants


class CameraTrigger(Piece):
    """A box without substance that changes the camera when the ball touches it.

    ``overhead`` (the original's ``camch``): on every entry, 1.667 s later, mode 2.
    ``retreat`` (``camch2``): on the first entry only, at once, mode 1.
    ``first_person`` (``cam_switcher``): mode 4 when the ball's centre is within ``reach`` of
    ``at``, and from then on until something else changes it; it has no box.
    """

    kind: Literal["overhead", "retreat", "first_person"]
    at: Point
    size: Size | None = Field(None, description="For overhead and retreat.")
    reach: PositiveLength = Field(quants(10.0), description="For first_person.")

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
