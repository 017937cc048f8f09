"""What contact scenes share: worlds and balls, the trial that is recorded and timed, the scene.

``scenes.csv`` says what charts and tables call each, and when a method has failed it.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path as File
from typing import Any, ClassVar, Final

import mujoco
import numpy as np
from pandas import read_csv

from roller_env.arrays import Float64
from roller_env.lab.game import FRICTION
from roller_env.lab.methods import MUJOCO, Cone, Method, MujocoMethod, without_warnings
from roller_env.lab.scene import Measure
from roller_env.lab.simulate import Path, record
from roller_env.physics.materials import IMPEDANCE, contact_parameters
from roller_env.physics.presets import MUJOCO_PRESETS, PhysicsPreset

CONVERGED: Final[Mapping[str, float]] = {"iterations": 100, "tolerance": 1e-14}
"""Solver options with which no error of its own is taken for one of the integrator's."""

UPWARDS: Final = ((0.0, 0.0, 1.0),)


def new_spec(
    method: MujocoMethod, dt_s: float, gravity_m_s2: float = 0.0, **options: Any
) -> mujoco.MjSpec:
    """Return an empty world with the method's settings, and more of ``mjOption``, flags added."""
    spec = mujoco.MjSpec()
    method.configure(spec, dt_s)
    spec.option.gravity = [0.0, 0.0, -gravity_m_s2]
    for name, value in options.items():
        set_already = getattr(spec.option, name)
        setattr(spec.option, name, set_already | value if name.endswith("flags") else value)
    return spec


def add_ball(
    spec: mujoco.MjSpec,
    at: Sequence[float],
    radius_m: float,
    mass_kg: float = 1.0,
    slides: Sequence[Sequence[float]] = (),
    **geom: Any,
) -> None:
    """Add a ball, centre at ``at`` in metres, on a free joint or on slide joints along axes."""
    body = spec.worldbody.add_body(pos=list(at))
    for axis in slides:
        body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    if not slides:
        body.add_freejoint()
    size = [radius_m, 0.0, 0.0]
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=size, mass=mass_kg, **geom)


def add_ground(spec: mujoco.MjSpec, **geom: Any) -> None:
    """Add the plane z = 0."""
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 1.0], **geom)


def contact_of(
    friction: float, solref: Sequence[float], impedance: float = IMPEDANCE
) -> dict[str, Any]:
    """Return a geom's contact: of constant impedance, and of higher priority than MuJoCo's own.

    With a constant impedance ``solref = (tau, ratio)`` is exactly the spring and damper
    ``x'' = -2 x' / tau - x / (tau ratio)²``, and ``(-K, -B)`` is ``x'' = -K x - B x'``.
    """
    return {
        "friction": [friction, 0.0, 0.0],
        "solref": list(solref),
        "solimp": [impedance, impedance, 0.001, 0.5, 2.0],
        "condim": 3 if friction else 1,
        "priority": 1,
    }


def game_contact(
    friction: float = FRICTION,
    elasticity: float = 0.0,
    preset: PhysicsPreset = MUJOCO_PRESETS["default"],
) -> dict[str, Any]:
    """Return a geom's contact as the product calibrates it for a preset, however it is stepped."""
    parameters = contact_parameters(friction, elasticity, preset)
    return contact_of(parameters.friction, parameters.solref)


def resting_depth(solref: Sequence[float], pull_m_s2: float) -> float:
    """Return how deep a body rests in a contact of the game's impedance d, m: (1 - d) pull / K.

    MuJoCo's contact gives -B v - K r + (1 - d) a0 (Computation chapter, "Constraint model"; d is
    constant). At rest that is 0, and a0 is minus the pull.
    """
    return (1.0 - IMPEDANCE) * pull_m_s2 / -solref[0]


def steps_of(seconds: float, dt_s: float) -> int:
    """Return how many steps of ``dt_s`` make ``seconds``.

    Raises:
        ValueError: it is not a whole number of steps, so that the end would be another time.
    """
    if not 0.0 < dt_s <= seconds:
        raise ValueError(f"dt_s: found {dt_s:g}; must be more than 0 and at most {seconds:g} s")
    steps = round(seconds / dt_s)
    if abs(steps * dt_s - seconds) > 1e-9 * seconds:
        raise ValueError(
            f"dt_s: found {dt_s:g}, of which no whole number makes {seconds:g} s; the nearest that "
            f"fits is {seconds / steps:.10g}"
        )
    return steps


Plan = Sequence[tuple[float, Sequence[float]]]
"""Seconds, and MuJoCo's controls, (nu,), that are held so long, one after the other."""

_STATE: Final = mujoco.mjtState.mjSTATE_INTEGRATION


class MujocoTrial:
    """One simulation of a scene: a `SteadyTrial`, with its ``model`` and ``data``.

    `run` writes down the path, which takes Python; `run_part` repeats the same steps in nothing
    but MuJoCo's loop. SimBenchmark, too, measures error and time in two passes.
    """

    def __init__(self, scene: ContactScene, method: MujocoMethod, dt_s: float):
        self.model = scene._world(method, dt_s).compile()
        self.data = mujoco.MjData(self.model)
        self._scene, self._method = scene, method
        self._plan = [(steps_of(seconds, dt_s), ctrl) for seconds, ctrl in scene.plan]
        self._steps = sum(steps for steps, _ in self._plan)
        first, last = (round(moment / dt_s) for moment in scene.timed_s or (0.0, scene.horizon_s))
        self._part = range(first, last)
        self._before_part = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        self._path: Path | None = None

    @property
    def part_s(self) -> float:
        """Simulated time of what `run_part` simulates, seconds."""
        return float(len(self._part) * self.model.opt.timestep)

    def run(self) -> None:
        """Simulate the whole motion and keep its path."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        self._scene._start(data, model.opt.timestep)
        begins = np.cumsum([0, *(steps for steps, _ in self._plan)]).tolist()[:-1]

        def control(step: int) -> None:
            if step == self._part.start:
                mujoco.mj_getState(model, data, self._before_part, _STATE)
            if step in begins:
                data.ctrl[:] = self._plan[begins.index(step)][1]

        self._path = record(model, data, self._steps, before=control)

    def run_part(self) -> None:
        """Simulate the part that is timed; a motion with a plan is timed as a whole."""
        mujoco.mj_setState(self.model, self.data, self._before_part, _STATE)
        for steps, ctrl in self._plan:
            self.data.ctrl[:] = ctrl
            mujoco.mj_step(self.model, self.data, min(steps, len(self._part)))

    @property
    def path(self) -> Path:
        """The path of the last run; the first use runs it."""
        if self._path is None:
            with without_warnings():
                self.run()
        assert self._path is not None
        return self._path

    def errors(self) -> Mapping[str, float]:
        """Return the errors by the name of their measure, NaN where it diverged."""
        if self.path.finite:
            return self._scene.judge(self.path, self._method)
        return {measure.name: math.nan for measure in self._scene.measures}


_WORDS: Final = read_csv(File(__file__).with_name("scenes.csv"))


def described(scene: str) -> dict[str, Any]:
    """Return what ``scenes.csv`` says of a scene: arguments of a `ContactScene`."""
    rows = _WORDS[_WORDS.scene == scene]
    first = rows.iloc[0]
    return {
        "name": scene,
        "title": first.title,
        "horizon_s": float(first.horizon_s),
        "measures": tuple(Measure(row.measure, row.label, row.kind) for row in rows.itertuples()),
        "time_steps_s": tuple(map(float, first.time_steps_s.split())),
        "failure": float(first.failure),
    }


@dataclass(frozen=True)
class ContactScene(ABC):
    """A `roller_env.lab.scene.Scene` that MuJoCo simulates.

    Where an error is called discretisation, the contact is the same soft one at every step.
    """

    name: str
    title: str
    horizon_s: float
    measures: Sequence[Measure]
    time_steps_s: Sequence[float]
    failure: float
    methods: Sequence[Method] = MUJOCO

    def trial(self, method: Method, dt_s: float) -> MujocoTrial:
        """Return a simulation of the scene, ready to run.

        Raises:
            ValueError: the scene is not for this method, or ends between two such time steps.
        """
        if not isinstance(method, MujocoMethod):
            raise ValueError(
                f"{self.name}: found method {method.name!r}; the rigid body knows no contact, "
                f"allowed are {', '.join(repr(one.name) for one in self.methods)}"
            )
        steps_of(self.horizon_s, dt_s)
        return MujocoTrial(self, method, dt_s)

    timed_s: ClassVar[tuple[float, float] | None] = None
    """Begin and end of what is timed, if that is not all."""

    @abstractmethod
    def _world(self, method: MujocoMethod, dt_s: float) -> mujoco.MjSpec:
        """Return the scene's bodies, ground and settings."""

    def _start(self, data: mujoco.MjData, dt_s: float) -> None:  # noqa: B027 - some just fall
        """Put the freshly reset data where the motion begins."""

    @property
    def plan(self) -> Plan:
        """Controls of the whole motion."""
        return ((self.horizon_s, ()),)

    @abstractmethod
    def judge(self, path: Path, method: MujocoMethod) -> Mapping[str, float]:
        """Return the errors of a finite path by the name of their measure."""


@dataclass(frozen=True)
class BallScene(ContactScene):
    """A scene whose first body is a free ball, whose place is compared at ``moments_s``."""

    moments_s: Sequence[float] = ()
    reference_step_s: float = 4e-5
    """Of the converged model; none of the scene's own, so that nothing is compared with itself."""

    def places(self, path: Path) -> Float64:
        """Return where the ball is at the scene's moments, (moments, 3) m."""
        return path.qpos[np.rint(np.array(self.moments_s) / path.time[1]).astype(int), :3]

    def away(self, path: Path, cone: Cone = "elliptic") -> Float64:
        """Return how far that is from where a vanishing step takes the ball, (moments, 3) m."""
        return self.places(path) - _converged(self, cone)


@cache
def _converged(scene: BallScene, cone: Cone) -> Float64:
    """Return where RK4, the most accurate method, takes the ball with the reference's step."""
    return scene.places(scene.trial(MujocoMethod("RK4", cone), scene.reference_step_s).path)
