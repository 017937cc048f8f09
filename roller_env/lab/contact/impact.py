"""A ball that falls on the ground and comes back: the soft contact's own answer, and elasticity."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any, Final

import mujoco
import numpy as np
from scipy.integrate import solve_ivp

from roller_env.lab.contact import scene
from roller_env.lab.game import GRAVITY_M_S2, MASS_KG, RADIUS_M
from roller_env.lab.methods import MujocoMethod
from roller_env.lab.simulate import Float64, Path
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
        scene.add_ball(
            spec, at, RADIUS_M, MASS_KG, scene.UPWARDS, contype=1, conaffinity=0, **contact
        )
    return spec


@dataclass(frozen=True)
class Bounce(scene.ContactScene):
    """A ball dropped on a spring-damper that stays the same at every step.

    *Discretisation* is the distance from the contact's own law, integrated from event to event
    (`soft_bounce`): the step that touching falls into is wrong to first order with every method,
    RK4 included, since none looks for the event. So one run has the luck of where in a step the
    ball touches. *Model* is the distance from a rigid ball that loses 1 - e of its speed at once.

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
        """Minus stiffness in 1/s² and minus damping in 1/s."""
        ratio = damping_ratio(self.elasticity)
        return -(self.frequency_rad_s**2), -2.0 * ratio * self.frequency_rad_s

    def _trial(self, method: MujocoMethod, dt_s: float) -> scene.MujocoTrial:
        def lift(data: mujoco.MjData) -> None:
            data.qpos[0] = self.height_m

        def judge(path: Path) -> Mapping[str, float]:
            soft = soft_bounce(self.height_m, self.solref, self.horizon_s)
            rigid = rigid_bounce(self.height_m, self.elasticity, self.horizon_s)
            errors = np.abs(path.qpos[-1, 0] - np.array((soft, rigid))) / self.height_m
            return dict(zip(("position", "rigid"), errors.tolist(), strict=True))

        spec = falling_balls(method, dt_s, [scene.contact_of(0.0, self.solref)])
        return scene.MujocoTrial(self, spec, judge, lift)


def _event(
    crossing: Callable[[float, Float64], float], direction: float
) -> Callable[[float, Float64], float]:
    """Return what ends an integration of SciPy's where it crosses 0 upwards or downwards."""
    crossing.terminal, crossing.direction = True, direction  # type: ignore[attr-defined]
    return crossing


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

    def push(_t: float, y: Float64) -> float:
        return float(-stiffness * y[0] - damping * y[1] + IMPEDANCE * GRAVITY_M_S2)

    def fall(_t: float, y: Float64) -> list[float]:
        return [y[1], -GRAVITY_M_S2]

    def press(t: float, y: Float64) -> list[float]:
        return [y[1], push(t, y) - GRAVITY_M_S2]

    touch = _event(lambda _t, y: float(y[0]), -1.0)
    let_go = [_event(push, -1.0), _event(lambda _t, y: float(y[0]), 1.0)]
    now, state, falling = 0.0, np.array([height_m, 0.0]), True
    while now < time_s:
        if not falling and abs(state[1]) < GRAVITY_M_S2 / damping:
            raise ValueError(f"time_s: found {time_s:g}; the ball is at rest after {now:g} s")
        law, events = (fall, [touch]) if falling else (press, let_go)
        part = solve_ivp(law, (now, time_s), state, "DOP853", rtol=1e-13, atol=1e-15, events=events)
        now, state, falling = float(part.t[-1]), part.y[:, -1], not falling
    return float(state[0])


def rigid_bounce(height_m: float, elasticity: float, time_s: float) -> float:
    """Return the height, metres, of a dropped rigid ball that bounces in no time."""
    speed = math.sqrt(2.0 * GRAVITY_M_S2 * height_m)
    # As if it had been thrown up from the ground.
    left = time_s + speed / GRAVITY_M_S2
    while left >= (flight := 2.0 * speed / GRAVITY_M_S2):
        left, speed = left - flight, speed * elasticity
    return speed * left - 0.5 * GRAVITY_M_S2 * left**2


ELASTICITIES: Final = (0.0, 0.2, 0.5, 0.8, 0.95)
SPEEDS_M_S: Final = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
FAST_M_S: Final = 2.0
"""Impacts from here on are what a player takes for bounces: e = 0.8 throws the ball 0.13 m high."""

ARRIVALS: Final = (0.2, 0.5, 0.8)
"""Fractions of a step after which a ball touches the ground, on which its bounce must not depend"""


class Restitution(scene.ContactScene):
    """Balls of every elasticity strike the ground at every speed, under gravity.

    The one scene whose contacts do follow the time step, as they do in the product
    (`roller_env.physics.materials`): how far can a level's elasticity be believed? Under gravity a
    slow ball falls on by g h in the step that turns it round, so expect the worst at 0.2 m/s and
    large steps. MuJoCo's ``discrete`` takes the contact's damper implicitly, which the product's
    one-step contact does not reckon with (1 - B h becomes 1 / (1 + B h) > 0): it never bounces.
    """

    def _trial(self, method: MujocoMethod, dt_s: float) -> scene.MujocoTrial:
        elasticity, speed, arrival = np.array([*product(ELASTICITIES, SPEEDS_M_S, ARRIVALS)]).T
        height = speed * dt_s * arrival

        def throw(data: mujoco.MjData) -> None:
            data.qpos[:] = height
            # The speed at the ground is the nominal one.
            data.qvel[:] = -np.sqrt(np.maximum(speed**2 - 2.0 * GRAVITY_M_S2 * height, 0.0))

        def judge(path: Path) -> Mapping[str, float]:
            error = np.abs(returned_speed(path) / speed - elasticity)
            chosen = {"worst": speed > 0.0, "fast": speed >= FAST_M_S} | {
                f"e={one:g}": elasticity == one for one in ELASTICITIES
            }
            return {name: float(error[those].max()) for name, those in chosen.items()}

        contacts = [calibrated(one, method, dt_s) for one in elasticity]
        return scene.MujocoTrial(self, falling_balls(method, dt_s, contacts), judge, throw)


def calibrated(elasticity: float, method: MujocoMethod, dt_s: float) -> dict[str, Any]:
    """Return the product's contact without friction, calibrated for a method and its step."""
    # The product has no discrete preset; every integrator but RK4 is calibrated alike.
    integrator = "implicitfast" if method.integrator == "discrete" else method.integrator
    return scene.game_contact(0.0, float(elasticity), PhysicsPreset("calibrated", dt_s, integrator))


def returned_speed(path: Path) -> Float64:
    """Return the speeds, (balls,) m/s, at which balls leave the ground after their first impact.

    From the first sample in which a ball is off the ground again and rising, less what gravity has
    taken since it left: sqrt(v² + 2 g z). 0 for a ball that stays.
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
