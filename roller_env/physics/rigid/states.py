"""The state of N balls and of the slabs of their levels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roller_env.arrays import Float64, Int64
from roller_env.physics.rigid.scene import Scenes


class States(NamedTuple):
    """All that the future of N balls depends on. SI units, world frame unless said.

    Copying a row of each array, and of `level_of_row`, back restores it exactly.
    """

    position: Float64  # (N, 3) centres
    velocity: Float64  # (N, 3)
    orientation: Float64  # (N, 4) unit quaternion (w, x, y, z), ball frame to world frame
    spin: Float64  # (N, 3) angular velocity in the ball's own frame
    slab: Float64  # (N, P) displacement of each slab along z, <= 0


class Commands(NamedTuple):
    """What is done to N balls during a step."""

    force: Float64  # (N, 3) newtons on the centre besides gravity, world frame
    slab_velocity: Float64  # (N, P) m/s along z at which each slab is to move
    delay: Float64  # (N,) seconds for which ball and slabs stand still before the step begins


class Counts(NamedTuple):
    """What the steps took, (N,) each, since they were last set to 0."""

    segments: Int64
    forced: Int64  # segments that did not end by themselves
    unsolved: Int64  # contact problems without an answer
    blocked: Int64  # slabs that were held up by a ball


def make_states(scenes: Scenes, count: int) -> States:
    """Return ``count`` balls at rest at the origin."""
    return States(
        position=np.zeros((count, 3)),
        velocity=np.zeros((count, 3)),
        orientation=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        spin=np.zeros((count, 3)),
        slab=np.zeros((count, scenes.slab_stop.shape[1])),
    )


def make_commands(scenes: Scenes, count: int) -> Commands:
    """Return no force, slabs that stand, and no delay."""
    return Commands(
        force=np.zeros((count, 3)),
        slab_velocity=np.zeros((count, scenes.slab_stop.shape[1])),
        delay=np.zeros(count),
    )


def make_counts(count: int) -> Counts:
    """Return counts of nothing."""
    return Counts(*(np.zeros(count, dtype=np.int64) for _ in Counts._fields))
