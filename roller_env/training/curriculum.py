"""A start-state curriculum: some episodes begin where the agent has been before.

A long level teaches its end slowly when every attempt at it must first play the whole beginning. So
the games an agent has brought to each waypoint of the route are kept, and a fraction of the
episodes begins from one of them (Salimans & Chen 2018, Ecoffet et al. 2021 do the like). Only
training does this: evaluation always plays from the start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from roller_env.arrays import Bool, Int64
from roller_env.envs.sb3 import RollerVecEnv, VecSnapshot
from roller_env.envs.spaces import shape_observation
from roller_env.game.state import GameState
from roller_env.simulation import Snapshot

FROM_START: Final = "from_start"
"""Key of a finished episode's info: whether it began at the level's start."""

_KEPT: Final = 32
"""Games kept of each waypoint; a newer one takes the place of any."""

_RENEWAL: Final = 0.1
"""Fraction of the arrivals that are kept when a waypoint has all its games already."""


@dataclass(frozen=True, eq=False)
class CurriculumSnapshot:
    """Everything that the future of a `StartStateCurriculum` depends on."""

    environments: VecSnapshot
    games: dict[int, list[Snapshot]]
    waypoint: Int64
    from_start: Bool
    generator: Mapping[str, Any]


class StartStateCurriculum(VecEnvWrapper):
    """Begins a fraction of the episodes at waypoints that were reached before, all as often."""

    def __init__(self, environments: RollerVecEnv, fraction: float, seed: int) -> None:
        """Wrap environments.

        Args:
            environments: to wrap.
            fraction: of the episodes that begin at a waypoint, 0 to 1.
            seed: of the choice.
        """
        super().__init__(environments)
        self.environments = environments
        self._fraction = fraction
        self._rng = np.random.default_rng(seed)
        self._games: dict[int, list[Snapshot]] = {}
        self._waypoint = np.zeros(self.num_envs, dtype=np.int64)
        self._from_start = np.ones(self.num_envs, dtype=bool)

    def reset(self) -> Any:
        """Begin every episode at the start."""
        observations = self.environments.reset()
        self._waypoint[:] = self.environments.simulation.state.shaping.waypoint
        self._from_start[:] = True
        return observations

    def step_wait(self) -> VecEnvStepReturn:
        """Step, keep what was reached, and begin some of the new episodes elsewhere."""
        observations, rewards, dones, infos = self.environments.step_wait()
        ended = np.flatnonzero(dones)
        for row in ended:
            infos[row][FROM_START] = bool(self._from_start[row])
        self._from_start[ended] = True
        if self._fraction > 0.0:
            self._keep(dones)
            self._begin(ended[self._rng.random(len(ended)) < self._fraction], observations)
        return observations, rewards, dones, infos

    def _keep(self, dones: Bool) -> None:
        """Keep the games that have just come to a waypoint."""
        simulation = self.environments.simulation
        waypoint = simulation.state.shaping.waypoint
        for row in np.flatnonzero((waypoint > self._waypoint) & ~dones):
            games = self._games.setdefault(int(waypoint[row]), [])
            if len(games) < _KEPT:
                games.append(simulation.snapshot(np.array([row])))
            elif self._rng.random() < _RENEWAL:
                games[int(self._rng.integers(_KEPT))] = simulation.snapshot(np.array([row]))
        self._waypoint[:] = waypoint

    def _begin(self, rows: Int64, observations: Any) -> None:
        """Put kept games into rows, and what they show into the observations."""
        if not len(rows) or not self._games:
            return
        simulation = self.environments.simulation
        waypoints = sorted(self._games)
        chosen = []
        for _ in rows:
            games = self._games[waypoints[int(self._rng.integers(len(waypoints)))]]
            chosen.append(games[int(self._rng.integers(len(games)))])
        own = simulation.snapshot(rows).generators
        simulation.restore(replace(joined(chosen), generators=own), rows)
        fresh = shape_observation(simulation.config, simulation.observe(rows))
        if isinstance(observations, dict):
            for name, values in observations.items():
                values[rows] = fresh[name]
        else:
            observations[rows] = fresh
        self._waypoint[rows] = simulation.state.shaping.waypoint[rows]
        self._from_start[rows] = False

    def snapshot(self) -> CurriculumSnapshot:
        """Return the state of all rows and what was kept; as copies."""
        return CurriculumSnapshot(
            environments=self.environments.get_state(),
            games={waypoint: list(games) for waypoint, games in self._games.items()},
            waypoint=self._waypoint.copy(),
            from_start=self._from_start.copy(),
            generator=self._rng.bit_generator.state,
        )

    def restore(self, snapshot: CurriculumSnapshot) -> None:
        """Put everything back; the same actions then give the same bits."""
        self.environments.set_state(snapshot.environments)
        self._games = {waypoint: list(games) for waypoint, games in snapshot.games.items()}
        self._waypoint[:] = snapshot.waypoint
        self._from_start[:] = snapshot.from_start
        self._rng.bit_generator.state = snapshot.generator


def joined(games: Sequence[Snapshot]) -> Snapshot:
    """Return snapshots of one row each as one of many rows."""
    return replace(
        games[0],
        physics=np.concatenate([game.physics for game in games]),
        game=GameState.joined([game.game for game in games]),
        level_of_row=np.concatenate([game.level_of_row for game in games]),
        generators=tuple(generator for game in games for generator in game.generators),
    )


def separate(games: Snapshot) -> list[Snapshot]:
    """Return a snapshot of many rows as snapshots of one row each."""
    return [games.take([row]) for row in range(len(games))]
