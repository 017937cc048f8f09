"""What the rules know of the physics: where everything is, and what the motors are told."""

from __future__ import annotations

from typing import NamedTuple

from roller_env.arrays import Float64


class Bodies(NamedTuple):
    """Where the balls and slabs of N envs are; live.

    Attributes:
        position: (N, 3) ball centres, metres, world frame.
        orientation: (N, 4) unit quaternions (w, x, y, z), ball to world.
        velocity: (N, 3) m/s, world frame.
        angular_velocity: (N, 3) rad/s, in each ball's own frame.
        displacement: (N, M) how far the slabs are from where they began, metres, <= 0.
        aim: (N, M) displacements to which they are being pulled, which they trail.
    """

    position: Float64
    orientation: Float64
    velocity: Float64
    angular_velocity: Float64
    displacement: Float64
    aim: Float64


class Controls(NamedTuple):
    """What the motors of N envs do in the next control step.

    Attributes:
        force_n: (N, 3) mean force on the ball over the step, newtons, world frame.
        velocity: (N, M) m/s at which what pulls the slabs moves; below zero is down.
    """

    force_n: Float64
    velocity: Float64
