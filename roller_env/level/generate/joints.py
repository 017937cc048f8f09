"""What joins two decks: a table of kinds, and for each what it is built of, in the joint's axes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from roller_env.level.generate.draft import BALL_M, THICKNESS_M, Draft, Span
from roller_env.units import quants

GRAVITY: Final = quants(386.0)
"""m/s^2."""

_CLEAR_M: Final = 0.02
"""Between a platform that moves and a deck."""

_ON_M: Final = 0.06
"""Height of what lies on a floor and has no substance."""


def plank(span: Span, draft: Draft) -> None:
    """Build a level plank, with a coin in three of four."""
    draft.slab(span.frame, (0.0, span.length), span.width, 0.0, "plank")
    if draft.chance(0.75):
        draft.coin(span.frame, span.length / 2, draft.between(-0.3, 0.3) * span.width)


def ice(span: Span, draft: Draft) -> None:
    """Build a plank that is slippery."""
    draft.slab(span.frame, (0.0, span.length), span.width, 0.0, "ice")
    draft.coin(span.frame, span.length / 2, draft.between(-0.2, 0.2) * span.width)


def kerbs(span: Span, draft: Draft) -> None:
    """Build a plank between kerbs."""
    draft.slab(span.frame, (0.0, span.length), span.width, 0.0, "plank")
    for side in (-1.0, 1.0):
        aside = side * (span.width / 2 + 0.1)
        draft.add(
            "walls",
            start=span.frame.point(0.0, aside)[:2],
            end=span.frame.point(span.length, aside)[:2],
            bottom=span.frame.point(0.0, 0.0, -THICKNESS_M)[2],
            height=THICKNESS_M + 0.3,
            thickness=0.2,
            material="kerb",
        )


def ramp(span: Span, draft: Draft) -> None:
    """Build a slope from deck to deck."""
    draft.add(
        "ramps",
        start=span.frame.point(0.0),
        end=span.frame.point(span.length, 0.0, span.rise),
        width=span.width,
        thickness=THICKNESS_M,
        material="plank",
    )


def wedge(span: Span, draft: Draft) -> None:
    """Build a steep slope on one end of a plank, or on the other if it goes down."""
    low, steep = min(span.rise, 0.0), 0.6 * span.length
    ends = (span.length - steep, span.length) if span.rise > 0.0 else (0.0, steep)
    height = abs(span.rise)
    draft.slab(span.frame, (0.0, span.length), span.width, low, "plank")
    draft.add(
        "wedges",
        at=span.frame.point(sum(ends) / 2, 0.0, low + height / 2),
        size=(steep, span.width, height),
        yaw_deg=90.0 * ((span.frame.heading + (0 if span.rise > 0.0 else 2)) % 4),
        material="plank",
    )


def step(span: Span, draft: Draft) -> None:
    """Build a plank that ends over the lower deck."""
    draft.slab(span.frame, (0.0, span.length), span.width, 0.0, "plank")
    draft.coin(span.frame, span.length / 2)


def gap(span: Span, draft: Draft) -> None:
    """Build two halves with nothing between them, the second one lower."""
    gap_m = draft.between(0.15, 0.5)
    near = (span.length - gap_m) / 2
    draft.slab(span.frame, (0.0, near), span.width, 0.0, "plank")
    draft.slab(span.frame, (near + gap_m, span.length), span.width, span.rise, "plank")


def ferry(span: Span, draft: Draft) -> None:
    """Build a platform that goes to and fro."""
    long, wide = 1.6, max(span.width, 1.5)
    ends = long / 2 + _CLEAR_M, span.length - long / 2 - _CLEAR_M
    begin, end = ends if draft.chance(0.5) else ends[::-1]
    draft.add(
        "platforms",
        name=f"ferry-{span.name}",
        at=span.frame.point(begin, 0.0, -THICKNESS_M / 2),
        to=span.frame.point(end, 0.0, -THICKNESS_M / 2),
        size=span.frame.size(long, wide, THICKNESS_M),
        speed=draft.between(0.8, 1.6),
        wait_s=draft.between(1.0, 2.5),
        material="mover",
    )
    if draft.chance(0.5):
        draft.coin(span.frame, span.length / 2)


def elevator(span: Span, draft: Draft) -> None:
    """Build a platform that goes up and down, as wide as the gap."""
    middle, low = span.length / 2, -THICKNESS_M / 2
    draft.add(
        "platforms",
        name=f"elevator-{span.name}",
        at=span.frame.point(middle, 0.0, low),
        to=span.frame.point(middle, 0.0, low + span.rise),
        size=span.frame.size(span.length - 2 * _CLEAR_M, max(span.width, 1.5), THICKNESS_M),
        speed=draft.between(0.6, 1.2),
        wait_s=draft.between(1.5, 2.5),
        material="mover",
    )


def spring(span: Span, draft: Draft) -> None:
    """Build a pad at the deck's edge that throws the ball onto the middle of the next deck.

    Thrown at v, the ball rises by v^2 / (2 g) and is down again after v / g and the fall's time.
    """
    high = max(span.rise, 0.0) + draft.between(0.6, 1.0)
    up = math.sqrt(2.0 * GRAVITY * high)
    flight_s = up / GRAVITY + math.sqrt(2.0 * (high - span.rise) / GRAVITY)
    deep = 0.8
    far = span.length + span.behind + deep / 2 + BALL_M / 2
    draft.add(
        "springs",
        at=span.frame.point(-deep / 2, 0.0, _ON_M / 2),
        size=span.frame.size(deep, min(2.0, 2.0 * span.before), _ON_M),
        velocity=span.frame.vector(far / flight_s, 0.0, up),
    )
    if draft.chance(0.5):
        draft.coin(span.frame, span.length / 2, 0.0, high - 0.2)


def fan(span: Span, draft: Draft) -> None:
    """Build a plank in a crosswind."""
    draft.slab(span.frame, (0.0, span.length), span.width + 0.3, 0.0, "plank")
    force_n = draft.side() * draft.between(0.8, 2.2)
    draft.add(
        "fans",
        at=span.frame.point(span.length / 2, 0.0, 1.0),
        size=span.frame.size(0.7 * span.length, span.width + 2.0, 2.0),
        force_n=span.frame.vector(0.0, force_n),
    )
    draft.coin(span.frame, span.length / 2)


def bumpers(span: Span, draft: Draft) -> None:
    """Build a wide plank with a bumper on either side, one behind the other."""
    wide, side = span.width + 1.4, draft.side()
    draft.slab(span.frame, (0.0, span.length), wide, 0.0, "plank")
    for part, left in ((0.3, side), (0.7, -side)):
        draft.add(
            "bumpers",
            at=span.frame.point(part * span.length, left * (wide / 2 - 0.35), 0.4),
            size=span.frame.size(0.7, 0.7, 0.8),
            speed=draft.between(1.5, 3.0),
        )
    draft.coin(span.frame, 0.7 * span.length, side * (wide / 2 - 0.4))


def hazards(span: Span, draft: Draft) -> None:
    """Build a wide plank with lava on alternate sides, and a way round it."""
    free = max(span.width, 1.6)
    lava, side = 1.2, draft.side()
    wide = free + lava
    draft.slab(span.frame, (0.0, span.length), wide, 0.0, "plank")
    for part, left in ((0.27, side), (0.73, -side)):
        draft.add(
            "hazards",
            at=span.frame.point(part * span.length, left * (wide - lava) / 2, _ON_M / 2),
            size=span.frame.size(0.16 * span.length, lava, _ON_M),
        )
    draft.coin(span.frame, span.length / 2)


def portal(span: Span, draft: Draft) -> None:
    """Build a teleporter at the deck's edge, and no way but through it."""
    teleporter(draft, span, span.frame.point(span.length + span.behind, 0.0, span.rise + BALL_M))


def teleporter(draft: Draft, span: Span, to: tuple[float, float, float]) -> None:
    """Build a teleporter at the edge of the deck that a span leaves.

    Args:
        draft: to add it to.
        span: at whose beginning it stands.
        to: where a ball would lie; it comes out a little above.
    """
    deep, tall = 0.3, 1.5
    draft.add(
        "teleporters",
        at=span.frame.point(-deep / 2, 0.0, tall / 2),
        size=span.frame.size(deep, 1.4, tall),
        to=(*to[:2], to[2] + 0.15),
    )


def gate(span: Span, draft: Draft) -> None:
    """Build a plank with a gate across it; what opens it is added by whoever asks for one."""
    draft.slab(span.frame, (0.0, span.length), span.width, 0.0, "plank")
    tall = 2.4
    draft.add(
        "gates",
        name=f"gate-{span.name}",
        at=span.frame.point(span.length / 2, 0.0, tall / 2 - 0.5),
        size=span.frame.size(0.3, span.width, tall),
    )


@dataclass(frozen=True, slots=True)
class Joint:
    """A kind of joint.

    Attributes:
        build: adds its pieces.
        easy: how often it is drawn at difficulty 0, beside the others.
        hard: the same at difficulty 1; between, in proportion.
        rise: the lowest and highest that the next deck may lie over this one, metres.
        from_start: whether the first deck may be left by it, where the ball begins.
    """

    build: Callable[[Span, Draft], None]
    easy: float
    hard: float
    rise: tuple[float, float] = (0.0, 0.0)
    from_start: bool = True

    def weight(self, difficulty: float) -> float:
        """Return how often it is drawn at a difficulty, beside the others."""
        return self.easy + (self.hard - self.easy) * difficulty


JOINTS: Final = {
    "plank": Joint(plank, 3.0, 1.0),
    "kerbs": Joint(kerbs, 4.0, 0.3),
    "ice": Joint(ice, 0.0, 1.0),
    "ramp up": Joint(ramp, 0.8, 0.8, (0.4, 1.2)),
    "ramp down": Joint(ramp, 0.8, 0.8, (-1.2, -0.4)),
    "wedge up": Joint(wedge, 0.3, 0.7, (0.3, 0.7)),
    "wedge down": Joint(wedge, 0.3, 0.7, (-0.7, -0.3)),
    "step": Joint(step, 0.8, 1.0, (-1.1, -0.3)),
    "gap": Joint(gap, 0.0, 1.0, (-0.7, -0.25)),
    "gate": Joint(gate, 0.5, 1.0, from_start=False),
    "ferry": Joint(ferry, 0.0, 1.2),
    "elevator": Joint(elevator, 0.3, 1.0, (0.8, 2.2)),
    "spring": Joint(spring, 0.3, 1.2, (-1.0, 1.2), from_start=False),
    "fan": Joint(fan, 0.4, 1.2),
    "bumpers": Joint(bumpers, 0.3, 0.8),
    "hazards": Joint(hazards, 0.0, 0.8),
    "portal": Joint(portal, 0.3, 0.8, (-2.0, 2.0), from_start=False),
}
"""By name. Whoever changes anything here makes another version of the generator."""
