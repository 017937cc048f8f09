"""Balls of the rigid engine among boxes, to be driven by tests. SI units, world frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from roller_env.physics.rigid.law import COULOMB, ContactLaw
from roller_env.physics.rigid.scene import RigidLevel, Scenes, SolidBox, SolidHull, pack
from roller_env.physics.rigid.states import States, make_counts, make_states
from roller_env.physics.rigid.step import advance
from roller_env.physics.rigid.workspace import make_workspace

Float64 = npt.NDArray[np.float64]

RADIUS_M: Final = 0.4064
GRAVITY: Final = 9.8044
FRICTION: Final = 0.3
CAP_S: Final = 1 / 120
STEP_S: Final = 1 / 20
RESTING_M: Final = RADIUS_M + 0.5e-9
"""Height of a ball that lies on ground at height 0: contacts are kept half a nanometre open."""


def floor(friction: float = FRICTION, elasticity: float = 0.0) -> SolidBox:
    """Return a floor whose upper face is at height 0."""
    centre, half = (0.0, 0.0, -1.0), (500.0, 500.0, 1.0)
    return SolidBox(centre, half, friction=friction, elasticity=elasticity)


def slope(degrees: float) -> SolidBox:
    """Return a floor through the origin that falls towards +x."""
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    rotation = ((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c))
    return SolidBox((-s, 0.0, -c), (500.0, 500.0, 1.0), rotation, FRICTION)


class World:
    """N balls, of 1 kg unless said, in one scene, at rest at the origin until they are put.

    Attributes:
        scenes: what they meet.
        states: where they are, and what is done to them.
        path: (N, K, 6) their ways in the last step.
        knots: (N,) how many knots each has.
        counts: what the steps took.
    """

    def __init__(
        self,
        boxes: Sequence[SolidBox | SolidHull],
        count: int = 1,
        *,
        slab_stop: Sequence[float] = (),
        slab_along: Sequence[Sequence[float]] = (),
        cap_s: float = CAP_S,
        law: ContactLaw = COULOMB,
        mass_kg: float = 1.0,
    ):
        level = RigidLevel(
            boxes,
            RADIUS_M,
            GRAVITY,
            mass_kg,
            slab_stop,
            slab_along,
            law,
        )
        self.scenes: Scenes = pack([level])
        self.states = make_states(self.scenes, count)
        self.counts = make_counts(count)
        self.path = np.zeros((count, 300, 6))
        self.knots = np.zeros(count, dtype=np.int64)
        self.cap_s = cap_s
        self._workspace = make_workspace(self.scenes)
        self._level_of_row = np.zeros(count, dtype=np.int64)
        self._rows = np.arange(count)

    def put(
        self,
        position: Sequence[float],
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        angular_velocity: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> World:
        """Put all balls somewhere; return this."""
        self.states.position[:] = position
        self.states.velocity[:] = velocity
        # The ball's frame, in which the spin is, is still the world's.
        self.states.spin[:] = angular_velocity
        return self

    def run(self, time_s: float, force: Sequence[float] | None = None) -> World:
        """Let time pass in control steps; return this."""
        if force is not None:
            self.states.force[:] = force
        for _ in range(round(time_s / STEP_S)):
            self.step()
        return self

    def step(self) -> None:
        """Let one control step pass."""
        advance(
            self.scenes,
            self._level_of_row,
            self.states.packed,
            self.counts,
            self._workspace,
            STEP_S,
            self.cap_s,
            self._rows,
            self.path,
            self.knots,
            0,
        )

    def way(self, row: int = 0, points: int = 50) -> Float64:
        """Return the places, (K, 3), that a ball came through in the last step."""
        path = self.path[row, : self.knots[row]]
        s = np.linspace(0.0, 1.0, points)[:, None]
        pieces = [path[:1, :3]]
        for (p, b), (q, _) in pairwise(path.reshape(-1, 2, 3)):
            pieces.append(p + s * (q - p - b) + s**2 * b)
        return np.concatenate(pieces)

    @property
    def commands(self) -> States:
        """What is done to the balls."""
        return self.states

    @property
    def angular_velocity(self) -> Float64:
        """(N, 3) rad/s, world frame."""
        turned: Float64 = np.array(
            [
                Rotation.from_quat(quaternion, scalar_first=True).apply(spin)
                for quaternion, spin in zip(self.states.orientation, self.states.spin, strict=True)
            ]
        )
        return turned

    def energy(self) -> Float64:
        """Return (N,) kinetic and potential energy over mass, J/kg."""
        v, w = self.states.velocity, self.states.spin
        kinetic = 0.5 * (v**2).sum(axis=1) + 0.2 * RADIUS_M**2 * (w**2).sum(axis=1)
        energy: Float64 = kinetic + GRAVITY * self.states.position[:, 2]
        return energy

    def depth(self) -> Float64:
        """Return (N,) how deep each ball is in a solid, metres; negative where it is free."""
        deepest = np.full(len(self.states.position), -np.inf)
        for solid in self.scenes.solids.one:
            relative = self.states.position - solid.centre
            if solid.slab >= 0:
                relative -= self.states.slab[:, solid.slab, None] * solid.along
            local = relative @ solid.axes.T
            half = solid.half
            outside = np.linalg.norm(np.maximum(np.abs(local) - half, 0.0), axis=1)
            inside = np.minimum((half - np.abs(local)).min(axis=1), np.inf)
            distance = np.where(outside > 0.0, outside, -inside)
            deepest = np.maximum(deepest, RADIUS_M - distance)
        return deepest
