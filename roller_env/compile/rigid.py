"""A level for the rigid-ball engine, and that as the engine of its games."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from roller_env.arrays import Bool, Float64, Int64
from roller_env.compile.merge import merge_solids
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.physics.protocol import Bodies, Columns
from roller_env.physics.rigid.rays import cast_rays
from roller_env.physics.rigid.scene import STATIC, RigidLevel, SolidBox, pack
from roller_env.physics.rigid.states import (
    make_commands,
    make_counts,
    make_states,
)
from roller_env.physics.rigid.step import advance
from roller_env.physics.rigid.workspace import make_workspace
from roller_env.pieces.piece import Solid

CAP_S = 1 / 120
"""Longest step where motions have no closed form."""

LARGEST = 1e10
"""What is larger, in SI units, counts as no longer finite: MuJoCo's ``mjMAXVAL``."""

WORLDS_A_THREAD = 32
"""Fewer are not worth a thread of their own."""


def rigid_level(level: Level) -> RigidLevel:
    """Return a level as the engine takes it; its slabs are the movers of the expanded level."""
    expanded = expand(level)

    def box(solid: Solid, slab: int = STATIC) -> SolidBox:
        material = level.material(solid.material)
        return SolidBox(
            centre=solid.centre,
            half_size=solid.half_size,
            rotation=solid.rotation,
            friction=level.ball.friction * material.friction,
            elasticity=level.ball.elasticity * material.elasticity,
            slab=slab,
        )

    return RigidLevel(
        boxes=[
            *map(box, merge_solids(expanded.ground)),
            *map(box, expanded.machines),
            *(box(mover.solid, number) for number, mover in enumerate(expanded.movers)),
        ],
        radius=level.ball.radius,
        gravity=level.gravity,
        mass=level.ball.mass_kg,
        slab_stop=[mover.travel for mover in expanded.movers],
    )


class RigidPhysics:
    """N worlds of a level; see `roller_env.physics.protocol.Physics`."""

    def __init__(
        self, level: Level, num_envs: int, substeps: int, num_threads: int, duration_s: float
    ):
        """Make the worlds.

        Args:
            level: that `roller_env.level.load_level` has accepted.
            num_envs: number of worlds, N.
            substeps: parts of a control step between which the path is kept, S.
            num_threads: threads; 0 means one for each CPU.
            duration_s: of a control step.
        """
        self.substeps = substeps
        self._start, self._duration_s = level.start.at, duration_s
        self._scenes = pack([rigid_level(level)])
        movers = self._scenes.slab_stop.shape[1]
        self.columns = Columns(0, 3, 7, 10, 13, 13, 13 + movers, 16 + movers, movers, path=0)
        self.state: Float64 = np.zeros((num_envs, 16 + 2 * movers))
        self._bodies = Bodies.of(self.state, self.columns)
        self._threads = min(num_threads or os.cpu_count() or 1, -(-num_envs // WORLDS_A_THREAD))
        self._level_of = np.zeros(num_envs, dtype=np.int64)
        self._every = np.arange(num_envs)
        self._states = make_states(self._scenes, num_envs)
        self._commands = make_commands(self._scenes, num_envs)
        self._counts = make_counts(num_envs)
        self._workspace = make_workspace(self._scenes, self._threads)
        self._path = np.zeros((num_envs, substeps + 1, 3))
        self._pool: tuple[int, ThreadPoolExecutor] | None = None
        self.reset(self._every)

    def reset(self, worlds: Int64) -> None:
        """Put worlds back to where the level begins, at rest."""
        self.state[worlds] = 0.0
        self._bodies.position[worlds] = self._start
        self._bodies.orientation[worlds, 0] = 1.0

    def advance(self, worlds: Int64 | None) -> Float64:
        """Advance worlds (all, if None), and return their balls' centres."""
        self._commands.delay[:] = 0.0
        return self._advance(worlds)

    def advance_late(self, worlds: Int64 | None, still: Int64) -> Float64:
        """Advance worlds, each after it has stood still for a while."""
        every = self._every if worlds is None else worlds
        self._commands.delay[every] = still * (self._duration_s / self.substeps)
        return self._advance(worlds)

    def diverged(self) -> Bool:
        """Say which worlds are no longer finite, or larger than anything in a game can be."""
        return np.logical_not((np.abs(self.state) <= LARGEST).all(axis=1))

    def rays(
        self, offsets: Float64, directions: Float64, longest: float, worlds: Int64 | None
    ) -> Float64:
        """Return the distances, (n, rays) metres, to the first solid along each ray."""
        rows = self._every if worlds is None else worlds
        self._read()
        found = np.empty((len(rows), len(directions)))
        cast_rays(
            self._scenes, self._level_of, self._states, rows, offsets, directions, longest, found
        )
        return found

    def _advance(self, worlds: Int64 | None) -> Float64:
        rows = self._every if worlds is None else worlds
        self._read()
        threads = min(self._threads, -(-len(rows) // WORLDS_A_THREAD))
        if threads <= 1:
            self._advance_some(rows, 0)
        else:
            parts = np.array_split(rows, threads)
            list(self._ready_pool().map(self._advance_some, parts, range(threads)))
        self._write(rows)
        return self._path if worlds is None else self._path[worlds]

    def _advance_some(self, rows: Int64, thread: int) -> None:
        advance(
            self._scenes,
            self._level_of,
            self._states,
            self._commands,
            rows,
            self._duration_s,
            CAP_S,
            self._path,
            self._counts,
            self._workspace,
            thread,
        )

    def _ready_pool(self) -> ThreadPoolExecutor:
        """Return threads of this process: a fork has none of its parent's."""
        if self._pool is None or self._pool[0] != os.getpid():
            self._pool = os.getpid(), ThreadPoolExecutor(self._threads)
        return self._pool[1]

    def _read(self) -> None:
        """Take the worlds from `state`, which others may have written to."""
        bodies, states, commands = self._bodies, self._states, self._commands
        states.position[:] = bodies.position
        states.orientation[:] = bodies.orientation
        states.velocity[:] = bodies.velocity
        states.spin[:] = bodies.angular_velocity
        states.slab[:] = bodies.displacement
        commands.force[:] = bodies.force_n
        commands.slab_velocity[:] = bodies.pull

    def _write(self, rows: Int64) -> None:
        """Put worlds that have moved into `state`."""
        bodies, states = self._bodies, self._states
        bodies.position[rows] = states.position[rows]
        bodies.orientation[rows] = states.orientation[rows]
        bodies.velocity[rows] = states.velocity[rows]
        bodies.angular_velocity[rows] = states.spin[rows]
        bodies.displacement[rows] = states.slab[rows]
