"""What flies in parallel, and what acts on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from roller_env.rigid_body import Body, PiecewiseConstantForce, State, key_sequence, quaternion
from roller_env.rigid_body.arrays import Float64
from roller_env.units import quants

Vector = tuple[float, float, float]

GRAVITY_M_S2: Final[Vector] = (0.0, 0.0, -quants(386.0))
"""The original's."""

LIFT_N: Final = quants(500.0)
"""The original's lift pad on its ball of 1 kg, in force for `LIFT_S`."""
LIFT_S: Final = 5.0

START_ORIENTATION: Final = (0.8, 0.2, -0.4, 0.4)
"""A unit quaternion with no special direction, so that no axis hides another."""

BODIES: Final[Mapping[str, Body]] = {
    "cube": Body.cube(size=1.0, mass=1.0),
    "box": Body.box(size=(0.1, 0.4, 0.9), mass=10.0),
}
"""The report's cube, and the slender box of the free-body benchmark (scpeters/benchmark)."""


@dataclass(frozen=True)
class FlightScene:
    """A flight: how it begins and what acts.

    Attributes:
        name: its key on the command line and in files.
        title: what people read.
        velocity_m_s: at the start, world axes.
        spin_rad_s: angular velocity at the start, **body** axes: that is where a box's axes differ.
        gravity_m_s2: world axes.
        held: keys or lift, a force on the centre of mass that changes by jumps.
        drag_n_s_m: force a m/s of velocity.
        damping_nms: torque a rad/s of angular velocity.
        torque_nm: constant, world axes.
    """

    name: str
    title: str
    velocity_m_s: Vector
    spin_rad_s: Vector
    gravity_m_s2: Vector = (0.0, 0.0, 0.0)
    held: PiecewiseConstantForce | None = None
    drag_n_s_m: float = 0.0
    damping_nms: float = 0.0
    torque_nm: Vector = (0.0, 0.0, 0.0)

    @property
    def turns_freely(self) -> bool:
        """Whether no torque ever acts."""
        return self.damping_nms == 0.0 and not any(self.torque_nm)

    @property
    def switches_s(self) -> Float64:
        """Times at which the held force jumps, rising."""
        return np.empty(0) if self.held is None else self.held.switches_s

    def held_force(self, t: float) -> Float64:
        """Return the keys' or lift's force at ``t``, (3,) N."""
        return np.zeros(3) if self.held is None else self.held.force_at_time(t)

    def start(self, body: Body) -> State:
        """Return the state in which ``body``, one of `BODIES`, begins."""
        q = np.array([START_ORIENTATION])
        return State.create(
            body,
            orientation=START_ORIENTATION,
            velocity=self.velocity_m_s,
            angular_velocity=quaternion.rotate(q, np.array([self.spin_rad_s])),
        )


KEYS_HELD: Final = ((0.0, "W"), (1.0, "WA"), (2.5, "A"), (4.0, "SD"), (6.5, "D"), (8.0, ""))
"""The WASD sequence: every key, singly and in pairs, and none. (time in s, keys from then on)."""

SCENES: Final[Mapping[str, FlightScene]] = {
    scene.name: scene
    for scene in (
        FlightScene("drift", "drift and spin, no gravity", (-0.9, 0.4, 0.1), (3.0, -5.0, 2.0)),
        FlightScene(
            "ballistic",
            "thrown, spun about the box's middle axis",
            (-2.0, 2.0, 8.0),
            (0.1, 5.0, 0.1),
            GRAVITY_M_S2,
        ),
        FlightScene(
            "keys",
            "WASD key sequence in free fall",
            (0.0, 0.0, 5.0),
            (2.0, 3.0, -4.0),
            GRAVITY_M_S2,
            held=key_sequence(KEYS_HELD),
        ),
        FlightScene(
            "lift",
            "lift of 12.7 N for 5 s",
            (0.5, 0.0, 0.0),
            (-3.0, 1.0, 5.0),
            GRAVITY_M_S2,
            held=PiecewiseConstantForce(
                np.array([0.0, LIFT_S]), np.array([(0.0, 0.0, LIFT_N), (0.0, 0.0, 0.0)])
            ),
        ),
        FlightScene(
            "damping",
            "linear and angular damping",
            (5.0, -3.0, 10.0),
            (4.0, -4.0, 3.0),
            GRAVITY_M_S2,
            drag_n_s_m=0.5,
            damping_nms=0.05,
        ),
        FlightScene(
            "torque",
            "the report's torque, (1, 0, 0) - 0.1 omega",
            (1.0, 0.0, 0.0),
            (1.0, -2.0, 3.0),
            damping_nms=0.1,
            torque_nm=(1.0, 0.0, 0.0),
        ),
    )
}
"""The scenes of free flight by name. The first two start as the benchmark's free boxes do, but the
first with a spin about no principal axis, which is harder than the benchmark's."""
