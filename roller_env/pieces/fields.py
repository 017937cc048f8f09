"""What fields of a level file can be: lengths that become metres, names, colours."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo
from pydantic_core import PydanticCustomError

from roller_env.units import METRES_PER_QUANT

METRES_PER_UNIT: Final = {"metre": 1.0, "quant": METRES_PER_QUANT}
"""Metres in one unit of a level file, by the name the file uses in ``units``."""

SCALE_KEY: Final = "metres_per_unit"
"""Key of pydantic's validation context under which the loader passes the file's scale."""

MAX_COORDINATE_M: Final = 5_000.0
"""No length of a level may exceed this: beyond it contact accuracy in float64 is still fine, but
nothing a ball can reach within an hour lies there, so a larger number is a typing error."""

MIN_LENGTH_M: Final = 0.001
"""No size, radius, thickness or speed may be smaller, unless it may be 0: a tenth of the thinnest
thing a ball could notice, and far above the masses and sizes MuJoCo refuses to compile."""


NAME_PATTERN: Final = r"^[A-Za-z][A-Za-z0-9_-]{0,63}$"
COLOUR_PATTERN: Final = r"^#[0-9a-fA-F]{6}([0-9a-fA-F]{2})?$"


def scale_of(info: ValidationInfo) -> float:
    """Return the metres in a unit of the file that is being read."""
    scale: float = (info.context or {}).get(SCALE_KEY, 1.0)
    return scale


def _to_metres(value: float, info: ValidationInfo) -> float:
    scale = scale_of(info)
    metres = value * scale
    if abs(metres) > MAX_COORDINATE_M:
        limit = MAX_COORDINATE_M / scale
        raise PydanticCustomError(
            "absurd_length",
            "a length of {value} is out of this world; allowed is -{limit} to {limit}",
            {"value": f"{value:g}", "limit": f"{limit:g}"},
        )
    return metres


def _to_metres_of_matter(value: float, info: ValidationInfo) -> float:
    metres = _to_metres(value, info)
    if value > 0.0 and metres < MIN_LENGTH_M:
        limit = MIN_LENGTH_M / scale_of(info)
        raise PydanticCustomError(
            "absurd_length",
            "{value} is too small to matter; allowed is {limit} or more",
            {"value": f"{value:g}", "limit": f"{limit:.3g}"},
        )
    return metres


class Role(Enum):
    """What becomes of a field when its piece is placed elsewhere, turned about the z axis."""

    PLACE = "moved and turned: `[x, y, z]` or `[x, y]`"
    DIRECTION = "turned: `[x, y, z]`"
    EXTENT = "along the piece's own axes if it has an `ANGLE`, else along the level's"
    HEIGHT = "moved: z"
    ANGLE = "turned: degrees about z"
    NAMES = "names of other pieces"


# Bounds stand on the number itself, before any AfterValidator: only there does pydantic write them
# into the JSON Schema as minimum and maximum.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Length = Annotated[Number, AfterValidator(_to_metres)]
"""A length (or, in fields called ``speed``, a length per second); metres once loaded."""
PositiveLength = Annotated[Number, Field(gt=0.0), AfterValidator(_to_metres_of_matter)]
NonNegativeLength = Annotated[Number, Field(ge=0.0), AfterValidator(_to_metres_of_matter)]
Seconds = Annotated[Number, Field(gt=0.0, le=86_400.0)]
Degrees = Annotated[Number, Field(ge=-360.0, le=360.0)]
Yaw = Annotated[Degrees, Role.ANGLE]
Height = Annotated[Length, Role.HEIGHT]
Point = Annotated[tuple[Length, Length, Length], Role.PLACE]
PlanePoint = Annotated[tuple[Length, Length], Role.PLACE]
Spacing = Annotated[tuple[Length, Length], Role.EXTENT]
Velocity = Annotated[tuple[Length, Length, Length], Role.DIRECTION]
Size = Annotated[tuple[PositiveLength, PositiveLength, PositiveLength], Role.EXTENT]
Names = Annotated[tuple[str, ...], Role.NAMES]
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
OptionalName = Annotated[
    Name | None, Field(description="To find it by in messages; no two pieces share one.")
]
MaterialName = Annotated[str, Field(description="One of the level's materials.")]
Colour = Annotated[str, Field(pattern=COLOUR_PATTERN)]


class Part(BaseModel):
    """Base of everything in a level: immutable, and an unknown field is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
