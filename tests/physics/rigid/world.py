"""Balls of the rigid engine among boxes, to be driven by tests. SI units, world frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.physics.rigid.engine import Balls, Counts, advance
from roller_env.physics.rigid.scene import Scene, SolidBox, make_scene

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
    """N balls in one scene, at rest at the origin until they are put somewhere.

    Attributes:
        scene: what they meet.
        balls: where they are.
        path: (N, S + 1, 3) centres of the last step.
        counts: what the steps took.
        force: (N, 3) force over mass besides gravity, m/s^2.
        slab_speed: (N, P) along z, m/s.
    """

    def __init__(
        self,
        boxes: Sequence[SolidBox],
        count: int = 1,
        *,
        slab_stop: Sequence[float] = (),
        cap_s: float = CAP_S,
        samples: int = 12,
    ):
        self.scene: Scene = make_scene(boxes, RADIUS_M, GRAVITY, slab_stop)
        slabs = len(slab_stop)
        self.balls = Balls(
            position=np.zeros((count, 3)),
            velocity=np.zeros((count, 3)),
            angular_velocity=np.zeros((count, 3)),
            attitude=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            slab=np.zeros((count, slabs)),
        )
        self.path = np.zeros((count, samples + 1, 3))
        self.counts = Counts(*(np.zeros(count, dtype=np.int64) for _ in Counts._fields))
        self.force = np.zeros((count, 3))
        self.slab_speed = np.zeros((count, slabs))
        self.cap_s = cap_s

    def put(
        self,
        position: Sequence[float],
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        angular_velocity: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> World:
        """Put all balls somewhere; return this."""
        self.balls.position[:] = position
        self.balls.velocity[:] = velocity
        self.balls.angular_velocity[:] = angular_velocity
        return self

    def run(self, time_s: float, force: Sequence[float] | None = None) -> World:
        """Let time pass in control steps; return this."""
        if force is not None:
            self.force[:] = force
        for _ in range(round(time_s / STEP_S)):
            self.step()
        return self

    def step(self) -> None:
        """Let one control step pass."""
        advance(
            self.scene,
            self.balls,
            self.force,
            self.slab_speed,
            STEP_S,
            self.cap_s,
            0,
            len(self.balls.position),
            self.path,
            self.counts,
        )

    def energy(self) -> Float64:
        """Return (N,) kinetic and potential energy over mass, J/kg."""
        v, w = self.balls.velocity, self.balls.angular_velocity
        kinetic = 0.5 * (v**2).sum(axis=1) + 0.2 * RADIUS_M**2 * (w**2).sum(axis=1)
        energy: Float64 = kinetic + GRAVITY * self.balls.position[:, 2]
        return energy

    def depth(self) -> Float64:
        """Return (N,) how deep each ball is in a solid, metres; negative where it is free."""
        deepest = np.full(len(self.balls.position), -np.inf)
        for box in range(len(self.scene.centre)):
            relative = self.balls.position - self.scene.centre[box]
            if self.scene.slab[box] >= 0:
                relative[:, 2] -= self.balls.slab[:, self.scene.slab[box]]
            local = relative @ self.scene.axes[box].T
            half = self.scene.half[box]
            outside = np.linalg.norm(np.maximum(np.abs(local) - half, 0.0), axis=1)
            inside = np.minimum((half - np.abs(local)).min(axis=1), np.inf)
            distance = np.where(outside > 0.0, outside, -inside)
            deepest = np.maximum(deepest, RADIUS_M - distance)
        return deepest
