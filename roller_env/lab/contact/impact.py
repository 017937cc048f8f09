"""A ball that falls on the ground and comes back: the soft contact's own answer, and elasticity."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any, Final

import mujoco
import numpy as np
from scipy.optimize import brentq

from roller_env.arrays import Float64
from roller_env.lab.contact import scene
from roller_env.lab.game import GRAVITY_M_S2, MASS_KG, RADIUS_M
from roller_env.lab.methods import MujocoMethod
from roller_env.lab.simulate import Path
from roller_env.physics.materials import IMPEDANCE, damping_ratio
from roller_env.physics.presets import PhysicsPreset


def falling_balls(
    method: MujocoMethod, dt_s: float, contacts: Sequence[Mapping[str, Any]]
) -> mujoco.MjSpec:
    """Return balls over the ground that can only move up and down; ``qpos`` are their heights."""
    spec = scene.new_spec(method, dt_s, GRAVITY_M_S2, **scene.CONVERGED)
    scene.add_ground(spec, condim=1, contype=0, conaffinity=1)
    for number, contact in enumerate(contacts):
        at = (2.0 * number, 0.0, RADIUS_M)
        scene.add_ball(spec, at, RADIUS_M, MASS_KG, scene.UPWARDS, conaffinity=0, **contact)
    return spec


@dataclass(frozen=True)
class Bounce(scene.ContactScene):
    """A ball dropped from ``height_m`` on a spring-damper that stays the same at every step.

    *Discretisation* is the distance from the contact's own law (`soft_bounce`): the step that
    touching falls into is wrong to first order with every method, RK4 included, since none looks
    for the event. So one run has the luck of where in a step the ball touches. *Model* is the
    distance from a rigid ball that loses 1 - ``elasticity`` of its speed at once.
    """

    height_m: float = 1.0
    elasticity: float = 0.8
    frequency_rad_s: float = 200.0  # Of the spring, undamped; Euler's limit is h = 2 / frequency.

    @property
    def solref(self) -> tuple[float, float]:
        """Minus stiffness in 1/s² and minus damping in 1/s."""
        ratio = damping_ratio(self.elasticity)
        return -(self.frequency_rad_s**2), -2.0 * ratio * self.frequency_rad_s

    def _world(self, method: MujocoMethod, dt_s: float) -> mujoco.MjSpec:
        return falling_balls(method, dt_s, [scene.contact_of(0.0, self.solref)])

    def _start(self, data: mujoco.MjData, dt_s: float) -> None:
        data.qpos[0] = self.height_m

    def judge(self, path: Path, method: MujocoMethod) -> Mapping[str, float]:
        """Return errors of the height in parts of the drop."""
        soft = soft_bounce(self.height_m, self.solref, self.horizon_s)
        rigid = rigid_bounce(self.height_m, self.elasticity, self.horizon_s)
        errors = np.abs(path.qpos[-1, 0] - np.array((soft, rigid))) / self.height_m
        return dict(zip(("position", "rigid"), errors.tolist(), strict=True))


@cache
def soft_bounce(height_m: float, solref: tuple[float, float], time_s: float) -> float:
    """Return the height, metres, of a ball dropped on a soft contact after ``time_s``.

    MuJoCo's contact of constant impedance d gives a penetrating ball, r < 0, the acceleration
    -K r - B v - (1 - d) g as long as that takes a push (Computation chapter, "Constraint model"): a
    damped swing about where it would rest. Everywhere else it falls.

    Raises:
        ValueError: the ball comes to rest before, and no longer leaves the ground by a push's end.
    """
    stiffness, damping = -solref[0], -solref[1]
    exponent = complex(-damping / 2.0, math.sqrt(stiffness - damping**2 / 4.0))
    rest = (1.0 - IMPEDANCE) * GRAVITY_M_S2 / stiffness

    def pressed(time: float, speed: float) -> tuple[float, float]:
        start = complex(rest, (exponent.real * rest + speed) / exponent.imag)
        swing = start * cmath.exp(exponent * time)
        return swing.real - rest, (exponent * swing).real

    def push(time: float, speed: float) -> float:
        height, velocity = pressed(time, speed)
        return -stiffness * height - damping * velocity + IMPEDANCE * GRAVITY_M_S2

    left, height, velocity = time_s, height_m, 0.0
    while True:
        speed = math.sqrt(velocity**2 + 2.0 * GRAVITY_M_S2 * height)
        flight = (velocity + speed) / GRAVITY_M_S2
        if left <= flight:
            return height + velocity * left - 0.5 * GRAVITY_M_S2 * left**2
        left -= flight
        if speed < 2.0 * GRAVITY_M_S2 / damping:
            then = f"{time_s - left:g} s"
            raise ValueError(f"time_s: found {time_s:g}; the ball is at rest after {then}")
        contact = brentq(push, 0.0, math.pi / exponent.imag, (speed,), xtol=1e-15)
        if left <= contact:
            return pressed(left, speed)[0]
        left, (height, velocity) = left - contact, pressed(contact, speed)


def rigid_bounce(height_m: float, elasticity: float, time_s: float) -> float:
    """Return the height, metres, of a dropped rigid ball that bounces in no time."""
    speed = math.sqrt(2.0 * GRAVITY_M_S2 * height_m)
    # As if it had been thrown up from the ground.
    left = time_s + speed / GRAVITY_M_S2
    while left >= (flight := 2.0 * speed / GRAVITY_M_S2):
        left, speed = left - flight, speed * elasticity
    return speed * left - 0.5 * GRAVITY_M_S2 * left**2


FAST_M_S: Final = 2.0
"""Impacts from here on are what a player takes for bounces: e = 0.8 throws the ball 0.13 m high."""

ELASTICITIES: Final = (0.0, 0.2, 0.5, 0.8, 0.95)
ELASTICITY, SPEED_M_S, ARRIVAL = np.array(
    [*product(ELASTICITIES, (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0), (0.2, 0.5, 0.8))]
).T
"""Of each ball; arrivals are the fractions of a step after which it touches the ground, on which
its bounce must not depend."""


class Restitution(scene.ContactScene):
    """Balls of every elasticity strike the ground at every speed, under gravity.

    The one scene whose contacts do follow the time step, as they do in the product
    (`roller_env.physics.materials`): how far can a level's elasticity be believed? Under gravity a
    slow ball falls on by g h in the step that turns it round, so expect the worst at 0.2 m/s and
    large steps. MuJoCo's ``discrete`` takes the contact's damper implicitly, which the product's
    one-step contact does not reckon with (1 - B h becomes 1 / (1 + B h) > 0): it never bounces.
    """

    def _world(self, method: MujocoMethod, dt_s: float) -> mujoco.MjSpec:
        return falling_balls(method, dt_s, [calibrated(e, method, dt_s) for e in ELASTICITY])

    def _start(self, data: mujoco.MjData, dt_s: float) -> None:
        data.qpos[:] = height = SPEED_M_S * dt_s * ARRIVAL
        data.qvel[:] = -np.sqrt(np.maximum(SPEED_M_S**2 - 2.0 * GRAVITY_M_S2 * height, 0.0))

    def judge(self, path: Path, method: MujocoMethod) -> Mapping[str, float]:
        """Return the largest error of the coefficient of restitution: of all, of some."""
        error = np.abs(returned_speed(path) / SPEED_M_S - ELASTICITY)
        chosen = {"worst": SPEED_M_S > 0.0, "fast": SPEED_M_S >= FAST_M_S} | {
            f"e={one:g}": one == ELASTICITY for one in ELASTICITIES
        }
        return {name: float(error[those].max()) for name, those in chosen.items()}


def calibrated(elasticity: float, method: MujocoMethod, dt_s: float) -> dict[str, Any]:
    """Return the product's contact without friction, calibrated for a method and its step."""
    # The product has no discrete preset; every integrator but RK4 is calibrated alike.
    integrator = "implicitfast" if method.integrator == "discrete" else method.integrator
    return scene.game_contact(0.0, float(elasticity), PhysicsPreset("calibrated", dt_s, integrator))


def returned_speed(path: Path) -> Float64:
    """Return the speeds, (balls,) m/s, at which balls leave the ground first; 0 for one that stays.

    Of the first sample in which it is off the ground and rising, with what gravity has taken since.
    """
    height, velocity = path.qpos, path.qvel
    touched = np.logical_or.accumulate(height < 0.0, axis=0)
    back = touched & (height >= 0.0) & (velocity > 0.0)
    first = back.argmax(axis=0), np.arange(height.shape[1])
    energy = velocity[first] ** 2 + 2.0 * GRAVITY_M_S2 * height[first]
    speed: Float64 = np.where(back.any(axis=0), np.sqrt(energy), 0.0)
    return speed


BOUNCE: Final = Bounce(**scene.described("bounce"))
RESTITUTION: Final = Restitution(**scene.described("restitution"))
