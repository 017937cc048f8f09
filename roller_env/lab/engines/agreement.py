"""The rigid engine and MuJoCo on the same balls, until each first leaves the face it began on.

Until a ball touches an edge or a second solid MuJoCo's contacts, whose softness goes with the step,
approach the rigid ball's. What parts the two later are impacts with friction, in which their laws
differ (see `courses`), and edges, over which a ball tips like an upside-down pendulum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from roller_env.arrays import Bool, Float64
from roller_env.compile.rigid import rigid_level
from roller_env.lab.engines.balls import solid_gaps
from roller_env.lab.engines.courses import wandering
from roller_env.lab.engines.thrown import Thrown
from roller_env.level import load_level
from roller_env.physics.presets import RIGID, PhysicsPreset
from roller_env.physics.protocol import Path
from roller_env.physics.rigid.scene import Scenes, pack

STEP_S: Final = 1 / 60
"""How often they are compared."""

TOUCHES_M: Final = 1e-5
"""A ball this near to a solid touches it."""

_KEYS_A_STEP: Final = 3
"""A control step of `courses.wandering`, over `STEP_S`."""


@dataclass(frozen=True, slots=True)
class Row:
    """How far apart two engines are while balls touch one face.

    Attributes:
        level: a shipped level.
        balls: how many did for at least a step, and were compared.
        seconds: for which they did, in the mean.
        median_m: of the largest distance of each.
        worst_m: of all.
        worst_rad: largest angle between their attitudes.
    """

    level: str
    balls: int
    seconds: float
    median_m: float
    worst_m: float
    worst_rad: float


def _faces(scenes: Scenes, slabs: Float64, radius: float, path: Path) -> tuple[Bool, Bool]:
    """Return which solids, (N, solids), and whether any edge, (N,), the balls' paths touch."""
    touched = np.zeros((len(path.knots), len(scenes.solids.one)), dtype=np.bool_)
    edge = np.zeros(len(path.knots), dtype=np.bool_)
    for knot in range(int(path.knots.max())):
        there = (knot < path.knots)[:, None]
        gaps, rounded = solid_gaps(scenes, path.at[:, knot, :3], slabs)
        touches = (gaps - radius < TOUCHES_M) & there
        touched |= touches
        edge |= (touches & rounded).any(axis=1)
    return touched, edge


def row(name: str, reference: PhysicsPreset, count: int = 96, seconds: float = 3.0) -> Row:
    """Compare balls on a level under random keys with MuJoCo by a preset."""
    level = load_level(name)
    steps = round(seconds / STEP_S)
    how = wandering(level, count, -(-steps // _KEYS_A_STEP))
    ours, theirs = (Thrown(level, preset, count, STEP_S) for preset in (RIGID, reference))
    for balls in (ours, theirs):
        balls.put(how.position, how.velocity, how.spin(level.ball.radius))
    scenes = pack([rigid_level(level)])
    touched, edges = (
        np.zeros((count, len(scenes.solids.one)), dtype=np.bool_),
        np.zeros(count, np.bool_),
    )
    apart, angle, alone_s = np.zeros((3, count))
    for step in range(steps):
        force = how.force[step // _KEYS_A_STEP]
        for balls in (ours, theirs):
            balls.bodies.force_n[:, :2] = force
        path = ours.step()
        theirs.step()
        solids, edge = _faces(scenes, ours.bodies.displacement, level.ball.radius, path)
        touched, edges = touched | solids, edges | edge
        alone = (touched.sum(axis=1) <= 1) & ~edges
        alone_s += STEP_S * alone
        distance = np.linalg.norm(ours.bodies.position - theirs.bodies.position, axis=1)
        one, other = (
            Rotation.from_quat(balls.bodies.orientation, scalar_first=True)
            for balls in (ours, theirs)
        )
        turned = (one.inv() * other).magnitude()
        apart = np.where(alone, np.maximum(apart, distance), apart)
        angle = np.where(alone, np.maximum(angle, turned), angle)
    compared = alone_s > 0.0
    return Row(
        level=name,
        balls=int(compared.sum()),
        seconds=float(alone_s[compared].mean()),
        median_m=float(np.median(apart[compared])),
        worst_m=float(apart[compared].max()),
        worst_rad=float(angle[compared].max()),
    )


def rows(levels: Sequence[str], reference: PhysicsPreset, count: int = 96) -> list[Row]:
    """Compare on several levels."""
    return [row(name, reference, count) for name in levels]
