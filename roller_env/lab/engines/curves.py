"""Motions of a ball that have no closed form, by DOP853 with events, and the rigid engine beside.

Round an edge or a corner the contact's normal turns by the velocity round it over the radius. A
ball that rolls there keeps its slip ``v + r n x w`` at 0 (tangential force -2/7 of what would
change it); one that slips has Coulomb's friction; the normal force keeps ``n.v`` at 0, and where it
ends the ball flies. All for one unit of mass; forces are accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.integrate import solve_ivp

from roller_env.arrays import Float64
from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.engines.balls import STEP_S, Balls
from roller_env.lab.game import FRICTION, GRAVITY_M_S2, RADIUS_M
from roller_env.physics.rigid.scene import RigidLevel, SolidBox

DOWN: Final = np.array([0.0, 0.0, -GRAVITY_M_S2])
UP: Final = np.array([0.0, 0.0, 1.0])

RELATIVE: Final = 1e-13
ABSOLUTE: Final = 1e-14
"""Tolerances of the references."""

CAPS_S: Final = (1 / 60, 1 / 120, 1 / 240, 1 / 480)

OPEN_M: Final = 0.5e-9
"""How far the engine keeps contacts open."""


def integrated(
    rates: Callable[[float, Float64], Float64], state: Float64, duration: float
) -> Float64:
    """Return a state after ``duration`` seconds without events."""
    done = solve_ivp(rates, (0.0, duration), state, "DOP853", rtol=RELATIVE, atol=ABSOLUTE)
    end: Float64 = done.y[:, -1]
    return end


@dataclass(frozen=True, slots=True)
class _Falls:
    """An event of ``solve_ivp`` that ends it: a value falls through 0."""

    value: Callable[[float, Float64], float]
    terminal: bool = True
    direction: float = -1.0

    def __call__(self, time: float, state: Float64) -> float:
        return self.value(time, state)


class Pivot:
    """A ball on an edge or a corner: it rolls until it slips, slips until it lifts, and flies.

    Attributes:
        phases: what it went through.
    """

    def __init__(self, pivot: Float64, edge: Float64 | None, friction: float):
        """Name a point of the edge, (3,) m, and its direction, (3,); None for a corner."""
        self.pivot, self.edge, self.friction = pivot, edge, friction
        self.phases: list[str] = []
        self._begins = np.zeros(3)

    def run(self, state: Float64, duration: float, phase: str = "rolls") -> Float64:
        """Return position, velocity and angular velocity, (9,), after ``duration`` seconds."""
        time = 0.0
        ends = {
            "rolls": _Falls(lambda _, y: self._room(y)),
            "slips": _Falls(lambda _, y: self._forces(y, True)[0]),
        }
        following = {"rolls": "slips", "slips": "flies"}
        while True:
            self.phases.append(phase)
            done = solve_ivp(
                lambda _, y, phase=phase: self._rates(y, phase),
                (time, duration),
                state,
                "DOP853",
                events=[ends[phase]] if phase in ends else [],
                rtol=RELATIVE,
                atol=ABSOLUTE,
            )
            state, time = done.y[:, -1], done.t[-1]
            if done.status == 0:
                return state
            self._begins = -self._forces(state, False)[1] if phase == "rolls" else self._begins
            phase = following[phase]

    def _normal(self, y: Float64) -> tuple[Float64, Float64]:
        arm = y[:3] - self.pivot
        going = y[3:6]
        if self.edge is not None:
            arm = arm - (arm @ self.edge) * self.edge
            going = going - (going @ self.edge) * self.edge
        n = arm / np.linalg.norm(arm)
        return n, (going - (going @ n) * n) / RADIUS_M

    def _forces(self, y: Float64, slips: bool) -> tuple[float, Float64]:
        n, turning = self._normal(y)
        v, w = y[3:6], y[6:]
        push = -n @ DOWN - turning @ v
        if slips:
            u = v - (n @ v) * n + RADIUS_M * np.cross(n, w)
            size = np.linalg.norm(u)
            direction = u / size if size > 1e-11 else self._begins / np.linalg.norm(self._begins)
            return push, -self.friction * push * direction
        change = DOWN + RADIUS_M * np.cross(turning, w)
        return push, -(change - (change @ n) * n) / 3.5

    def _room(self, y: Float64) -> float:
        push, drag = self._forces(y, False)
        return float(self.friction * push - np.linalg.norm(drag))

    def _rates(self, y: Float64, phase: str) -> Float64:
        if phase == "flies":
            return np.concatenate([y[3:6], DOWN, np.zeros(3)])
        n, _ = self._normal(y)
        push, drag = self._forces(y, phase == "slips")
        torque = -2.5 / RADIUS_M * np.cross(n, drag)
        return np.concatenate([y[3:6], DOWN + push * n + drag, torque])


def slipping(
    normals: Float64, state: Float64, force: Float64, duration: float, friction: float = FRICTION
) -> Float64:
    """Return (9,) of a ball that slips on every one of some planes all the while.

    Args:
        normals: (n, 3) of the planes, to the ball.
        state: (9,) position, velocity, angular velocity.
        force: (3,) on the ball, gravity with it.
        duration: seconds.
        friction: of all planes.
    """

    def rates(_: float, y: Float64) -> Float64:
        v, w = y[3:6], y[6:]
        slips = [v - (n @ v) * n + RADIUS_M * np.cross(n, w) for n in normals]
        units = np.array(
            [n - friction * u / np.linalg.norm(u) for n, u in zip(normals, slips, strict=True)]
        )
        push = np.linalg.solve(normals @ units.T, -normals @ force)
        drags = push[:, None] * (units - normals)
        torque = -2.5 / RADIUS_M * np.cross(normals, drags).sum(axis=0)
        return np.concatenate([v, force + push @ units, torque])

    return integrated(rates, state, duration)


def rolling(normal: Float64, velocity: Float64) -> Float64:
    """Return the angular velocity, (3,) rad/s, with which a ball rolls on a plane."""
    spin: Float64 = np.cross(normal, velocity) / RADIUS_M
    return spin


@dataclass(frozen=True, slots=True)
class Curve:
    """A ball's motion, and what it comes to.

    Attributes:
        name: what tables call it.
        boxes: what the ball is on.
        start: (9,) position, velocity, angular velocity at the start.
        push: (3,) newtons on 1 kg.
        duration: seconds, a number of control steps.
        end: (9,) the same at the end, by DOP853.
    """

    name: str
    boxes: Sequence[SolidBox]
    start: Float64
    push: Float64
    duration: float
    end: Float64

    def played(self, cap_s: float) -> Float64:
        """Return (9,) the end by the rigid engine, ``cap_s`` being its longest step of RK4."""
        balls = Balls(RigidLevel(self.boxes, RADIUS_M, GRAVITY_M_S2), 1, cap_s)
        states = balls.states
        states.position[0], states.velocity[0] = self.start[:3], self.start[3:6]
        states.spin[0], states.force[0] = self.start[6:], self.push
        for _ in range(round(self.duration / STEP_S)):
            balls.step()
        return np.concatenate([states.position[0], states.velocity[0], balls.angular_velocity()[0]])

    def error(self, cap_s: float) -> float:
        """Return how far from the reference the engine ends, metres."""
        return float(np.linalg.norm(self.played(cap_s)[:3] - self.end[:3]))


def over_an_edge(
    velocity: tuple[float, float, float], friction: float, duration: float
) -> tuple[Curve, list[str]]:
    """Return a ball that rolls over the edge of a box, and what it goes through."""
    box = SolidBox((-50.0, 0.0, -50.0), (50.0, 50.0, 50.0), friction=friction)
    pivot = Pivot(np.zeros(3), np.array([0.0, 1.0, 0.0]), friction)
    v = np.array(velocity)
    start = np.concatenate([RADIUS_M * UP, v, rolling(UP, v)])
    end = pivot.run(start, duration)
    name = f"over an edge at ({velocity[0]:g}, {velocity[1]:g}), friction {friction:g}"
    started = start + np.pad(OPEN_M * UP, (0, 6))
    return Curve(name, [box], started, np.zeros(3), duration, end), pivot.phases


def tipping(corner: bool, slips: bool) -> tuple[Curve, list[str]]:
    """Return a ball that tips over an edge or a corner, rolling or slipping."""
    edge = None if corner else np.array([0.0, 1.0, 0.0])
    box = SolidBox((-50.0, -50.0 if corner else 0.0, -50.0), (50.0, 50.0, 50.0), friction=FRICTION)
    n = np.array([0.1, 0.2 if corner else 0.0, 1.0])
    n /= np.linalg.norm(n)
    v = np.array([0.3, 0.1, 0.0])
    v -= (v @ n) * n
    spin = np.array([6.0, -5.0, 2.0]) if slips else rolling(n, v) + 2.0 * n
    pivot = Pivot(np.zeros(3), edge, FRICTION)
    start = np.concatenate([RADIUS_M * n, v, spin])
    end = pivot.run(start, 0.2, "slips" if slips else "rolls")
    name = f"{'slips' if slips else 'rolls'} over {'a corner' if corner else 'an edge'}"
    started = start + np.pad(OPEN_M * n, (0, 6))
    return Curve(name, [box], started, np.zeros(3), 0.2, end), pivot.phases


def across_a_push() -> Curve:
    """Return a ball that skids across the push of a key."""
    floor = SolidBox((0.0, 0.0, -1.0), (500.0, 500.0, 1.0), friction=FRICTION)
    start = np.array([0.0, 0.0, RADIUS_M, 4.0, 1.0, 0.0, 3.0, 1.0, 2.0])
    push = np.array([0.0, KEY_FORCE_N, 0.0])
    end = slipping(UP[None], start, DOWN + push, 0.3)
    return Curve("skids across a key's push", [floor], start, push, 0.3, end)


def on_floor_and_wall() -> Curve:
    """Return a ball that slips on a floor and on a wall into which a key presses it."""
    boxes = [
        SolidBox((0.0, 0.0, -1.0), (500.0, 500.0, 1.0), friction=FRICTION),
        SolidBox((0.0, 1.0 + RADIUS_M, 0.0), (500.0, 1.0, 50.0), friction=FRICTION),
    ]
    normals = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    start = np.array([0.0, 0.0, RADIUS_M, 4.0, 0.0, 0.0, 3.0, -6.0, 10.0])
    push = np.array([0.0, KEY_FORCE_N, 0.0])
    end = slipping(normals, start, DOWN + push, 0.3)
    return Curve("slips on floor and wall", boxes, start, push, 0.3, end)


def in_a_groove(degrees: float) -> Curve:
    """Return a ball that slips along a V whose sides rise by so many degrees."""
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    sides = [
        SolidBox(
            (0.0, y * s, -c),
            (500.0, 50.0, 1.0),
            ((1, 0, 0), (0, c, -y * s), (0, y * s, c)),
            FRICTION,
        )
        for y in (1.0, -1.0)
    ]
    normals = np.array([[0.0, -s, c], [0.0, s, c]])
    start = np.array([0.0, 0.0, RADIUS_M / c, 4.0, 0.0, 0.0, 3.0, 2.0, 5.0])
    end = slipping(normals, start, DOWN, 0.3)
    return Curve(f"slips along a V of {degrees:g}°", sides, start, np.zeros(3), 0.3, end)


def catalogue() -> list[Curve]:
    """Return all motions that tables show."""
    return [
        over_an_edge((0.5, 0.0, 0.0), 0.3, 0.5)[0],
        over_an_edge((0.5, 0.0, 0.0), 2.0, 0.5)[0],
        over_an_edge((0.2, -1.5, 0.0), 0.8, 0.4)[0],
        *(tipping(corner, slips)[0] for corner in (False, True) for slips in (False, True)),
        on_floor_and_wall(),
        in_a_groove(30.0),
        across_a_push(),
    ]
