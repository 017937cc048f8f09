"""The report's rigid body, as a library of its own: NumPy and Numba, many bodies at a time.

    >>> from roller_env.rigid_body import RK4, Body, State, advance, driving_torque
    >>> cube = State.create(Body.cube(size=1.0, mass=1.0))
    >>> spun = advance(cube, RK4, dt=0.01, steps=1000, load=driving_torque())
    >>> spun.angular_velocity.round(3).tolist()
    [[9.975, 0.0, 0.0]]

Modules: `state` (primary, secondary and constant values), `quaternion`, `forces`, `integrators`,
`kernels` (what of these two is compiled), `exact` (motions with a known answer, the only one that
needs SciPy), `pacing` (fixed steps under frames of any length, drawing between them), `axes` (the
report's axes and the game's).
"""

from __future__ import annotations

from roller_env.rigid_body.axes import OPENGL_TO_GAME, REPORT_TO_GAME, AxesMap
from roller_env.rigid_body.forces import (
    Derivative,
    DerivativeFunction,
    Load,
    PiecewiseConstantForce,
    Wrench,
    constant,
    derivative_of,
    driving_torque,
    force_at,
    gravity,
    key_sequence,
    linear_drag,
    on_axle,
    push_at,
    total,
    velocity_at,
)
from roller_env.rigid_body.integrators import (
    BUSS2,
    BUSS3,
    EXPLICIT_EULER,
    INTEGRATORS,
    LIE_RK4,
    RK4,
    RK4_BODY,
    SEMI_IMPLICIT_EULER,
    SPLITTING2,
    SPLITTING4,
    Integrator,
    advance,
    integrator,
    trajectory,
)
from roller_env.rigid_body.pacing import FixedStepPacer, interpolate
from roller_env.rigid_body.state import Body, Pose, State

__all__ = [
    "BUSS2",
    "BUSS3",
    "EXPLICIT_EULER",
    "INTEGRATORS",
    "LIE_RK4",
    "OPENGL_TO_GAME",
    "REPORT_TO_GAME",
    "RK4",
    "RK4_BODY",
    "SEMI_IMPLICIT_EULER",
    "SPLITTING2",
    "SPLITTING4",
    "AxesMap",
    "Body",
    "Derivative",
    "DerivativeFunction",
    "FixedStepPacer",
    "Integrator",
    "Load",
    "PiecewiseConstantForce",
    "Pose",
    "State",
    "Wrench",
    "advance",
    "constant",
    "derivative_of",
    "driving_torque",
    "force_at",
    "gravity",
    "integrator",
    "interpolate",
    "key_sequence",
    "linear_drag",
    "on_axle",
    "push_at",
    "total",
    "trajectory",
    "velocity_at",
]
