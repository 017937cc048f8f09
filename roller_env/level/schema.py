"""What a level is: frozen pydantic models of everything a designer can write.

Axes: x forward, y left, z up, right-handed. **Every length in a `Level` object is in metres**; a
level file may be written in quants, and `roller_env.level.load` converts while it reads. Angles are
degrees and carry ``_deg`` in their name; forces are newtons and carry ``_n``; times are seconds
and carry ``_s``.

Sources of the defaults: the original game's listing, decoded in `docs/original.md`, whose tables a
test holds against the numbers here.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated, Final, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from roller_env.units import METRES_PER_QUANT, quants

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

PLATE_HIT_HEIGHT_M: Final = quants(25.0)
"""A plate counts a hit only while the ball's centre is higher than this over its ``at``: the
original's guard against hits from the side."""

COIN_REACH_M: Final = quants(30.0)
"""A coin is collected when the ball's centre is this near to it (`collect`)."""

MAX_COINS: Final = 10_000
MAX_PIECES: Final = 20_000
MAX_PLAN_CELLS: Final = 40_000


NAME_PATTERN: Final = r"^[A-Za-z][A-Za-z0-9_-]{0,63}$"
COLOUR_PATTERN: Final = r"^#[0-9a-fA-F]{6}([0-9a-fA-F]{2})?$"


def _scale(info: ValidationInfo) -> float:
    scale: float = (info.context or {}).get(SCALE_KEY, 1.0)
    return scale


def _to_metres(value: float, info: ValidationInfo) -> float:
    scale = _scale(info)
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
        limit = MIN_LENGTH_M / _scale(info)
        raise PydanticCustomError(
            "absurd_length",
            "{value} is too small to matter; allowed is {limit} or more",
            {"value": f"{value:g}", "limit": f"{limit:.3g}"},
        )
    return metres


# Bounds stand on the number itself, before any AfterValidator: only there does pydantic write them
# into the JSON Schema as minimum and maximum.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Length = Annotated[Number, AfterValidator(_to_metres)]
"""A length (or, in fields called ``speed``, a length per second); metres once loaded."""
PositiveLength = Annotated[Number, Field(gt=0.0), AfterValidator(_to_metres_of_matter)]
NonNegativeLength = Annotated[Number, Field(ge=0.0), AfterValidator(_to_metres_of_matter)]
Seconds = Annotated[Number, Field(gt=0.0, le=86_400.0)]
Degrees = Annotated[Number, Field(ge=-360.0, le=360.0)]
Point = tuple[Length, Length, Length]
PlanePoint = tuple[Length, Length]
Size = tuple[PositiveLength, PositiveLength, PositiveLength]
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
Colour = Annotated[str, Field(pattern=COLOUR_PATTERN)]


class Piece(BaseModel):
    """Base of everything in a level: immutable, and an unknown field is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Material(Piece):
    """A surface. What the ball feels on it is the product of the ball's number and this one."""

    friction: Annotated[Number, Field(ge=0.0, le=10.0)] = Field(
        1.0, description="Factor on the ball's Coulomb friction (1: the ball's own 0.30)."
    )
    elasticity: Annotated[Number, Field(ge=0.0, le=1.0)] = Field(
        1.0, description="Factor on the ball's elasticity (1: the ball's own)."
    )
    colour: Colour = Field("#8fa3b8", description="#rrggbb or #rrggbbaa.")
    pattern: Literal["plain", "checker", "grid"] = Field(
        "plain", description="What is painted on it, so that motion over it can be seen."
    )


BUILT_IN_MATERIALS: Final[dict[str, Material]] = {
    "default": Material(colour="#8fa3b8", pattern="grid"),
    "glass": Material(colour="#7fd4ff99"),
}
"""Materials every level has; a level may redefine them under the same names. Of glass are tubes,
whose alpha is 60 percent in the original (`btube`)."""


class Ball(Piece):
    """The player's ball: a rigid sphere of uniform density."""

    radius: PositiveLength = quants(16.0)
    mass_kg: Annotated[Number, Field(ge=0.001, le=1_000.0)] = 1.0
    friction: Annotated[Number, Field(ge=0.0, le=10.0)] = Field(
        0.3, description="Coulomb coefficient against a material of friction 1."
    )
    elasticity: Annotated[Number, Field(ge=0.0, le=0.95)] = Field(
        0.0, description="Coefficient of restitution against a material of elasticity 1."
    )


class Start(Piece):
    """Where the ball's centre is at the start of an episode."""

    at: Point = Field(description="The ball's centre: one radius over what it stands on.")
    jitter: tuple[NonNegativeLength, NonNegativeLength] = Field(
        (0.0, 0.0), description="Half-widths in x and y of the uniform random offset at reset."
    )


class Box(Piece):
    """A solid box. Rotated about its centre: first pitch (about y), then yaw (about z)."""

    at: Point = Field(description="Centre of the box.")
    size: Size = Field(description="Full edge lengths along its own x, y and z.")
    yaw_deg: Degrees = Field(0.0, description="Positive turns +x towards +y (to the left).")
    pitch_deg: Degrees = Field(0.0, description="Positive tips the +x end down.")
    material: str = "default"
    name: Name | None = None


class Ramp(Piece):
    """A sloping slab: ``start`` and ``end`` are the ends of its upper face's centre line."""

    start: Point = Field(description="Middle of the upper face's one end.")
    end: Point = Field(description="Middle of the upper face's other end.")
    width: PositiveLength
    thickness: PositiveLength = Field(
        quants(16.0), description="At right angles to the upper face, downwards."
    )
    material: str = "default"
    name: Name | None = None

    @model_validator(mode="after")
    def _has_run(self) -> Ramp:
        if math.dist(self.start[:2], self.end[:2]) < MIN_LENGTH_M:
            raise PydanticCustomError(
                "ramp_without_run", "start and end must differ in x or y; use a wall or a tube"
            )
        return self


class Wall(Piece):
    """An upright slab over the line from ``start`` to ``end``."""

    start: PlanePoint = Field(description="(x, y) of the one end of its middle line.")
    end: PlanePoint = Field(description="(x, y) of the other end of its middle line.")
    bottom: Length = Field(description="Height of its lower edge.")
    height: PositiveLength
    thickness: PositiveLength = quants(8.0)
    material: str = "default"
    name: Name | None = None

    @model_validator(mode="after")
    def _has_length(self) -> Wall:
        if math.dist(self.start, self.end) < MIN_LENGTH_M:
            raise PydanticCustomError("wall_without_length", "start and end must differ")
        return self


class FloorCell(Piece):
    """What one character of a floor plan stands for."""

    material: str = "default"
    coin: bool = Field(False, strict=True, description="A coin lies on the middle of the cell.")
    wall: NonNegativeLength = Field(
        0.0, description="Height of a block standing on the cell; 0 for none."
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
        description="The drawing: a block of text ('plan: |'), all rows equally long; a blank one "
        "is empty."
    )
    legend: dict[str, FloorCell] = Field(
        default_factory=dict, description="More characters, or other meanings of # and o."
    )
    name: Name | None = None

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
        lines = [line.rstrip() for line in self.plan.splitlines()]
        empty = "." * len(next(filter(None, lines), ""))
        return [line or empty for line in lines] if empty else []

    @cached_property
    def cells(self) -> dict[str, FloorCell]:
        """Every character that may stand in the plan, with its meaning (``.`` left out)."""
        return {"#": FloorCell(), "o": FloorCell(coin=True), **self.legend}


class Opening(Piece):
    """A slot along the whole length of a tube."""

    toward_deg: Degrees = Field(
        description="Direction of its middle: for an upright tube the compass angle from +x to "
        "+y; for a lying one the angle from straight up."
    )
    width_deg: Annotated[Number, Field(gt=0.0, lt=360.0)] = Field(
        description="Panels whose middle lies within half of this are left out."
    )


class Tube(Piece):
    """A transparent pipe of flat panels that the ball rolls or rises inside."""

    start: Point = Field(description="Middle of the pipe's one end.")
    end: Point = Field(description="Middle of its other end.")
    inner_radius: PositiveLength = Field(description="From its axis to the middle of a panel.")
    thickness: PositiveLength = quants(4.0)
    sides: Annotated[int, Field(strict=True, ge=3, le=64)] = Field(
        16, description="Number of flat panels around it."
    )
    opening: Opening | None = None
    material: str = "glass"
    name: Name | None = None

    @model_validator(mode="after")
    def _has_length(self) -> Tube:
        if math.dist(self.start, self.end) < MIN_LENGTH_M:
            raise PydanticCustomError("tube_without_length", "start and end must differ")
        return self


class CoinLine(Piece):
    """Coins at equal distances on a straight line, both ends included."""

    start: Point
    end: Point
    count: Annotated[int, Field(strict=True, ge=2, le=MAX_COINS)]


class CoinArc(Piece):
    """Coins at equal angles on a level arc, both ends included."""

    centre: Point
    radius: PositiveLength
    from_deg: Degrees = Field(description="Angle of the first coin, from +x towards +y.")
    to_deg: Degrees = Field(description="Angle of the last coin.")
    count: Annotated[int, Field(strict=True, ge=2, le=MAX_COINS)]


class CoinGrid(Piece):
    """Coins in level rows and columns round a centre."""

    centre: Point
    spacing: PlanePoint = Field(description="Distance between neighbours along x and y.")
    count: tuple[
        Annotated[int, Field(strict=True, ge=1, le=MAX_COINS)],
        Annotated[int, Field(strict=True, ge=1, le=MAX_COINS)],
    ] = Field(description="Coins along x and along y.")

    @model_validator(mode="after")
    def _is_bounded(self) -> CoinGrid:
        if self.count[0] * self.count[1] > MAX_COINS:
            raise PydanticCustomError(
                "too_many_coins", "a grid may hold at most {limit} coins", {"limit": MAX_COINS}
            )
        return self


class Coins(Piece):
    """One coin (``at``), or a ``line``, ``arc`` or ``grid`` of them: exactly one of the four."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    at: Point | None = None
    line: CoinLine | None = None
    arc: CoinArc | None = None
    grid: CoinGrid | None = None

    @model_validator(mode="after")
    def _exactly_one(self) -> Coins:
        given = [key for key in ("at", "line", "arc", "grid") if getattr(self, key) is not None]
        if len(given) != 1:
            raise PydanticCustomError(
                "coins_ambiguous",
                "give exactly one of at, line, arc, grid; found {given}",
                {"given": ", ".join(given) or "none"},
            )
        return self


class Plate(Piece):
    """A pressure plate: struck from above it sinks, and once down it opens its gates.

    It counts as struck when the ball touches it while the ball's centre is more than 25 quants
    above ``at``; with the original's ball of 16 quants, build it thicker than 18 quants.
    """

    name: Name
    at: Point = Field(description="Centre of the plate before it sinks.")
    size: Size
    opens: tuple[str, ...] = Field(description="Names of the gates it opens.")
    sinks_to: Length = Field(quants(67.0), description="Height of its centre when it is down.")
    speed: PositiveLength = Field(quants(1.6), description="Length per second, downwards.")


class Gate(Piece):
    """A slab that sinks out of the way when one of its plates is down."""

    name: Name
    at: Point = Field(description="Centre of the closed gate.")
    size: Size
    yaw_deg: Degrees = 0.0
    lowers_to: Length = Field(quants(-32.0), description="Height of its centre when it is open.")
    speed: PositiveLength = Field(quants(32.0), description="Length per second, downwards.")


class LiftPad(Piece):
    """A solid pad that throws whatever enters it upwards with a steady force for a while."""

    at: Point
    size: Size
    force_n: Annotated[Number, Field(gt=0.0, le=1e6)] = Field(
        quants(500.0), description="Newtons upwards; more than the ball's weight."
    )
    duration_s: Seconds = Field(5.0, description="How long it pushes, once entered.")
    name: Name | None = None


class Finish(Piece):
    """The end of the level: a box without substance."""

    at: Point
    size: Size


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


class Route(Piece):
    """Waypoints of one good way through the level. Used by reward shaping and by nothing else."""

    points: Annotated[tuple[Point, ...], Field(min_length=2, max_length=1_000)] = Field(
        description="From the start to the finish, in the order to pass them."
    )
    radius: PositiveLength = Field(
        1.5, description="A leg counts as reached within this distance of it."
    )


class Level(Piece):
    """Everything a designer wrote, in metres. Pure data: equal levels compile equally."""

    name: Name = Field(description="A letter, then letters, digits, '_' or '-'.")
    title: Annotated[str, Field(max_length=80)] = Field("", description="What players read.")
    description: Annotated[str, Field(max_length=2_000)] = ""
    units: Literal["metre", "quant"] = Field(
        "metre",
        description="Unit of every length written in the file; 1 quant = 0.0254 m. What is left "
        "out keeps its default, which is stated in metres and the same in either unit.",
    )
    gravity: PositiveLength = Field(quants(386.0), description="Per second squared, downwards.")
    kill_height: Length = Field(
        quants(-1129.0), description="The ball has fallen when its centre is this low."
    )
    time_limit_s: Seconds = Field(120.0, description="An episode ends after this long.")
    ball: Ball = Ball()
    start: Start
    finish: Finish
    materials: dict[Name, Material] = Field(
        default_factory=dict, description="Besides 'default' and 'glass', which are built in."
    )
    floors: tuple[FloorPlan, ...] = ()
    boxes: tuple[Box, ...] = ()
    ramps: tuple[Ramp, ...] = ()
    walls: tuple[Wall, ...] = ()
    tubes: tuple[Tube, ...] = ()
    coins: tuple[Coins, ...] = ()
    plates: tuple[Plate, ...] = ()
    gates: tuple[Gate, ...] = ()
    lift_pads: tuple[LiftPad, ...] = ()
    camera_triggers: tuple[CameraTrigger, ...] = ()
    route: Route | None = None

    @field_validator("units")
    @classmethod
    def _units_end_as_metres(
        cls, units: Literal["metre", "quant"], info: ValidationInfo
    ) -> Literal["metre"]:
        if METRES_PER_UNIT[units] != _scale(info):
            raise PydanticCustomError(
                "unscaled_units",
                "a Level built in Python is in metres; load text in quants with parse_level",
            )
        return "metre"

    def material(self, name: str) -> Material:
        """Return the material called ``name``, the level's own before the built-in one.

        Raises:
            KeyError: the level has no such material (`check_level` refuses such levels).
        """
        return self.materials.get(name) or BUILT_IN_MATERIALS[name]
