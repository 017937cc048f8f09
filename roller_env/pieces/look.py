"""How things look, as plain data: shapes, their paints, and what of them changes as one plays.

A piece says it in `Piece.looks`; whoever draws a level reads it there. Nothing here knows what
draws it. Shapes are only seen: what the ball meets is in `roller_env.pieces.piece.Solid`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

from roller_env.pieces.piece import UNTURNED, Matrix, Vector
from roller_env.pieces.surfaces import Surface

IDLE, ACTIVE, DONE = 0, 1, 2
"""Phases of a piece: nothing has happened yet; something happens; all that could has happened."""

PHASES: Final = (IDLE, ACTIVE, DONE)


class Paint(NamedTuple):
    """What a shape is painted with.

    Attributes:
        name: one of a kind; no material of a level is called so, since it has a slash.
        colour: ``#rrggbb`` or ``#rrggbbaa`` of each face.
        emission: share of the colour that is seen without any light.
        specular: strength of highlights, 0 to 1.
        shininess: sharpness of highlights, 0 to 1.
        opacity: of a body as a whole, two faces of which are looked through; 1 leaves ``colour``.
        texture: what is drawn on it.
    """

    name: str
    colour: str = "#ffffff"
    emission: float = 0.0
    specular: float = 0.2
    shininess: float = 0.3
    opacity: float = 1.0
    texture: Literal["", "chequers"] = ""


METAL: Final = Paint("metal/", "#39424e", specular=0.6, shininess=0.6)
"""Of the solids of whatever moves or does something."""

LIGHT: Final = Paint("ring/", "#bff0ff59", emission=0.8)
"""Of what is nothing but light."""


class Spin(NamedTuple):
    """Turns about an upright axis through its middle, and bobs up and down.

    Attributes:
        turns_per_s: turns a second, from +x towards +y.
        bob_m: amplitude, metres.
        bobs_per_s: how often a second.
        phase: radians that both are ahead.
    """

    turns_per_s: float
    bob_m: float
    bobs_per_s: float
    phase: float


class Run(NamedTuple):
    """Runs along a line from its ``at``, and begins anew at the end.

    Attributes:
        way: from the beginning to the end, metres.
        speed: m/s.
        ahead: metres along the way at time 0.
    """

    way: Vector
    speed: float
    ahead: float


class Fly(NamedTuple):
    """Flies off from its ``at`` in an arbitrary direction, shrinking and fading, again and again.

    Of all that do there is one born every so often; this is the n-th youngest.

    Attributes:
        number: n, from 0.
        every_s: time between births, seconds.
        speed: at most, along each axis, m/s.
        width: when it is born, metres.
        life_s: until it is nothing, seconds.
    """

    number: int
    every_s: float
    speed: float
    width: float
    life_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Something to see.

    Attributes:
        name: one of a kind in a level, made by `part`.
        form: a box, a cylinder along z, a sphere, or a surface in metres.
        paint: a paint for each phase, the last one also for those after it; or the name of a
            material of the level.
        size: half edges; radius and half height; radius. Metres. Of no use to a surface.
        at: its middle, metres, in the world's frame or that of what carries it.
        rotation: from its own frame to that.
        carrier: name of the piece that moves and that it is fixed to.
        seen_in: the phases in which it is seen.
        motion: how it moves by itself.
    """

    name: str
    form: Literal["box", "cylinder", "sphere"] | Surface
    paint: tuple[Paint, ...] | str
    size: Vector = (0.0, 0.0, 0.0)
    at: Vector = (0.0, 0.0, 0.0)
    rotation: Matrix = UNTURNED
    carrier: str = ""
    seen_in: tuple[int, ...] = PHASES
    motion: Spin | Run | Fly | None = None

    @property
    def has_phases(self) -> bool:
        """Whether the piece's phase changes how it looks."""
        return self.seen_in != PHASES or len(self.materials) > 1

    @property
    def paints(self) -> tuple[Paint, ...]:
        """Its own paints; none if it is of a material of the level."""
        return () if isinstance(self.paint, str) else self.paint

    @property
    def materials(self) -> tuple[str, ...]:
        """The names of what it is painted with, by phase."""
        return tuple(paint.name for paint in self.paints) or (str(self.paint),)


def part(kind: str, *numbers: int) -> str:
    """Return the name of something to see; no piece of a level can be called so."""
    return "/".join([kind, *map(str, numbers)]) + "/"


def states(kind: str, *paints: tuple[str, float]) -> tuple[Paint, ...]:
    """Return a paint for each phase of a kind of piece, of its colour and emission there."""
    return tuple(
        Paint(f"{kind}/{state}", colour, emission)
        for state, (colour, emission) in zip(("idle", "active", "done"), paints, strict=False)
    )
