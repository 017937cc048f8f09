"""N balls of the rigid engine in one scene, with nothing of the game around them."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from roller_env.arrays import Bool, Float64
from roller_env.physics.rigid.scene import RigidLevel, Scenes, pack
from roller_env.physics.rigid.states import Counts, make_counts, make_states
from roller_env.physics.rigid.step import advance
from roller_env.physics.rigid.workspace import make_workspace

STEP_S: Final = 1 / 20
"""A control step."""

_KNOTS: Final = 400


class Balls:
    """N balls in one scene, at rest at the origin until they are put somewhere.

    Attributes:
        level: the scene.
        states: where they are, and what is done to them.
        counts: what the steps took.
    """

    def __init__(self, level: RigidLevel, count: int, cap_s: float = 1 / 120) -> None:
        """Make them; ``cap_s`` is the longest step of what has no closed form."""
        self.level, self._cap_s = level, cap_s
        self._scenes = pack([level])
        self.states = make_states(self._scenes, count)
        self.counts: Counts = make_counts(count)
        self._workspace = make_workspace(self._scenes)
        self._levels, self._rows = np.zeros(count, dtype=np.int64), np.arange(count)
        self._path, self._knots = np.zeros((count, _KNOTS, 6)), np.zeros(count, dtype=np.int64)

    def step(self) -> None:
        """Let a control step pass."""
        advance(
            self._scenes,
            self._levels,
            self.states.packed,
            self.counts,
            self._workspace,
            STEP_S,
            self._cap_s,
            self._rows,
            self._path,
            self._knots,
            0,
        )

    def energy(self) -> Float64:
        """Return (N,) kinetic and potential energy, joules."""
        v, w = self.states.velocity, self.states.spin
        level = self.level
        kinetic = 0.5 * (v**2).sum(axis=1) + 0.2 * level.radius**2 * (w**2).sum(axis=1)
        total: Float64 = level.mass * (kinetic + level.gravity * self.states.position[:, 2])
        return total

    def angular_velocity(self) -> Float64:
        """Return (N, 3) rad/s, world frame."""
        turned: Float64 = Rotation.from_quat(self.states.orientation, scalar_first=True).apply(
            self.states.spin
        )
        return turned

    def depth(self) -> Float64:
        """Return (N,) how deep each ball is in a solid, metres; negative where it is free."""
        states = self.states
        gaps = solid_gaps(self._scenes, states.position, states.slab)[0]
        depth: Float64 = self.level.radius - gaps.min(axis=1, initial=np.inf)
        return depth


def solid_gaps(scenes: Scenes, places: Float64, slabs: Float64) -> tuple[Float64, Bool]:
    """Return (N, solids) the distances of places from solids, and whether of an edge or corner.

    Args:
        scenes: of one level.
        places: (N, 3) metres.
        slabs: (N, P) how far each slab has moved, metres.

    Returns:
        The distances, metres; negative inside. And where the nearest point is not on a face.
    """
    gaps = np.empty((len(places), len(scenes.solids.one)))
    rounded = np.empty(gaps.shape, dtype=np.bool_)
    for number, solid in enumerate(scenes.solids.one):
        relative = places - solid.centre
        if solid.slab >= 0:
            relative -= slabs[:, solid.slab, None] * solid.along
        beyond = np.abs(relative @ solid.axes.T) - solid.half
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        gaps[:, number] = np.where(outside > 0.0, outside, beyond.max(axis=1))
        rounded[:, number] = (beyond > 0.0).sum(axis=1) > 1
    return gaps, rounded
