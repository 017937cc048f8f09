"""Where a simulation's platforms are, and which is nearest to each ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roller_env.arrays import Float64, Int64
from roller_env.pieces.platform import PLATFORM
from roller_env.simulation import Simulation


@dataclass(frozen=True, slots=True)
class Platforms:
    """The P platforms of a simulation of one level. Metres, world frame.

    Attributes:
        start: (P, 3) their centres where they begin.
        along: (P, 3) unit vectors from their other ends to where they begin.
        stop: (P,) displacement at their other ends, <= 0.
        half: (P, 3) half edges, along their own axes.
        axes: (P, 3, 3) those axes, one a row.
        columns: of `Simulation.qpos`, which hold their displacements.
    """

    start: Float64
    along: Float64
    stop: Float64
    half: Float64
    axes: Float64
    columns: slice

    @staticmethod
    def of(simulation: Simulation) -> Platforms:
        """Return those of a simulation of one level."""
        own, movers = simulation.table.own(PLATFORM), simulation.table.movers
        mine = slice(own.mover, own.mover + own.movers)
        slabs = [platform.mover("").solid for platform in simulation.level.platforms]
        return Platforms(
            start=movers.centre[0, mine],
            along=movers.along[0, mine],
            stop=movers.stop[0, mine],
            half=np.array([slab.half_size for slab in slabs]).reshape(-1, 3),
            axes=np.array([slab.rotation for slab in slabs]).reshape(-1, 3, 3).swapaxes(1, 2),
            columns=slice(7 + mine.start, 7 + mine.stop),
        )

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.start)

    def displacement(self, simulation: Simulation) -> Float64:
        """Return (N, P) by how much each has moved, metres, <= 0."""
        moved: Float64 = simulation.qpos[:, self.columns]
        return moved

    def places(self, simulation: Simulation) -> Float64:
        """Return (N, P, 3) their centres now."""
        places: Float64 = self.start + self.displacement(simulation)[..., None] * self.along
        return places

    def nearest(self, simulation: Simulation) -> Int64:
        """Return (N,) the one on whose way, wherever it is now, each ball is the nearest."""
        from_start = simulation.ball_position[:, None] - self.start
        reached = np.clip((from_start * self.along).sum(axis=2), self.stop, 0.0)
        apart = np.linalg.norm(from_start - reached[..., None] * self.along, axis=2)
        nearest: Int64 = apart.argmin(axis=1)
        return nearest

    def ridden(self, simulation: Simulation, above_m: float) -> Int64:
        """Return (N,) the one that each ball's centre is over by at most so much; -1: none."""
        if not len(self):
            return np.full(simulation.num_envs, -1)
        away = simulation.ball_position[:, None] - self.places(simulation)
        own = np.einsum("pij,npj->npi", self.axes, away)
        over = (np.abs(own[..., :2]) <= self.half[:, :2]).all(axis=2)
        over &= (own[..., 2] > 0.0) & (own[..., 2] <= self.half[:, 2] + above_m)
        ridden: Int64 = np.where(over.any(axis=1), over.argmax(axis=1), -1)
        return ridden
