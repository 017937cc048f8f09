"""Small MuJoCo scenes: a ball and what it meets, with contacts whose parameters are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from roller_env.lab.methods import MujocoMethod

BALL: Final = "ball"
GRAVITY: Final = 9.81
RADIUS_M: Final = 0.2

TAU_S: Final = 0.02
"""MuJoCo's default time constant of a contact."""

FINE_S: Final = TAU_S / 400
"""A step that resolves a contact; what remains of the discretisation is about h / tau."""

COARSE_S: Final = 0.002
"""MuJoCo's default time step."""

SETTLE_S: Final = 0.5
"""After which what was put down no longer sinks."""

EULER: Final = MujocoMethod("Euler")

SPRING: Final = "solution of the contact's x'' = -2x'/tau - x/tau²"
MAP: Final = "the Euler step of the contact's spring, written out"
STATICS: Final = "balance of the constraint's regularised equation, a = d aref + (1-d) a0"
"""Sources of formulae."""


@dataclass(frozen=True, slots=True)
class Contact:
    """Contact parameters, the same on both geoms, so that nothing is mixed.

    The impedance is constant. With it ``solref = (tau, ratio)`` is exactly the spring and damper
    ``x'' = -2 x' / tau - x / (tau ratio)²``; MuJoCo's default lets it rise from 0.9 to 0.95 within
    the first millimetre of depth.

    Attributes:
        solref: (tau in s, damping ratio), or (-stiffness in 1/s², -damping in 1/s).
        impedance: d.
        friction: Coulomb coefficient.
    """

    solref: tuple[float, float] = (TAU_S, 1.0)
    impedance: float = 0.95
    friction: float = 0.0

    @property
    def attributes(self) -> dict[str, object]:
        """The geom's attributes."""
        return {
            "solref": self.solref,
            "solimp": [self.impedance, self.impedance, 0.001, 0.5, 2.0],
            "friction": [self.friction, 0.0, 0.0],
            "condim": 3 if self.friction else 1,
        }


def new_spec(method: MujocoMethod, dt_s: float, gravity: float = 0.0) -> mujoco.MjSpec:
    """Return an empty scene; gravity in m/s² along -z."""
    spec = mujoco.MjSpec()
    method.configure(spec, dt_s)
    spec.option.gravity = [0.0, 0.0, -gravity]
    return spec


def add_ball(
    spec: mujoco.MjSpec,
    contact: Contact,
    *,
    radius: float = RADIUS_M,
    rolls: bool = False,
) -> None:
    """Add a ball of 1 kg that touches z = 0 from above.

    Args:
        spec: the scene.
        contact: of the ball.
        radius: m.
        rolls: whether it hangs on a free joint, ``qpos`` being the world position of its centre,
            or cannot turn and hangs on three slide joints, ``qpos`` being its way from here.
    """
    body = spec.worldbody.add_body(name=BALL, pos=(0.0, 0.0, radius))
    if rolls:
        body.add_freejoint(name=BALL)
    else:
        for axis in np.eye(3):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    body.add_geom(
        name=BALL,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[radius, 0.0, 0.0],
        mass=1.0,
        **contact.attributes,
    )


def add_box(
    spec: mujoco.MjSpec, contact: Contact, at: Sequence[float], half_size: Sequence[float]
) -> None:
    """Add a fixed box."""
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=at, size=half_size, **contact.attributes
    )


def add_floor(spec: mujoco.MjSpec, contact: Contact) -> None:
    """Add a thick wide box whose upper face is at z = 0."""
    add_box(spec, contact, (0.0, 0.0, -1.0), (50.0, 50.0, 1.0))
