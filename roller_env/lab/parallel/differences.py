"""How far motions are apart: over time, the largest, and which side is wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from roller_env.lab.parallel.scenes import Vector
from roller_env.rigid_body import State, quaternion
from roller_env.rigid_body.arrays import Float64

AGREEMENT: Final = 1e-9
"""The two sides agree when position, m, and attitude, rad, stay within this of one another."""


class Difference(NamedTuple):
    """How far two motions of one body are apart, each (moments,)."""

    position_m: Float64
    attitude_rad: Float64
    momentum_kg_m_s: Float64
    angular_momentum_kg_m2_s: Float64
    energy_j: Float64

    def largest(self) -> tuple[float, ...]:
        """Return the maximum over time of each; NaN when a motion was no number."""
        return tuple(float(values.max()) for values in self)


def difference(a: State, b: State, gravity_m_s2: Vector) -> Difference:
    """Return how far ``a`` and ``b``, rows of one body's moments, are apart.

    Vectors by the length of their difference, attitude by the angle, energy (kinetic and potential)
    by its absolute value.
    """
    height = (a.position - b.position) @ np.array(gravity_m_s2)
    energy = a.kinetic_energy() - b.kinetic_energy() - a.body.mass * height
    return Difference(
        quaternion.norm(a.position - b.position),
        quaternion.angle_between(a.rotation, b.rotation),
        quaternion.norm(a.momentum - b.momentum),
        quaternion.norm(a.angular_momentum - b.angular_momentum),
        np.abs(energy),
    )


Pair = Literal["ours - MuJoCo", "ours - reference", "MuJoCo - reference"]


@dataclass(frozen=True, slots=True)
class Sample:
    """One row of the results over time."""

    body: str
    scene: str
    pair: Pair
    time_s: float
    position_m: float
    attitude_rad: float
    momentum_kg_m_s: float
    angular_momentum_kg_m2_s: float
    energy_j: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """One row of the summary: the largest differences of a flight, and which side is wrong.

    The first five are ours against MuJoCo, the ``error`` ones against the reference.
    """

    body: str
    scene: str
    ours: str
    mujoco: str
    dt_s: float
    duration_s: float
    position_m: float
    attitude_rad: float
    momentum_kg_m_s: float
    angular_momentum_kg_m2_s: float
    energy_j: float
    ours_position_error_m: float
    ours_attitude_error_rad: float
    mujoco_position_error_m: float
    mujoco_attitude_error_rad: float

    @property
    def agree(self) -> bool:
        """Whether position and attitude stay within `AGREEMENT`; a motion that blew up does not."""
        return self.position_m <= AGREEMENT and self.attitude_rad <= AGREEMENT

    @property
    def words(self) -> str:
        """``agree``, or which side is further from the truth, by what and how much."""
        if self.agree:
            return "agree"
        sides = {
            self.ours: (self.ours_position_error_m, self.ours_attitude_error_rad),
            self.mujoco: (self.mujoco_position_error_m, self.mujoco_attitude_error_rad),
        }
        which, unit = (1, "rad") if self.position_m <= AGREEMENT else (0, "m")
        right, wrong = sorted(sides, key=lambda side: sides[side][which])
        return (
            f"{wrong} is off by {sides[wrong][which]:.1e} {unit}, "
            f"{right} by {sides[right][which]:.1e}"
        )


@dataclass(frozen=True, slots=True)
class Remedy:
    """One row of what could mend a disagreement: largest attitude errors over a flight, rad."""

    body: str
    scene: str
    method: str
    dt_s: float
    against_mujoco_rad: float
    error_rad: float
    mujoco_error_rad: float
