"""A ball that falls on the ground and comes back: the soft contact's own answer, and elasticity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any, Final

import mujoco
import numpy as np
from scipy.integrate import solve_ivp

from roller_env.lab.contact.scene import ContactScene, Float64, contact_of, game_contact, new_spec
from roller_env.lab.contact.trial import Held, MujocoTrial, steps_of
from roller_env.lab.game import GRAVITY_M_S2, MASS_KG, RADIUS_M
from roller_env.lab.methods import MUJOCO, MujocoMethod
from roller_env.lab.scene import Measure
from roller_env.lab.simulate import Path
from roller_env.physics.materials import IMPEDANCE, damping_ratio
from roller_env.physics.presets import PhysicsPreset


def add_falling_ball(spec: mujoco.MjSpec, name: str, x_m: float, **contact: Any) -> None:
    """Add a ball that can only move up and down; its joint's 0 is where it touches the ground."""
    body = spec.worldbody.add_body(name=name, pos=[x_m, 0.0, RADIUS_M])
    body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, 1.0])
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[RADIUS_M, 0.0, 0.0],
        mass=MASS_KG,
        condim=1,
        contype=1,
        conaffinity=0,
        **contact,
    )


def add_ground(spec: mujoco.MjSpec) -> None:
    """Add the ground z = 0, which leaves the contact's parameters to what falls on it."""
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 1.0],
        condim=1,
        contype=0,
        conaffinity=1,
    )


@dataclass(frozen=True)
class Bounce(ContactScene):
    """A ball dropped on a spring-damper that stays the same at every step.

    The answer to *discretisation* is not a simulation with a small step but the contact's own law,
    integrated from event to event (`soft_bounce`): the step that touching falls into is wrong to
    first order with every method, RK4 included, since none of them looks for the event. It misses
    up to half of what the damper, which sets in at once, gives in a step (RK4: a third). So one run
    says little about a method: its error has the luck of where in a step the ball touches, and
    changes with anything that moves that. The *model* error is the distance from a rigid ball that
    loses 1 - e of its speed in no time.

    Attributes:
        height_m: of the drop.
        elasticity: e.
        frequency_rad_s: of the spring, undamped; Euler's limit is h = 2 / frequency.
    """

    height_m: float = 1.0
    elasticity: float = 0.8
    frequency_rad_s: float = 200.0

    @property
    def solref(self) -> tuple[float, float]:
        """Minus stiffness in 1/s^2 and minus damping in 1/s."""
        ratio = damping_ratio(self.elasticity)
        return -(self.frequency_rad_s**2), -2.0 * ratio * self.frequency_rad_s

    def _trial(self, method: MujocoMethod, dt_s: float) -> MujocoTrial:
        spec = new_spec(method, dt_s, GRAVITY_M_S2)
        add_ground(spec)
        add_falling_ball(spec, "ball", 0.0, **contact_of(0.0, self.solref))

        def lift(data: mujoco.MjData) -> None:
            data.qpos[0] = self.height_m

        def judge(path: Path) -> Mapping[str, float]:
            height = path.qpos[-1, 0]
            soft = soft_bounce(self.height_m, self.solref, self.horizon_s)
            rigid = rigid_bounce(self.height_m, self.elasticity, self.horizon_s)
            return {
                "position": abs(height - soft) / self.height_m,
                "rigid": abs(height - rigid) / self.height_m,
            }

        plan = [Held(np.empty(0), steps_of(self.horizon_s, dt_s))]
        return MujocoTrial(spec.compile(), lift, plan, judge, self._names)


@cache
def soft_bounce(height_m: float, solref: tuple[float, float], time_s: float) -> float:
    """Return the height, metres, of a ball dropped on a soft contact after ``time_s``.

    MuJoCo's contact of constant impedance d gives a penetrating ball, r < 0, the acceleration
    -K r - B v - (1 - d) g as long as that takes a push (Computation chapter, "Constraint model");
    everywhere else it falls. Touching (r = 0) and letting go (no push left, or r = 0) are found as
    events of an integration to 13 digits.

    Raises:
        ValueError: the ball comes to rest before, which is not an event.
    """
    stiffness, damping = -solref[0], -solref[1]

    def fall(_t: float, y: Float64) -> list[float]:
        return [y[1], -GRAVITY_M_S2]

    def press(_t: float, y: Float64) -> list[float]:
        return [y[1], -stiffness * y[0] - damping * y[1] - (1.0 - IMPEDANCE) * GRAVITY_M_S2]

    def touch(_t: float, y: Float64) -> float:
        return float(y[0])

    def push(_t: float, y: Float64) -> float:
        return float(-stiffness * y[0] - damping * y[1] + IMPEDANCE * GRAVITY_M_S2)

    touch.terminal, touch.direction = True, -1.0  # type: ignore[attr-defined]
    push.terminal, push.direction = True, -1.0  # type: ignore[attr-defined]

    def leave(_t: float, y: Float64) -> float:
        return float(y[0])

    leave.terminal, leave.direction = True, 1.0  # type: ignore[attr-defined]
    now, state, falling = 0.0, np.array([height_m, 0.0]), True
    while now < time_s:
        if not falling and abs(state[1]) < GRAVITY_M_S2 / damping:
            raise ValueError(f"time_s: found {time_s:g}; the ball is at rest after {now:g} s")
        law, events = (fall, [touch]) if falling else (press, [push, leave])
        part = solve_ivp(law, (now, time_s), state, "DOP853", rtol=1e-13, atol=1e-15, events=events)
        now, state, falling = float(part.t[-1]), part.y[:, -1], not falling
    return float(state[0])


def rigid_bounce(height_m: float, elasticity: float, time_s: float) -> float:
    """Return the height, metres, of a dropped rigid ball that bounces in no time."""
    speed = math.sqrt(2.0 * GRAVITY_M_S2 * height_m)
    left = time_s - speed / GRAVITY_M_S2
    if left < 0.0:
        return height_m - 0.5 * GRAVITY_M_S2 * time_s**2
    while True:
        speed *= elasticity
        flight = 2.0 * speed / GRAVITY_M_S2
        if left < flight:
            return speed * left - 0.5 * GRAVITY_M_S2 * left**2
        left -= flight


ELASTICITIES: Final = (0.0, 0.2, 0.5, 0.8, 0.95)
SPEEDS_M_S: Final = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
FAST_M_S: Final = 2.0
"""Impacts from here on are what a player takes for bounces: e = 0.8 throws the ball 0.13 m high."""

ARRIVALS: Final = (0.2, 0.5, 0.8)
"""Shares of a step after which a ball touches the ground, of which its bounce must not depend."""


@dataclass(frozen=True)
class Restitution(ContactScene):
    """Balls of every elasticity strike the ground at every speed, under gravity.

    The one scene whose contacts do follow the time step, as they do in the product
    (`roller_env.physics.materials`): it asks how far a level's elasticity can be believed with
    each method and step. Its error is of the *model* alone. Without gravity it would not depend on
    the step at all, since the calibration scales with it; under gravity a slow ball falls on by
    g h in the step that turns it round, so expect the worst at 0.2 m/s and large steps.

    MuJoCo's ``discrete`` takes the contact's damper implicitly, which the product's one-step
    contact does not reckon with (1 - B h becomes 1 / (1 + B h) > 0): it never bounces.
    """

    def _trial(self, method: MujocoMethod, dt_s: float) -> MujocoTrial:
        spec = new_spec(method, dt_s, GRAVITY_M_S2)
        add_ground(spec)
        # The product has no discrete preset; every integrator but RK4 is calibrated alike.
        integrator = "implicitfast" if method.integrator == "discrete" else method.integrator
        preset = PhysicsPreset("restitution", dt_s, integrator)
        drops = list(product(ELASTICITIES, SPEEDS_M_S, ARRIVALS))
        elasticity, speed, arrival = np.array(drops).T
        for number, one in enumerate(elasticity):
            contact = game_contact(0.0, float(one), preset)
            add_falling_ball(spec, f"ball_{number}", 2.0 * number, **contact)
        height = speed * dt_s * arrival

        def throw(data: mujoco.MjData) -> None:
            data.qpos[:] = height
            # The speed at the ground is the nominal one.
            data.qvel[:] = -np.sqrt(np.maximum(speed**2 - 2.0 * GRAVITY_M_S2 * height, 0.0))

        def judge(path: Path) -> Mapping[str, float]:
            error = np.abs(returned_speed(path) / speed - elasticity)
            worst = {
                _restitution_name(one): float(error[elasticity == one].max())
                for one in ELASTICITIES
            }
            fast = speed >= FAST_M_S
            return {"worst": float(error.max()), "fast": float(error[fast].max())} | worst

        plan = [Held(np.empty(0), steps_of(self.horizon_s, dt_s))]
        return MujocoTrial(spec.compile(), throw, plan, judge, self._names)


def returned_speed(path: Path) -> Float64:
    """Return the speeds, (balls,) m/s, at which balls leave the ground after their first impact.

    From the first sample in which a ball is off the ground again and rising, less what gravity has
    taken since it left: sqrt(v^2 + 2 g z). 0 for a ball that stays.
    """
    height, velocity = path.qpos, path.qvel
    touched = np.logical_or.accumulate(height < 0.0, axis=0)
    back = touched & (height >= 0.0) & (velocity > 0.0)
    first = back.argmax(axis=0), np.arange(height.shape[1])
    energy = velocity[first] ** 2 + 2.0 * GRAVITY_M_S2 * height[first]
    speed: Float64 = np.where(back.any(axis=0), np.sqrt(energy), 0.0)
    return speed


def _restitution_name(elasticity: float) -> str:
    return f"e={elasticity:g}"


BOUNCE: Final = Bounce(
    name="bounce",
    title="A ball drops 1 m on a spring and bounces",
    horizon_s=2.0,
    measures=(
        Measure("position", "height error after 2 s against the drop", "discretisation"),
        Measure("rigid", "height error after 2 s against a rigid ball's", "model"),
    ),
    methods=MUJOCO,
    time_steps_s=(0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4, 1e-4),
    failure=0.5,
)
RESTITUTION: Final = Restitution(
    name="restitution",
    title="Balls of every elasticity strike the ground at 0.2 to 20 m/s",
    horizon_s=0.2,
    measures=(
        Measure("worst", "largest error of the coefficient of restitution", "model"),
        Measure("fast", "the same at 2 m/s and more", "model"),
        *(
            Measure(
                _restitution_name(one),
                f"largest error of the coefficient of restitution of elasticity {one:g}",
                "model",
            )
            for one in ELASTICITIES
        ),
    ),
    methods=MUJOCO,
    time_steps_s=(0.005, 0.002, 0.001, 5e-4, 2e-4, 1e-4),
    failure=0.5,
)

IMPACTS: Final[Sequence[ContactScene]] = (BOUNCE, RESTITUTION)
