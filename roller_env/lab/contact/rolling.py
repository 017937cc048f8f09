"""A ball on the level and on a slope, pushed, rolling and skidding.

What is expected (both parts are held by the tests):

- *Discretisation*, pushed from rest or down a slope: every integrator of the Euler family takes
  the velocity at the end of a step for the whole step, so after n steps the ball is at
  a h^2 n (n + 1) / 2 and its relative error is exactly h / T, whatever the force. RK4 has none.
- *Model*: the ball rests a depth delta in the ground and MuJoCo puts the contact half way, so the
  lever of friction is r - delta / 2 and a = F / (m + I / (r - delta / 2)^2), which is lower than
  the rigid ball's by (2/7) delta / r. That, and not the creep of the soft friction (some fifty
  times less with impratio 10), is what RK4 keeps.
- *Skid to roll*: with the elliptic cone after 2 v0 / (7 mu g) at every heading, give or take a
  hop. Friction's impulse is mu times the normal one, which is m (g t + v_z) with the ball's upward
  speed v_z, so the slip is v0 - 7/2 mu (g t + v_z) whatever the step, and a ball that goes up while
  its slip ends rolls v_z / g too early. The pyramidal cone's edges are the world's axes: at 45
  degrees its friction is mu / sqrt(2), and between it bends the path. The heading at the end is
  right with any cone, since no friction changes the angular momentum about a point of the ground:
  a skid ends at exactly 5/7 of the start's velocity.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import mujoco
import numpy as np

from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.contact.scene import (
    ContactScene,
    Float64,
    add_ball,
    game_contact,
    new_spec,
    resting_depth,
    soft_contact,
)
from roller_env.lab.contact.trial import Held, MujocoTrial, at_most, steps_of
from roller_env.lab.game import FRICTION, GRAVITY_M_S2, MASS_KG, RADIUS_M
from roller_env.lab.methods import MUJOCO, PYRAMIDAL, MujocoMethod
from roller_env.lab.scene import Measure
from roller_env.lab.simulate import Path

REFERENCE: Final = MujocoMethod("RK4")
"""With a small step: what the same soft model does as the step vanishes."""

TIMED_STEPS: Final = 2000
"""Steps that are timed of a motion whose steps all cost the same."""

ROLLS_BELOW: Final = 0.02
"""Share of the first slip below which a ball counts as rolling, extrapolated to none.

The game's soft friction takes all that the cone allows only while it wants more, which is the rate
B = 216/s of the slip: above 7/2 mu g / B, 1.6 % of 3 m/s. Below, the slip dies out exponentially;
at 1 % the ball would seem to roll 0.15 % too late with every method and step."""


@dataclass(frozen=True)
class SteadyRoll(ContactScene):
    """A ball that a steady force sets rolling from rest.

    Attributes:
        slope_deg: of the ground, falling towards +x.
        force_n: through the ball's centre, along +x; 0 on the slope.
    """

    slope_deg: float = 0.0
    force_n: float = 0.0

    @property
    def acceleration_m_s2(self) -> float:
        """Of a rigid ball: five sevenths of what it would be without friction."""
        pull = GRAVITY_M_S2 * math.sin(math.radians(self.slope_deg))
        return 5.0 / 7.0 * (pull + self.force_n / MASS_KG)

    @property
    def way_m(self) -> float:
        """How far a rigid ball gets."""
        return 0.5 * self.acceleration_m_s2 * self.horizon_s**2

    def _trial(self, method: MujocoMethod, dt_s: float) -> MujocoTrial:
        spec = new_spec(method, dt_s, GRAVITY_M_S2)
        angle = math.radians(self.slope_deg)
        normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
        along = np.array([math.cos(angle), 0.0, -math.sin(angle)])
        contact = soft_contact()
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0.0, 0.0, 1.0],
            quat=[math.cos(angle / 2.0), 0.0, math.sin(angle / 2.0), 0.0],
            **contact,
        )
        depth = resting_depth(contact["solref"], GRAVITY_M_S2 * math.cos(angle))
        add_ball(spec, ((RADIUS_M - depth) * normal).tolist())

        def push(data: mujoco.MjData) -> None:
            data.xfrc_applied[1, 0] = self.force_n

        def judge(path: Path) -> Mapping[str, float]:
            moved = path.qpos[-1, :3] - path.qpos[0, :3]
            converged = np.array(_converged_move(self))
            return {
                "position": float(np.linalg.norm(moved - converged) / np.linalg.norm(converged)),
                "acceleration": abs(float(moved @ along) / self.way_m - 1.0),
            }

        total = steps_of(self.horizon_s, dt_s)
        plan = [Held(np.empty(0), steps) for steps in at_most(TIMED_STEPS, total)]
        return MujocoTrial(spec.compile(), push, plan, judge, self._names, slice(0, 1))


@cache
def _converged_move(scene: SteadyRoll) -> tuple[float, ...]:
    """Return where the soft model's ball gets to as the step vanishes, (3,) metres.

    With a step that no scene uses, so that no error is 0 for having been compared with itself.
    """
    path = scene.trial(REFERENCE, scene.horizon_s / 7000.0).path
    return tuple((path.qpos[-1, :3] - path.qpos[0, :3]).tolist())


@dataclass(frozen=True)
class Skid(ContactScene):
    """A ball that is thrown along the ground without spin, skids, and begins to roll.

    The ground is the game's own at its default preset: in the soft contact of the other two, the
    skid would last 6 % too long.

    Attributes:
        heading_deg: direction of the throw, from +x towards +y. MuJoCo aligns the pyramidal
            cone's edges with the world's axes on level ground.
        speed_m_s: of the throw.
    """

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

    def way_m(self, time_s: float) -> float:
        """Return how far a rigid ball has got after ``time_s``."""
        skidding = min(time_s, self.rolls_after_s)
        way = self.speed_m_s * skidding - 0.5 * FRICTION * GRAVITY_M_S2 * skidding**2
        return way + 5.0 / 7.0 * self.speed_m_s * (time_s - skidding)

    def _trial(self, method: MujocoMethod, dt_s: float) -> MujocoTrial:
        spec = new_spec(method, dt_s, GRAVITY_M_S2)
        contact = game_contact()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 1.0], **contact)
        add_ball(spec, (0.0, 0.0, RADIUS_M - resting_depth(contact["solref"], GRAVITY_M_S2)))

        def throw(data: mujoco.MjData) -> None:
            data.qvel[:2] = self.speed_m_s * self.direction

        def judge(path: Path) -> Mapping[str, float]:
            place = path.qpos[-1, :2]
            heading = np.arctan2(*path.qvel[:, 1::-1].T) - math.radians(self.heading_deg)
            converged = np.array(_converged_place(self, method.cone))
            rigid = self.way_m(self.horizon_s) * self.direction
            return {
                "position": float(np.linalg.norm(place - converged)),
                "roll_time": abs(roll_time(path) / self.rolls_after_s - 1.0),
                "heading": math.degrees(float(np.abs(heading).max())),
                "place": float(np.linalg.norm(place - rigid)),
            }

        total = steps_of(self.horizon_s, dt_s)
        plan = [Held(np.empty(0), total)]
        return MujocoTrial(spec.compile(), throw, plan, judge, self._names)


def roll_time(path: Path) -> float:
    """Return when a thrown ball begins to roll, seconds; infinite where it never does.

    Friction takes the slip away evenly, so the moment at which `ROLLS_BELOW` of it is left,
    interpolated between two steps, tells when none would be.
    """
    slip = slip_speed(path)
    slow = slip <= ROLLS_BELOW * slip[0]
    if not slow.any():
        return math.inf
    after = int(slow.argmax())
    share = (slip[after - 1] - ROLLS_BELOW * slip[0]) / (slip[after - 1] - slip[after])
    time = path.time[after - 1] + share * (path.time[after] - path.time[after - 1])
    return float(time / (1.0 - ROLLS_BELOW))


def slip_speed(path: Path) -> Float64:
    """Return the speed of the ball's lowest point over the ground, (S + 1,) m/s."""
    spin = np.array(
        [_to_world(q, w) for q, w in zip(path.qpos[:, 3:7], path.qvel[:, 3:6], strict=True)]
    )
    contact = np.array([0.0, 0.0, -RADIUS_M])
    speed: Float64 = np.linalg.norm((path.qvel[:, :3] + np.cross(spin, contact))[:, :2], axis=1)
    return speed


def _to_world(quaternion: Float64, vector: Float64) -> Float64:
    """Return a vector of the body's frame, in which MuJoCo's free joint spins, in the world's."""
    rotated = np.empty(3)
    mujoco.mju_rotVecQuat(rotated, vector, quaternion)
    return rotated


@cache
def _converged_place(scene: Skid, cone: str) -> tuple[float, float]:
    """Return where the soft model's ball ends as the step vanishes, metres."""
    method = MujocoMethod("RK4", "pyramidal" if cone == "pyramidal" else "elliptic")
    path = scene.trial(method, scene.horizon_s / 28_000.0).path
    return float(path.qpos[-1, 0]), float(path.qpos[-1, 1])


_STEADY_MEASURES: Final = (
    Measure("position", "position error against the way after 2 s", "discretisation"),
    Measure("acceleration", "position error against (5/7) a t²/2 after 2 s", "model"),
)
_SKID_MEASURES: Final = (
    Measure("position", "position error after 0.5 s, m", "discretisation"),
    Measure("roll_time", "error of the time to roll against 2 v/(7 µ g)", "model"),
    Measure("heading", "largest error of the heading, degrees", "model"),
    Measure("place", "position error against the rigid ball after 0.5 s, m", "model"),
)
_SOFT_STEPS_S: Final = (0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4)
_GAME_STEPS_S: Final = (0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4, 1e-4)


def _skid(heading_deg: float) -> Skid:
    return Skid(
        name=f"skid-{heading_deg:g}",
        title=f"A skidding ball begins to roll, thrown at {heading_deg:g}°",
        horizon_s=0.5,
        measures=_SKID_MEASURES,
        methods=(*MUJOCO, *PYRAMIDAL),
        time_steps_s=_GAME_STEPS_S,
        failure=0.05,
        heading_deg=heading_deg,
    )


INCLINE: Final = SteadyRoll(
    name="incline",
    title="A ball rolls down a slope of 20°",
    horizon_s=2.0,
    measures=_STEADY_MEASURES,
    methods=MUJOCO,
    time_steps_s=_SOFT_STEPS_S,
    failure=0.05,
    slope_deg=20.0,
)
PUSH: Final = SteadyRoll(
    name="push",
    title="A key pushes a ball over level ground",
    horizon_s=2.0,
    measures=_STEADY_MEASURES,
    methods=MUJOCO,
    time_steps_s=_SOFT_STEPS_S,
    failure=0.05,
    force_n=KEY_FORCE_N,
)
SKIDS: Final = tuple(_skid(heading_deg) for heading_deg in (0.0, 22.5, 45.0))

ROLLING: Final[Sequence[ContactScene]] = (INCLINE, PUSH, *SKIDS)
