"""What an accuracy run measured, and what follows from it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from roller_env.lab.answers import Answer, Trust, answers, trusts
from roller_env.lab.crowd import CrowdCost
from roller_env.lab.experiment import ErrorKind, Measure, Point, Scene
from roller_env.lab.orders import Order


@dataclass(frozen=True)
class Results:
    """Points and orders of some scenes.

    Attributes:
        scenes: as they were run.
        points: of every scene, method, time step and measure.
        orders: of the free scenes.
        crowd: what a step costs for many bodies at a time; empty without free scenes.
    """

    scenes: Sequence[Scene]
    points: Sequence[Point]
    orders: Sequence[Order]
    crowd: Sequence[CrowdCost]

    def charted(self, kind: ErrorKind) -> list[tuple[Scene, Measure]]:
        """Return the error of this kind that stands for each scene: its first. Not all have one."""
        return [
            (scene, next(one for one in scene.measures if one.kind == kind))
            for scene in self.scenes
            if any(one.kind == kind for one in scene.measures)
        ]

    @cached_property
    def answers(self) -> list[Answer]:
        """The cheapest method for each tolerance, of every error that is charted."""
        charted = [*self.charted("discretisation"), *self.charted("model")]
        return answers(self._points_of(charted))

    @cached_property
    def trusts(self) -> list[Trust]:
        """Up to which time step each method can be trusted on each scene."""
        return trusts(self._points_of([(scene, scene.measures[0]) for scene in self.scenes]))

    def _points_of(self, errors: Iterable[tuple[Scene, Measure]]) -> list[Point]:
        wanted = {(scene.name, one.name) for scene, one in errors}
        return [point for point in self.points if (point.scene, point.measure) in wanted]

    @property
    def disagreeing(self) -> list[Order]:
        """The orders that are not as theory expects."""
        return [order for order in self.orders if not order.agrees]
