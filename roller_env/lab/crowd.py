"""What a step of our integrators costs a body when many advance in one call.

Our rigid body is NumPy. For one body nearly all of a step is the interpreter's overhead, so that
its wall time beside MuJoCo's says little of the method; a thousand bodies share the overhead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import mujoco

from roller_env.lab.free import COMPLEX_BOX, free_model
from roller_env.lab.methods import MUJOCO, RIGID_BODY, Method, MujocoMethod, RigidBodyMethod
from roller_env.lab.timing import wall_time
from roller_env.rigid_body import advance

BODIES: Final = (1, 1000)
_DT_S: Final = 1e-3
_STEPS: Final = 10
_MUJOCO_STEPS: Final = 2000


@dataclass(frozen=True, slots=True)
class CrowdCost:
    """The cost of a method's step for each of a number of bodies that advance together."""

    method: str
    bodies: int
    us_per_body_step: float
    """Microseconds."""
    us_per_body_evaluation: float


def costs(repeats: int) -> list[CrowdCost]:
    """Time every method on the tumbling box: ours with 1 and 1000 bodies, MuJoCo with one."""
    ours = [_ours(method, bodies, repeats) for method in RIGID_BODY for bodies in BODIES]
    return [*(_mujoco(method, repeats) for method in MUJOCO), *ours]


def _mujoco(method: MujocoMethod, repeats: int) -> CrowdCost:
    model = free_model(COMPLEX_BOX.start.body, method, _DT_S)
    data = mujoco.MjData(model)
    COMPLEX_BOX.acting.apply(model, data)
    wall = wall_time(lambda: mujoco.mj_step(model, data, _MUJOCO_STEPS), repeats)
    return _cost(method, 1, wall.median_s / _MUJOCO_STEPS)


def _ours(method: RigidBodyMethod, bodies: int, repeats: int) -> CrowdCost:
    crowd, load = COMPLEX_BOX.start.take([0] * bodies), COMPLEX_BOX.acting.load()
    wall = wall_time(lambda: advance(crowd, method.integrator, _DT_S, _STEPS, load=load), repeats)
    return _cost(method, bodies, wall.median_s / (_STEPS * bodies))


def _cost(method: Method, bodies: int, seconds: float) -> CrowdCost:
    us = 1e6 * seconds
    return CrowdCost(method.name, bodies, us, us / method.evaluations)
