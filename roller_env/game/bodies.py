"""What the rules know of the physics: where everything is, and what the motors are told.

All of it is columns of the physics' own state, one row an env.
"""

from __future__ import annotations

from typing import NamedTuple

from roller_env.arrays import Float64
from roller_env.physics.protocol import Columns


class Bodies(NamedTuple):
    """Views of the columns of N envs; see `Columns`."""

    position: Float64
    orientation: Float64
    velocity: Float64
    angular_velocity: Float64
    displacement: Float64
    aim: Float64
    force_n: Float64
    pull: Float64

    @staticmethod
    def of(physics: Float64, at: Columns) -> Bodies:
        """Return views of ``physics``, (N, width)."""

        def columns(first: int, count: int) -> Float64:
            return physics[:, first : first + count]

        return Bodies(
            position=columns(at.position, 3),
            orientation=columns(at.orientation, 4),
            velocity=columns(at.velocity, 3),
            angular_velocity=columns(at.angular_velocity, 3),
            displacement=columns(at.displacement, at.movers),
            aim=columns(at.aim, at.movers),
            force_n=columns(at.force_n, 3),
            pull=columns(at.pull, at.movers),
        )
