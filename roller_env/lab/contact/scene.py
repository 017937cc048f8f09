"""What every contact scene shares: its description, its solver settings and its contacts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
import numpy.typing as npt

from roller_env.lab.contact.trial import MujocoTrial
from roller_env.lab.game import FRICTION, MASS_KG, RADIUS_M
from roller_env.lab.methods import Method, MujocoMethod
from roller_env.lab.scene import Measure
from roller_env.physics.materials import IMPEDANCE, contact_parameters
from roller_env.physics.presets import PRESETS, PhysicsPreset

Float64 = npt.NDArray[np.float64]

SOFT_TIME_CONSTANT_S: Final = 0.04
"""Of the soft contact: 2 h for the largest step h = 0.02 s with which it is used, what MuJoCo's
``refsafe`` would ask for. Euler's limit, damping times h below 2, is at h = 0.04 s."""

STIFF_FRICTION: Final = 10.0
"""``impratio`` of these scenes. The game has 1; the soft contacts here are four times as slow as
its own, and their creep would hide what integrators do."""


@dataclass(frozen=True)
class ContactScene(ABC):
    """A scene that MuJoCo simulates; see `roller_env.lab.scene.Scene`.

    Contact parameters never follow the time step where an error is called discretisation: at every
    step, and for the reference, it is the same soft contact.
    """

    name: str
    title: str
    horizon_s: float
    measures: Sequence[Measure]
    methods: Sequence[Method]
    time_steps_s: Sequence[float]
    failure: float

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
        return self._trial(method, dt_s)

    @abstractmethod
    def _trial(self, method: MujocoMethod, dt_s: float) -> MujocoTrial: ...

    @property
    def _names(self) -> list[str]:
        return [one.name for one in self.measures]


def new_spec(method: MujocoMethod, dt_s: float, gravity_m_s2: float) -> mujoco.MjSpec:
    """Return a world with the method's settings, in which the solver always converges.

    The iterations are more than any scene takes and the tolerance is as small as doubles can tell,
    so that no solver error is taken for one of the integrator's.
    """
    spec = mujoco.MjSpec()
    method.configure(spec, dt_s)
    spec.option.gravity = [0.0, 0.0, -gravity_m_s2]
    spec.option.iterations = 100
    spec.option.tolerance = 1e-14
    spec.option.impratio = STIFF_FRICTION
    return spec


def soft_contact(friction: float = FRICTION) -> dict[str, Any]:
    """Return a geom's contact: critically damped, and soft enough for steps of 0.02 s.

    In MuJoCo's direct form, which ``refsafe`` leaves alone: B = 2 / tau, K = (B / 2)^2.
    """
    damping = 2.0 / SOFT_TIME_CONSTANT_S
    return contact_of(friction, (-((damping / 2.0) ** 2), -damping))


def game_contact(
    friction: float = FRICTION,
    elasticity: float = 0.0,
    preset: PhysicsPreset = PRESETS["default"],
) -> dict[str, Any]:
    """Return a geom's contact as the product calibrates it for a preset, the default's if unsaid.

    The product scales it with the preset's time step. Here it stays what it is for that preset
    however the scene is stepped.
    """
    parameters = contact_parameters(friction, elasticity, preset)
    return contact_of(parameters.friction, parameters.solref)


def contact_of(friction: float, solref: tuple[float, float]) -> dict[str, Any]:
    """Return a geom's contact from its friction and its direct ``solref``, of higher priority."""
    return {
        "friction": [friction, 0.0, 0.0],
        "solref": list(solref),
        "solimp": [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0],
        "priority": 1,
    }


def resting_depth(solref: Sequence[float], pull_m_s2: float) -> float:
    """Return how deep a body rests in a contact of constant impedance, metres.

    MuJoCo's contact gives the acceleration d (-B v - K r) / d_max + (1 - d) a0 (Computation
    chapter, "Constraint model"; in the direct form K and B are divided by d_max). At rest it is 0,
    and a0 is minus the pull, so with constant d the depth -r is (1 - d) pull / K.
    """
    return (1.0 - IMPEDANCE) * pull_m_s2 / -solref[0]


def add_ball(spec: mujoco.MjSpec, position: Sequence[float], name: str = "ball") -> None:
    """Add the game's ball on a free joint of the same name, centre at ``position`` in metres."""
    body = spec.worldbody.add_body(name=name, pos=list(position))
    body.add_freejoint(name=name)
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[RADIUS_M, 0.0, 0.0],
        mass=MASS_KG,
        condim=3,
    )
