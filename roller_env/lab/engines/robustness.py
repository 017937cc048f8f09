"""Where engines fail: random steps on levels and among turned boxes, and what went wrong in them.

A **forced** step had more events than are followed; an **unsolved** problem of contacts was gone on
from with velocities that gain no energy. Both should be 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from roller_env.compile.rigid import rigid_level
from roller_env.lab.engines.balls import Balls
from roller_env.lab.engines.courses import KEY_N, wandering
from roller_env.level import load_level
from roller_env.physics.rigid.law import COULOMB, ContactLaw
from roller_env.physics.rigid.scene import RigidLevel, SolidBox

_LEVEL_STEPS: Final = 200
_SLAB_PHASES: Final = (1.0, -1.0, 0.0)
_BOX_STEPS: Final = 60
_BALLS_AMONG_BOXES: Final = 8
_MOST_BOXES: Final = 125
_RADIUS_M: Final = 0.4064
_GRAVITY: Final = 9.8044


@dataclass(frozen=True, slots=True)
class Row:
    """What ``steps`` control steps of single balls came to.

    Attributes:
        scene: a level, or random boxes.
        steps: control steps of single balls.
        forced: segments that had to be ended by force.
        unsolved: problems of contacts without an answer.
        blocked: slabs that a ball held up.
        depth_m: deepest a ball was in a solid after a step that was looked at.
        gained_j: most energy such a step gained beyond the work of the keys; slabs do none.
    """

    scene: str
    steps: int
    forced: int
    unsolved: int
    blocked: int
    depth_m: float
    gained_j: float


class _Watch:
    """Takes the steps of balls and keeps the worst of what they came to.

    It looks at every ``every``-th step only: looking costs more than the step.
    """

    def __init__(self, every: int = 1) -> None:
        self._every = every
        self.taken = self.steps = self.forced = self.unsolved = self.blocked = 0
        self.depth_m = self.gained_j = -np.inf

    def step(self, balls: Balls) -> None:
        self.taken += 1
        self.steps += len(balls.states.position)
        if self.taken % self._every:
            balls.step()
            return
        place, before = balls.states.position.copy(), balls.energy()
        slabs = balls.states.slab.copy()
        balls.step()
        work = (balls.states.force * (balls.states.position - place)).sum(axis=1)
        still = (balls.states.slab == slabs).all(axis=1)
        gained = (balls.energy() - before - work)[still]
        self.gained_j = max(self.gained_j, float(gained.max(initial=-np.inf)))
        self.depth_m = max(self.depth_m, float(balls.depth().max()))

    def count(self, balls: Balls) -> None:
        self.forced += int(balls.counts.forced.sum())
        self.unsolved += int(balls.counts.unsolved.sum())
        self.blocked += int(balls.counts.blocked.sum())

    def row(self, scene: str) -> Row:
        return Row(
            scene,
            self.steps,
            self.forced,
            self.unsolved,
            self.blocked,
            self.depth_m,
            self.gained_j,
        )


def level_rows(
    levels: Sequence[str],
    steps: int,
    count: int = 1024,
    law: ContactLaw = COULOMB,
    seed: int = 0,
    every: int = 1,
) -> list[Row]:
    """Let balls wander on levels whose slabs go down and up, at least ``steps`` steps on each.

    Depth and energy are looked at in every ``every``-th step.
    """
    rows = []
    for name in levels:
        level, watch = load_level(name), _Watch(every)
        rigid = rigid_level(level, law)
        down = np.sign(rigid.slab_stop)
        for part in range(-(-steps // (count * _LEVEL_STEPS))):
            how = wandering(level, count, _LEVEL_STEPS, seed + part)
            balls = Balls(rigid, count)
            states = balls.states
            states.position[:], states.velocity[:] = how.position, how.velocity
            states.spin[:] = how.spin(rigid.radius)
            speed = np.random.default_rng(seed + part).uniform(0.0, 1.0, states.slab.shape)
            for number, force in enumerate(how.force):
                states.force[:, :2] = force
                # They go down, go up, and stand.
                states.slab_velocity[:] = down * speed * _SLAB_PHASES[number // 40 % 3]
                watch.step(balls)
            watch.count(balls)
        rows.append(watch.row(name))
    return rows


def turned_boxes(random: np.random.Generator, law: ContactLaw = COULOMB) -> RigidLevel:
    """Return up to 125 boxes, turned and overlapping at random, over a floor."""
    friction = float(random.uniform(0.0, 1.5))
    boxes = [
        SolidBox(
            tuple(random.uniform(-2.5, 2.5, 3)),
            tuple(random.uniform(0.1, 0.8, 3)),
            Rotation.random(random_state=random).as_matrix().tolist(),
            friction,
            float(random.choice([0.0, 0.5])),
        )
        for _ in range(random.integers(2, _MOST_BOXES + 1))
    ]
    floor = SolidBox((0.0, 0.0, -5.0), (9.0, 9.0, 0.5))
    return RigidLevel([*boxes, floor], _RADIUS_M, _GRAVITY, law=law)


def box_row(scenes: int, law: ContactLaw = COULOMB, seed: int = 0) -> Row:
    """Let balls fall among turned boxes and be pushed about, in so many random scenes."""
    watch = _Watch()
    for scene in range(scenes):
        random = np.random.default_rng([seed, scene])
        balls = Balls(turned_boxes(random, law), _BALLS_AMONG_BOXES)
        states = balls.states
        states.position[:] = [0.0, 0.0, 5.0]
        states.position[:, :2] += random.uniform(-2.5, 2.5, (_BALLS_AMONG_BOXES, 2))
        for step in range(_BOX_STEPS):
            if step % 3 == 0:
                keys = random.choice([-1.0, 0.0, 1.0], (_BALLS_AMONG_BOXES, 2))
                states.force[:, :2] = KEY_N * keys
            watch.step(balls)
        watch.count(balls)
    return watch.row("turned boxes")
