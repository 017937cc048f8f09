"""The game itself as a scene: its own levels, servos and contacts, under keys held open loop.

The product scales its contacts with the time step; a curve of errors over steps needs one model.
So the levels are compiled once with the default preset's contacts, and only the integrator and the
step vary. Contact damping times h reaches 2 at h = 9.3 ms, and the movers' servos (200 rad/s) take
Euler to 4.1 ms, RK4 to 13.9 ms and implicitfast to 24 ms. After a few impacts the ball's path is a
matter of chance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import mujoco
import numpy as np

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.compile.mjcf import build_spec
from roller_env.config import make_config
from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.contact import scene
from roller_env.lab.game import played
from roller_env.lab.methods import MujocoMethod
from roller_env.lab.simulate import Path
from roller_env.level import load_level
from roller_env.physics.presets import MUJOCO_PRESETS

CONTROL_DT_S: Final = 0.05
"""Between changes of the keys: the environments' default."""


@cache
def _compiled(level: str) -> CompiledLevel:
    return compile_level(load_level(level), "default")


@dataclass(frozen=True)
class GameScene(scene.BallScene):
    """A shipped ``level`` that is played open loop."""

    level: str = "classic"

    def _world(self, method: MujocoMethod, dt_s: float) -> mujoco.MjSpec:
        spec = build_spec(_compiled(self.level).level, MUJOCO_PRESETS["default"])
        method.configure(spec, dt_s)
        for name, value in scene.CONVERGED.items():
            setattr(spec.option, name, value)
        return spec

    def judge(self, path: Path, method: MujocoMethod) -> Mapping[str, float]:
        """Return how far the ball is from the converged one, m, at each moment."""
        distances = np.linalg.norm(self.away(path), axis=1).tolist()
        return dict(zip((one.name for one in self.measures), distances, strict=True))


class GatePush(GameScene):
    """A key presses the ball against the gate while the servo, of 100 times its mass, lowers it."""

    @property
    def plan(self) -> scene.Plan:
        """A push, half a second before the gate begins to move."""
        compiled = _compiled(self.level)
        pressing, lowering = np.zeros((2, compiled.model.nu))
        pressing[compiled.force_ctrl[0]] = lowering[compiled.force_ctrl[0]] = KEY_FORCE_N
        lowering[compiled.gate_ctrl[0]] = -compiled.level.gates[0].speed
        return (0.5, pressing.tolist()), (self.horizon_s - 0.5, lowering.tolist())

    def _start(self, data: mujoco.MjData, dt_s: float) -> None:
        level = _compiled(self.level).level
        gate = level.gates[0]
        data.qpos[:2] = gate.at[0] - gate.size[0] / 2.0 - level.ball.radius, gate.at[1]


@dataclass(frozen=True)
class Course(GameScene):
    """The classic level under keys of ``wasd``, each held for some seconds.

    They are played once through the product's own simulation, rules and all, at its ``accurate``
    preset. What its actuators did is then repeated open loop, so that events which are quantised to
    control steps fall alike with every method.
    """

    keys: tuple[tuple[str, float], ...] = (("w", 1.5), ("wa", 0.5), ("a", 0.5), ("s", 1.5))

    @property
    def plan(self) -> scene.Plan:
        """What the actuators did."""
        return played_plan(self.level, self.keys)


@cache
def played_plan(level: str, keys: tuple[tuple[str, float], ...]) -> scene.Plan:
    """Play keys through the product's simulation, and return what its actuators did."""
    settings = {"physics": "accurate", "control_dt_s": CONTROL_DT_S, "num_threads": 1}
    config = make_config(level=load_level(level), **settings)
    return tuple((CONTROL_DT_S, row) for row in played(config, keys, seed=0)[1].tolist())


GATE_PUSH: Final = GatePush(**scene.described("gate-push"), level="gate", moments_s=(3.6, 2.4, 0.4))

# After an impact RK4, too, is of first order: this reference is good to 2e-4 m (by halving its
# step), one of 4e-5 s to 1e-3 m.
COURSE: Final = Course(
    **scene.described("course"), moments_s=(3.0, 2.0, 4.0), reference_step_s=1e-5
)
