"""Tiny levels, and short ways to play them, for tests that measure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.config import EnvConfig
from roller_env.game.actions import forces, held_keys
from roller_env.game.observations import STATE_ENTRIES, split
from roller_env.level import Level, check_level
from roller_env.level.expand import expand
from roller_env.physics.presets import PhysicsPreset
from roller_env.physics.stepper import Stepper
from roller_env.simulation import Simulation, Transition
from roller_env.units import quants

Float64 = npt.NDArray[np.float64]
Vector = tuple[float, float, float]

ORIGINALS: Final = ("bridge", "classic", "flat", "gate", "lift")
"""Levels with the original game's pieces and a route: for what would take too long on all."""

VARIED: Final = ("classic", "flat", "gate", "lift", "elevators", "finale")
"""Levels among which every kind of piece is."""

BALL_RADIUS_M: Final = 0.4064
GRAVITY: Final = 9.8044
WEIGHTLESS: Final = 0.001
"""The smallest gravity a level may have: for what must be seen without gravity."""

GROUND: Final[dict[str, Any]] = {"at": (0.0, 0.0, -2.0), "size": (800.0, 800.0, 4.0)}
"""A floor with its upper face at z = 0, wide and thick enough for any experiment."""


def q(*lengths: float) -> Vector:
    """Return a point or size given in quants in metres."""
    x, y, z = lengths
    return (quants(x), quants(y), quants(z))


def resting(x: float = 0.0, y: float = 0.0) -> Vector:
    """Return where the default ball's centre is while it rests on the ground at (x, y) metres."""
    return (x, y, BALL_RADIUS_M)


def make_level(**pieces: Any) -> Level:
    """Return a checked level: a ball on wide ground with its finish far away, and ``pieces``."""
    plain: dict[str, Any] = {
        "name": "test",
        "start": {"at": resting()},
        "finish": {"at": (390.0, 390.0, 0.5), "size": (1.0, 1.0, 1.0)},
        "boxes": [GROUND],
        "time_limit_s": 1000.0,
    }
    level = Level.model_validate(plain | pieces)
    problems = check_level(level)
    assert not problems, problems
    return level


def coin(*at: float) -> dict[str, Any]:
    """Return one coin at a point in metres."""
    return {"at": at}


@dataclass
class World:
    """N copies of a level's physics without the game's rules, for experiments with the ball."""

    compiled: CompiledLevel
    stepper: Stepper

    @property
    def position(self) -> Float64:
        """(N, 3) live view, metres."""
        start = self.compiled.ball_qpos
        return self.stepper.qpos[:, start : start + 3]

    @property
    def velocity(self) -> Float64:
        """(N, 3) live view, m/s."""
        start = self.compiled.ball_qvel
        return self.stepper.qvel[:, start : start + 3]

    @property
    def spin(self) -> Float64:
        """(N, 3) live view, rad/s in the ball's frame, which is the world's until it has turned."""
        start = self.compiled.ball_qvel + 3
        return self.stepper.qvel[:, start : start + 3]

    @property
    def force(self) -> Float64:
        """(N, 3) live view, newtons (the three motors are the first actuators)."""
        first = int(self.compiled.force_ctrl[0])
        return self.stepper.ctrl[:, first : first + 3]

    @property
    def dt_s(self) -> float:
        return self.compiled.preset.dt_s

    def path(self) -> Float64:
        """Advance; return the balls' positions, (N, S + 1, 3), of which the first is the start."""
        start = self.compiled.ball_qpos
        return self.stepper.advance()[:, :, start : start + 3].copy()


def make_world(
    level: Level,
    seconds: float,
    count: int = 1,
    physics: str | PhysicsPreset = "default",
    threads: int = 2,
) -> World:
    """Return ``count`` copies of a level, of which each `World.path` lasts ``seconds``."""
    compiled = compile_level(level, physics)
    substeps = round(seconds / compiled.preset.dt_s)
    return World(compiled, Stepper(compiled.model, count, substeps, threads))


class Game:
    """One or more games of a level, played with keys."""

    def __init__(
        self, level: Level, control_dt_s: float = 1 / 20, num_envs: int = 1, **options: Any
    ):
        config = EnvConfig(level=level, control_dt_s=control_dt_s, num_threads=1, **options)
        self.simulation = Simulation(config, num_envs)
        self.simulation.reset()

    @property
    def state(self) -> Any:
        return self.simulation.state

    @property
    def position(self) -> Float64:
        """(3,) of the first game's ball, metres."""
        position: Float64 = self.simulation.ball_position[0]
        return position

    def place(self, at: Vector, velocity: Vector = (0.0, 0.0, 0.0)) -> None:
        """Put every game's ball somewhere, with a velocity and without spin."""
        snapshot = self.simulation.snapshot()
        snapshot.bodies.position[:] = at
        snapshot.bodies.velocity[:] = velocity
        snapshot.bodies.angular_velocity[:] = 0.0
        self.simulation.restore(snapshot)

    def step(self, keys: str = "") -> Transition:
        """Hold ``keys`` for one control step in every game."""
        held = np.tile(held_keys(keys), (self.simulation.num_envs, 1))
        return self.simulation.step(forces("keys", held))

    def play(self, seconds: float, keys: str = "") -> Float64:
        """Hold ``keys`` for a time; return the first ball's positions after each control step."""
        steps = round(seconds / self.simulation.duration_s)
        path = np.empty((steps, 3))
        for index in range(steps):
            self.step(keys)
            path[index] = self.position
        return path

    def slab(self, name: str) -> float:
        """Return the displacement of the first game's plate or gate ``name``, metres."""
        names = [mover.name for mover in expand(self.simulation.level).movers]
        return float(self.simulation.qpos[0, 7 + names.index(name)])

    def observed(self, name: str) -> npt.NDArray[np.float32]:
        """Return one entry of the first game's observation."""
        entry: npt.NDArray[np.float32] = split(self.simulation.observe(), STATE_ENTRIES)[name][0]
        return entry
