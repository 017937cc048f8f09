"""How robust a play is: what becomes of it when it is followed from other starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from gymnasium.utils import seeding

from roller_env.level import Level
from roller_env.replay.contents import Replay
from roller_env.simulation import Simulation
from roller_env.solver.reference import Reference
from roller_env.solver.search import Search, solver_config
from roller_env.solver.tracker import Tracker

_PATIENCE: Final = 1.5
"""How much of a play's time who follows it may take."""

_WAITING: Final = 100
"""Control steps that it may take beyond that: a platform that has left comes back."""


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
    simulation = Simulation(solver_config(level, physics), games)
    simulation.seed([seeding.np_random(seed + row)[0] for row in range(games)])
    simulation.reset()
    reference = Reference.of(replay, level)
    Tracker(reference, simulation).play(round(_PATIENCE * len(reference)) + _WAITING)
    finished = simulation.state.finished
    share = simulation.state.coins / np.maximum(simulation.coins_in_level, 1)
    return Robustness(physics, games, float(finished.mean()), float(share.mean()))


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
