"""A game whose ball moves on rails: the real rules on a path that a test draws by hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from roller_env.arrays import Bool, Float64, Int64
from roller_env.game import step
from roller_env.game.rewards import RewardMode, RewardWeights
from roller_env.game.state import GameState
from roller_env.game.step import Games, Rewarding
from roller_env.game.tables import LevelTable
from roller_env.level import Level
from roller_env.physics.protocol import Bodies, Columns
from roller_env.pieces.coin import COIN
from tests.builders import Vector

NEVER = 10**9


class Events(NamedTuple):
    """What happened in a step of N games: see `roller_env.game.step.Step`."""

    entry: Float64
    inside: Bool
    end: Float64
    finished: Bool
    fallen: Bool
    coins: Bool
    collected: Int64
    terms: Float64
    reward: Float64


class Rails:
    """N games, row i of level ``levels[i]``, whose balls go where they are told.

    Attributes:
        games: the games.
        state: their state.
        table: the levels.
        time_s: how long they have been going.
    """

    def __init__(
        self,
        *levels: Level,
        step_s: float = 0.05,
        reward: RewardMode = "points",
        weights: RewardWeights | None = None,
    ):
        """Put one game of each level into one table."""
        count = len(levels)
        self.table = LevelTable.of_levels(levels)
        self.games = Games(self.table, np.arange(count), np.full(count, NEVER))
        self.state: GameState = self.games.state
        self.state.truncated[:] = False
        self.step_s = step_s
        self.time_s = 0.0
        movers = self.table.movers.stop.shape[1]
        # On rails the slabs trail nothing.
        self.at = Columns(
            0, 3, 7, 10, 13, 13, 13 + movers, 16 + movers, movers, path=0, path_width=3
        )
        self.physics = np.zeros((count, 16 + 2 * movers))
        self.bodies = Bodies.of(self.physics, self.at)
        self.bodies.position[:] = self.table.start
        self.bodies.orientation[:, 0] = 1.0
        self._rewarding = Rewarding.of(weights or RewardWeights(), reward, 1.0)
        self._every = np.arange(count)

    def prepare(self) -> None:
        """Let the motors be told what to do in the next step, without keys."""
        keys = np.zeros((len(self._every), 2))
        games = self.games.preparing
        step.prepare(games, self.physics, self.at, self.step_s, self._every, keys)

    def follow(self, path: Float64) -> Events:
        """Let one control step pass on a path, (N, S + 1, 3) metres; struck plates sink."""
        slabs, before = self.bodies.displacement, self.state.of(COIN).taken.copy()
        self.prepare()
        slabs += self.bodies.pull * self.step_s
        np.maximum(slabs, self.table.movers.stop, out=slabs)
        games = self.games.concluding
        path = np.ascontiguousarray(path, dtype=np.float64)
        self.bodies.position[:] = path[:, -1]
        knots, envs = np.full(len(path), path.shape[1]), self._every
        fixed = games, self.physics, self.at, self.step_s, self._rewarding
        step.conclude(*fixed, envs, path, knots)
        self.time_s += self.step_s
        found = self.games.step
        return Events(
            entry=found.entry.copy(),
            inside=found.inside.copy(),
            end=found.end.copy(),
            finished=self.state.finished.copy(),
            fallen=self.state.fallen.copy(),
            coins=self.state.of(COIN).taken & ~before,
            collected=found.coins[:, 0].copy(),
            terms=found.terms.copy(),
            reward=found.reward.copy(),
        )

    def go(self, *points: Vector | Sequence[float]) -> Events:
        """Move every ball along straight pieces from where it is in one control step."""
        here = self.bodies.position
        way = [here, *(np.broadcast_to(point, here.shape) for point in points)]
        return self.follow(np.stack(way, axis=1))

    def put(self, *point: float) -> None:
        """Put every ball somewhere without a path."""
        self.bodies.position[:] = point

    def wait(self, seconds: float) -> None:
        """Let time pass with the balls at rest."""
        here = self.bodies.position
        for _ in range(round(seconds / self.step_s)):
            self.follow(np.stack([here, here], axis=1))
