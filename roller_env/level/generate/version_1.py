"""Version 1 of the generator: decks on a grid, joined along a route by what a ball can roll over.

A level is a self-avoiding walk from platform to platform. What joins two of them is a plank, a
ramp, a step down, a gap with the far side lower, or a plank with a gate whose plate lies on a
platform before it. Side platforms with coins branch off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

PITCH_M: Final = 4.4
"""Distance of the grid's places."""

_PLATFORM_M: Final = 2.4
_THICKNESS_M: Final = 0.4
_BALL_M: Final = 0.4064
_STEPS: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))
_KERB_M: Final = 0.3

Place = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Knobs:
    """What difficulty turns, each from its easy end to its hard one.

    Attributes:
        platforms: on the route.
        width: of a plank, metres.
        turns: chance that the route turns at a platform.
        slopes: chance of a ramp up or down.
        drops: chance of a step down.
        gaps: chance of a gap.
        gates: how many, at most one in four platforms.
        kerbs: chance that a plank has kerbs.
        ice: chance that a plank is slippery.
        branches: side platforms with coins, for each platform of the route.
    """

    platforms: int
    width: float
    turns: float
    slopes: float
    drops: float
    gaps: float
    gates: int
    kerbs: float
    ice: float
    branches: float

    @staticmethod
    def of(difficulty: float, rng: np.random.Generator) -> Knobs:
        """Return the knobs of a difficulty, 0 to 1, some of them by chance."""
        d = difficulty
        return Knobs(
            platforms=3 + round(11.0 * d + rng.uniform(0.0, 2.0)),
            width=float((2.2 - 1.2 * d) * rng.uniform(0.9, 1.1)),
            turns=0.25 + 0.35 * d,
            slopes=0.1 + 0.25 * d,
            drops=0.1 + 0.15 * d,
            gaps=0.2 * d,
            gates=round(2.4 * d * rng.uniform(0.2, 1.0)),
            kerbs=max(0.0, 0.9 - 1.4 * d),
            ice=max(0.0, 0.4 * (d - 0.4)),
            branches=0.15 + 0.2 * d,
        )


def fields(difficulty: float, rng: np.random.Generator) -> dict[str, Any]:
    """Return what a level of a difficulty, 0 to 1, consists of, but for its name."""
    knobs = Knobs.of(difficulty, rng)
    builder = _Builder(knobs, rng)
    builder.build()
    return {
        "time_limit_s": 30.0 + 8.0 * knobs.platforms,
        "kill_height": min(0.0, builder.lowest) - 12.0,
        "materials": {
            "deck": {"colour": "#2a9d8f", "pattern": "checker"},
            "plank": {"colour": "#3f7fd6", "pattern": "grid"},
            "ice": {"colour": "#bfe6ff", "friction": 0.25},
            "kerb": {"colour": "#46566e"},
        },
        **builder.parts,
    }


class _Builder:
    """Puts the pieces of one level together."""

    def __init__(self, knobs: Knobs, rng: np.random.Generator) -> None:
        self._knobs, self._rng = knobs, rng
        self.parts: dict[str, Any] = {
            name: [] for name in ("boxes", "ramps", "walls", "plates", "gates", "coins")
        }
        self.lowest = 0.0

    def build(self) -> None:
        """Make the whole level."""
        places = self._walk()
        heights, joints = [0.0], []
        gates = self._gated(len(places))
        for number in range(1, len(places)):
            joint, change = self._joint(number in gates)
            joints.append(joint)
            heights.append(heights[-1] + change)
        self.lowest = min(heights)
        for place, height in zip(places, heights, strict=True):
            self._platform(place, height)
        for number, joint in enumerate(joints):
            ends = places[number], places[number + 1]
            self._join(ends, (heights[number], heights[number + 1]), joint)
            if joint == "gate":
                self._plate(places[number], heights[number])
        self._branch_off(places, heights)
        self._begin_and_end(places, heights)

    def _walk(self) -> list[Place]:
        """Return the route's places: a walk that meets itself nowhere."""
        rng = self._rng
        while True:
            places, heading = [(0, 0)], 0
            while len(places) < self._knobs.platforms:
                turns = [heading]
                if rng.random() < self._knobs.turns:
                    turns = [(heading + side) % 4 for side in rng.permutation([1, 3]).tolist()]
                    turns.append(heading)
                free = [turn for turn in turns if self._next(places[-1], turn) not in places]
                if not free:
                    break
                heading = free[0]
                places.append(self._next(places[-1], heading))
            if len(places) == self._knobs.platforms:
                return places

    @staticmethod
    def _next(place: Place, heading: int) -> Place:
        step = _STEPS[heading]
        return place[0] + step[0], place[1] + step[1]

    def _gated(self, platforms: int) -> set[int]:
        """Return before which platforms gates stand, never before the first two."""
        allowed = np.arange(2, platforms)
        count = min(self._knobs.gates, platforms // 4)
        return set(self._rng.choice(allowed, count, replace=False).tolist()) if count else set()

    def _joint(self, gated: bool) -> tuple[str, float]:
        """Return how two platforms are joined, and how much higher the second is, metres."""
        rng, knobs = self._rng, self._knobs
        chance = rng.random()
        change = float(rng.uniform(0.4, 1.1))
        if gated:
            return "gate", 0.0
        if chance < knobs.slopes:
            return "ramp", change * (1.0 if rng.random() < 0.5 else -1.0)
        if chance < knobs.slopes + knobs.drops:
            return "drop", -change
        if chance < knobs.slopes + knobs.drops + knobs.gaps:
            return "gap", -0.7 * change
        return "plank", 0.0

    def _platform(self, place: Place, height: float) -> None:
        at = (place[0] * PITCH_M, place[1] * PITCH_M, height - _THICKNESS_M / 2)
        size = (_PLATFORM_M, _PLATFORM_M, _THICKNESS_M)
        self.parts["boxes"].append({"at": at, "size": size, "material": "deck"})

    def _join(self, places: tuple[Place, Place], heights: tuple[float, float], joint: str) -> None:
        """Join two platforms that are neighbours on the grid."""
        (x0, y0), (x1, y1) = (np.array(place) * PITCH_M for place in places)
        way = np.array([x1 - x0, y1 - y0]) / PITCH_M
        begin = np.array([x0, y0]) + way * _PLATFORM_M / 2
        end = np.array([x1, y1]) - way * _PLATFORM_M / 2
        icy = self._rng.random() < self._knobs.ice
        material = "ice" if icy else "plank"
        if joint == "ramp":
            ends = {
                "start": (*begin.tolist(), heights[0]),
                "end": (*end.tolist(), heights[1]),
            }
            size = {"width": self._knobs.width, "thickness": _THICKNESS_M}
            self.parts["ramps"].append({**ends, **size, "material": material})
            return
        if joint == "gap":
            # The near half as high as what it comes from, the far one as what it leads to.
            length = float(np.linalg.norm(end - begin))
            gap = 0.15 + 0.35 * self._rng.random()
            near = begin + way * (length - gap) / 2
            far = end - way * (length - gap) / 2
            self._plank(begin, near, heights[0], material)
            self._plank(far, end, heights[1], material)
            return
        self._plank(begin, end, heights[0], material)
        if joint == "gate":
            self._gate((begin + end) / 2, way, heights[0])
            return
        if self._rng.random() < self._knobs.kerbs:
            self._kerbs(begin, end, way, heights[0])
        if self._rng.random() < 0.7:
            aside = self._rng.uniform(-0.3, 0.3) * self._knobs.width
            x, y = (begin + end) / 2 + aside * np.array([-way[1], way[0]])
            self._coin(float(x), float(y), heights[0])

    def _plank(self, begin: Any, end: Any, height: float, material: str) -> None:
        middle, span = (begin + end) / 2, np.abs(end - begin)
        size = np.where(span > 1e-9, span, self._knobs.width)
        self.parts["boxes"].append(
            {
                "at": (*middle.tolist(), height - _THICKNESS_M / 2),
                "size": (*size.tolist(), _THICKNESS_M),
                "material": material,
            }
        )

    def _kerbs(self, begin: Any, end: Any, way: Any, height: float) -> None:
        aside = np.array([-way[1], way[0]]) * (self._knobs.width / 2 + 0.1)
        for side in (aside, -aside):
            self.parts["walls"].append(
                {
                    "start": (begin + side).tolist(),
                    "end": (end + side).tolist(),
                    "bottom": height - _THICKNESS_M,
                    "height": _THICKNESS_M + _KERB_M,
                    "thickness": 0.2,
                    "material": "kerb",
                }
            )

    def _gate(self, middle: Any, way: Any, height: float) -> None:
        along = np.abs(way) > 0.5
        size = np.where(along, 0.3, self._knobs.width)
        tall = 2.4
        self.parts["gates"].append(
            {
                "name": f"gate{self._gates + 1}",
                "at": (*middle.tolist(), height + tall / 2 - 0.5),
                "size": (*size.tolist(), tall),
            }
        )

    def _plate(self, place: Place, height: float) -> None:
        """Put the plate of the latest gate on a platform, off its middle."""
        gate = f"gate{self._gates}"
        aside = self._rng.choice([-1.0, 1.0], 2) * 0.55
        at = (
            place[0] * PITCH_M + float(aside[0]),
            place[1] * PITCH_M + float(aside[1]),
            height - 0.2,
        )
        size = (0.9, 0.9, 0.5)
        self.parts["plates"].append(
            {"name": f"plate{self._gates}", "at": at, "size": size, "opens": [gate]}
        )

    @property
    def _gates(self) -> int:
        return len(self.parts["gates"])

    def _branch_off(self, places: list[Place], heights: list[float]) -> None:
        """Add side platforms with coins."""
        rng, taken = self._rng, set(places)
        for number, place in enumerate(places[:-1]):
            if rng.random() >= self._knobs.branches:
                continue
            beside = [self._next(place, heading) for heading in rng.permutation(4).tolist()]
            free = [other for other in beside if other not in taken]
            if free:
                taken.add(free[0])
                self._platform(free[0], heights[number])
                self._join((place, free[0]), (heights[number], heights[number]), "plank")
                for _ in range(int(rng.integers(1, 4))):
                    x, y = (np.array(free[0]) * PITCH_M + rng.uniform(-0.8, 0.8, 2)).tolist()
                    self._coin(x, y, heights[number])

    def _coin(self, x: float, y: float, height: float) -> None:
        self.parts["coins"].append({"at": (x, y, height + _BALL_M)})

    def _begin_and_end(self, places: list[Place], heights: list[float]) -> None:
        x, y = (np.array(places[-1]) * PITCH_M).tolist()
        self.parts["start"] = {"at": (0.0, 0.0, _BALL_M), "jitter": (0.3, 0.3)}
        self.parts["finish"] = {"at": (x, y, heights[-1] + 0.6), "size": (0.9, 0.9, 1.2)}
        points = [
            (*(np.array(place) * PITCH_M).tolist(), height + _BALL_M)
            for place, height in zip(places, heights, strict=True)
        ]
        self.parts["route"] = {"points": points}
