"""A search for a way to the finish, and for one with every coin, by playing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from gymnasium.utils import seeding

from roller_env.arrays import Float64, Int64
from roller_env.config import EnvConfig, make_config
from roller_env.game.actions import DIRECTIONS, forces
from roller_env.level import Level
from roller_env.level.expand import expand
from roller_env.level.generate import LATEST, generate
from roller_env.pieces.coin import COIN, COIN_REACH_M
from roller_env.pieces.finish import FINISH
from roller_env.pieces.hazard import HAZARD
from roller_env.replay.contents import Replay
from roller_env.replay.recorder import Recorder
from roller_env.replay.scripted import steering
from roller_env.simulation import Simulation, joined
from roller_env.solver.archive import ROOT, Archive, Node, cells
from roller_env.solver.platforms import Platforms

SOLVER: Final = "solver"
"""Who played, in a replay's words."""

GAMES: Final = 256
"""Played on at a time."""

LEG_S: Final = 2.5
"""For which a game is played on before another is taken up."""

_HOLD_S: Final = (0.2, 1.2)
"""Shortest and longest time for which a direction is held; a place is headed for throughout."""

_NEAR: Final = 5
"""One of so many of the nearest coins is headed for."""

_HEADS: Final = 0.6
"""Fraction of the games that head for a place."""

_GREED: Final = 0.7

STEP_S: Final = 0.1
"""Length of a control step of what is found."""

_ROW: Final = np.zeros(1, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Solution:
    """A way to the finish.

    Attributes:
        actions: (T,) what to hold in each control step, indices of `DIRECTIONS`.
        coins: how many are collected on it.
        steps: environment steps after which it was found.
    """

    actions: Int64
    coins: int
    steps: int


def solver_config(level: Level | str, physics: str = "rigid") -> EnvConfig:
    """Return the game that is searched: its actions are the eight directions and none."""
    return make_config(
        level=level, physics=physics, action="directions", control_dt_s=STEP_S, num_threads=1
    )


class Search:
    """Plays a level until it is found how it is won.

    Attributes:
        archive: what was reached.
        best: the best solution so far: with the most coins, then the shortest; None before.
        steps: environment steps played.
    """

    def __init__(self, level: Level | str, seed: int = 0, physics: str = "rigid"):
        """Begin at the level's start, whose jitter ``seed`` decides as in `RollerEnv.reset`."""
        self.config, self.seed = solver_config(level, physics), seed
        self._simulation = Simulation(self.config, GAMES)
        self._rng = np.random.default_rng([seed, 1])
        self._simulation.seed([seeding.np_random(seed)[0] for _ in range(GAMES)])
        self._simulation.reset()
        self.coins = int(self._simulation.coins_in_level[0])
        self._lowest = _lowest(self._simulation.level)
        self.archive, self.steps = Archive(), 0
        self.best: Solution | None = None
        start = Node(ROOT, np.zeros(0, dtype=np.int64), 0, 0, self._simulation.snapshot(_ROW))
        self.archive.put(cells(self._simulation)[0], start)

    def run(self, budget: int, all_coins: bool = False) -> Solution | None:
        """Search until the finish is found, or all coins with it, or the budget is spent.

        Args:
            budget: environment steps in all.
            all_coins: go on until the best has every coin.
        """
        while self.steps < budget:
            self._leg()
            if self.best is not None and (not all_coins or self.best.coins == self.coins):
                break
        return self.best

    def _leg(self) -> None:
        """Play on from games of the archive for a while, and keep what is new."""
        simulation, rng = self._simulation, self._rng
        nodes = self.archive.draw(GAMES, _GREED, rng)
        games = joined([game for node in nodes if (game := self.archive.nodes[node].game)])
        simulation.restore(replace(games, generators=simulation.snapshot().generators))
        count = round(LEG_S / STEP_S)
        aims = self._aims()
        held, left = np.zeros(GAMES, dtype=np.int64), np.zeros(GAMES, dtype=np.int64)
        actions = np.zeros((count, GAMES), dtype=np.int64)
        finished = simulation.state.finished.copy()
        for step in range(count):
            again = np.flatnonzero(left <= 0)
            held[again] = rng.integers(len(DIRECTIONS), size=len(again))
            shortest, longest = (round(time / STEP_S) for time in _HOLD_S)
            left[again] = rng.integers(shortest, longest + 1, len(again))
            left -= 1
            actions[step] = self._steered(held, aims)
            simulation.step(forces("directions", actions[step]))
            self.steps += GAMES
            self._keep(nodes, actions[: step + 1])
            for row in np.flatnonzero(simulation.state.finished & ~finished):
                self._finish(nodes[row], actions[: step + 1, row], int(simulation.state.coins[row]))
            finished |= simulation.state.finished

    def _aims(self) -> Float64:
        """Return (N, 3) places that games head for; NaN for those that hold keys at random."""
        simulation, rng = self._simulation, self._rng
        table = simulation.table
        finish = table.regions.centre[0, table.own(FINISH).region]
        own = table.own(HAZARD)
        wanted = table.regions.real[0].copy()
        wanted[own.region : own.region + own.regions] = False
        regions = table.regions.centre[0][wanted]
        platforms = Platforms.of(simulation).places(simulation)
        coins, taken = table.of(COIN).at[0], simulation.state.of(COIN).taken
        aims = np.full((GAMES, 3), np.nan)
        for row in np.flatnonzero(rng.random(GAMES) < _HEADS):
            left = coins[~taken[row]] if len(coins) else coins
            ball = simulation.ball_position[row]
            near = left[np.argsort(np.linalg.norm(left - ball, axis=1), kind="stable")[:_NEAR]]
            # A plate, a pad or a switch is a region as the finish is.
            places = [*near, finish, regions[rng.integers(len(regions))]]
            if platforms.shape[1]:
                places.append(platforms[row, rng.integers(platforms.shape[1])])
            aims[row] = places[rng.integers(len(places))]
        return aims

    def _steered(self, held: Int64, aims: Float64) -> Int64:
        """Return what each game holds now, (N,)."""
        simulation = self._simulation
        directions = held.copy()
        heading = np.flatnonzero(np.isfinite(aims[:, 0]))
        way = aims[heading] - simulation.ball_position[heading]
        velocity = simulation.ball_velocity[heading]
        mass_kg = simulation.level.ball.mass_kg
        directions[heading] = steering(way[:, :2], velocity[:, :2], mass_kg)
        return directions

    def _keep(self, nodes: list[int], actions: Int64) -> None:
        """Put the games that are in a new cell, or came to one sooner, into the archive."""
        simulation, archive = self._simulation, self.archive
        steps = simulation.state.steps
        now = cells(simulation)
        sooner: dict[bytes, int] = {}  # the row that came to each cell first
        lost = simulation.ball_position[:, 2] < self._lowest
        for row in np.flatnonzero(~(simulation.state.over | lost)).tolist():
            before = archive.steps_to(now[row])
            if before is None or steps[row] < before:
                first = sooner.setdefault(now[row].tobytes(), row)
                if steps[row] < steps[first]:
                    sooner[now[row].tobytes()] = row
        rows = list(sooner.values())
        kept = simulation.snapshot(np.array(rows, dtype=np.int64))
        for place, row in enumerate(rows):
            node = Node(
                nodes[row],
                actions[:, row].copy(),
                int(steps[row]),
                int(simulation.state.coins[row]),
                kept.take([place]),
            )
            archive.put(now[row], node)

    def _finish(self, parent: int, actions: Int64, coins: int) -> None:
        """Remember a way to the finish, if it is the best."""
        whole = np.concatenate([self.archive.way_to(parent), actions])
        best = self.best
        if best is None or (coins, -len(whole)) > (best.coins, -len(best.actions)):
            self.best = Solution(whole, coins, self.steps)

    def replay(self, solution: Solution) -> Replay:
        """Return a solution as a replay, after playing it once more.

        Raises:
            RuntimeError: it does not end as it did in the search: the engine is at fault.
        """
        simulation = Simulation(self.config)
        simulation.seed([seeding.np_random(self.seed)[0]])
        simulation.reset()
        recorder = Recorder(simulation, SOLVER)
        recorder.begin(seed=self.seed)
        for action in solution.actions:
            force = forces("directions", np.array([action]))
            simulation.step(force)
            recorder.record(force)
        replay = recorder.replay()
        if not replay.result.success or replay.result.coins != solution.coins:
            raise RuntimeError(f"the play found does not repeat: {replay.result}")
        return replay


def _lowest(level: Level) -> float:
    """Return the height of the ball's centre, metres, under which there is nothing but the fall."""
    everything = expand(level)
    solids = (*everything.at_the_start, *(mover.end for mover in everything.movers))
    boxes = [(s.centre[2], float(np.abs(s.rotation[2]) @ s.half_size)) for s in solids]
    regions = [region for own in everything.regions.values() for region in own]
    boxes += [(region.centre[2], region.half[2] + region.radius) for region in regions]
    boxes += [(height, COIN_REACH_M) for height in everything.coins[:, 2].tolist()]
    return min(middle - reach for middle, reach in boxes) - level.ball.radius


def solve(
    level: Level | str, budget: int = 5_000_000, all_coins: bool = False, seed: int = 0
) -> Replay | None:
    """Return a play of a level that ends at the finish, or None if none was found in the budget.

    Args:
        level: the level, or the name or path of one.
        budget: environment steps. That none was found in them does not say that there is none.
        all_coins: go on for the rest of the budget until every coin is collected.
        seed: of the start's jitter and of the search.
    """
    search = Search(level, seed)
    solution = search.run(budget, all_coins)
    return None if solution is None else search.replay(solution)


@dataclass(frozen=True, slots=True)
class Won:
    """A generated level that the solver has won.

    Attributes:
        level: the level.
        replay: the play that won it.
        attempts: how many levels of the seed were given up before, and this one.
        steps: environment steps of all searches.
    """

    level: Level
    replay: Replay
    attempts: int
    steps: int


GENERATED_BUDGET: Final = 600_000
"""Environment steps that a generated level may take; who is not won in them is rejected."""

_MOST_ATTEMPTS: Final = 20


def won_level(seed: int, difficulty: float = 0.5, *, version: int = LATEST) -> Won:
    """Return the first generated level of a seed and difficulty that the solver wins.

    Args:
        seed: see `roller_env.level.generate.generate`.
        difficulty: likewise.
        version: likewise.

    Raises:
        ValueError: likewise.
        RuntimeError: none of twenty was won.
    """
    steps = 0
    for attempt in range(_MOST_ATTEMPTS):
        level = generate(seed, difficulty, attempt, version=version)
        search = Search(level)
        solution = search.run(GENERATED_BUDGET)
        steps += search.steps
        if solution is not None:
            return Won(level, search.replay(solution), attempt + 1, steps)
    raise RuntimeError(
        f"seed {seed}, difficulty {difficulty:g}, version {version}: none of {_MOST_ATTEMPTS} "
        "levels was won"
    )
