"""Crowd: balls of an agent that play beside a game, each a game of its own; seen, never met."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from roller_env.arrays import Float64, Int64
from roller_env.envs.spaces import shape_observation
from roller_env.game.actions import forces
from roller_env.game.result import EpisodeResult
from roller_env.simulation import Simulation, Transition
from roller_env.training.files import RunError
from roller_env.training.policy import TrainedPolicy

MOST: Final = 256
_ROUNDING: Final = 1e-9


class Crowd:
    """N games of one agent, begun together with the game that they accompany.

    It is an observer as `roller_env.play.session.GameSession` takes them: it makes a step whenever
    that one does. A ball whose game is over begins again.

    Attributes:
        policy: who plays.
    """

    def __init__(self, policy: TrainedPolicy, count: int):
        """Make a crowd of ``count`` balls that ``policy`` steers, from 1 to `MOST`."""
        if not 1 <= count <= MOST:
            raise ValueError(f"agents: found {count}; must be a whole number from 1 to {MOST}")
        self.policy, self._count = policy, count
        self._simulation: Simulation | None = None
        self._per_action = 1
        self._forces = np.zeros((count, 2))
        self._before = self._after = np.zeros((count, 3))

    def steps_per_action(self, control_dt_s: float) -> int:
        """Return for how many control steps of a game an action of the agent's holds.

        Raises:
            RunError: it decides between two of them.
        """
        decides_s = self.policy.config.evaluation_environment.control_dt_s
        steps = round(decides_s / control_dt_s)
        if steps < 1 or abs(decides_s / control_dt_s - steps) > _ROUNDING:
            raise RunError(
                f"control_dt_s: found an agent that decides every {decides_s:g} s "
                f"beside a game in steps of {control_dt_s:g} s; must be a multiple of them"
            )
        return steps

    def centres(self, fraction: float) -> Float64:
        """Return where the balls are, (N, 3) metres, between their last two states."""
        return self._before + fraction * (self._after - self._before)

    def on_reset(self, simulation: Simulation, seed: int) -> None:
        """Begin all the games, each with a start of its own."""
        games = self._simulation
        if games is None or games.level is not simulation.level:
            games = self._simulation = self._make(simulation)
        games.seed([np.random.default_rng([seed, row]) for row in range(self._count)])
        self._begin(np.arange(self._count), intro=bool(simulation.state.control_delay_s[0] > 0.0))
        self._before = self._after

    def on_step(self, simulation: Simulation, force_n: Float64, transition: Transition) -> None:
        """Make a step of all the games."""
        games = self._simulation
        assert games is not None
        if int(simulation.state.steps[0] - 1) % self._per_action == 0:
            seen = shape_observation(games.config, games.entries, games.observe())
            self._forces = forces(games.config.action, self.policy(seen))
        self._before = self._after
        games.step(self._forces)
        self._after = games.ball_position
        over = np.flatnonzero(games.state.over)
        if len(over):
            self._begin(over)
            # Nothing to draw between: it is put there.
            self._before[over] = self._after[over]

    def on_rewind(self, simulation: Simulation) -> None:
        """Nothing: the others go on from where they are."""

    def on_end(self, simulation: Simulation, result: EpisodeResult) -> None:
        """Nothing."""

    def _begin(self, rows: Int64, intro: bool = False) -> None:
        assert self._simulation is not None
        self._simulation.reset(rows, intro=intro)
        self._after = self._simulation.ball_position

    def _make(self, beside: Simulation) -> Simulation:
        """Return the games, of the level, physics and time of the one that they accompany."""
        self._per_action = self.steps_per_action(beside.duration_s)
        trained = self.policy.config.evaluation_environment
        config = replace(
            trained,
            level=beside.level,
            physics=beside.preset,
            control_dt_s=beside.duration_s,
            max_episode_steps=None,
            num_threads=1,
        )
        return Simulation(config, self._count)
