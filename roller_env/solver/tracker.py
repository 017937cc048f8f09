"""A player that follows a play from wherever its ball is, and knows when not to.

Following is `Reference`'s law. Every few control steps the player has a model of the game, on the
rigid engine, go on for a while as the law says. Where that ends well it is done. Where the ball
would be lost, or left behind, the model tries each direction for a moment before it follows again,
and the best of these is held: the rollout algorithm (D. Bertsekas, *Rollout, Policy Iteration, and
Distributed Reinforcement Learning*, 2020). So a ball waits on the quay until rolling on ends on the
ferry, and comes to a spring as fast as the landing needs.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Final

import numpy as np

from roller_env.arrays import Float64, Int64
from roller_env.game.actions import DIRECTIONS, forces
from roller_env.simulation import Simulation, Snapshot
from roller_env.solver.platforms import Platforms
from roller_env.solver.reference import Reference
from roller_env.solver.search import solver_config

_LOOK: Final = 25
"""Control steps that the model goes on for."""

_EVERY: Final = 2
"""Control steps after which it is asked again."""

_LENGTHS: Final = (4, 8, 2, 12)
"""Control steps for which it tries directions, in turn."""

_BEHIND: Final = 10
"""Moments of the play by which it may end short of what the play does in that time."""

_OFF_M: Final = 0.5
"""And so far from the play."""

_PROGRESS_M: Final = 0.1
"""Distance from the play that a moment of it is worth."""

_COIN_M: Final = 1.5
"""And what a coin of the play is worth that is collected, too."""

_LOST: Final = 1e6
_WON: Final = -1e6


class Tracker:
    """Follows a play in every row of a simulation of its level, on any physics."""

    def __init__(self, reference: Reference, simulation: Simulation) -> None:
        """Begin at the play's first moment, in games that begin.

        Args:
            reference: the play.
            simulation: of its level, as `solver_config` makes it; no row's game is over.
        """
        self._reference, self._simulation = reference, simulation
        self._platforms = Platforms.of(simulation)
        self._moment, self._direction, self._held = np.zeros((3, simulation.num_envs), np.int64)
        self._lengths = itertools.cycle(_LENGTHS)
        self._model = Simulation(
            solver_config(simulation.level), simulation.num_envs * (len(DIRECTIONS) + 1)
        )
        self._model.reset()
        self._blank = self._model.snapshot()

    def play(self, steps: int) -> None:
        """Play on until every game is over, for so many control steps at the most."""
        simulation = self._simulation
        for step in range(steps):
            if simulation.state.over.all():
                break
            if step % _EVERY == 0:
                rows = np.flatnonzero(~simulation.state.over)
                plan = self._planned(rows)
            self._moment = self._nearest(simulation, self._moment)
            actions = np.zeros(simulation.num_envs, dtype=np.int64)
            actions[rows] = plan[step % _EVERY]
            simulation.step(forces("directions", actions))

    def _planned(self, rows: Int64) -> Int64:
        """Return what to hold in rows in each of the next steps, (`_EVERY`, n).

        A plan is a direction, and for how many steps it is held before the law is followed. A game
        keeps its plan until it looks bad and another looks better.
        """
        games, moment = self._modelled(rows), self._moment[rows]
        direction, held = self._direction[rows], self._held[rows]
        actions, cost = self._tried(games, moment, direction, held)
        doubtful = np.flatnonzero(cost > _OFF_M - _PROGRESS_M * self._expected(moment))
        if len(doubtful):
            count = len(DIRECTIONS) + 1
            each = np.repeat(doubtful, count)
            directions = np.tile(np.arange(count) % len(DIRECTIONS), len(doubtful))
            # The last of them is the law alone.
            lengths = np.tile(np.append(np.full(count - 1, next(self._lengths)), 0), len(doubtful))
            others, costs = self._tried(games.take(each), moment[each], directions, lengths)
            best = costs.reshape(-1, count).argmin(axis=1) + count * np.arange(len(doubtful))
            better = costs[best] < cost[doubtful]
            best, mended = best[better], doubtful[better]
            actions[:, mended] = others[:, best]
            direction[mended], held[mended] = directions[best], lengths[best]
        self._direction[rows], self._held[rows] = direction, np.maximum(held - _EVERY, 0)
        return actions

    def _expected(self, moment: Int64) -> Int64:
        """Return the moment that a game ends at, at least, if it is followed well."""
        expected: Int64 = np.minimum(moment + _LOOK, len(self._reference) - 1) - _BEHIND
        return expected

    def _modelled(self, rows: Int64) -> Snapshot:
        """Return games as the model has them: on the rigid engine, of which it takes the bodies."""
        now = self._simulation.snapshot(rows)
        games = replace(self._blank.take(np.arange(len(rows))), game=now.game)
        for name in ("position", "orientation", "velocity", "angular_velocity", "displacement"):
            getattr(games.bodies, name)[:] = getattr(now.bodies, name)
        return games

    def _tried(
        self, games: Snapshot, moment: Int64, direction: Int64, held: Int64
    ) -> tuple[Int64, Float64]:
        """Return what n games hold in their first steps, (`_EVERY`, n), and the costs, (n,) metres.

        Args:
            games: to go on from.
            moment: (n,) of the play that they are at.
            direction: (n,) what to hold at first, indices of `DIRECTIONS`.
            held: (n,) for how many steps; then the law is followed.
        """
        model, count = self._model, len(games)
        model.restore(games)
        hold = np.arange(model.num_envs) >= count
        actions = np.zeros((_LOOK, model.num_envs), dtype=np.int64)
        won, missed = np.zeros(count, dtype=np.int64), self._missed(model, moment)
        for step in range(_LOOK):
            moment = self._nearest(model, moment)
            followed = self._steered(model, moment)
            actions[step, :count] = np.where(step < held, direction, followed)
            model.step(forces("directions", actions[step]), hold)
            won += model.state.finished[:count]
        moment = self._nearest(model, moment)
        cost = self._off(model, moment) - _PROGRESS_M * moment
        cost += _COIN_M * (self._missed(model, moment) - missed)
        cost[model.state.over[:count]] = _LOST
        cost[won > 0] = _WON - won[won > 0]
        return actions[:_EVERY, :count], cost

    def _missed(self, simulation: Simulation, moment: Int64) -> Int64:
        """Return how many coins less games have than the play had, (n,)."""
        missing = self._reference.coins[moment] - simulation.state.coins[: len(moment)]
        missed: Int64 = np.maximum(missing, 0)
        return missed

    def _steered(self, simulation: Simulation, moment: Int64) -> Int64:
        rows = slice(len(moment))
        ball, velocity = simulation.ball_position[rows], simulation.ball_velocity[rows]
        return self._reference.steering(moment, ball, velocity)

    def _nearest(self, simulation: Simulation, moment: Int64) -> Int64:
        return self._reference.nearest(moment, *self._bodies(simulation, len(moment)))

    def _off(self, simulation: Simulation, moment: Int64) -> Float64:
        off = self._reference.off(moment[:, None], *self._bodies(simulation, len(moment)))
        return off[:, 0]

    def _bodies(self, simulation: Simulation, count: int) -> tuple[Float64, Float64, Float64]:
        """Return what the reference asks of the first games of a simulation; see its `off`."""
        displacement = self._platforms.displacement(simulation)
        bodies = simulation.ball_position, simulation.ball_velocity, displacement
        ball, velocity, moved = (each[:count] for each in bodies)
        return ball, velocity, moved
