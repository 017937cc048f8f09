"""What is compared: MuJoCo's integrators under both friction cones, and the rigid body's own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final, Literal, get_args

import mujoco

from roller_env.rigid_body import INTEGRATORS, Integrator

MujocoIntegrator = Literal["Euler", "implicit", "implicitfast", "discrete", "RK4"]
Cone = Literal["elliptic", "pyramidal"]


@dataclass(frozen=True, slots=True)
class MujocoMethod:
    """MuJoCo with one integrator and one friction cone."""

    integrator: MujocoIntegrator
    cone: Cone = "elliptic"

    @property
    def name(self) -> str:
        """What tables and charts call it."""
        cone = "" if self.cone == "elliptic" else f", {self.cone} cone"
        return f"MuJoCo {self.integrator}{cone}"

    @property
    def order(self) -> int:
        """Power of dt with which the error of smooth motion falls."""
        return 4 if self.integrator == "RK4" else 1

    @property
    def evaluations(self) -> int:
        """Evaluations of the forces in a step."""
        return 4 if self.integrator == "RK4" else 1

    def configure(self, spec: mujoco.MjSpec, dt_s: float) -> None:
        """Make ``spec`` use this method with steps of ``dt_s`` seconds.

        MuJoCo must not start a diverged simulation again from the beginning, which it does by
        default: an experiment has to see it. The constraint Jacobian is dense since the sparse
        path of MuJoCo 4.0.0 has a wrong Hessian (its changelog, 4.0.1).
        """
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{self.integrator.upper()}")
        spec.option.cone = getattr(mujoco.mjtCone, f"mjCONE_{self.cone.upper()}")
        spec.option.timestep = dt_s
        spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        if self.integrator == "discrete":
            # MuJoCo 4.0 refuses it together with the sleep of a level's fixed geoms.
            spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET


@dataclass(frozen=True, slots=True)
class RigidBodyMethod:
    """One of our own integrators on the report's rigid body."""

    integrator: Integrator

    @property
    def name(self) -> str:
        """What tables and charts call it."""
        return f"ours {self.integrator.name}"

    @property
    def order(self) -> int:
        """Power of dt with which the error of smooth motion falls."""
        return self.integrator.order

    @property
    def evaluations(self) -> int:
        """Evaluations of the forces in a step."""
        return self.integrator.evaluations


Method = MujocoMethod | RigidBodyMethod

MUJOCO: Final = tuple(MujocoMethod(integrator) for integrator in get_args(MujocoIntegrator))
"""Every integrator of MuJoCo with the elliptic cone, which bends no heading."""

PYRAMIDAL: Final = tuple(
    MujocoMethod(integrator, "pyramidal") for integrator in ("Euler", "implicitfast", "RK4")
)
RIGID_BODY: Final = tuple(RigidBodyMethod(integrator) for integrator in INTEGRATORS.values())

FREE: Final[tuple[Method, ...]] = (*MUJOCO, *RIGID_BODY)
"""Every method that can move a free body."""


@contextmanager
def without_warnings() -> Iterator[None]:
    """Keep MuJoCo from writing MUJOCO_LOG.TXT: an experiment expects simulations that diverge."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
