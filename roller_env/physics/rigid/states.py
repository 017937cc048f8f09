"""The state of N balls and of the slabs of their levels, and what is done to them."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from roller_env.arrays import Float64, Int64
from roller_env.physics.rigid.scene import Scenes

POSITION: Final = 0
ORIENTATION: Final = 3
VELOCITY: Final = 7
SPIN: Final = 10
FORCE: Final = 13
DELAY: Final = 16
SLAB: Final = 17
"""Where things begin in a row of `States.packed`. Behind the slabs' displacements are their
velocities."""


class States(NamedTuple):
    """All that the future of N balls depends on. SI units, world frame unless said.

    Kernels take `packed`; the others are views of it. Copying a row of it, and of the balls'
    levels, back restores it exactly.
    """

    packed: Float64  # (N, 17 + 2 P)
    position: Float64  # (N, 3) centres
    orientation: Float64  # (N, 4) unit quaternion (w, x, y, z), ball frame to world frame
    velocity: Float64  # (N, 3)
    spin: Float64  # (N, 3) angular velocity in the ball's own frame
    force: Float64  # (N, 3) newtons on the centre besides gravity, during the next step
    delay: Float64  # (N,) seconds for which the next step leaves ball and slabs alone; it ends that
    slab: Float64  # (N, P) displacement of each slab along z, <= 0
    slab_velocity: Float64  # (N, P) m/s along its line at which each slab is to move in a step


class Counts(NamedTuple):
    """What the steps took, (N,) each, since they were last set to 0."""

    segments: Int64
    forced: Int64  # segments that did not end by themselves
    unsolved: Int64  # contact problems without an answer
    blocked: Int64  # slabs that were held up by a ball


def make_states(scenes: Scenes, count: int) -> States:
    """Return ``count`` balls at rest at the origin, on which nothing acts."""
    slabs = scenes.slab_stop.shape[1]
    packed = np.zeros((count, SLAB + 2 * slabs))
    packed[:, ORIENTATION] = 1.0
    return States(
        packed=packed,
        position=packed[:, POSITION : POSITION + 3],
        orientation=packed[:, ORIENTATION : ORIENTATION + 4],
        velocity=packed[:, VELOCITY : VELOCITY + 3],
        spin=packed[:, SPIN : SPIN + 3],
        force=packed[:, FORCE : FORCE + 3],
        delay=packed[:, DELAY],
        slab=packed[:, SLAB : SLAB + slabs],
        slab_velocity=packed[:, SLAB + slabs :],
    )


def make_counts(count: int) -> Counts:
    """Return counts of nothing."""
    return Counts(*(np.zeros(count, dtype=np.int64) for _ in Counts._fields))
