"""What a reader wants to know of the points: the cheapest method, and the largest step to trust."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from roller_env.lab.experiment import Point

TOLERANCES: Final = (1e-3, 1e-6, 1e-9)
TRUSTED_ERROR: Final = 1e-2
"""A time step is trusted when it and every smaller one keep the error under this."""

ROUNDING: Final = 1e-13
"""Errors below it are rounding of float64: the answer is exact."""

TIE: Final = 0.15
"""Costs within this of the cheapest count as the same: a shared machine's clock knows no better."""

Cost = Literal["wall time", "force evaluations"]
COSTS: Final[tuple[Cost, ...]] = ("wall time", "force evaluations")


@dataclass(frozen=True, slots=True)
class Answer:
    """The cheapest way to an error, one of the time steps that were measured."""

    scene: str
    measure: str
    kind: str
    tolerance: float
    cost: Cost
    method: str
    """Empty where no method reaches the tolerance."""
    also: str
    """Methods that cost the same within `TIE`."""
    dt_s: float
    error: float
    times_real_time: float
    evaluations_per_s: float
    largest_tried: bool
    """Whether no larger time step was tried, so that one might do, and be cheaper."""


@dataclass(frozen=True, slots=True)
class Trust:
    """Up to which time step a method can be trusted on a scene."""

    scene: str
    method: str
    measure: str
    kind: str
    largest_dt_s: float
    """The largest that keeps the error under `TRUSTED_ERROR`, as all smaller ones do; 0: none."""
    first_failing_dt_s: float
    """The smallest with which the method failed; infinite: none that was tried."""


def curves(points: Iterable[Point]) -> dict[tuple[str, str, str], list[Point]]:
    """Return the points of each (scene, measure, method), smallest time step first."""
    found: dict[tuple[str, str, str], list[Point]] = {}
    for point in points:
        found.setdefault((point.scene, point.measure, point.method), []).append(point)
    return {name: sorted(rows, key=lambda point: point.dt_s) for name, rows in found.items()}


def sound(curve: Sequence[Point]) -> list[Point]:
    """Return the points before the first that fails as time steps grow; later ones are luck.

    Args:
        curve: one method's points, smallest time step first.
    """
    return list(itertools.takewhile(lambda point: not fails(point), curve))


def first_failure(curve: Sequence[Point]) -> Point | None:
    """Return the point of the smallest time step that fails, or None."""
    return next(filter(fails, curve), None)


def fails(point: Point) -> bool:
    """Return whether the method failed there, or gave no number for this error."""
    return point.failed or not math.isfinite(point.error)


def reliable(curve: Sequence[Point], tolerance: float) -> list[Point]:
    """Return the points of a curve that keep to a tolerance, as all of smaller time steps do.

    A larger step that happens to land near the answer is no method that has the error.

    Args:
        curve: one method's points, smallest time step first.
        tolerance: largest error.
    """
    return list(itertools.takewhile(lambda point: point.error <= tolerance, sound(curve)))


def cost_of(point: Point, cost: Cost) -> float:
    """Return what a simulated second costs: seconds, or evaluations."""
    return point.wall_s_per_s if cost == "wall time" else point.evaluations_per_s


def answers(points: Sequence[Point]) -> list[Answer]:
    """Return the cheapest method for each tolerance, by each cost.

    Args:
        points: of one measure a scene.
    """
    return [
        _answer(list(rows), tolerance, cost)
        for rows in _by_scene(points)
        for tolerance in TOLERANCES
        for cost in COSTS
    ]


def _by_scene(points: Sequence[Point]) -> list[list[Point]]:
    names = dict.fromkeys((point.scene, point.measure) for point in points)
    return [[p for p in points if (p.scene, p.measure) == name] for name in names]


def _answer(points: list[Point], tolerance: float, cost: Cost) -> Answer:
    cheapest = [
        min(kept, key=lambda point: cost_of(point, cost))
        for curve in curves(points).values()
        if (kept := reliable(curve, tolerance))
    ]
    cheapest.sort(key=lambda point: (cost_of(point, cost), point.error))
    first = points[0]
    if not cheapest:
        return Answer(
            scene=first.scene,
            measure=first.measure,
            kind=first.kind,
            tolerance=tolerance,
            cost=cost,
            method="",
            also="",
            dt_s=math.nan,
            error=math.nan,
            times_real_time=math.nan,
            evaluations_per_s=math.nan,
            largest_tried=False,
        )
    best, *others = cheapest
    limit = cost_of(best, cost) * (1.0 + TIE)
    return Answer(
        scene=best.scene,
        measure=best.measure,
        kind=best.kind,
        tolerance=tolerance,
        cost=cost,
        method=best.method,
        also=", ".join(one.method for one in others if cost_of(one, cost) <= limit),
        dt_s=best.dt_s,
        error=best.error,
        times_real_time=1.0 / best.wall_s_per_s,
        evaluations_per_s=best.evaluations_per_s,
        largest_tried=best.dt_s == max(p.dt_s for p in points if p.method == best.method),
    )


def trusts(points: Sequence[Point]) -> list[Trust]:
    """Return up to which time step each method can be trusted."""
    found = []
    for curve in curves(points).values():
        kept = reliable(curve, TRUSTED_ERROR)
        failure = first_failure(curve)
        found.append(
            Trust(
                scene=curve[0].scene,
                method=curve[0].method,
                measure=curve[0].measure,
                kind=curve[0].kind,
                largest_dt_s=kept[-1].dt_s if kept else 0.0,
                first_failing_dt_s=failure.dt_s if failure else math.inf,
            )
        )
    return found


def pareto(points: Sequence[Point], cost: Cost) -> list[Point]:
    """Return the points that no other beats in both error and cost, cheapest first.

    All errors under `ROUNDING` are alike: none is better than exact.
    """
    front: list[Point] = []
    candidates = [point for curve in curves(points).values() for point in sound(curve)]
    for point in sorted(candidates, key=lambda point: (cost_of(point, cost), point.error)):
        if not front or max(point.error, ROUNDING) < front[-1].error:
            front.append(point)
    return front
