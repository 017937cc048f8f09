"""What a level is: frozen pydantic models of everything a designer can write.

Axes: x forward, y left, z up, right-handed. **Every length in a `Level` object is in metres**; a
level file may be written in quants, and `roller_env.level.load` converts while it reads. Angles are
degrees and carry ``_deg`` in their name; forces are newtons and carry ``_n``; times are seconds
and carry ``_s``.

Sources of the defaults: the original game's listing, decoded in `docs/original.md`, whose tables a
test holds against the numbers here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Final, Literal, get_args, get_origin

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    field_validator,
    model_serializer,
)
from pydantic_core import PydanticCustomError

from roller_env.pieces.box import Box
from roller_env.pieces.bumper import Bumper
from roller_env.pieces.camera_trigger import CameraTrigger
from roller_env.pieces.checkpoint import Checkpoint
from roller_env.pieces.coin import Coins
from roller_env.pieces.curve import Bowl, HalfPipe, Spiral
from roller_env.pieces.fan import Fan
from roller_env.pieces.fields import (
    METRES_PER_UNIT,
    Colour,
    Length,
    Name,
    NonNegativeLength,
    Number,
    Part,
    Point,
    PositiveLength,
    Seconds,
    scale_of,
)
from roller_env.pieces.finish import Finish
from roller_env.pieces.floor import FloorPlan
from roller_env.pieces.gate import Gate
from roller_env.pieces.ground import Ground
from roller_env.pieces.hazard import Hazard
from roller_env.pieces.hull import Hull, Wedge
from roller_env.pieces.lift_pad import LiftPad
from roller_env.pieces.piece import Piece, Solid
from roller_env.pieces.plate import Plate
from roller_env.pieces.platform import Platform
from roller_env.pieces.ramp import Ramp
from roller_env.pieces.spring import Spring
from roller_env.pieces.switch import Switch
from roller_env.pieces.teleporter import Teleporter
from roller_env.pieces.tube import Tube
from roller_env.pieces.wall import Wall
from roller_env.units import quants

MAX_PIECES: Final = 20_000


LATER_KINDS: Final = ("half_pipes", "bowls", "spirals")
"""Kinds that came when levels already went by the hash of their text, as records and checkpoints
have it: a level without them is written as it always was."""


class Material(Part):
    """A surface. What the ball feels on it is the product of the ball's number and this one."""

    friction: Annotated[Number, Field(ge=0.0, le=10.0)] = Field(
        1.0, description="Factor on the ball's friction."
    )
    elasticity: Annotated[Number, Field(ge=0.0, le=1.0)] = Field(
        1.0, description="Factor on the ball's elasticity."
    )
    colour: Colour = Field(
        "#8fa3b8", description='`"#rrggbb"`, or `"#rrggbbaa"` to see through it; in quotes.'
    )
    pattern: Literal["plain", "checker", "grid"] = Field(
        "plain", description="Painted on, so that one sees motion over it."
    )


BUILT_IN_MATERIALS: Final[dict[str, Material]] = {
    "default": Material(colour="#8fa3b8", pattern="grid"),
    "glass": Material(colour="#7fd4ff99"),
}
"""Materials every level has; a level may redefine them under the same names. Of glass are tubes,
whose alpha is 60 percent in the original (`btube`)."""


class Ball(Part):
    """The player's ball: a rigid sphere of uniform density."""

    radius: PositiveLength = Field(quants(16.0), description="Of the sphere.")
    mass_kg: Annotated[Number, Field(ge=0.001, le=1_000.0)] = Field(1.0, description="Its mass.")
    friction: Annotated[Number, Field(ge=0.0, le=10.0)] = Field(
        0.3, description="Coulomb coefficient on a material of friction 1."
    )
    elasticity: Annotated[Number, Field(ge=0.0, le=0.95)] = Field(
        0.0, description="Coefficient of restitution on a material of elasticity 1."
    )


class Start(Part):
    """Where the ball's centre is at the start of an episode."""

    at: Point = Field(description="The ball's **centre**: one radius over the floor it stands on.")
    jitter: tuple[NonNegativeLength, NonNegativeLength] = Field(
        (0.0, 0.0),
        description="The start is moved by up to this much in x and y at every reset, at random.",
    )


class Route(Part):
    """Waypoints of one good way through the level. Used by reward shaping and by nothing else."""

    points: Annotated[tuple[Point, ...], Field(min_length=2, max_length=1_000)] = Field(
        description="From the start to the finish, in the order to pass them."
    )
    radius: PositiveLength = Field(
        1.5, description="A leg counts as reached within this distance of it."
    )


class Level(Part):
    """Everything a designer wrote, in metres. Pure data: equal levels compile equally."""

    name: Name = Field(description="What it is called: a letter, then letters, digits, `_` or `-`.")
    title: Annotated[str, Field(max_length=80)] = Field("", description="What players read.")
    description: Annotated[str, Field(max_length=2_000)] = Field(
        "", description="What it is about."
    )
    units: Literal["metre", "quant"] = Field(
        "metre",
        description="Unit of every length written in the file; 1 quant = 0.0254 m. What is left "
        "out keeps its default, which is the same length in either unit.",
    )
    gravity: PositiveLength = Field(
        quants(386.0), description="Length per second squared, downwards."
    )
    kill_height: Length = Field(
        quants(-1129.0), description="The ball has fallen when its centre is this low."
    )
    falls: Literal["end", "checkpoint"] = Field(
        "end",
        description="What a fall does: `end` the episode, or let the ball go on from the last "
        "`checkpoint` that it touched.",
    )
    time_limit_s: Seconds = Field(120.0, description="An episode ends after this long.")
    par_time_s: Seconds | None = Field(
        None, description="Time in which a good player collects all coins and finishes."
    )
    ball: Ball = Ball()
    start: Start
    finish: Finish
    materials: dict[Name, Material] = Field(
        default_factory=dict,
        description="Surfaces by name, besides `default` and `glass`, which are built in.",
    )
    coins: tuple[Coins, ...] = ()
    floors: tuple[FloorPlan, ...] = ()
    boxes: tuple[Box, ...] = ()
    ramps: tuple[Ramp, ...] = ()
    walls: tuple[Wall, ...] = ()
    hulls: tuple[Hull, ...] = ()
    wedges: tuple[Wedge, ...] = ()
    half_pipes: tuple[HalfPipe, ...] = ()
    bowls: tuple[Bowl, ...] = ()
    spirals: tuple[Spiral, ...] = ()
    tubes: tuple[Tube, ...] = ()
    plates: tuple[Plate, ...] = ()
    switches: tuple[Switch, ...] = ()
    gates: tuple[Gate, ...] = ()
    platforms: tuple[Platform, ...] = ()
    fans: tuple[Fan, ...] = ()
    lift_pads: tuple[LiftPad, ...] = ()
    springs: tuple[Spring, ...] = ()
    bumpers: tuple[Bumper, ...] = ()
    teleporters: tuple[Teleporter, ...] = ()
    hazards: tuple[Hazard, ...] = ()
    camera_triggers: tuple[CameraTrigger, ...] = ()
    checkpoints: tuple[Checkpoint, ...] = ()
    route: Route | None = None

    @field_validator("units")
    @classmethod
    def _units_end_as_metres(
        cls, units: Literal["metre", "quant"], info: ValidationInfo
    ) -> Literal["metre"]:
        if METRES_PER_UNIT[units] != scale_of(info):
            raise PydanticCustomError(
                "unscaled_units",
                "a Level built in Python is in metres; load text in quants with parse_level",
            )
        return "metre"

    @field_validator("*")
    @classmethod
    def _pieces_stand_on_the_ground(cls, value: Any, info: ValidationInfo) -> Any:
        """Settle pieces on those of the fields before theirs."""
        if not isinstance(value, tuple) or not value or not isinstance(value[0], Piece):
            return value
        below = [piece for field in PIECE_FIELDS for piece in info.data.get(field, ())]
        ground = Ground(lambda: _solids(below))
        return tuple(piece.settled(ground) for piece in value)

    @model_serializer(mode="wrap")
    def _without_later_kinds(self, written: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave kinds out that came later, where a level has none: see `LATER_KINDS`."""
        fields: dict[str, Any] = written(self)
        return {name: f for name, f in fields.items() if f or name not in LATER_KINDS}

    def material(self, name: str) -> Material:
        """Return the material called ``name``, the level's own before the built-in one.

        Without a name it is the one whose factors are all 1.

        Raises:
            KeyError: the level has no such material (`check_level` refuses such levels).
        """
        if not name:
            return Material()
        return self.materials.get(name) or BUILT_IN_MATERIALS[name]

    def pieces(self) -> Iterator[tuple[str, Piece]]:
        """Yield every piece with its path in the level, such as ``floors[0]``, in the kinds' order.

        The finish, which there is one of, comes last: so does what happens there.
        """
        for field in PIECE_FIELDS:
            for index, piece in enumerate(getattr(self, field)):
                yield f"{field}[{index}]", piece
        yield "finish", self.finish


def _solids(pieces: Iterable[Piece]) -> list[Solid]:
    """Return what of pieces stands still; nothing of so many that the level will be refused."""
    if sum(piece.count().solids for piece in pieces) > MAX_PIECES:  # they could take all memory
        return []
    return [solid for piece in pieces for solid in piece.solids("")]


PIECE_FIELDS: Final = {
    name: get_args(field.annotation)[0]
    for name, field in Level.model_fields.items()
    if get_origin(field.annotation) is tuple
}
"""The kinds of pieces of which a level has any number, by their fields: a kind is registered by
its field in `Level`."""

PIECE_KINDS: Final[tuple[type[Piece], ...]] = (*PIECE_FIELDS.values(), Finish)
"""Every kind, in the order in which what happens at the same moment is taken."""
