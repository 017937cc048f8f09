"""Games to go on from, one for every cell of places and deeds.

After Go-Explore (A. Ecoffet et al., *First return, then explore*, 2021): of all games that ever
were in a cell the one that came there in the fewest steps is kept, whole, so that the search can
return to it without playing the way again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from roller_env.arrays import Float64, Int64
from roller_env.pieces.coin import COIN
from roller_env.pieces.platform import PLATFORM
from roller_env.simulation import Simulation, Snapshot
from roller_env.solver.platforms import Platforms

CELL_M: Final = 1.0
"""Edge of a cell."""

PHASE_S: Final = 1.0
"""Part of a platform's timetable that counts as one."""

MOST_CELLS: Final = 60_000
"""Beyond so many a third is forgotten: those with the fewest coins."""

_FEW_LEFT: Final = 2
"""Of so many coins left it counts which they are; before, only how many."""

ROOT: Final = -1


@dataclass(frozen=True, slots=True)
class Node:
    """A game that was reached.

    Attributes:
        parent: number of the node that it went on from, or `ROOT`.
        actions: (n,) what was held since, indices of `DIRECTIONS`.
        steps: control steps since the start.
        coins: how many are collected.
        game: to go on from; None once there is a better one for its cell.
    """

    parent: int
    actions: Int64
    steps: int
    coins: int
    game: Snapshot | None


class Archive:
    """The best game of every cell.

    Attributes:
        nodes: all games that were ever kept; ways lead through those that were bettered, too.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._number: dict[bytes, int] = {}  # of each cell
        self._node: list[int] = []  # of each cell
        self._coins: list[int] = []
        self._place: list[int] = []
        self._visits: list[int] = []
        self._places: dict[tuple[int, ...], int] = {}

    def __len__(self) -> int:
        return len(self._node)

    def steps_to(self, cell: Int64) -> int | None:
        """Return in how many steps a cell, (k,), was reached, None if never."""
        number = self._number.get(cell.tobytes())
        return None if number is None else self.nodes[self._node[number]].steps

    def put(self, cell: Int64, node: Node) -> None:
        """Keep a game as the best of its cell, (k,)."""
        number = self._number.setdefault(cell.tobytes(), len(self._node))
        if number == len(self._node):
            place = self._places.setdefault(tuple(cell[:3].tolist()), len(self._places))
            self._node.append(len(self.nodes))
            self._coins.append(node.coins)
            self._place.append(place)
            self._visits.append(0)
        else:
            self._forget(number)
            self._node[number] = len(self.nodes)
        self.nodes.append(node)
        if len(self._node) > MOST_CELLS:
            self._thin_out()

    def _forget(self, cell: int) -> None:
        """Let go of a cell's game; the way through it stays."""
        node = self._node[cell]
        self.nodes[node] = replace(self.nodes[node], game=None)

    def _thin_out(self) -> None:
        coins = np.array(self._coins)
        kept = np.sort(np.argsort(-coins, kind="stable")[: 2 * len(coins) // 3])
        for cell in np.setdiff1d(np.arange(len(coins)), kept):
            self._forget(cell)
        new = {old: number for number, old in enumerate(kept.tolist())}
        self._number = {key: new[old] for key, old in self._number.items() if old in new}
        for values in (self._node, self._coins, self._place, self._visits):
            values[:] = [values[old] for old in kept]

    def _behind(self) -> Int64:
        """Return (cells,) how many coins less each has than the best of its place."""
        coins, place = np.array(self._coins), np.array(self._place)
        most = np.zeros(len(self._places), dtype=np.int64)
        np.maximum.at(most, place, coins)
        behind: Int64 = most[place] - coins
        return behind

    def draw(self, count: int, greed: float, rng: np.random.Generator) -> list[int]:
        """Return nodes to go on from, (count,), rather of cells that were seldom gone on from.

        Args:
            count: how many.
            greed: fraction of them that have about the most coins; of these a third have them not
                of all, but of those at their place: who leaves a coin behind is further on sooner,
                and would be all that is gone on from.
            rng: draws.
        """
        weights: Float64 = 1.0 / np.sqrt(1.0 + np.array(self._visits, dtype=np.float64))
        coins = np.array(self._coins)
        rich, here = weights * (coins >= coins.max() - 1), weights * (self._behind() == 0)
        shares = ((1.0 - greed, weights), (greed * 2 / 3, rich), (greed / 3, here))
        mixed = sum(share * each / each.sum() for share, each in shares)
        drawn = rng.choice(len(weights), count, p=mixed)
        for cell in drawn:
            self._visits[cell] += 1
        return [self._node[cell] for cell in drawn]

    def way_to(self, number: int) -> Int64:
        """Return what to hold from the start on to come to a node, indices of `DIRECTIONS`."""
        parts: list[Int64] = []
        while number != ROOT:
            node = self.nodes[number]
            parts.append(node.actions)
            number = node.parent
        return np.concatenate([np.zeros(0, dtype=np.int64), *reversed(parts)])


def cells(simulation: Simulation) -> Int64:
    """Return (N, k) in which cell each game is: where the ball is, and what is done.

    Coins count by their number until few are left: which they are would make cells without end.
    """
    state = simulation.state
    place = np.floor(simulation.ball_position / CELL_M).astype(np.int64)
    taken = state.of(COIN).taken
    left = np.where(simulation.coins_in_level - state.coins <= _FEW_LEFT, 1, 0)
    which = left * (taken @ (1 + np.arange(taken.shape[1])) ** 2)
    done = np.stack([state.coins, state.achieved.sum(axis=1), which], axis=1)
    parts = (place, done, state.signals, _platforms(simulation))
    return np.ascontiguousarray(np.concatenate(parts, axis=1))


def _platforms(simulation: Simulation) -> Int64:
    """Return (N, 0 or 2) which platform is the nearest, and where in its timetable that is.

    Who comes somewhere first may have to wait there: the same place is another cell then.
    """
    platforms = Platforms.of(simulation)
    if not len(platforms):
        return np.zeros((simulation.num_envs, 0), dtype=np.int64)
    table, which = simulation.table.of(PLATFORM), platforms.nearest(simulation)
    period_s = 2.0 * (table.way[0] / table.speed[0] + table.wait_s[0])[which]
    clock_s = simulation.state.of(PLATFORM).clock_s[np.arange(len(which)), which]
    return np.stack([which, (clock_s % period_s / PHASE_S).astype(np.int64)], axis=1)
