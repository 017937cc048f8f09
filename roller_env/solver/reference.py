"""A play as something to follow: where its ball is in each control step, and the law that steers.

The law looks which moment of the play a ball is nearest to, and holds the keys that bring it
nearest to where the play was a little later: model predictive control over one action.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from gymnasium.utils import seeding

from roller_env.arrays import Bool, Float64, Int64
from roller_env.game.actions import DIRECTIONS, forces
from roller_env.level import Level
from roller_env.replay.contents import Replay
from roller_env.simulation import Simulation
from roller_env.solver.platforms import Platforms
from roller_env.solver.search import STEP_S, solver_config

_AHEAD: Final = 3
"""Control steps that the law looks ahead."""

_WINDOW: Final = 10
"""Control steps by which a ball may catch up at once."""

_SPEED_S: Final = 0.1
"""Seconds by which a difference of speeds counts as one of places."""

_PACE_M: Final = 0.05
"""What a step out of the play's pace counts."""

_ROLLING: Final = 1.4
"""Inertia of a ball that rolls, over its mass."""

_RIDING_M: Final = 0.2
"""Beyond its radius, by so much a ball that rides may be above the platform's upper face."""


@dataclass(frozen=True, slots=True)
class Reference:
    """The T moments of a play, before each control step, and the middle of the finish behind them.

    Attributes:
        place: (T, 3) metres, world frame.
        velocity: (T, 3) m/s, world frame.
        displacement: (T, P) of the platforms, metres.
        ridden: (T, P) whether the ball rides each.
        coins: (T,) how many are collected.
        push: (9, 2) acceleration of a rolling ball by each of `DIRECTIONS`, m/s^2.
    """

    place: Float64
    velocity: Float64
    displacement: Float64
    ridden: Bool
    coins: Int64
    push: Float64

    @staticmethod
    def of(replay: Replay, level: Level | str) -> Reference:
        """Return what a play of the solver's is followed by.

        Args:
            replay: the play, as `roller_env.solver.search.solve` returns it.
            level: that it is of.
        """
        simulation = Simulation(solver_config(level))
        simulation.seed([seeding.np_random(replay.seed)[0]])
        simulation.reset()
        platforms, ball = Platforms.of(simulation), simulation.level.ball
        moments = []
        for force in [None, *replay.force_n]:
            if force is not None:
                simulation.step(force[None])
            which = platforms.ridden(simulation, ball.radius + _RIDING_M)
            moments.append(
                (
                    simulation.ball_position[0],
                    simulation.ball_velocity[0],
                    platforms.displacement(simulation)[0],
                    which[0] == np.arange(len(platforms)),
                    simulation.state.coins[0],
                )
            )
        push = forces("directions", np.arange(len(DIRECTIONS))) / (_ROLLING * ball.mass_kg)
        finish = np.array([*simulation.level.finish.at[:2], moments[-1][0][2]])
        moments.append((finish, np.zeros(3), *moments[-1][2:]))
        place, velocity, displacement, ridden, coins = (
            np.array(each) for each in zip(*moments, strict=True)
        )
        return Reference(place, velocity, displacement, ridden, coins, push)

    def __len__(self) -> int:
        """Return the number of moments, T."""
        return len(self.place)

    def off(
        self, moment: Int64, ball: Float64, velocity: Float64, displacement: Float64
    ) -> Float64:
        """Return how far games are from moments, (n, k) metres.

        A platform that the ball rides then has to be where it was then, too: who comes when it has
        left is not further on for being where the ball went on board.

        Args:
            moment: (n, k) which, for each game.
            ball: (n, 3) metres, world frame.
            velocity: (n, 3) m/s, world frame.
            displacement: (n, P) of the platforms, metres.
        """
        off = np.linalg.norm(ball[:, None] - self.place[moment], axis=2)
        off += _SPEED_S * np.linalg.norm(velocity[:, None] - self.velocity[moment], axis=2)
        late = np.abs(displacement[:, None] - self.displacement[moment]) * self.ridden[moment]
        apart: Float64 = off + late.sum(axis=2)
        return apart

    def nearest(
        self, moment: Int64, ball: Float64, velocity: Float64, displacement: Float64
    ) -> Int64:
        """Return the moment that each game is at now, (n,), of those from the one it was at on.

        The arguments are those of `off`, but for ``moment``, (n,).
        """
        steps = np.arange(_WINDOW + 1)
        window = np.minimum(moment[:, None] + steps, len(self) - 1)
        off = self.off(window, ball, velocity, displacement) + _PACE_M * np.abs(steps - 1)
        nearest: Int64 = window[np.arange(len(window)), off.argmin(axis=1)]
        return nearest

    def steering(self, moment: Int64, ball: Float64, velocity: Float64) -> Int64:
        """Return what to hold in games that are at moments, (n,) indices of `DIRECTIONS`."""
        ahead, time = np.minimum(moment + _AHEAD, len(self) - 1), _AHEAD * STEP_S
        there = ball[:, None, :2] + time * velocity[:, None, :2] + 0.5 * time**2 * self.push
        then = velocity[:, None, :2] + time * self.push
        off = np.linalg.norm(there - self.place[ahead, None, :2], axis=2)
        off += _SPEED_S * np.linalg.norm(then - self.velocity[ahead, None, :2], axis=2)
        best: Int64 = off.argmin(axis=1)
        return best
