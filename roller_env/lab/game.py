"""The product's own levels and presets, for experiments with the ball and without the rules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np

from roller_env.arrays import Float64
from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.config import EnvConfig
from roller_env.game.actions import forces, held_keys
from roller_env.lab.simulate import record, started
from roller_env.level import Level, load_level
from roller_env.simulation import Simulation
from roller_env.units import quants

LOST: Final = 1e6
"""No number of a ball in the game is so large, m, m/s or rad/s."""

# The original's ball, gravity and friction: its docs are in `roller_env.level.schema`.
RADIUS_M: Final = quants(16.0)
MASS_KG: Final = 1.0
GRAVITY_M_S2: Final = quants(386.0)
FRICTION: Final = 0.3

DECK_M: Final = quants(16.0)
"""Thickness of the original's decks."""
THROUGH_M: Final = RADIUS_M + DECK_M / 2
"""A ball this deep in a deck has its centre past the middle and is pushed out below."""

GATE_SPEED_M_S: Final = quants(32.0)
PLATE_SPEED_M_S: Final = quants(1.6)
LIFT_N: Final = quants(500.0)
LIFT_S: Final = 5.0
"""Of the original's gates, plates and lift pads; how long a pad lifts."""

TUBE_FALL_M: Final = 46.9
"""The highest that a pad and a tube of the classic level throw the ball over a deck."""

GROUND: Final[Mapping[str, Any]] = {"at": (0.0, 0.0, -2.0), "size": (400.0, 400.0, 4.0)}
"""A wide thick floor with its upper face at z = 0."""


def make_level(**pieces: Any) -> Level:
    """Return a checked level of ``pieces``, on wide ground unless they say otherwise."""
    plain: dict[str, Any] = {
        "name": "experiment",
        "start": {"at": (-150.0, -150.0, RADIUS_M)},
        "finish": {"at": (190.0, 190.0, 0.5), "size": (1.0, 1.0, 1.0)},
        "boxes": [dict(GROUND)],
    }
    return load_level(Level.model_validate(plain | pieces))


@dataclass(frozen=True)
class Course:
    """A compiled level and where its ball begins."""

    compiled: CompiledLevel
    at: Sequence[float]  # the ball's centre, m
    velocity: Sequence[float] = (0.0, 0.0, 0.0)  # m/s
    spin: Sequence[float] = (0.0, 0.0, 0.0)  # rad/s, world frame
    force_n: Sequence[float] = (0.0, 0.0, 0.0)  # held on the ball
    movers_m_s: float = 0.0  # of every plate and gate, up positive

    def prepare(self, data: mujoco.MjData) -> None:
        """Put ``data`` to the beginning."""
        mujoco.mj_resetData(self.compiled.model, data)
        qpos, qvel = self.compiled.ball_qpos, self.compiled.ball_qvel
        data.qpos[qpos : qpos + 3] = self.at
        data.qvel[qvel : qvel + 3] = self.velocity
        data.qvel[qvel + 3 : qvel + 6] = self.spin
        data.ctrl[self.compiled.force_ctrl] = self.force_n
        data.ctrl[self.compiled.plate_ctrl] = self.movers_m_s
        data.ctrl[self.compiled.gate_ctrl] = self.movers_m_s

    @property
    def ball(self) -> slice:
        """The ball's position in ``qpos``."""
        return slice(self.compiled.ball_qpos, self.compiled.ball_qpos + 3)


@dataclass(frozen=True)
class Run:
    """What the ball did."""

    time_s: Float64  # (n,)
    position: Float64  # (n, 3) m
    velocity: Float64  # (n, 3) m/s
    energy: Float64  # (n,) J a kg: of motion, spin and height, less the held force's work
    depth: Float64  # (n,) of the deepest contact, m; 0 in the air
    finite: bool

    @property
    def speed(self) -> Float64:
        """(n,) m/s."""
        return np.asarray(np.linalg.norm(self.velocity, axis=1))


def play(course: Course, seconds: float) -> Run:
    """Simulate, and look at every step."""
    compiled = course.compiled
    model, level = compiled.model, compiled.level
    data = started(model, course.prepare)
    steps = round(seconds / compiled.preset.dt_s)
    depth = np.zeros(steps + 1)
    first = compiled.ball_qvel

    def look(step: int) -> None:
        # Contacts of this very position; the step after it finds them again by itself.
        mujoco.mj_fwdPosition(model, data)
        depth[step] = -min(0.0, data.contact.dist.min()) if data.ncon else 0.0

    def sane() -> bool:
        ball = (*data.qpos[course.ball], *data.qvel[first : first + 6])
        return bool(np.abs(ball).max() < LOST)

    path = record(model, data, steps, before=look, goes_on=sane)
    motion = np.full((steps + 1, 9), np.nan)
    motion[: len(path.time), :3] = path.qpos[:, course.ball]
    motion[: len(path.time), 3:] = path.qvel[:, first : first + 6]
    # A sphere's energy of spin for each kg is (R w)² / 5.
    rim = level.ball.radius * motion[:, 6:]
    energy = 0.5 * (motion[:, 3:6] ** 2).sum(1) + 0.2 * (rim**2).sum(1)
    work = motion[:, :3] @ np.asarray(course.force_n, dtype=np.float64)
    return Run(
        time_s=np.arange(steps + 1, dtype=np.float64) * compiled.preset.dt_s,
        position=motion[:, :3],
        velocity=motion[:, 3:6],
        energy=energy + level.gravity * motion[:, 2] - work / level.ball.mass_kg,
        depth=depth,
        finite=bool(np.abs(motion).max() < LOST),
    )


def played(
    config: EnvConfig, keys: Sequence[tuple[str, float]], seed: int
) -> tuple[Float64, Float64]:
    """Play keys of ``wasd``, each for some seconds, through the product's own simulation.

    Returns:
        Where the ball began, (3,) m, and what the actuators did in each control step, (steps, nu),
        so that it can be repeated open loop: events that are quantised to control steps then fall
        alike with every method.
    """
    simulation = Simulation(config)
    simulation.seed([np.random.default_rng(seed)])
    simulation.reset()
    model = compile_level(simulation.level, simulation.preset).model
    data = mujoco.MjData(model)
    start, ctrl = simulation.ball_position[0].copy(), []
    for held, seconds in keys:
        force = forces("keys", held_keys(held)[None])
        for _ in range(round(seconds / config.control_dt_s)):
            simulation.step(force)
            state: Float64 = simulation.snapshot().physics[0]
            mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
            ctrl.append(data.ctrl.copy())
    return start, np.array(ctrl)
