"""Version 2 of the generator: a route over decks on a grid, joined by all kinds of pieces.

The route is a walk that meets itself nowhere; each joint is drawn from `joints.JOINTS`, and says by
how much the way rises there. Then come loops, where decks of the route lie beside each other, and
side ways: with coins, with what opens a gate further on, or with nothing, if not a teleporter back
to the start.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from roller_env.level.generate.draft import BALL_M, Draft, Frame, Span, rounded
from roller_env.level.generate.joints import JOINTS, ramp, teleporter

PITCH_M: Final = 6.4
"""Distance of the grid's places."""

_AWAY: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))
"""Steps on the grid, by heading."""

_FIRST_DECK_M: Final = 3.2

_STEEPEST_M: Final = 1.2
"""Rise of a loop's ramp at most."""

_MATERIALS: Final[dict[str, dict[str, Any]]] = {
    "deck": {"colour": "#3f8f7f", "pattern": "checker"},
    "side": {"colour": "#8f7a4f", "pattern": "checker"},
    "plank": {"colour": "#4f7fc6", "pattern": "grid"},
    "ice": {"colour": "#bfe6ff", "friction": 0.25},
    "kerb": {"colour": "#46566e"},
    "mover": {"colour": "#8793a6", "pattern": "grid"},
}

Place = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Knobs:
    """What difficulty turns, beside how often each of `joints.JOINTS` is drawn.

    Attributes:
        decks: on the route.
        width: of a joint, metres; the ball is 0.81 m wide.
        turns: chance that the route turns at a deck.
        loops: chance that two decks of the route that lie beside each other are joined.
        branches: chance that a side way leaves a deck of the route.
        decoys: chance that it leads to nothing.
        portals_back: chance that a decoy has a teleporter back to the start.
        errands: chance that a gate is opened by a switch on a side way, not by a plate before it.
        closing: chance that such a gate closes again.
        toll: chance that the finish asks for coins.
    """

    decks: int
    width: float
    turns: float
    loops: float
    branches: float
    decoys: float
    portals_back: float
    errands: float
    closing: float
    toll: float

    @staticmethod
    def of(difficulty: float, draft: Draft) -> Knobs:
        """Return the knobs of a difficulty, 0 to 1, some of them by chance."""
        d = difficulty
        return Knobs(
            decks=3 + round(6.5 * d + draft.between(0.0, 2.0)),
            width=(2.4 - 1.1 * d) * draft.between(0.9, 1.1),
            turns=draft.between(0.2, 0.5) + 0.2 * d,
            loops=0.3 + 0.3 * d,
            branches=0.25 + 0.15 * d,
            decoys=0.4 * d,
            portals_back=0.5,
            errands=0.2 + 0.5 * d,
            closing=0.6 * d,
            toll=0.3 * d,
        )


@dataclass(frozen=True, slots=True)
class _Deck:
    """What is stood on at a place.

    Attributes:
        place: on the grid.
        height: of its upper face, metres.
        edge: of its square, metres.
    """

    place: Place
    height: float
    edge: float

    def frame(self, along: float = 0.0, heading: int = 0) -> Frame:
        """Return axes so far from its middle, on the upper face."""
        x, y = (
            PITCH_M * step + along * away
            for step, away in zip(self.place, _AWAY[heading], strict=True)
        )
        return Frame((rounded(x), rounded(y), rounded(self.height)), heading)

    @property
    def middle(self) -> tuple[float, float, float]:
        """Where a ball lies on its middle."""
        return self.frame().point(0.0, 0.0, BALL_M)


def fields(difficulty: float, rng: np.random.Generator) -> dict[str, Any]:
    """Return what a level of a difficulty, 0 to 1, consists of, but for its name."""
    draft = Draft(rng)
    builder = _Builder(draft, Knobs.of(difficulty, draft), difficulty)
    builder.build()
    route, decks = builder.route, builder.decks.values()
    finish = route[-1].frame()
    coins = len(draft.fields["coins"])
    toll = (
        1 + int(rng.integers(coins // 2)) if coins > 1 and draft.chance(builder.knobs.toll) else 0
    )
    return {
        "time_limit_s": 40.0 + 10.0 * len(decks),
        "kill_height": min(deck.height for deck in decks) - 8.0,
        "materials": _MATERIALS,
        "start": {"at": route[0].middle, "jitter": (0.3, 0.3)},
        "finish": {
            "at": finish.point(0.0, 0.0, 0.6),
            "size": (0.9, 0.9, 1.2),
            "needs_coins": min(toll, 3),
        },
        "route": {"points": [deck.middle for deck in route]},
        **draft.fields,
    }


class _Builder:
    """Puts the pieces of one level together.

    Attributes:
        knobs: what difficulty has turned.
        route: the decks from the start to the finish.
        decks: all of them, by place.
    """

    def __init__(self, draft: Draft, knobs: Knobs, difficulty: float) -> None:
        self.knobs, self._draft = knobs, draft
        self._weights = {name: joint.weight(difficulty) for name, joint in JOINTS.items()}
        self.route: list[_Deck] = []
        self.decks: dict[Place, _Deck] = {}
        self._joined: set[frozenset[Place]] = set()

    def build(self) -> None:
        """Make the whole level."""
        gates = self._route(self._walk())
        for number in gates:
            self._lock(number)
        self._loops()
        for deck in self.route[:-1]:
            if self._draft.chance(self.knobs.branches):
                self._branch(deck)

    def _walk(self) -> list[Place]:
        """Return the route's places: a walk that meets itself nowhere."""
        while True:
            places, heading = [(0, 0)], 0
            while len(places) < self.knobs.decks:
                side = 1 if self._draft.chance(0.5) else 3
                turned = [(heading + side) % 4, (heading - side) % 4, heading]
                headings = turned if self._draft.chance(self.knobs.turns) else [heading]
                free = [h for h in headings if _next(places[-1], h) not in places]
                if not free:
                    break
                heading = free[0]
                places.append(_next(places[-1], heading))
            if len(places) == self.knobs.decks:
                return places

    def _route(self, places: list[Place]) -> list[int]:
        """Build decks and joints of the route; return the joints that are gates."""
        draft, gates = self._draft, []
        self.route.append(self._deck(places[0], 0.0, _FIRST_DECK_M, "deck"))
        for number, place in enumerate(places[1:]):
            before = self.route[-1]
            allowed = {
                name: weight
                for name, weight in self._weights.items()
                if number or JOINTS[name].from_start
            }
            name = _drawn(allowed, draft)
            rise = draft.between(*JOINTS[name].rise)
            edge = draft.between(2.6, 3.2)
            deck = self._deck(place, before.height + rise, edge, "deck")
            self.route.append(deck)
            JOINTS[name].build(self._span(before, deck, f"{number}"), draft)
            self._joined.add(frozenset((before.place, place)))
            if name == "gate":
                gates.append(number)
        return gates

    def _deck(self, place: Place, height: float, edge: float, material: str) -> _Deck:
        deck = _Deck(place, rounded(height), rounded(edge))
        half = deck.edge / 2
        self._draft.slab(deck.frame(), (-half, half), deck.edge, 0.0, material)
        self.decks[place] = deck
        return deck

    def _span(self, before: _Deck, behind: _Deck, name: str) -> Span:
        heading = _AWAY.index(
            (behind.place[0] - before.place[0], behind.place[1] - before.place[1])
        )
        return Span(
            frame=before.frame(before.edge / 2, heading),
            length=rounded(PITCH_M - (before.edge + behind.edge) / 2),
            rise=rounded(behind.height - before.height),
            width=rounded(self.knobs.width),
            before=before.edge / 2,
            behind=behind.edge / 2,
            name=name,
        )

    def _lock(self, number: int) -> None:
        """Add what opens the gate that is a joint of the route: a plate, or a switch aside."""
        draft, gate, deck = self._draft, f"gate-{number}", self.route[number]
        errand = self._free_beside(deck) if draft.chance(self.knobs.errands) else None
        if errand is None:
            frame = deck.frame()
            aside = (0.6 * draft.side(), 0.6 * draft.side())
            draft.add(
                "plates",
                name=f"plate-{number}",
                at=frame.point(*aside, -0.2),
                size=(1.1, 1.1, 0.5),
                opens=[gate],
            )
            return
        side = self._deck(errand, deck.height, draft.between(2.0, 2.6), "side")
        self._join(deck, side)
        lock: dict[str, Any] = {"mode": "once"}
        if draft.chance(self.knobs.closing):
            lock = {"mode": "timed", "duration_s": rounded(draft.between(8.0, 14.0))}
            next(each for each in draft.fields["gates"] if each["name"] == gate)["closes"] = True
        size = (1.0, 1.0, 0.06)
        draft.add("switches", at=side.frame().point(0.0, 0.0, 0.03), size=size, sets=[gate], **lock)

    def _loops(self) -> None:
        """Join decks of the route that lie beside each other and are not joined."""
        for number, deck in enumerate(self.route):
            for other in self.route[number + 2 :]:
                apart = abs(deck.place[0] - other.place[0]) + abs(deck.place[1] - other.place[1])
                gentle = abs(deck.height - other.height) <= _STEEPEST_M
                if apart == 1 and gentle and self._draft.chance(self.knobs.loops):
                    self._join(deck, other)

    def _branch(self, deck: _Deck) -> None:
        """Add a side way of one deck or two."""
        draft, before = self._draft, deck
        for _ in range(1 + int(draft.chance(0.3))):
            place = self._free_beside(before)
            if place is None:
                break
            rise = draft.between(-0.9, 0.9) if draft.chance(0.4) else 0.0
            behind = self._deck(place, before.height + rise, draft.between(1.8, 2.6), "side")
            self._join(before, behind)
            before = behind
        if before is deck:
            return
        if not draft.chance(self.knobs.decoys):
            for _ in range(1 + int(draft.rng.integers(3))):
                reach = before.edge / 2 - 0.3
                left, along = draft.between(-reach, reach), draft.between(-reach, reach)
                draft.coin(before.frame(), along, left)
        elif draft.chance(self.knobs.portals_back):
            out = Span(before.frame(before.edge / 2, 0), 0.0, 0.0, 0.0, 0.0, 0.0, "")
            teleporter(draft, out, self.route[0].middle)

    def _join(self, before: _Deck, behind: _Deck) -> None:
        """Join two decks that are no neighbours on the route by what a ball can roll over."""
        span = self._span(before, behind, "")
        flat = ("plank", "kerbs", "ice", "fan", "bumpers", "hazards")
        if span.rise == 0.0:
            name = _drawn({name: self._weights[name] for name in flat}, self._draft)
            JOINTS[name].build(span, self._draft)
        else:
            ramp(span, self._draft)

    def _free_beside(self, deck: _Deck) -> Place | None:
        """Return a place beside a deck where nothing is, if there is one."""
        first = int(self._draft.rng.integers(4))
        places = [_next(deck.place, first + turn) for turn in range(4)]
        return next((place for place in places if place not in self.decks), None)


def _next(place: Place, heading: int) -> Place:
    x, y = _AWAY[heading % 4]
    return place[0] + x, place[1] + y


def _drawn(weights: dict[str, float], draft: Draft) -> str:
    """Return a name, each as often as its weight says."""
    left = draft.between(0.0, sum(weights.values()))
    for name, weight in weights.items():
        left -= weight
        if left < 0.0:
            return name
    return name
