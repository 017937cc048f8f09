"""Seeded simulations, and ways to drive them through what a level has to offer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

from roller_env.config import make_config
from roller_env.game.actions import KEY_FORCE_N, forces
from roller_env.game.observations import STATE_ENTRIES, layout
from roller_env.simulation import Simulation, Snapshot

Float64 = npt.NDArray[np.float64]

_VELOCITY = layout(STATE_ENTRIES)["velocity"]


def simulation_of(level: Any, num_envs: int = 1, seed: int = 0, **options: Any) -> Simulation:
    """Return ``num_envs`` games of a level at the start of an episode; row i has seed + i."""
    simulation = Simulation(make_config(level=level, **options), num_envs)
    simulation.seed([seeding.np_random(seed + row)[0] for row in range(num_envs)])
    simulation.reset()
    return simulation


def wandering(num_envs: int, seed: int = 0) -> Iterator[Float64]:
    """Yield forces, (N, 2), that push every ball in random directions for random times.

    Long pushes, so that balls leave the start and fall; row i's pushes depend on seed + i alone.
    """
    generators = [np.random.default_rng(seed + row) for row in range(num_envs)]
    direction = np.zeros(num_envs, dtype=np.int64)
    left = np.zeros(num_envs, dtype=np.int64)
    while True:
        for row in np.flatnonzero(left == 0):
            direction[row] = generators[row].integers(9)
            left[row] = generators[row].integers(5, 30)
        left -= 1
        yield forces("directions", direction)


def along_the_route(simulation: Simulation) -> Float64:
    """Return forces, (N, 2), that steer every ball to its next waypoint.

    The simulation must have the ``shaped`` reward, which is what keeps count of the waypoints.
    """
    points = simulation.table.routes.points[0]
    away = (points[simulation.state.shaping.waypoint] - simulation.ball_position)[:, :2]
    velocity = simulation.observe()[:, _VELOCITY][:, :2]
    push: Float64 = KEY_FORCE_N * np.clip(away - velocity, -1.0, 1.0)
    return push


def plain_data(model: mujoco.MjModel, state: Float64) -> mujoco.MjData:
    """Return MuJoCo's own data in one of a snapshot's ``physics`` states."""
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    return data


def force_on_ball(simulation: Simulation) -> list[float]:
    """Return the newtons, x, y and z, with which the motors pushed the first ball."""
    force: list[float] = simulation.snapshot().bodies.force_n[0].tolist()
    return force


def bits(simulation: Simulation) -> list[bytes]:
    """Return, row by row, all that a simulation's future depends on."""
    return [bits_of_row(simulation.snapshot(), row) for row in range(simulation.num_envs)]


def bits_of_row(snapshot: Snapshot, row: int) -> bytes:
    """Return all that the future of one of a snapshot's rows depends on."""
    game = b"".join(values[row].tobytes() for values in snapshot.game.arrays())
    physics: bytes = snapshot.physics[row].tobytes()
    return physics + game + repr(snapshot.generators[row]).encode()
