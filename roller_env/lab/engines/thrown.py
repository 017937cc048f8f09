"""N balls of a level under any preset of any engine, with none of the game's rules."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from roller_env.arrays import Float64
from roller_env.game.tables import LevelTable
from roller_env.level import Level
from roller_env.physics.presets import PhysicsPreset
from roller_env.physics.protocol import Bodies, Path
from roller_env.simulation import make_physics


class Thrown:
    """N balls at rest at the level's start, until they are put elsewhere.

    Attributes:
        level: where they are.
        step_s: duration of `step`, seconds.
        bodies: live views of where everything is, and what is done to it. The balls have not
            turned yet, so that angular velocities can be given in the world's frame.
    """

    def __init__(self, level: Level, preset: PhysicsPreset, count: int, step_s: float):
        """Make them; ``step_s`` is a multiple of the preset's ``dt_s``."""
        self.level, self.step_s = level, step_s
        substeps = round(step_s / preset.dt_s)
        table, level_of = LevelTable.of_levels([level]), np.zeros(count, dtype=np.int64)
        self._physics = make_physics([level], table, level_of, preset, substeps, num_threads=1)
        self.bodies = Bodies.of(self._physics.state, self._physics.columns)

    def put(
        self,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike = (0.0, 0.0, 0.0),
        angular_velocity: npt.ArrayLike = (0.0, 0.0, 0.0),
    ) -> Thrown:
        """Put all balls somewhere: metres, m/s, rad/s, (3,) or (N, 3); return this."""
        bodies = self.bodies
        bodies.position[:], bodies.velocity[:] = position, velocity
        bodies.angular_velocity[:] = angular_velocity
        return self

    def roll(self, position: npt.ArrayLike, speed: npt.ArrayLike) -> Thrown:
        """Put all balls somewhere, rolling along x with a speed, m/s, (N,) or one; return this."""
        self.put(position)
        self.bodies.velocity[:, 0] = speed
        self.bodies.angular_velocity[:, 1] = self.bodies.velocity[:, 0] / self.level.ball.radius
        return self

    def step(self) -> Path:
        """Let `step_s` pass, and return where the balls went."""
        return self._physics.advance(None)

    def rise(self) -> Float64:
        """Return (N,) how high the balls would fly, nothing being in the way, metres."""
        upward = self.bodies.velocity[:, 2].clip(min=0.0)
        height: Float64 = self.bodies.position[:, 2] + upward**2 / (2.0 * self.level.gravity)
        return height

    def energy(self) -> Float64:
        """Return (N,) of motion, spin and height for each kilogram, J/kg."""
        bodies, level = self.bodies, self.level
        rim = level.ball.radius * bodies.angular_velocity
        kinetic = 0.5 * (bodies.velocity**2).sum(axis=1) + 0.2 * (rim**2).sum(axis=1)
        energy: Float64 = kinetic + level.gravity * bodies.position[:, 2]
        return energy

    def angular_velocity(self) -> Float64:
        """Return (N, 3) angular velocities in the world's frame, rad/s."""
        turned: Float64 = Rotation.from_quat(self.bodies.orientation, scalar_first=True).apply(
            self.bodies.angular_velocity
        )
        return turned
