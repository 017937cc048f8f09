"""A game whose ball moves on rails: the real rules on a path that a test draws by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roller_env.game import rules, sweep
from roller_env.game.slabs import Bodies
from roller_env.game.state import GameState
from roller_env.game.tables import LevelTable
from roller_env.level import Level
from tests.builders import Float64, Vector


class Rails:
    """N games, row i of level ``levels[i]``, whose balls go where they are told.

    Attributes:
        state: the games' state.
        table: the rows' level data.
        time_s: how long they have been going.
    """

    def __init__(self, *levels: Level, step_s: float = 0.05):
        """Put one game of each level into one table."""
        self.table = LevelTable.of(levels).for_rows(np.arange(len(levels)))
        self.state = GameState.initial(self.table)
        self.step_s = step_s
        self.time_s = 0.0
        self.plate = np.zeros(self.table.plate_stop.shape)
        self.gate = np.zeros(self.table.gate_stop.shape)
        self._ball = self.table.start.copy()

    @property
    def bodies(self) -> Bodies:
        """Where the balls and slabs are; on rails the slabs trail nothing."""
        still = np.zeros_like(self._ball)
        return Bodies(self._ball, still, self.plate, self.gate, self.plate, self.gate)

    def follow(self, path: Float64) -> sweep.Events:
        """Let one control step pass on a path, (N, S + 1, 3) metres; struck plates sink."""
        keys = np.zeros((len(path), 2))
        controls = rules.controls(self.state, self.table, keys, self.bodies, self.step_s)
        self.plate = np.maximum(
            self.plate + controls.plate_velocity * self.step_s, self.table.plate_stop
        )
        self.gate = np.maximum(
            self.gate + controls.gate_velocity * self.step_s, self.table.gate_stop
        )
        motion = sweep.Motion(path, self.plate, self.step_s)
        events = sweep.find_events(self.state, self.table, motion)
        rules.apply(self.state, self.table, motion, events)
        self._ball = path[:, -1].copy()
        self.time_s += self.step_s
        return events

    def go(self, *points: Vector | Sequence[float]) -> sweep.Events:
        """Move every ball along straight pieces from where it is in one control step."""
        way = [self._ball, *(np.broadcast_to(point, self._ball.shape) for point in points)]
        return self.follow(np.stack(way, axis=1).astype(np.float64))

    def put(self, *point: float) -> None:
        """Put every ball somewhere without a path."""
        self._ball = np.tile(np.array(point, dtype=np.float64), (len(self._ball), 1))

    def wait(self, seconds: float) -> None:
        """Let time pass with the balls at rest."""
        for _ in range(round(seconds / self.step_s)):
            self.follow(np.stack([self._ball, self._ball], axis=1))
