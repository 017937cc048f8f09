"""The velocity form, which is what MuJoCo keeps: to and from it, and the report's method on it.

`EulerEquations` is the report's method with one thing exchanged, to find out what makes a result.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from roller_env.rigid_body import (
    LIE_RK4,
    RK4,
    SPLITTING4,
    Body,
    DerivativeFunction,
    Integrator,
    State,
    quaternion,
)
from roller_env.rigid_body.arrays import Float64, cross, positive_time


def to_mujoco(state: State) -> tuple[Float64, Float64]:
    """Return a free joint's ``qpos`` (N, 7) and ``qvel`` (N, 6).

    Its velocity is in world axes and its angular velocity in body axes, m/s and rad/s.
    """
    spin = quaternion.rotate_inverse(state.rotation, state.angular_velocity)
    return np.hstack([state.position, state.rotation]), np.hstack([state.velocity, spin])


def from_mujoco(body: Body, qpos: npt.ArrayLike, qvel: npt.ArrayLike) -> State:
    """Return the momentum form of a free joint's ``qpos`` (N, 7) and ``qvel`` (N, 6).

    Raises:
        ValueError: on other shapes, NaN, or a quaternion far from unit.
    """
    pose, rate = np.asarray(qpos, dtype=np.float64), np.asarray(qvel, dtype=np.float64)
    wanted = (body.count, 7), (body.count, 6)
    if (pose.shape, rate.shape) != wanted:
        raise ValueError(
            f"qpos and qvel of {body.count} free joints must have shapes {wanted[0]} and "
            f"{wanted[1]}, got {pose.shape} and {rate.shape}"
        )
    still = State.create(body, position=pose[:, :3], orientation=pose[:, 3:], velocity=rate[:, :3])
    return still.recalculate(
        angular_momentum=quaternion.rotate(still.rotation, body.inertia * rate[:, 3:])
    )


@dataclass(frozen=True, eq=False)
class _Carried(State):
    """A state that keeps the angular velocity it came from, to the last bit.

    To and from angular momentum in every step would round ten thousand times more than MuJoCo, and
    next to a separatrix that shows: 6e-9 rad on the thrown box.
    """

    omega: Float64 = field(kw_only=True)


@dataclass(frozen=True)
class EulerEquations:
    """The report's Runge-Kutta and its sums of quaternions on another equation: Euler's.

    Angular velocity is primary instead of angular momentum, I w' = torque - w x I w. In body axes
    I stands still and w needs no attitude, as in MuJoCo; in world axes I turns with the body, and
    w needs the attitude as in the report's momentum form. So the two tell apart what the choice of
    the primary value does from what the choice of axes does.
    """

    axes: Literal["body", "world"]
    order: int = 4
    evaluations: int = 4

    @property
    def name(self) -> str:
        """What tables call it; not in `INTEGRATORS`, being an experiment."""
        return f"velocity_rk4_{self.axes}_axes"

    def step(self, state: State, derivative: DerivativeFunction, t: float, dt: float) -> State:
        """See `Integrator.step`."""
        positive_time("dt", dt)
        half = 0.5 * dt
        y = self._packed(state)
        k1 = self._rates(state, derivative, t)
        k2 = self._rates(self._state(state, y + half * k1), derivative, t + half)
        k3 = self._rates(self._state(state, y + half * k2), derivative, t + half)
        k4 = self._rates(self._state(state, y + dt * k3), derivative, t + dt)
        y = y + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        end = self._state(state, y).recalculate(orientation=quaternion.normalise(y[:, 6:10]))
        primary = (end.position, end.momentum, end.orientation, end.angular_momentum)
        return _Carried(state.body, *primary, omega=y[:, 10:])

    def _own_axes(self, state: State, vector: Float64) -> Float64:
        if self.axes == "world":
            return vector
        return quaternion.rotate_inverse(state.rotation, vector)

    def _packed(self, state: State) -> Float64:
        if isinstance(state, _Carried):
            omega = state.omega
        else:
            omega = self._own_axes(state, state.angular_velocity)
        return np.hstack([state.position, state.momentum, state.orientation, omega])

    def _state(self, start: State, y: Float64) -> State:
        x, p, q, omega = np.split(y, [3, 6, 10], axis=1)
        moved = start.recalculate(position=x, momentum=p, orientation=q, renormalise=False)
        if self.axes == "world":
            return moved.recalculate(angular_momentum=moved.times_inertia(omega))
        turned = quaternion.rotate(moved.rotation, start.body.inertia * omega)
        return moved.recalculate(angular_momentum=turned)

    def _rates(self, state: State, derivative: DerivativeFunction, t: float) -> Float64:
        rate = derivative(state, t)
        gyroscopic = cross(rate.angular_velocity, state.angular_momentum)
        alpha = self._own_axes(state, state.over_inertia(rate.torque - gyroscopic))
        return np.hstack([rate.velocity, rate.force, rate.spin, alpha])


REMEDIES: Final[Mapping[str, tuple[Integrator, str]]] = {
    "rk4": (RK4, "the report's: momentum, world axes"),
    "lie_rk4": (LIE_RK4, "turns instead of sums of quaternions"),
    "velocity_rk4_world_axes": (EulerEquations("world"), "velocity instead of momentum"),
    "velocity_rk4_body_axes": (EulerEquations("body"), "body axes instead of world axes"),
    "splitting4": (SPLITTING4, "exact turns about body axes"),
}
"""The report's method and what could mend it, each with the one thing that it exchanges."""
