"""MuJoCo as the engine of a level's games."""

from __future__ import annotations

import numpy as np

from roller_env.arrays import Bool, Float64, Int64
from roller_env.compile.compiled import CompiledLevel
from roller_env.physics.protocol import Columns, Path
from roller_env.physics.stepper import Stepper


class MujocoPhysics:
    """N worlds of a compiled level; see `roller_env.physics.protocol.Physics`."""

    def __init__(self, compiled: CompiledLevel, num_envs: int, substeps: int, num_threads: int):
        """Make the worlds; the arguments are those of `Stepper`."""
        self.substeps = substeps
        self._ball = compiled.ball_body
        self._knots = np.full(num_envs, substeps + 1)
        self._stepper = Stepper(compiled.model, num_envs, substeps, num_threads)
        self.state = self._stepper.state
        self.columns = self._columns(compiled)
        # MuJoCo's threads are its own.
        self.parts = [slice(0, num_envs)]

    def _columns(self, compiled: CompiledLevel) -> Columns:
        """Return where things are in MuJoCo's integration state.

        It numbers joints and actuators in the order in which the level's spec adds them: the
        ball's, then those of the slabs.
        """
        first = self._stepper.first_columns
        position = first["qpos"] + compiled.ball_qpos
        velocity = first["qvel"] + compiled.ball_qvel
        return Columns(
            position=position,
            orientation=position + 3,
            velocity=velocity,
            angular_velocity=velocity + 3,
            displacement=position + 7,
            aim=first["act"],
            force_n=first["ctrl"],
            pull=first["ctrl"] + 3,
            movers=self._stepper.act.shape[1],
            path=compiled.ball_qpos,
            path_width=3,
        )

    def reset(self, worlds: Int64) -> None:
        """Put worlds back to where the level begins, and forget their warnings."""
        self._stepper.reset(worlds)

    def advance(self, worlds: Int64 | None) -> Path:
        """Advance worlds (all, if None); the path is of ``qpos`` after every physics step."""
        return self._straight(self._stepper.advance(worlds))

    def advance_late(self, worlds: Int64 | None, still: Int64) -> Path:
        """Advance worlds, each after it has stood still for a while."""
        return self._straight(self._stepper.advance_late(worlds, still))

    def _straight(self, places: Float64) -> Path:
        return Path(places, self._knots[: len(places)])

    def diverged(self, worlds: Int64 | None) -> Bool:
        """Say which worlds MuJoCo has warned of, or are not finite."""
        lost: Bool = self._stepper.diverged() | ~np.isfinite(self._stepper.qpos).all(axis=1)
        return lost if worlds is None else lost[worlds]

    def rays(
        self, offsets: Float64, directions: Float64, longest: float, worlds: Int64 | None
    ) -> Float64:
        """Return the distances, (n, rays) metres, to the first geom that is not the ball."""
        first = self.columns.position
        ball = self.state[:, first : first + 3]
        origins = (ball if worlds is None else ball[worlds])[:, None, :] + offsets
        return self._stepper.rays(origins, directions, self._ball, worlds)
