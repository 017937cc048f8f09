"""What a step is worth: small functions over rows, and the weights that they are summed with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from roller_env import checks
from roller_env.compiled import compiled
from roller_env.game.result import REWARD_TERMS
from roller_env.game.state import GameState
from roller_env.game.sweep import Events
from roller_env.game.tables import LevelTable

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]
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
        checked = checks.each(
            {
                name: partial(checks.number, f"reward_weights.{name}", getattr(self, name))
                for name in REWARD_TERMS
            }
        )
        for name, value in checked.items():
            object.__setattr__(self, name, value)


def event_terms(events: Events, weights: RewardWeights) -> Float64:
    """Return what a step's events are worth, (N, 4) by `REWARD_TERMS`; the progress is left 0."""
    terms = np.zeros((len(events.points), len(REWARD_TERMS)))
    _weigh(
        weights.coin,
        weights.finish,
        weights.fall,
        events.points,
        events.finished,
        events.fallen,
        terms,
    )
    return terms


@compiled
def _weigh(
    coin: float,
    finish: float,
    fall: float,
    coins: Int64,
    finished: Bool,
    fallen: Bool,
    terms: Float64,
) -> None:
    for row in range(len(terms)):
        terms[row, 0] = coin * coins[row]
        terms[row, 1] = finish * finished[row]
        terms[row, 2] = fall * fallen[row]


def add_up(terms: Float64, total_reward: Float64, reward_terms: Float64) -> Float64:
    """Return a step's rewards, (N,): its terms, (N, 4), added up in their order.

    Args:
        terms: the step's.
        total_reward: (N,) of the episodes so far; the step's are added.
        reward_terms: (N, 4) likewise.
    """
    reward = np.empty(len(terms))
    _add_up(terms, total_reward, reward_terms, reward)
    return reward


@compiled
def _add_up(terms: Float64, total_reward: Float64, reward_terms: Float64, reward: Float64) -> None:
    for row in range(len(terms)):
        reward[row] = terms[row, 0]
        for term in range(1, terms.shape[1]):
            reward[row] += terms[row, term]
        total_reward[row] += reward[row]
        for term in range(terms.shape[1]):
            reward_terms[row, term] += terms[row, term]


def follow_route(state: GameState, table: LevelTable, ball: Float64) -> None:
    """Advance each row's next waypoint past the furthest leg that the ball, (N, 3), has reached.

    A leg is reached when the ball is within the route's radius of it. Legs that the ball has
    jumped over count as passed: a waypoint missed in flight must not draw it back.
    """
    _follow_route(ball, table.route, table.route_length, table.route_radius, state.waypoint)


@compiled
def _follow_route(
    ball: Float64, route: Float64, length: Int64, radius: Float64, waypoint: Int64
) -> None:
    for row in range(len(ball)):
        x, y, z = ball[row, 0], ball[row, 1], ball[row, 2]
        # The furthest leg counts, and the legs up to the next waypoint are behind already.
        for leg in range(length[row] - 1, waypoint[row], -1):
            start, end = route[row, leg - 1], route[row, leg]
            if _leg_distance2(x, y, z, start, end) <= radius[row] * radius[row]:
                waypoint[row] = leg
                break


@compiled
def _leg_distance2(x: float, y: float, z: float, start: Float64, end: Float64) -> float:
    """Return the squared distance of a point to the piece from ``start`` to ``end``."""
    way_x, way_y, way_z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    x, y, z = x - start[0], y - start[1], z - start[2]
    length2 = way_x * way_x + way_y * way_y + way_z * way_z
    share = (x * way_x + y * way_y + z * way_z) / max(length2, 1e-12)
    share = min(max(share, 0.0), 1.0)
    x, y, z = x - share * way_x, y - share * way_y, z - share * way_z
    return x * x + y * y + z * z


def route_progress(state: GameState, table: LevelTable, ball: Float64) -> Float64:
    """Return the potential, (N,): the share of the route that lies behind the ball, 0 to 1.

    It is the arc length up to the next waypoint less the straight distance to it.
    """
    progress = np.zeros(len(ball))
    _route_progress(
        ball, table.route, table.route_arc, table.route_length, state.waypoint, progress
    )
    return progress


@compiled
def _route_progress(
    ball: Float64,
    route: Float64,
    arc: Float64,
    length: Int64,
    waypoint: Int64,
    progress: Float64,
) -> None:
    for row in range(len(ball)):
        total = arc[row, length[row] - 1] if length[row] > 1 else 0.0
        if total > 0.0:
            goal = route[row, waypoint[row]]
            x, y, z = goal[0] - ball[row, 0], goal[1] - ball[row, 1], goal[2] - ball[row, 2]
            behind = arc[row, waypoint[row]] - math.sqrt(x * x + y * y + z * z)
            progress[row] = min(max(behind / total, 0.0), 1.0)


def shaping(before: Float64, after: Float64, terminated: Bool, discount: float) -> Float64:
    """Return gamma * Phi(s') - Phi(s), (N,), with Phi = 0 in terminal states.

    Over any episode this telescopes to a sum that depends on the start alone, so it never changes
    which policy is best (Ng, Harada & Russell 1999), and staying in place earns
    (gamma - 1) * Phi <= 0.
    """
    reward = np.empty(len(before))
    _shape(before, after, terminated, float(discount), reward)
    return reward


@compiled
def _shape(
    before: Float64, after: Float64, terminated: Bool, discount: float, reward: Float64
) -> None:
    for row in range(len(reward)):
        reward[row] = discount * (0.0 if terminated[row] else after[row]) - before[row]
