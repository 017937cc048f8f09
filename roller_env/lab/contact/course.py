"""The game itself as a scene: its own levels, servos and contacts, under keys held open loop.

The product scales its contacts with the time step; a curve of errors over steps needs one model.
So the levels are compiled once with the default preset's contacts, the softest that a player meets
but for ``fast``, and only the integrator and the step vary. Errors are of the *discretisation*:
against RK4 with a step at least a hundred times finer than the preset's.

What to expect: contact damping times h reaches 2 at h = 9.3 ms, and the movers' servos (200 rad/s,
critically damped) take Euler to 4.1 ms, RK4 to 13.9 ms and implicitfast to 24 ms.
Before any impact the Euler family errs by h/T. Every impact falls somewhere into a step, which is
first order for every method; after a few of them the ball's path is a matter of chance, so the
horizon is short.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import mujoco
import numpy as np

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.compile.mjcf import build_spec
from roller_env.config import make_config
from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.contact.scene import ContactScene, Float64
from roller_env.lab.contact.trial import Held, MujocoTrial, steps_of
from roller_env.lab.game import played
from roller_env.lab.methods import MUJOCO, MujocoMethod
from roller_env.lab.scene import Measure
from roller_env.lab.simulate import Path
from roller_env.level import Level, load_level
from roller_env.physics.presets import PRESETS

REFERENCE: Final = MujocoMethod("RK4")

CONTROL_DT_S: Final = 0.05
"""Between changes of the keys: the environments' default."""


@dataclass(frozen=True, slots=True)
class Pressed:
    """Keys of ``wasd`` that are held for a time."""

    keys: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Controlled:
    """What MuJoCo's actuators do for a time.

    Attributes:
        ctrl: (nu,) newtons and m/s.
        seconds: how long.
    """

    ctrl: tuple[float, ...]
    seconds: float


@dataclass(frozen=True)
class GameScene(ContactScene):
    """A shipped level that is played open loop, and looked at at several moments.

    Attributes:
        level: name of the level.
        moments_s: when the ball's place is compared; the first is what the chart shows.
        reference_step_s: of the converged model; no step of the scene's own, so that nothing is
            compared with itself.
    """

    level: str = "classic"
    moments_s: tuple[float, ...] = ()
    reference_step_s: float = 4e-5

    @abstractmethod
    def _controls(self) -> Sequence[Controlled]: ...

    def _start(self, data: mujoco.MjData) -> None:
        """Put the freshly reset data where the motion begins."""

    def _trial(self, method: MujocoMethod, dt_s: float) -> MujocoTrial:
        level, _ = _compiled(self.level)
        spec = build_spec(level, PRESETS["default"])
        method.configure(spec, dt_s)
        spec.option.iterations = 100
        spec.option.tolerance = 1e-14

        def judge(path: Path) -> Mapping[str, float]:
            away = self.places(path) - np.array(_converged_places(self))
            return dict(zip(self._names, np.linalg.norm(away, axis=1).tolist(), strict=True))

        plan = [Held(np.array(one.ctrl), steps_of(one.seconds, dt_s)) for one in self._controls()]
        return MujocoTrial(spec.compile(), self._start, plan, judge, self._names)

    def places(self, path: Path) -> Float64:
        """Return where the ball is at the scene's moments, (moments, 3) metres."""
        ball = _compiled(self.level)[1].ball_qpos
        return path.qpos[np.searchsorted(path.time, self.moments_s, "right") - 1, ball : ball + 3]


@cache
def _compiled(name: str) -> tuple[Level, CompiledLevel]:
    level = load_level(name)
    return level, compile_level(level, "default")


@cache
def _converged_places(scene: GameScene) -> tuple[tuple[float, ...], ...]:
    """Return where the ball is at the moments as the step vanishes, metres."""
    places = scene.places(scene.trial(REFERENCE, scene.reference_step_s).path)
    return tuple(tuple(one) for one in places.tolist())


def _measures(moments_s: Sequence[float], said: Sequence[str]) -> tuple[Measure, ...]:
    return tuple(
        Measure(f"position_{moment:g}s", f"position error {what}, m", "discretisation")
        for moment, what in zip(moments_s, said, strict=True)
    )


@dataclass(frozen=True)
class GatePush(GameScene):
    """A key presses the ball against the gate while the servo lowers it past the ball.

    Three bodies of the product meet: the ball on the floor, its side on the sliding gate, whose
    friction drags it down, and the servo of 100 times its mass.
    """

    def _controls(self) -> Sequence[Controlled]:
        level, compiled = _compiled(self.level)
        pressing = np.zeros(compiled.model.nu)
        pressing[compiled.force_ctrl[0]] = KEY_FORCE_N
        lowering = pressing.copy()
        lowering[compiled.gate_ctrl[0]] = -level.gates[0].speed
        first = 0.5
        return (
            Controlled(tuple(pressing.tolist()), first),
            Controlled(tuple(lowering.tolist()), self.horizon_s - first),
        )

    def _start(self, data: mujoco.MjData) -> None:
        level, compiled = _compiled(self.level)
        gate, radius = level.gates[0], level.ball.radius
        data.qpos[compiled.ball_qpos] = gate.at[0] - gate.size[0] / 2.0 - radius
        data.qpos[compiled.ball_qpos + 1] = gate.at[1]


DRIVE: Final = (Pressed("w", 1.5), Pressed("wa", 0.5), Pressed("a", 0.5), Pressed("s", 1.5))


@dataclass(frozen=True)
class Course(GameScene):
    """The classic level under a sequence of keys.

    The keys are played once through the product's own simulation, rules and all, at its
    ``accurate`` preset. What its actuators did is then repeated open loop, so that events which
    are quantised to control steps fall alike with every method.
    """

    keys: tuple[Pressed, ...] = DRIVE

    def _controls(self) -> Sequence[Controlled]:
        return played_controls(self.level, self.keys)


@cache
def played_controls(level: str, keys: tuple[Pressed, ...]) -> tuple[Controlled, ...]:
    """Play keys through the product's simulation, and return what its actuators did."""
    config = make_config(
        level=load_level(level), physics="accurate", control_dt_s=CONTROL_DT_S, num_threads=1
    )
    _, ctrl = played(config, [(one.keys, one.seconds) for one in keys], seed=0)
    return tuple(Controlled(tuple(row), CONTROL_DT_S) for row in ctrl.tolist())


_GATE_MOMENTS_S: Final = (3.6, 2.4, 0.4)
_COURSE_MOMENTS_S: Final = (3.0, 2.0, 4.0)

GATE_PUSH: Final = GatePush(
    name="gate-push",
    title="A key presses the ball against the gate, which sinks",
    horizon_s=3.6,
    measures=_measures(
        _GATE_MOMENTS_S,
        (
            "after 3.6 s, over the gate",
            "after 2.4 s, pressed against the sinking gate",
            "after 0.4 s, pressed against the resting gate",
        ),
    ),
    methods=MUJOCO,
    time_steps_s=(0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4),
    failure=0.1,
    level="gate",
    moments_s=_GATE_MOMENTS_S,
)
COURSE: Final = Course(
    name="course",
    title="The classic course under a sequence of keys",
    horizon_s=4.0,
    measures=_measures(
        _COURSE_MOMENTS_S,
        (
            "after 3 s, thrown up by the plate's edge",
            "after 2 s, before the first impact",
            "after 4 s, off the wall",
        ),
    ),
    methods=MUJOCO,
    time_steps_s=(0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4),
    failure=0.5,
    moments_s=_COURSE_MOMENTS_S,
    # After an impact RK4, too, is of first order: this reference is good to 2e-4 m (found by
    # halving its step), one of 4e-5 s to 1e-3 m.
    reference_step_s=1e-5,
)

GAME_SCENES: Final[Sequence[ContactScene]] = (GATE_PUSH, COURSE)
