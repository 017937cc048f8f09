"""A level for the rigid-ball engine, and that as the engine of its games."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

import numpy as np

from roller_env.arrays import Bool, Float64, Int64
from roller_env.compile.merge import merge_solids
from roller_env.compiled import Bound
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.physics.presets import FrictionLaw
from roller_env.physics.protocol import Columns, Path
from roller_env.physics.rigid.law import COULOMB, LAWS, ContactLaw
from roller_env.physics.rigid.rays import cast_rays
from roller_env.physics.rigid.scene import STATIC, RigidLevel, SolidBox, SolidHull, pack
from roller_env.physics.rigid.states import (
    FORCE,
    ORIENTATION,
    POSITION,
    SLAB,
    SPIN,
    VELOCITY,
    make_counts,
    make_states,
)
from roller_env.physics.rigid.step import advance
from roller_env.physics.rigid.workspace import make_workspace
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.piece import UPWARDS, Solid

CAP_S = 1 / 120
"""Longest step where motions have no closed form."""

LARGEST = 1e10
"""What is larger, in SI units, counts as no longer finite: MuJoCo's ``mjMAXVAL``."""

KNOTS = 24
KNOTS_A_CAP = 4
"""Room for the knots of a path: so many, and so many more for each time of the cap in a step."""

WORLDS_A_THREAD = 512
"""Fewer are not worth a thread of their own: they would wait for each other in Python."""


def rigid_level(
    level: Level, law: ContactLaw = COULOMB, slots: Sequence[int] | None = None, slabs: int = 0
) -> RigidLevel:
    """Return a level as the engine takes it; its slabs are the movers of the expanded level.

    Args:
        level: the level.
        law: of its contacts.
        slots: (movers,) which slab each mover is; by default they are numbered as they come.
        slabs: how many slabs there are, if ``slots`` are given; those of no mover stand still.
    """
    expanded = expand(level)
    numbers = range(len(expanded.movers)) if slots is None else slots
    stops = np.zeros(max(slabs, len(expanded.movers)))
    stops[list(numbers)] = [mover.travel for mover in expanded.movers]
    along = np.tile(UPWARDS, (len(stops), 1))
    along[list(numbers)] = np.array([mover.along for mover in expanded.movers]).reshape(-1, 3)

    def rigid(solid: Solid, slab: int = STATIC) -> SolidBox | SolidHull:
        material = level.material(solid.material)
        friction = level.ball.friction * material.friction
        elasticity = level.ball.elasticity * material.elasticity
        if isinstance(solid, ConvexSolid):
            return SolidHull(solid.corners().tolist(), friction, elasticity, slab)
        return SolidBox(solid.centre, solid.half_size, solid.rotation, friction, elasticity, slab)

    return RigidLevel(
        solids=[
            *map(rigid, merge_solids(expanded.ground)),
            *map(rigid, expanded.machines),
            *(
                rigid(mover.solid, number)
                for number, mover in zip(numbers, expanded.movers, strict=True)
            ),
        ],
        radius=level.ball.radius,
        gravity=level.gravity,
        mass=level.ball.mass_kg,
        slab_stop=stops.tolist(),
        slab_along=along.tolist(),
        law=law,
    )


class RigidPhysics:
    """N worlds of some levels; see `roller_env.physics.protocol.Physics`."""

    def __init__(
        self,
        levels: Sequence[Level],
        level_of: Int64,
        slots: Sequence[Sequence[int]],
        slabs: int,
        num_envs: int,
        substeps: int,
        num_threads: int,
        duration_s: float,
        law: FrictionLaw = "coulomb",
    ):
        """Make the worlds.

        Args:
            levels: that `roller_env.level.load_level` has accepted.
            level_of: (N,) which of them each world is; whoever changes it resets the world.
            slots: of each level which slab each of its movers is.
            slabs: how many slabs there are.
            num_envs: number of worlds, N.
            substeps: parts of a control step between which the path is kept, S.
            num_threads: threads; 0 means one for each CPU.
            duration_s: of a control step.
            law: of friction and impact.
        """
        self.substeps = substeps
        self._start, self._duration_s = np.array([each.start.at for each in levels]), duration_s
        self._level_of = level_of
        self._scenes = pack(
            [
                rigid_level(level, LAWS[law], own, slabs)
                for level, own in zip(levels, slots, strict=True)
            ]
        )
        movers = self._scenes.slab_stop.shape[1]
        self.columns = Columns(
            position=POSITION,
            orientation=ORIENTATION,
            velocity=VELOCITY,
            angular_velocity=SPIN,
            displacement=SLAB,
            aim=SLAB,
            force_n=FORCE,
            pull=SLAB + movers,
            movers=movers,
            path=0,
            path_width=6,
        )
        self._worlds = make_states(self._scenes, num_envs)
        self.state: Float64 = self._worlds.packed
        threads = min(num_threads or os.cpu_count() or 1, -(-num_envs // WORLDS_A_THREAD))
        self._part_size = -(-num_envs // threads)
        self.parts = [
            slice(first, min(first + self._part_size, num_envs))
            for first in range(0, num_envs, self._part_size)
        ]
        self._every = np.arange(num_envs)
        most = KNOTS + math.ceil(KNOTS_A_CAP * duration_s / CAP_S)
        self._path = Path(np.zeros((num_envs, most, 6)), np.zeros(num_envs, dtype=np.int64))
        counts, workspace = make_counts(num_envs), make_workspace(self._scenes, len(self.parts))
        self._advance = Bound(
            advance, self._scenes, level_of, self.state, counts, workspace, duration_s, CAP_S
        )
        self._cast_rays = Bound(cast_rays, self._scenes, level_of, self.state)
        self.reset(self._every)

    def reset(self, worlds: Int64) -> None:
        """Put worlds back to where the level begins, at rest."""
        self.state[worlds] = 0.0
        self._worlds.position[worlds] = self._start[self._level_of[worlds]]
        self._worlds.orientation[worlds, 0] = 1.0

    def advance(self, worlds: Int64 | None) -> Path:
        """Advance worlds (all, if None), and return their balls' ways."""
        rows = self._every if worlds is None else worlds
        part = int(rows[0]) // self._part_size
        # Worlds of a part have room where the part begins, as all have together.
        room = slice(part * self._part_size, part * self._part_size + len(rows))
        path = Path(self._path.at[room], self._path.knots[room])
        self._advance(rows, *path, part)
        return path

    def advance_late(self, worlds: Int64 | None, still: Int64) -> Path:
        """Advance worlds, each after it has stood still for a while."""
        rows = self._every if worlds is None else worlds
        self._worlds.delay[rows] = still * (self._duration_s / self.substeps)
        return self.advance(worlds)

    def diverged(self, worlds: Int64 | None) -> Bool:
        """Say which worlds are no longer finite, or larger than anything in a game can be."""
        state = self.state if worlds is None else self.state[worlds]
        return np.logical_not((np.abs(state) <= LARGEST).all(axis=1))

    def rays(
        self, offsets: Float64, directions: Float64, longest: float, worlds: Int64 | None
    ) -> Float64:
        """Return the distances, (n, rays) metres, to the first solid along each ray."""
        rows = self._every if worlds is None else worlds
        found = np.empty((len(rows), len(directions)))
        self._cast_rays(rows, offsets, directions, longest, found)
        return found
