"""A ball on the level and on a slope, pushed, rolling and skidding.

What is expected, all of it held by the tests: the Euler family takes the velocity at the end of a
step for the whole step, so a ball that rolls from rest is ahead by h / T, whatever the force. RK4
has no such error. MuJoCo puts the contact of a ball that rests a depth delta in the ground half
way, so it rolls on a lever shortened by delta / 2, which is worth (2/7) delta / r. A skid ends
after 2 v0 / (7 mu g), give or take a hop, at 5/7 of its velocity. The pyramidal cone's edges are
the world's axes: at 45 degrees its friction is mu / sqrt(2), and between it bends the path.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np

from roller_env.arrays import Float64
from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.contact import scene
from roller_env.lab.game import FRICTION, GRAVITY_M_S2, MASS_KG, RADIUS_M
from roller_env.lab.methods import MUJOCO, PYRAMIDAL, Method, MujocoMethod
from roller_env.lab.simulate import Path

IMPRATIO: Final = 10.0
"""The game has 1; the soft contact here is four times as slow as its own, and its creep would hide
what integrators do."""

SOFT_TIME_CONSTANT_S: Final = 0.04
"""Of the soft contact: 2 h for the largest step h = 0.02 s with which it is used, what MuJoCo's
``refsafe`` would ask for. Euler's limit, damping times h below 2, is at h = 0.04 s."""

SOFT_SOLREF: Final = (-(SOFT_TIME_CONSTANT_S**-2), -2.0 / SOFT_TIME_CONSTANT_S)
"""Critically damped, in MuJoCo's direct form, which ``refsafe`` leaves alone."""

ROLLS_BELOW: Final = 0.02
"""Fraction of the first slip below which a ball counts as rolling, extrapolated to none. The game's
soft friction takes all that the cone allows only while it wants more, which is the rate B = 216/s
of the slip: above 7/2 mu g / B, 1.6 % of 3 m/s. Below, the slip dies out exponentially."""


def resting_ball(
    method: MujocoMethod, dt_s: float, contact: Mapping[str, Any], slope_deg: float = 0.0
) -> mujoco.MjSpec:
    """Return the game's ball at rest on a ground."""
    spec = scene.new_spec(method, dt_s, GRAVITY_M_S2, impratio=IMPRATIO, **scene.CONVERGED)
    angle = math.radians(slope_deg)
    tilt = [math.cos(angle / 2.0), 0.0, math.sin(angle / 2.0), 0.0]
    scene.add_ground(spec, quat=tilt, **contact)
    height = RADIUS_M - scene.resting_depth(contact["solref"], GRAVITY_M_S2 * math.cos(angle))
    at = (height * math.sin(angle), 0.0, height * math.cos(angle))
    scene.add_ball(spec, at, RADIUS_M, MASS_KG)
    return spec


@dataclass(frozen=True)
class SteadyRoll(scene.BallScene):
    """A ball that a force along +x, or a ground that falls towards +x, sets rolling from rest."""

    moments_s: Sequence[float] = (2.0,)
    reference_step_s: float = 2.0 / 7000.0
    slope_deg: float = 0.0
    force_n: float = 0.0

    @property
    def acceleration_m_s2(self) -> float:
        """Of a rigid ball: five sevenths of what it would be without friction."""
        pull = GRAVITY_M_S2 * math.sin(math.radians(self.slope_deg))
        return 5.0 / 7.0 * (pull + self.force_n / MASS_KG)

    def _world(self, method: MujocoMethod, dt_s: float) -> mujoco.MjSpec:
        return resting_ball(method, dt_s, scene.contact_of(FRICTION, SOFT_SOLREF), self.slope_deg)

    def _start(self, data: mujoco.MjData, dt_s: float) -> None:
        data.xfrc_applied[1, 0] = self.force_n

    def judge(self, path: Path, method: MujocoMethod) -> Mapping[str, float]:
        """Return errors of the position in parts of the displacement."""
        angle = math.radians(self.slope_deg)
        along = (math.cos(angle), 0.0, -math.sin(angle))
        rigid = 0.5 * self.acceleration_m_s2 * self.horizon_s**2
        (away,), (moved,) = self.away(path), self.places(path) - path.qpos[0, :3]
        return {
            "position": float(np.linalg.norm(away) / np.linalg.norm(moved - away)),
            "acceleration": abs(float(moved @ along) / rigid - 1.0),
        }


@dataclass(frozen=True)
class Skid(scene.BallScene):
    """A ball that is thrown along the ground without spin, skids, and begins to roll.

    The ground is the game's own at its default preset: in the soft contact of the other two, the
    skid would last 6 % too long. The heading is from +x towards +y.
    """

    methods: Sequence[Method] = (*MUJOCO, *PYRAMIDAL)
    moments_s: Sequence[float] = (0.5,)
    reference_step_s: float = 0.5 / 28_000.0
    heading_deg: float = 0.0
    speed_m_s: float = 3.0

    @property
    def rolls_after_s(self) -> float:
        """When a rigid ball begins to roll: 2 v0 / (7 mu g)."""
        return 2.0 * self.speed_m_s / (7.0 * FRICTION * GRAVITY_M_S2)

    @property
    def direction(self) -> Float64:
        """(2,) unit vector of the throw."""
        angle = math.radians(self.heading_deg)
        return np.array([math.cos(angle), math.sin(angle)])

    @property
    def rigid_place_m(self) -> Float64:
        """(2,) where a rigid ball is in the end."""
        skids, rolls = self.rolls_after_s, self.horizon_s - self.rolls_after_s
        braked = 0.5 * FRICTION * GRAVITY_M_S2 * skids**2
        return (self.speed_m_s * (skids + 5.0 / 7.0 * rolls) - braked) * self.direction

    def _world(self, method: MujocoMethod, dt_s: float) -> mujoco.MjSpec:
        return resting_ball(method, dt_s, scene.game_contact())

    def _start(self, data: mujoco.MjData, dt_s: float) -> None:
        data.qvel[:2] = self.speed_m_s * self.direction

    def judge(self, path: Path, method: MujocoMethod) -> Mapping[str, float]:
        """Return errors against the converged and the rigid ball."""
        heading = np.arctan2(*path.qvel[:, 1::-1].T) - math.radians(self.heading_deg)
        return {
            "position": float(np.linalg.norm(self.away(path, method.cone)[0, :2])),
            "roll_time": abs(roll_time(path) / self.rolls_after_s - 1.0),
            "heading": math.degrees(float(np.abs(heading).max())),
            "place": float(np.linalg.norm(path.qpos[-1, :2] - self.rigid_place_m)),
        }


def roll_time(path: Path) -> float:
    """Return when a thrown ball begins to roll, seconds; infinite where it never does.

    Friction takes the slip away evenly, so when `ROLLS_BELOW` of it is left tells when none is.
    """
    slip = slip_speed(path)
    threshold = ROLLS_BELOW * slip[0]
    if not (slip <= threshold).any():
        return math.inf
    after = int((slip <= threshold).argmax())
    around = slice(after, after - 2, -1)
    time = np.interp(threshold, slip[around], path.time[around])
    return float(time / (1.0 - ROLLS_BELOW))


def slip_speed(path: Path) -> Float64:
    """Return the speed of the ball's lowest point over the ground, (S + 1,) m/s."""
    spin = np.empty((len(path.time), 3))
    for world, quaternion, own in zip(spin, path.qpos[:, 3:7], path.qvel[:, 3:6], strict=True):
        mujoco.mju_rotVecQuat(world, own, quaternion)
    contact = np.array([0.0, 0.0, -RADIUS_M])
    return np.asarray(np.linalg.norm((path.qvel[:, :3] + np.cross(spin, contact))[:, :2], axis=1))


INCLINE: Final = SteadyRoll(**scene.described("incline"), slope_deg=20.0)
PUSH: Final = SteadyRoll(**scene.described("push"), force_n=KEY_FORCE_N)
SKIDS: Final = tuple(
    Skid(**scene.described(f"skid-{heading_deg:g}"), heading_deg=heading_deg)
    for heading_deg in (0.0, 22.5, 45.0)
)
