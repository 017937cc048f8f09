"""A floor drawn with characters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from typing import Annotated, Any, Final

import numpy as np
from pydantic import BaseModel, Field, ValidationError, field_validator, model_validator
from pydantic_core import PydanticCustomError

from roller_env.arrays import Float64
from roller_env.pieces.fields import (
    MaterialName,
    NonNegativeLength,
    Number,
    OptionalName,
    Part,
    Point,
    PositiveLength,
)
from roller_env.pieces.piece import UNTURNED, Count, Piece, Solid
from roller_env.pieces.placing import CannotTurn, Frame
from roller_env.problems import FieldPath
from roller_env.units import quants

MAX_PLAN_CELLS: Final = 40_000

COIN_HEIGHT_M: Final = quants(16.0)
"""Height of a coin over its cell: the middle of the original's ball."""


class FloorCell(Part):
    """What one character of a floor plan stands for."""

    material: MaterialName = "default"
    coin: bool = Field(
        False, strict=True, description="Whether a coin lies on the middle of the cell."
    )
    wall: NonNegativeLength = Field(
        0.0, description="Height of a block on the cell, 0 for none; its coin lies on the block."
    )


class FloorPlan(Piece):
    """A floor drawn with characters: up the page is +x (forward), to the left is +y.

    ``#`` is floor, ``o`` floor with a coin on it, ``.`` nothing; ``legend`` adds more characters.
    """

    corner: Point = Field(
        description="The lower right corner of the plan (smallest x and y), on the upper face."
    )
    cell: PositiveLength = Field(description="Edge length of one character's square.")
    thickness: PositiveLength = Field(quants(16.0), description="Downwards from the upper face.")
    plan: Annotated[str, Field(max_length=MAX_PLAN_CELLS)] = Field(
        description="The drawing: a block of text, all rows equally long; a blank one is empty."
    )
    legend: dict[str, FloorCell] = Field(
        default_factory=dict, description="More characters, or other meanings of `#` and `o`."
    )
    name: OptionalName = None

    @classmethod
    def placed(cls, fields: Mapping[str, Any], frame: Frame) -> dict[str, Any]:
        """Return its fields in a frame: its drawing turned by quarter turns, which are all it can.

        Raises:
            CannotTurn: it would have to be turned by something else.
        """
        plain = dict(fields)
        quarters, rest = divmod(frame.yaw_deg % 360.0, 90.0)
        if rest:
            raise CannotTurn
        with suppress(ValidationError):  # which is told when the floor is read
            drawing = _Drawing.model_validate(fields)
            rows, corner, cell = rows_of(drawing.plan), drawing.corner, drawing.cell
            width, depth = len(rows[0]) * cell, len(rows) * cell
            x, y = corner[:2]
            lowest = ((x, y), (-y - width, x), (-x - depth, -y - width), (y, -x - depth))
            plain["corner"] = [*lowest[int(quarters)], corner[2]]
            for _ in range(int(quarters)):
                rows = ["".join(column) for column in zip(*rows, strict=True)][::-1]
            if quarters:
                plain["plan"] = "\n".join(rows)
        return super().placed(plain, Frame(frame.at))

    @field_validator("legend")
    @classmethod
    def _single_characters(cls, legend: dict[str, FloorCell]) -> dict[str, FloorCell]:
        for key in legend:
            if len(key) != 1 or key == "." or key.isspace():
                raise PydanticCustomError(
                    "legend_key",
                    "found {key} in the legend; allowed: single characters other than '.'",
                    {"key": repr(key)},
                )
        return legend

    @model_validator(mode="after")
    def _is_rectangular(self) -> FloorPlan:
        rows = self.rows
        if not rows:
            raise PydanticCustomError("empty_plan", "plan has no rows")
        for number, row in enumerate(rows, start=1):
            if len(row) != len(rows[0]):
                raise PydanticCustomError(
                    "ragged_plan",
                    "row {number} of the plan has {found} characters, others have {wanted}; "
                    "draw empty cells as '.'",
                    {"number": number, "found": len(row), "wanted": len(rows[0])},
                )
            for character in row:
                if character != "." and character not in self.cells:
                    raise PydanticCustomError(
                        "unknown_cell",
                        "row {number} of the plan has {character}, which is not in the legend; "
                        "known are {known}",
                        {
                            "number": number,
                            "character": repr(character),
                            "known": " ".join([".", *self.cells]),
                        },
                    )
        return self

    @property
    def rows(self) -> list[str]:
        """The plan's rows, from the largest x to the smallest; a blank line is an empty row."""
        return rows_of(self.plan)

    @cached_property
    def cells(self) -> dict[str, FloorCell]:
        """Every character that may stand in the plan, with its meaning (``.`` left out)."""
        return {"#": FloorCell(), "o": FloorCell(coin=True), **self.legend}

    def count(self) -> Count:
        """Return the number of its slabs and blocks, and of its coins."""
        numbers = Counter("".join(self.rows).replace(".", ""))
        cells = [(self.cells[character], number) for character, number in numbers.items()]
        solids = sum(number * (2 if cell.wall > 0.0 else 1) for cell, number in cells)
        return Count(solids, sum(number * cell.coin for cell, number in cells))

    def materials(self) -> Iterator[tuple[FieldPath, str]]:
        """Yield those of the legend."""
        for character, cell in self.legend.items():
            yield ("legend", character, "material"), cell.material

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield a slab for each cell, and the block that stands on it."""
        half, top = self.cell / 2, self.corner[2]
        for cell, x, y in self._squares():
            slab = (half, half, self.thickness / 2)
            yield Solid((x, y, top - self.thickness / 2), slab, UNTURNED, cell.material, source)
            if cell.wall > 0.0:
                block = (half, half, cell.wall / 2)
                yield Solid((x, y, top + cell.wall / 2), block, UNTURNED, cell.material, source)

    def coins(self) -> Float64:
        """Return the coins that lie on cells."""
        height = self.corner[2] + COIN_HEIGHT_M
        found = [(x, y, height + cell.wall) for cell, x, y in self._squares() if cell.coin]
        return np.array(found).reshape(-1, 3)

    def _squares(self) -> Iterator[tuple[FloorCell, float, float]]:
        """Yield what every square that is not empty stands for, and its middle, x and y."""
        rows = self.rows
        for from_top, row in enumerate(rows):
            x = self.corner[0] + (len(rows) - from_top - 0.5) * self.cell
            for from_left, character in enumerate(row):
                if character != ".":
                    y = self.corner[1] + (len(row) - from_left - 0.5) * self.cell
                    yield self.cells[character], x, y


def rows_of(plan: str) -> list[str]:
    """Return a plan's rows, from the largest x to the smallest; a blank line is an empty row."""
    lines = [line.rstrip() for line in plan.splitlines()]
    empty = "." * len(next(filter(None, lines), ""))
    return [line or empty for line in lines] if empty else []


class _Drawing(BaseModel):
    """What of a floor's fields is turned, in any unit; no drawing that is refused anyway."""

    corner: tuple[Number, Number, Number]
    cell: Number
    plan: Annotated[str, Field(max_length=MAX_PLAN_CELLS)]
    legend: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _is_sound(self) -> _Drawing:
        rows, known = rows_of(self.plan), {".", "#", "o", *self.legend}
        if not rows or len(set(map(len, rows))) > 1 or not known.issuperset("".join(rows)):
            raise ValueError
        return self
