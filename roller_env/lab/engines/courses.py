"""Balls under random keys on a level, by the rigid engine and by MuJoCo: how far apart they end.

Distances are given over the way that a ball has gone. Half of the balls begin at rest near the
start, half of them roll already, so that they meet walls, kerbs and edges within a second.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.compile.compiled import compile_level
from roller_env.compile.rigid import rigid_level
from roller_env.lab.engines.balls import STEP_S, Balls
from roller_env.level import Level, load_level
from roller_env.physics.presets import DEFAULT, PhysicsPreset
from roller_env.physics.rigid.law import COULOMB, RELAXED, ContactLaw
from roller_env.physics.stepper import Stepper

KEY_N: Final = 5.08
"""A key's force."""

_STEPS_A_KEY: Final = 10
_FASTEST_M_S: Final = 6.0
_SPREAD_M: Final = 0.6

FINE_S: Final = 1 / 15360
"""MuJoCo's step for references."""

REFERENCE: Final = PhysicsPreset(
    "RK4, 1/15360 s", dt_s=FINE_S, integrator="RK4", iterations=50, tolerance=1e-12
)
REFERENCES: Final = (
    REFERENCE,
    PhysicsPreset("implicitfast, 1/15360 s", dt_s=FINE_S, iterations=50, tolerance=1e-12),
)

RK4_RESTITUTION: Final = 0.015
"""What MuJoCo's RK4 makes of an elasticity of 0: it follows the damper through the contact, where
the Euler family takes one step (`roller_env.physics.materials`, ``PLASTIC_RESTITUTION``)."""

LAWS: Final[Mapping[str, ContactLaw]] = {
    "Coulomb's friction, plastic": COULOMB,
    "relaxed friction, plastic": ContactLaw(dilatancy=1.0),
    "relaxed friction, restitution of default (the preset)": RELAXED,
    "relaxed friction, restitution of RK4": ContactLaw(1.0, RK4_RESTITUTION, 1.0),
}
"""From Coulomb's law to MuJoCo's, one cause at a time."""


@dataclass(frozen=True, slots=True)
class Wandering:
    """How N balls begin, and which keys are held.

    Attributes:
        position: (N, 3) metres.
        velocity: (N, 3) m/s; they roll.
        force: (steps, N, 2) newtons.
    """

    position: Float64
    velocity: Float64
    force: Float64

    def spin(self, radius: float) -> Float64:
        """Return (N, 3) angular velocities with which they roll on level ground, rad/s."""
        x, y, _ = self.velocity.T
        return np.stack([-y, x, 0.0 * x], axis=1) / radius


def wandering(level: Level, count: int, steps: int, seed: int = 7) -> Wandering:
    """Return how ``count`` balls begin and are pushed for ``steps`` control steps."""
    random = np.random.default_rng(seed)
    changes = -(-steps // _STEPS_A_KEY)
    keys = KEY_N * random.choice([-1.0, 0.0, 1.0], (changes, count, 2))
    aside = random.uniform(-_SPREAD_M, _SPREAD_M, (count, 2))
    velocity = np.zeros((count, 3))
    still = count // 2
    velocity[still:, :2] = random.uniform(-_FASTEST_M_S, _FASTEST_M_S, (count - still, 2))
    return Wandering(
        position=np.asarray(level.start.at) + np.pad(aside, ((0, 0), (0, 1))),
        velocity=velocity,
        force=np.repeat(keys, _STEPS_A_KEY, axis=0)[:steps],
    )


def rolled(level: Level, how: Wandering, law: ContactLaw, cap_s: float = 1 / 120) -> Float64:
    """Return (steps + 1, N, 3) where the balls of the rigid engine are after each step, metres."""
    balls = Balls(rigid_level(level, law), len(how.position), cap_s)
    states = balls.states
    states.position[:], states.velocity[:] = how.position, how.velocity
    states.spin[:] = how.spin(level.ball.radius)
    places = [how.position.copy()]
    for force in how.force:
        states.force[:, :2] = force
        balls.step()
        places.append(states.position.copy())
    return np.array(places)


def simulated(level: Level, how: Wandering, preset: PhysicsPreset) -> Float64:
    """Return (steps + 1, N, 3) where MuJoCo's balls are after each step, metres."""
    compiled = compile_level(level, preset)
    stepper = Stepper(compiled.model, len(how.position), round(STEP_S / preset.dt_s), 1)
    first, moving = compiled.ball_qpos, compiled.ball_qvel
    stepper.qpos[:, first : first + 3] = how.position
    stepper.qvel[:, moving : moving + 3] = how.velocity
    stepper.qvel[:, moving + 3 : moving + 6] = how.spin(level.ball.radius)
    places = [how.position.copy()]
    for force in how.force:
        stepper.ctrl[:, compiled.force_ctrl[:2]] = force
        stepper.advance()
        places.append(stepper.qpos[:, first : first + 3].copy())
    return np.array(places)


def apart(places: Float64, others: Float64) -> Float64:
    """Return (N,) the distance of two ways' ends over the length of the second."""
    way = np.linalg.norm(np.diff(others, axis=0), axis=2).sum(axis=0)
    # Who stands still has gone no way; what it is off by then is so many metres.
    distance: Float64 = np.linalg.norm(places[-1] - others[-1], axis=1) / np.maximum(way, 1e-3)
    return distance


@dataclass(frozen=True, slots=True)
class Row:
    """How far apart two ways to compute the same balls end, over the way."""

    level: str
    one: str
    other: str
    seconds: float
    median: float
    mean: float
    worst: float


def _row(level: str, one: str, other: str, places: Float64, others: Float64) -> Row:
    off = apart(places, others)
    seconds = STEP_S * (len(places) - 1)
    return Row(
        level, one, other, seconds, float(np.median(off)), float(off.mean()), float(off.max())
    )


def law_rows(
    levels: Sequence[str],
    count: int = 96,
    steps: int = 20,
    references: Sequence[PhysicsPreset] = REFERENCES,
) -> list[Row]:
    """Compare the laws, one cause after the other, with MuJoCo at a fine step and with `default`.

    Args:
        levels: names of shipped levels.
        count: balls on each.
        steps: control steps.
        references: what MuJoCo is asked for besides its ``default``.
    """
    rows = []
    for name in levels:
        level = load_level(name)
        how = wandering(level, count, steps)
        ours = {law: rolled(level, how, LAWS[law]) for law in LAWS}
        for preset in (*references, DEFAULT):
            theirs = simulated(level, how, preset)
            rows += [_row(name, law, preset.name, theirs, places) for law, places in ours.items()]
    return rows


def cap_rows(
    levels: Sequence[str], count: int = 256, steps: int = 60, law: ContactLaw = COULOMB
) -> list[Row]:
    """Compare the engine at the preset's cap, 1/120 s, with itself at 1/960 s."""
    rows = []
    for name in levels:
        level = load_level(name)
        how = wandering(level, count, steps)
        coarse, fine = (rolled(level, how, law, cap_s) for cap_s in (1 / 120, 1 / 960))
        rows.append(_row(name, "cap 1/120 s", "cap 1/960 s", coarse, fine))
    return rows
