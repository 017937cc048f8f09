"""A level while it is put together: its pieces so far, and where on the grid they go."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

BALL_M: Final = 0.4064
"""Radius of the ball."""

THICKNESS_M: Final = 0.4
"""Of what is rolled on."""

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Frame:
    """Axes along a joint: x along it, y to the left of it, z up from the deck that it leaves.

    Attributes:
        origin: middle of the edge that it leaves, on the upper face, metres, world frame.
        heading: how many right angles it is turned to the left from world x.
    """

    origin: Point
    heading: int

    def point(self, along: float, left: float = 0.0, up: float = 0.0) -> Point:
        """Return a point in the world, metres."""
        x, y, z = self.vector(along, left, up)
        ox, oy, oz = self.origin
        return rounded(ox + x), rounded(oy + y), rounded(oz + z)

    def vector(self, along: float, left: float = 0.0, up: float = 0.0) -> Point:
        """Return a direction in the world."""
        for _ in range(self.heading % 4):
            along, left = -left, along
        return rounded(along), rounded(left), rounded(up)

    def size(self, along: float, across: float, up: float) -> Point:
        """Return the full edges of a box, along the world's axes."""
        turned = self.heading % 2 == 1
        x, y = (across, along) if turned else (along, across)
        return rounded(x), rounded(y), rounded(up)


def rounded(metres: float) -> float:
    """Return a length in whole millimetres, so that level files are short."""
    return round(metres, 3) + 0.0


@dataclass(frozen=True, slots=True)
class Span:
    """What a joint has to join.

    Attributes:
        frame: its axes.
        length: to the edge of the other deck, metres.
        rise: by how much that is higher, metres.
        width: of what is rolled on, metres.
        before: half an edge of the deck that it leaves, metres.
        behind: half an edge of the deck that it leads to, metres.
        name: of pieces that need one.
    """

    frame: Frame
    length: float
    rise: float
    width: float
    before: float
    behind: float
    name: str


@dataclass(frozen=True, slots=True)
class Draft:
    """Pieces so far.

    Attributes:
        rng: what chance decides.
        fields: lists of pieces, by their field in the level.
    """

    rng: np.random.Generator
    fields: dict[str, list[dict[str, Any]]] = field(default_factory=lambda: defaultdict(list))

    def add(self, kind: str, **fields: Any) -> None:
        """Add a piece."""
        self.fields[kind].append(fields)

    def coin(self, frame: Frame, along: float, left: float = 0.0, up: float = 0.0) -> None:
        """Add a coin where a ball would lie."""
        self.add("coins", at=frame.point(along, left, up + BALL_M))

    def slab(
        self, frame: Frame, along: tuple[float, float], width: float, up: float, material: str
    ) -> None:
        """Add a box whose upper face is rolled on, from one place along the axis to another."""
        begin, end = along
        self.add(
            "boxes",
            at=frame.point((begin + end) / 2, 0.0, up - THICKNESS_M / 2),
            size=frame.size(end - begin, width, THICKNESS_M),
            material=material,
        )

    def between(self, low: float, high: float) -> float:
        """Return a number between two, each as likely."""
        return low + (high - low) * float(self.rng.random())

    def chance(self, probability: float) -> bool:
        """Say whether something happens."""
        return bool(self.rng.random() < probability)

    def side(self) -> float:
        """Return -1 or 1."""
        return 1.0 if self.chance(0.5) else -1.0
