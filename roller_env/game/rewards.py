"""What a step is worth: small functions over rows, and the weights that they are summed with."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from roller_env import checks
from roller_env.arrays import Float64, Int64
from roller_env.compiled import device_function
from roller_env.game.result import REWARD_TERMS

RewardMode = Literal["points", "shaped", "nearness"]

POINTS, ROUTE, NEARNESS = range(3)
"""What the potential of each `RewardMode` is of, in their order."""

NEARNESS_M: Final = 4.0
"""Distance from which on what is left to do draws the ball nearer."""


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Points for what happens in a step.

    Attributes:
        coin: for each coin collected.
        finish: for reaching the finish. By default twice the progress: at the finish the shaping
            takes the potential back, and that step should still be worth taking.
        fall: for falling below the kill height.
        progress: potential of a completed route for the ``shaped`` reward, of being at the next
            thing to do for ``nearness``.
        completeness: what leaving coins costs at the finish, 0 or more: it is paid
            ``finish * (1 - completeness * share of the coins left)``. With 0 it is paid in full,
            with 1 by the share collected, with 4 it costs who has left more than a quarter.
    """

    coin: float = 1.0
    finish: float = 20.0
    fall: float = -1.0
    progress: float = 10.0
    completeness: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no finite number, and a completeness below 0."""
        asked: dict[str, Callable[[], Any]] = {
            name: partial(checks.number, f"reward_weights.{name}", getattr(self, name))
            for name in REWARD_TERMS
        }
        asked["completeness"] = lambda: checks.number(
            "reward_weights.completeness", self.completeness, 0.0, 100.0, "a number from 0 to 100"
        )
        checked = checks.each(asked)
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def terms(self) -> tuple[float, float, float, float]:
        """The weights by `REWARD_TERMS`."""
        return (self.coin, self.finish, self.fall, self.progress)


class ShapingState(NamedTuple):
    """What the shaping of N envs owns.

    Attributes:
        waypoint: (N,) index of the next waypoint of the route.
        potential: (N,) of where the ball is.
    """

    waypoint: Int64
    potential: Float64

    @staticmethod
    def initial(num_envs: int) -> ShapingState:
        """Return the state at the start of an episode."""
        return ShapingState(np.zeros(num_envs, dtype=np.int64), np.zeros(num_envs))


@device_function
def next_waypoint(ball: Float64, route: Float64, length: int, radius: float, waypoint: int) -> int:
    """Return the furthest leg that the ball, (3,), has reached, or ``waypoint``.

    A leg is reached when the ball is within the route's radius of it. Legs that the ball has
    jumped over count as passed: a waypoint missed in flight must not draw it back.

    Args:
        ball: its centre, metres.
        route: (W, 3) waypoints, metres.
        length: how many there are.
        radius: the route's, metres.
        waypoint: index of the next so far.
    """
    # The furthest leg counts, and the legs up to the next waypoint are behind already.
    for leg in range(length - 1, waypoint, -1):
        if _leg_distance2(ball, route[leg - 1], route[leg]) <= radius * radius:
            return leg
    return waypoint


@device_function
def _leg_distance2(ball: Float64, start: Float64, end: Float64) -> float:
    """Return the squared distance of a point to the piece from ``start`` to ``end``."""
    way_x, way_y, way_z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    x, y, z = ball[0] - start[0], ball[1] - start[1], ball[2] - start[2]
    length2 = way_x * way_x + way_y * way_y + way_z * way_z
    share = (x * way_x + y * way_y + z * way_z) / max(length2, 1e-12)
    share = min(max(share, 0.0), 1.0)
    x, y, z = x - share * way_x, y - share * way_y, z - share * way_z
    squared: float = x * x + y * y + z * z
    return squared


@device_function
def route_progress(
    ball: Float64, route: Float64, arc: Float64, length: int, waypoint: int
) -> float:
    """Return the fraction of the route that lies behind the ball, 0 to 1.

    It is the arc length up to the next waypoint less the straight distance to it.

    Args:
        ball: its centre, (3,) metres.
        route: (W, 3) waypoints, metres.
        arc: (W,) metres along the route up to each.
        length: how many there are.
        waypoint: index of the next.
    """
    total = arc[length - 1] if length > 1 else 0.0
    if total <= 0.0:
        return 0.0
    goal = route[waypoint]
    x, y, z = goal[0] - ball[0], goal[1] - ball[1], goal[2] - ball[2]
    behind = arc[waypoint] - math.sqrt(x * x + y * y + z * z)
    fraction: float = min(max(behind / total, 0.0), 1.0)
    return fraction


@device_function
def nearness(distance_m: float) -> float:
    """Return 1 where the ball is at what it is to do next, 0 from `NEARNESS_M` on."""
    return 1.0 - min(distance_m / NEARNESS_M, 1.0)


@device_function
def shaping(before: float, after: float, terminated: bool, discount: float) -> float:
    """Return gamma * Phi(s') - Phi(s), with Phi = 0 in terminal states.

    Over any episode this telescopes to a sum that depends on the start alone, so it never changes
    which policy is best (Ng, Harada & Russell 1999), and staying in place earns
    (gamma - 1) * Phi <= 0.
    """
    return discount * (0.0 if terminated else after) - before
