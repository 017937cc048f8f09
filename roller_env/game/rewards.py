"""What a step is worth: small functions over rows, and the weights that they are summed with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Literal

import numpy as np
import numpy.typing as npt

from roller_env.game.rules import Events
from roller_env.game.state import GameState
from roller_env.game.tables import LevelTable

Float64 = npt.NDArray[np.float64]
RewardMode = Literal["points", "shaped"]


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Points for what happens in a step.

    Attributes:
        coin: for each coin collected.
        finish: for reaching the finish. By default twice the progress: at the finish the shaping
            takes the potential back, and that step should still be worth taking.
        fall: for falling below the kill height.
        progress: potential of a completed route, for the ``shaped`` reward only.
    """

    coin: float = 1.0
    finish: float = 20.0
    fall: float = -1.0
    progress: float = 10.0

    def __post_init__(self) -> None:
        """Refuse weights that are not finite numbers."""
        for name in self.__slots__:
            value = getattr(self, name)
            if not (isinstance(value, Real) and math.isfinite(value)):
                raise ValueError(f"reward_weights.{name}: found {value!r}; must be a finite number")


def points_reward(events: Events, weights: RewardWeights) -> Float64:
    """Return the points, (N,), of a step's events: coins, finish, fall."""
    points: Float64 = (
        weights.coin * events.coins.sum(axis=1)
        + weights.finish * events.finished
        + weights.fall * events.fallen
    )
    return points


def follow_route(state: GameState, table: LevelTable, ball: Float64) -> None:
    """Advance each row's next waypoint past the furthest leg that the ball, (N, 3), has reached.

    A leg is reached when the ball is within the route's radius of it. Legs that the ball has
    jumped over count as passed: a waypoint missed in flight must not draw it back.
    """
    x, y, z = (
        position[:, None] - start for position, start in zip(ball.T, table.leg_start, strict=True)
    )
    if x.shape[1] == 0:
        return
    way_x, way_y, way_z = table.leg_way
    length2 = way_x * way_x + way_y * way_y + way_z * way_z
    share = (x * way_x + y * way_y + z * way_z) / np.maximum(length2, 1e-12)
    np.clip(share, 0.0, 1.0, out=share)
    distance2 = (x - share * way_x) ** 2 + (y - share * way_y) ** 2 + (z - share * way_z) ** 2
    reached = distance2 <= table.route_radius[:, None] ** 2
    furthest = np.where(reached, np.arange(1, x.shape[1] + 1), 0).max(axis=1)
    state.waypoint = np.maximum(state.waypoint, furthest)


def route_progress(state: GameState, table: LevelTable, ball: Float64) -> Float64:
    """Return the potential, (N,): the share of the route that lies behind the ball, 0 to 1.

    It is the arc length up to the next waypoint less the straight distance to it.
    """
    if table.route.shape[1] < 2:
        return np.zeros(len(ball))
    rows = np.arange(len(ball))
    last = np.maximum(table.route_length - 1, 0)
    next_point = table.route[rows, state.waypoint]
    distance = np.sqrt(((next_point - ball) ** 2).sum(axis=1))
    behind = table.route_arc[rows, state.waypoint] - distance
    total = table.route_arc[rows, last]
    return np.where(total > 0.0, np.clip(behind / np.maximum(total, 1e-12), 0.0, 1.0), 0.0)


def shaping(
    before: Float64, after: Float64, terminated: npt.NDArray[np.bool_], discount: float
) -> Float64:
    """Return gamma * Phi(s') - Phi(s), (N,), with Phi = 0 in terminal states.

    Over any episode this telescopes to a sum that depends on the start alone, so it never changes
    which policy is best (Ng, Harada & Russell 1999), and staying in place earns
    (gamma - 1) * Phi <= 0.
    """
    return discount * np.where(terminated, 0.0, after) - before
