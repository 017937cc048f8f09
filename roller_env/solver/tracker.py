"""A player that follows a play, so that it is known whether more than its very bits are winnable.

Every control step it looks which moment of the play its ball is nearest to, and holds the keys that
bring it nearest to where the play was a little later: model predictive control over one action.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from gymnasium.utils import seeding

from roller_env.arrays import Float64, Int64
from roller_env.game.actions import DIRECTIONS, forces
from roller_env.level import Level
from roller_env.replay.contents import Replay
from roller_env.simulation import Simulation
from roller_env.solver.search import STEP_S, Search, solver_config

_AHEAD: Final = 3
"""Control steps that it looks ahead."""

_WINDOW: Final = 10
"""Control steps by which it may catch up at once."""

_SPEED_S: Final = 0.1
"""Seconds by which a difference of speeds counts as one of places."""

_PACE_M: Final = 0.05
"""What a step out of the play's pace counts."""

_ROLLING: Final = 1.4
"""Inertia of a ball that rolls, over its mass."""


@dataclass(frozen=True, slots=True)
class Robustness:
    """What became of a play that was followed from many starts.

    Attributes:
        physics: name of the preset.
        games: how many.
        finished: share of them that ended at the finish.
        coins: share of the coins that they collected, in the mean.
    """

    physics: str
    games: int
    finished: float
    coins: float


class Tracker:
    """Follows a play in every row of a simulation."""

    def __init__(self, place: Float64, velocity: Float64, mass_kg: float, games: int):
        """Take the play's places, (T, 3) metres, and velocities, (T, 3) m/s, one a control step."""
        self._place, self._velocity = place, velocity
        self._push = forces("directions", np.arange(len(DIRECTIONS))) / (_ROLLING * mass_kg)
        self._at = np.zeros(games, dtype=np.int64)

    def __call__(self, simulation: Simulation) -> Int64:
        """Return what to hold in each row, (N,) indices of `DIRECTIONS`."""
        ball, velocity = simulation.ball_position, simulation.ball_velocity
        last = len(self._place) - 1
        window = np.minimum(self._at[:, None] + np.arange(_WINDOW + 1), last)
        away = np.linalg.norm(ball[:, None] - self._place[window], axis=2)
        away += _SPEED_S * np.linalg.norm(velocity[:, None] - self._velocity[window], axis=2)
        away += _PACE_M * np.abs(np.arange(_WINDOW + 1) - 1)
        self._at = window[np.arange(len(window)), away.argmin(axis=1)]
        ahead = np.minimum(self._at + _AHEAD, last)
        time = _AHEAD * STEP_S
        there = ball[:, None, :2] + time * velocity[:, None, :2] + 0.5 * time**2 * self._push
        then = velocity[:, None, :2] + time * self._push
        off = np.linalg.norm(there - self._place[ahead, None, :2], axis=2)
        off += _SPEED_S * np.linalg.norm(then - self._velocity[ahead, None, :2], axis=2)
        best: Int64 = off.argmin(axis=1)
        return best


def robustness(
    replay: Replay, level: Level | str, physics: str, games: int = 100, seed: int = 1
) -> Robustness:
    """Follow a play of the solver's from many starts within the level's jitter.

    Args:
        replay: the play, as `roller_env.solver.search.solve` returns it.
        level: that it is of.
        physics: name of the preset on which it is followed.
        games: how many starts.
        seed: of the starts.
    """
    config = solver_config(level, physics)
    place, velocity = _ways(replay, level)
    simulation = Simulation(config, games)
    simulation.seed([seeding.np_random(seed + row)[0] for row in range(games)])
    simulation.reset()
    tracker = Tracker(place, velocity, simulation.level.ball.mass_kg, games)
    # Who lags behind gets half of the time more.
    for _ in range(round(1.5 * len(place)) + 20):
        simulation.step(forces("directions", tracker(simulation)))
        if simulation.state.over.all():
            break
    finished = simulation.state.finished
    share = simulation.state.coins / np.maximum(simulation.coins_in_level, 1)
    return Robustness(physics, games, float(finished.mean()), float(share.mean()))


def _ways(replay: Replay, level: Level | str) -> tuple[Float64, Float64]:
    """Return where the ball of a play is, and how fast, before each control step and at the end."""
    simulation = Simulation(solver_config(level))
    simulation.seed([seeding.np_random(replay.seed)[0]])
    simulation.reset()
    places, velocities = [simulation.ball_position[0]], [simulation.ball_velocity[0]]
    for force in replay.force_n:
        simulation.step(force[None])
        places.append(simulation.ball_position[0])
        velocities.append(simulation.ball_velocity[0])
    return np.array(places), np.array(velocities)


@dataclass(frozen=True, slots=True)
class Proof:
    """A play that is followed from other starts, too.

    Attributes:
        replay: the play.
        robustness: of it, on each physics that was asked for.
        steps: environment steps of the searches for it and for those that were less robust.
    """

    replay: Replay
    robustness: tuple[Robustness, ...]
    steps: int

    @property
    def finished(self) -> float:
        """The share that ends at the finish on the physics where it is least."""
        return min(one.finished for one in self.robustness)


ROBUST: Final = 0.9
"""Share of the games at the finish from which on a play counts as robust."""


def prove(
    level: Level | str,
    budget: int = 5_000_000,
    all_coins: bool = False,
    seed: int = 0,
    physics: Sequence[str] = ("rigid", "default"),
    games: int = 100,
    tries: int = 8,
) -> Proof | None:
    """Return a robust play of a level; else the most robust one found; None if none was found.

    Args:
        level: the level, or the name or path of one.
        budget: environment steps of all searches together.
        all_coins: see `roller_env.solver.search.solve`.
        seed: of the first search; each other has the next one.
        physics: names of the presets on which it is followed.
        games: from how many starts.
        tries: searches at most.
    """
    best, left = None, budget
    for number in range(tries):
        search = Search(level, seed + number)
        solution = search.run(left, all_coins)
        left -= search.steps
        if solution is not None:
            replay = search.replay(solution)
            found = tuple(robustness(replay, level, each, games) for each in physics)
            proof = Proof(replay, found, budget - left)
            if best is None or proof.finished > best.finished:
                best = proof
            if best.finished >= ROBUST:
                break
        if left <= 0:
            break
    return best
