"""The rigid engine's curved motions against DOP853 with events, and against closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp

from roller_env.physics.rigid.scene import SolidBox
from tests.physics.rigid.world import CAP_S, FRICTION, GRAVITY, RADIUS_M, RESTING_M, World, floor

Float64 = npt.NDArray[np.float64]
DOWN = np.array([0.0, 0.0, -GRAVITY])


class Pivot:
    """A ball on an edge or a corner: it rolls until it slips, slips until it lifts, and flies.

    The contact's normal n turns by the velocity round it over the radius. Rolling, the slip
    v + r n x w stays 0 (tangential force -2/7 of what would change it); slipping, friction is
    Coulomb's; the normal force keeps n.v at 0.

    Attributes:
        phases: what it went through.
    """

    def __init__(self, pivot: Float64, edge: Float64 | None, friction: float):
        self.pivot, self.edge, self.friction = pivot, edge, friction
        self.phases: list[str] = []
        self._begins = np.zeros(3)

    def run(self, state: Float64, duration: float, phase: str = "rolls") -> Float64:
        """Return position, velocity and angular velocity, (9,), after ``duration`` seconds."""
        time = 0.0
        ends: dict[str, Callable[[float, Float64], float]] = {
            "rolls": lambda _, y: self._room(y),
            "slips": lambda _, y: self._forces(y, True)[0],
        }
        following = {"rolls": "slips", "slips": "flies"}
        while True:
            self.phases.append(phase)
            events = []
            if phase in ends:
                end = ends[phase]
                end.terminal, end.direction = True, -1.0  # type: ignore[attr-defined]
                events = [end]
            done = solve_ivp(
                lambda _, y, phase=phase: self._rates(y, phase),
                (time, duration),
                state,
                "DOP853",
                events=events,
                rtol=1e-13,
                atol=1e-14,
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


def rolling(normal: Float64, velocity: Float64) -> Float64:
    """Return the angular velocity with which a ball rolls."""
    return np.cross(normal, velocity) / RADIUS_M


def state_of(world: World) -> Float64:
    states = world.states
    return np.concatenate([states.position[0], states.velocity[0], world.angular_velocity[0]])


UP = np.array([0.0, 0.0, 1.0])
FINE_S = 1 / 960
"""A cap at which velocities are as near as places are at the usual one."""


@pytest.mark.parametrize(
    ("velocity", "friction", "duration", "phases"),
    [
        ((0.5, 0.0, 0.0), 0.3, 0.5, ["rolls", "slips", "flies"]),
        ((0.5, 0.0, 0.0), 2.0, 0.5, ["rolls", "slips", "flies"]),
        ((0.5, 0.0, 0.0), 5.0, 0.5, ["rolls", "slips", "flies"]),
        ((0.4, 0.7, 0.0), 0.3, 0.35, ["rolls"]),
        ((0.2, -1.5, 0.0), 0.8, 0.4, ["rolls"]),
    ],
)
def test_a_ball_rolls_over_an_edge_as_dop853_has_it(
    velocity: tuple[float, float, float], friction: float, duration: float, phases: list[str]
) -> None:
    box = SolidBox((-50.0, 0.0, -50.0), (50.0, 50.0, 50.0), friction=friction)
    spin = rolling(UP, np.array(velocity))
    pivot = Pivot(np.zeros(3), np.array([0.0, 1.0, 0.0]), friction)
    start = np.concatenate([RADIUS_M * UP, velocity, spin])
    wanted = pivot.run(start, duration)
    assert pivot.phases == phases
    for cap_s, exact in ((CAP_S, 3), (FINE_S, 9)):
        world = World([box], cap_s=cap_s).put((0.0, 0.0, RESTING_M), velocity, tuple(spin))
        world.run(duration)
        assert state_of(world)[:exact] == pytest.approx(wanted[:exact], abs=1e-8)


@pytest.mark.parametrize("edge", [np.array([0.0, 1.0, 0.0]), None], ids=["edge", "corner"])
@pytest.mark.parametrize("phase", ["rolls", "slips"])
def test_a_ball_tips_over_an_edge_or_a_corner_as_dop853_has_it(
    edge: Float64 | None, phase: str
) -> None:
    y = 0.0 if edge is not None else -50.0
    box = SolidBox((-50.0, y, -50.0), (50.0, 50.0, 50.0), friction=FRICTION)
    n = np.array([0.1, 0.0 if edge is not None else 0.2, 1.0])
    n /= np.linalg.norm(n)
    v = np.array([0.3, 0.1, 0.0])
    v -= (v @ n) * n
    spin = rolling(n, v) + 2.0 * n if phase == "rolls" else np.array([6.0, -5.0, 2.0])
    pivot = Pivot(np.zeros(3), edge, FRICTION)
    wanted = pivot.run(np.concatenate([RADIUS_M * n, v, spin]), 0.2, phase)
    assert pivot.phases == [phase]
    for cap_s, exact in ((CAP_S, 3), (FINE_S, 9)):
        world = World([box], cap_s=cap_s).put(tuple(RESTING_M * n), tuple(v), tuple(spin))
        world.run(0.2)
        assert state_of(world)[:exact] == pytest.approx(wanted[:exact], abs=1e-8)


@pytest.mark.parametrize("degrees", [20.0, 45.0, 60.0])
def test_a_ball_rolls_in_a_v_about_the_line_through_both_contacts(degrees: float) -> None:
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    # Both sides rise from the x axis; each lies on the inside of the V, a metre thick.
    sides = [
        SolidBox((0.0, y * s, -c), (500.0, 50.0, 1.0), ((1, 0, 0), (0, c, -y * s), (0, y * s, c)))
        for y in (1.0, -1.0)
    ]
    world = World(sides).put((0.0, 0.0, RESTING_M / c)).run(2.0, (1.0, 0.0, 0.0))
    # The line is r cos(angle) under the centre.
    way = 0.5 * 1.0 / (1.0 + 0.4 / c**2) * 2.0**2
    assert world.states.position[0] == pytest.approx([way, 0.0, RESTING_M / c], abs=1e-8)


def slip_on_floor_and_wall(state: Float64, force: Float64, duration: float) -> Float64:
    """Return (9,) of a ball that slips on a floor and a wall beyond y, by DOP853."""
    normals = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])

    def rates(_: float, y: Float64) -> Float64:
        v, w = y[3:6], y[6:]
        slips = [v - (n @ v) * n + RADIUS_M * np.cross(n, w) for n in normals]
        units = np.array(
            [n - FRICTION * u / np.linalg.norm(u) for n, u in zip(normals, slips, strict=True)]
        )
        push = np.linalg.solve(normals @ units.T, -normals @ force)
        drags = push[:, None] * (units - normals)
        torque = -2.5 / RADIUS_M * np.cross(normals, drags).sum(axis=0)
        return np.concatenate([v, force + push @ units, torque])

    done = solve_ivp(rates, (0.0, duration), state, "DOP853", rtol=1e-13, atol=1e-14)
    end: Float64 = done.y[:, -1]
    return end


def test_a_ball_slips_on_floor_and_wall_as_dop853_has_it() -> None:
    wall = SolidBox((0.0, 1.0 + RADIUS_M, 0.0), (500.0, 1.0, 50.0), friction=FRICTION)
    v, w, push = (4.0, 0.0, 0.0), (3.0, -6.0, 10.0), (0.0, 5.08, 0.0)
    start = np.array([0.0, 0.0, RADIUS_M, *v, *w])
    wanted = slip_on_floor_and_wall(start, DOWN + push, 0.3)
    for cap_s, exact in ((CAP_S, 3), (FINE_S, 9)):
        world = World([floor(), wall], cap_s=cap_s).put((0.0, 0.0, RESTING_M), v, w).run(0.3, push)
        assert state_of(world)[:exact] == pytest.approx(wanted[:exact], abs=1e-8)
