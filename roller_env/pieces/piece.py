"""What every kind of piece is to the rest of the house: its shapes, as plain data."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple, Self, TypeVar, cast

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Float64
from roller_env.pieces.fields import Part
from roller_env.pieces.placing import Frame, place_fields
from roller_env.problems import FieldPath, Problem
from roller_env.units import SCRIPT_RATE_HZ

if TYPE_CHECKING:
    from roller_env.pieces.ground import Ground
    from roller_env.pieces.look import Shape
    from roller_env.pieces.rules import Rules
    from roller_env.pieces.surroundings import Surroundings

Matrix = tuple[tuple[float, float, float], ...]
Vector = tuple[float, float, float]

TOUCHING_M: Final = 0.001
"""Things that are this near to each other touch, and one may reach this deep into another: covers
rounded numbers in files and the depth to which a resting ball sinks into MuJoCo's soft contacts."""

UPWARDS: Final[Vector] = (0.0, 0.0, 1.0)

UNTURNED: Final[Matrix] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


_SIGNS: Final = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
# Round the face, not across it.
_ROUND: Final = [
    [np.flatnonzero(_SIGNS[:, axis] == sign)[[0, 1, 3, 2]] for sign in (-1.0, 1.0)]
    for axis in range(3)
]
"""Indices of a box's corners round its faces, by axis and side."""


class Face(NamedTuple):
    """A face of a solid.

    Attributes:
        normal: (3,) unit vector, out of the solid, world frame.
        corners: (n, 3) metres, world frame, one after the other round it.
    """

    normal: Float64
    corners: Float64


@dataclass(frozen=True, slots=True)
class Solid:
    """A box that stands still.

    `roller_env.pieces.convex.ConvexSolid` is one of another shape.

    Attributes:
        centre: world frame, metres.
        half_size: half edge lengths along its own axes, metres.
        rotation: box frame to world frame, 3x3, row major.
        material: name of its material; empty: one whose factors are all 1.
        source: the piece of the level it comes from, as a path such as ``floors[0]``.
    """

    centre: Vector
    half_size: Vector
    rotation: Matrix
    material: str
    source: str

    @property
    def axis_aligned(self) -> bool:
        """Whether its edges lie along the world's axes."""
        return self.rotation == UNTURNED

    def contains(self, points: Float64, margin: float = 0.0) -> npt.NDArray[np.bool_]:
        """Say which of ``points``, (n, 3) in metres, lie inside or within ``margin`` of it.

        With a ``margin`` below zero, which lie inside and that deep under each face.
        """
        local = (points - np.array(self.centre)) @ np.array(self.rotation)
        half = np.maximum(np.array(self.half_size) + min(margin, 0.0), 0.0)
        outside = np.maximum(np.abs(local) - half, 0.0)
        inside: npt.NDArray[np.bool_] = (outside**2).sum(axis=-1) <= max(margin, 0.0) ** 2
        return inside

    def corners(self) -> Float64:
        """Return its corners, (n, 3) metres, world frame."""
        corners: Float64 = (_SIGNS * self.half_size) @ np.array(self.rotation).T + self.centre
        return corners

    def faces(self) -> Iterator[Face]:
        """Yield its faces."""
        corners, rotation = self.corners(), np.array(self.rotation)
        for axis in range(3):
            for side, sign in enumerate((-1.0, 1.0)):
                yield Face(sign * rotation[:, axis], corners[_ROUND[axis][side]])


@dataclass(frozen=True, slots=True)
class Mover:
    """A solid slab that moves along a line between where it is at the start and an end.

    Attributes:
        name: of the piece.
        solid: where it is at the start.
        stop: displacement at which it has arrived, metres, <= 0.
        travel: displacement at which it stands still, metres, <= ``stop``.
        speed: m/s, at most.
        along: unit vector in which displacements count, world frame: away from the end.
    """

    name: str
    solid: Solid
    stop: float
    travel: float
    speed: float
    along: Vector = UPWARDS

    @staticmethod
    def down(name: str, solid: Solid, to: float, speed: float) -> Mover:
        """Return a slab that goes down until its centre is at a height, as the original's do.

        That tests ``z > stop`` before each decrement, so its slabs end up to one frame of travel
        below the stop: here half a frame, on average the same, and so they do pass it.
        """
        height = solid.centre[2]
        return Mover(name, solid, to - height, to - 0.5 * speed / SCRIPT_RATE_HZ - height, speed)

    @property
    def end(self) -> Solid:
        """It where it has arrived."""
        return self.at(self.stop)

    def at(self, displacement: float) -> Solid:
        """Return it where it is then."""
        x, y, z = (
            here + displacement * way
            for here, way in zip(self.solid.centre, self.along, strict=True)
        )
        return replace(self.solid, centre=(x, y, z))


class Region(NamedTuple):
    """Where something happens to the ball: a rounded box, above a floor.

    Attributes:
        centre: metres, world frame.
        half: half edges of the box, along the world's axes, metres.
        radius: of the rounding, metres: the ball's centre is as near as that to the box.
        floor: least height of the ball's centre over the region's.
    """

    centre: Vector
    half: Vector
    radius: float
    floor: float = -math.inf


class Count(NamedTuple):
    """What a piece stands for, in numbers."""

    solids: int = 1
    coins: int = 0


class Piece(Part):
    """A kind of thing of which a level has any number, each in the field of its kind.

    What a kind does not have it leaves as it is here: nothing.

    Attributes:
        receives: whether plates and switches can tell it something, by its name.
        is_searched: whether `roller_env.level.reach` knows what it can do for the ball.
        is_pipe: whether its solids are pipes, not decks: it says itself how they look, and a map
            may be cut through them.
        rules: what the kind does in a game; None for what is only solid.
    """

    receives: ClassVar[bool] = False
    is_searched: ClassVar[bool] = True
    is_pipe: ClassVar[bool] = False
    rules: ClassVar[Rules[Any, Any] | None] = None

    @classmethod
    def placed(cls, fields: Mapping[str, Any], frame: Frame) -> dict[str, Any]:
        """Return the fields of one, as a file has them, in a frame; see `place_fields`."""
        return place_fields(cls, fields, frame)

    def count(self) -> Count:
        """Return how much it stands for, without making it."""
        return Count()

    def materials(self) -> Iterator[tuple[FieldPath, str]]:
        """Yield the materials that it names, each with the field in which it does."""
        name = getattr(self, "material", None)
        if name is not None:
            yield ("material",), name

    def settled(self, ground: Ground) -> Self:
        """Return it with what follows from the ground where nobody has given it."""
        return self

    def solids(self, source: str) -> Iterator[Solid]:
        """Yield what of it is solid and stands still.

        Args:
            source: its path in the level, such as ``floors[0]``.
        """
        yield from ()

    def coins(self) -> Float64:
        """Return the centres of its coins, (n, 3) metres, world frame."""
        return np.zeros((0, 3))

    def mover(self, source: str) -> Mover | None:
        """Return what of it is solid and moves."""
        return None

    def region(self, touch: float) -> Region | None:
        """Return where it acts on the ball.

        Args:
            touch: distance of the ball's centre from a surface that it touches, metres.
        """
        return None

    def signals(self) -> tuple[str, ...]:
        """Return the names of the pieces that it tells when it is down, or on."""
        return ()

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield what is seen of it besides its solids and coins.

        Args:
            number: its own among those of its kind.
        """
        yield from ()

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return what it is doing: IDLE, ACTIVE or DONE of `roller_env.pieces.look`.

        Args:
            state: the games', a `roller_env.game.state.GameState`.
            row: the game.
            number: its own among those of its kind.
            arrived: whether it moves and is where it stops.
        """
        return 0

    def label(self) -> tuple[str, Vector] | None:
        """Return what maps write beside it, and the place of it, metres."""
        return None

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield what is wrong with it, so that no level may have it.

        Args:
            path: its own, which those of its fields begin with.
            around: the level around it.
        """
        yield from ()

    def doubts(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield what it hardly can be meant to be, as `problems` does: shown at every loading."""
        yield from ()

    def slow_doubts(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield what only ``roller level check`` says, since it takes long to find."""
        yield from ()


PieceT = TypeVar("PieceT", bound=Piece)


@dataclass(frozen=True, eq=False)
class ExpandedLevel:
    """What a level consists of, SI units, world frame, in the order of its pieces.

    Attributes:
        solids: what stands still.
        movers: what is solid and moves, where it is at the start.
        mover_kinds: the kind of piece that each of them is.
        decks: what of ``solids`` is ground, but for pipes.
        pipes: what of them is pipes, which look otherwise and lead from deck to deck.
        coins: (K, 3) float64 centres, metres.
        coin_sources: the piece that each coin comes from, as a path such as ``coins[0]``.
        regions: where pieces act on the ball, by kind of piece.
        pieces: all of them, by kind.
    """

    solids: tuple[Solid, ...]
    movers: tuple[Mover, ...]
    mover_kinds: tuple[type[Piece], ...]
    decks: tuple[Solid, ...]
    pipes: tuple[Solid, ...]
    coins: Float64
    coin_sources: tuple[str, ...]
    regions: dict[type[Piece], tuple[Region, ...]]
    pieces: dict[type[Piece], tuple[Piece, ...]]

    def of(self, kind: type[PieceT]) -> tuple[PieceT, ...]:
        """Return the pieces of a kind."""
        return cast("tuple[PieceT, ...]", self.pieces.get(kind, ()))

    @property
    def ground(self) -> tuple[Solid, ...]:
        """What stands still and does nothing."""
        return tuple(solid for solid in self.solids if solid.material)

    @property
    def machines(self) -> tuple[Solid, ...]:
        """What stands still and does something: what has no material of its own."""
        return tuple(solid for solid in self.solids if not solid.material)

    def movers_of(self, kind: type[Piece]) -> list[Mover]:
        """Return what moves of one kind of piece, in their order."""
        return [m for m, own in zip(self.movers, self.mover_kinds, strict=True) if own is kind]

    @property
    def at_the_start(self) -> tuple[Solid, ...]:
        """All that is solid, where it stands at the start."""
        return (*self.solids, *(mover.solid for mover in self.movers))


def path_of(source: str) -> FieldPath:
    """Return ``("floors", 0)`` for ``floors[0]``, and ``("finish",)`` for ``finish``."""
    kind, _, number = source.removesuffix("]").partition("[")
    return (kind, int(number)) if number else (kind,)


def number_of(source: str) -> int:
    """Return the number of ``floors[0]`` among those of its kind; 0 for what there is one of."""
    _, *number = path_of(source)
    return int(number[0]) if number else 0


def rotation_matrix(yaw_deg: float = 0.0, pitch_deg: float = 0.0, roll_deg: float = 0.0) -> Matrix:
    """Return the matrix of a roll about x, then a pitch about y, then a yaw about z."""
    if yaw_deg == 0.0 and pitch_deg == 0.0 and roll_deg == 0.0:
        return UNTURNED
    yaw, pitch, roll = math.radians(yaw_deg), math.radians(pitch_deg), math.radians(roll_deg)
    cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    if roll_deg == 0.0:
        return ((cy * cp, -sy, cy * sp), (sy * cp, cy, sy * sp), (-sp, 0.0, cp))
    cr, sr = math.cos(roll), math.sin(roll)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def half_of(size: Vector) -> Vector:
    """Return the half edges of a box of ``size``."""
    return (size[0] / 2, size[1] / 2, size[2] / 2)
