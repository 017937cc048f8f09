"""Explorers: games that nobody learns from, played at random to find what can be achieved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Int64
from roller_env.game.actions import DIRECTIONS, action_of_keys
from roller_env.pieces.coin import COIN
from roller_env.pieces.finish import FINISH
from roller_env.replay.scripted import steering
from roller_env.simulation import Simulation

_HOLD_S: Final = 1.0
"""Longest time for which a direction is held; a place is headed for up to twice as long."""

_JOURNEY_S: Final = 8.0
"""Longest time after which an explorer is put elsewhere."""

_NEAR: Final = 4
"""One of so many of the nearest coins is headed for."""

_NOWHERE: Final = -1


@dataclass(frozen=True, eq=False)
class Journeys:
    """What the future of `Explorers` depends on, for each of E of them.

    Attributes:
        direction: (E,) index of `DIRECTIONS` that is held.
        aim: (E,) number of the coin that is headed for instead, as many as there are coins for
            the finish, -1 for nothing.
        hold: (E,) steps until something else is done.
        left: (E,) steps until the journey ends.
    """

    direction: Int64
    aim: Int64
    hold: Int64
    left: Int64

    def copy(self) -> Journeys:
        """Return another with the same numbers."""
        return Journeys(*(getattr(self, name).copy() for name in self.__dataclass_fields__))


class Explorers:
    """Plays the last rows of a simulation: holds any direction, or heads for a coin or the finish.

    Random keys alone hardly ever hit a coin beside the way: one two metres off is passed within
    reach by one journey in sixty.
    """

    def __init__(self, simulation: Simulation, count: int, rng: np.random.Generator):
        """Play the last ``count`` rows of ``simulation``."""
        self._simulation = simulation
        self._rng = rng
        self.rows = np.arange(simulation.num_envs - count, simulation.num_envs)
        zeros = np.zeros(count, dtype=np.int64)
        self.journeys = Journeys(zeros, zeros + _NOWHERE, zeros.copy(), zeros.copy())
        mode = simulation.config.action
        self._actions = np.stack([action_of_keys(mode, held) for held in DIRECTIONS])

    def arrived(self) -> Int64:
        """Return the rows, (n,), whose journeys are over."""
        return self.rows[self.journeys.left <= 0]

    def set_out(self, rows: Int64) -> None:
        """Begin journeys in rows, (n,), from wherever they are."""
        which = rows - self.rows[0] if len(self.rows) else rows
        self.journeys.left[which] = self._lengths(_JOURNEY_S, len(which))
        self.journeys.hold[which] = 0

    def actions(self) -> npt.NDArray[np.generic]:
        """Return what each does now, (E, ...) in the simulation's action mode."""
        journeys = self.journeys
        self._choose(np.flatnonzero(journeys.hold <= 0))
        journeys.hold[:] -= 1
        journeys.left[:] -= 1
        directions = journeys.direction.copy()
        heading = np.flatnonzero(journeys.aim != _NOWHERE)
        if len(heading):
            rows, simulation = self.rows[heading], self._simulation
            way = self._places()[journeys.aim[heading]] - simulation.ball_position[rows]
            velocity = simulation.ball_velocity[rows]
            mass_kg = simulation.level.ball.mass_kg
            directions[heading] = steering(way[:, :2], velocity[:, :2], mass_kg)
        actions: npt.NDArray[np.generic] = self._actions[directions]
        return actions

    def _choose(self, which: Int64) -> None:
        """Let some of the explorers do something else from now on."""
        journeys, rng = self.journeys, self._rng
        journeys.direction[which] = rng.integers(len(DIRECTIONS), size=len(which))
        journeys.aim[which] = _NOWHERE
        journeys.hold[which] = self._lengths(_HOLD_S, len(which))
        taken = self._simulation.state.of(COIN).taken
        for explorer in which[rng.random(len(which)) < 0.5]:
            row = self.rows[explorer]
            left = np.flatnonzero(~taken[row])
            away = np.linalg.norm(
                self._places()[left] - self._simulation.ball_position[row], axis=1
            )
            near = left[np.argsort(away, kind="stable")[:_NEAR]]
            # The place behind the coins' is the finish.
            aims = np.append(near, taken.shape[1])
            journeys.aim[explorer] = aims[rng.integers(len(aims))]
            journeys.hold[explorer] *= 2

    def _places(self) -> npt.NDArray[np.float64]:
        """Return where the coins are, and behind them the finish, (K + 1, 3) metres."""
        table = self._simulation.table
        finish = table.regions.centre[0, table.own(FINISH).region]
        return np.vstack([table.of(COIN).at[0], finish])

    def _lengths(self, longest_s: float, count: int) -> Int64:
        """Return random numbers of steps, up to those in ``longest_s``."""
        longest = max(round(longest_s / self._simulation.config.control_dt_s), 1)
        return self._rng.integers(1, longest + 1, count)
