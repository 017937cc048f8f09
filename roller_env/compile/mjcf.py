"""Level -> MjSpec, of the shapes that its pieces stand for.

What the physics needs and no more: the ball on its free joint, static boxes on the world body, one
slide joint and one servo for each plate and gate, three motors on the ball. Coins, triggers and
the finish are decided by the rules on the ball's path and do not exist here.
"""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from roller_env.compile.merge import merge_solids
from roller_env.level.expand import expand
from roller_env.level.schema import Level, Material
from roller_env.physics.materials import contact_parameters
from roller_env.physics.presets import PhysicsPreset
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.piece import Mover, Solid, path_of

BALL: Final = "ball"
FORCE_ACTUATORS: Final = ("force_x", "force_y", "lift")
"""Motors on the ball's free joint: newtons along the world's x, y and z through its centre."""

BALL_BIT: Final = 1
"""Contact bit of the ball's contype and of the level's conaffinity: only pairs of the ball and a
piece of the level meet; level pieces, gates and plates among themselves never do."""

MOVER_MASS_RATIO: Final = 100.0
"""Mass of a plate or gate over the ball's, so that the ball's landing does not budge it."""

SERVO_FREQUENCY: Final = 200.0
"""Natural frequency of the plates' and gates' servos, rad/s. They trail their set-point by
2 speed / frequency (8 mm for a gate) and implicitfast is stable up to dt = 4.8 / frequency."""

SERVO_G: Final = 10.0
"""Most force of a servo over the weight of what it moves, in standard gravities. Ample for keeping
its speed with the ball on it; without a limit a gate that closes on the ball shoots it away at
50 m/s, since nothing rigid gives way (``scripts/stability.py``, gate_closing_on_the_ball)."""

STANDARD_GRAVITY: Final = 9.80665
"""m/s^2, by definition."""

MIDPHASE_GEOMS: Final = 150
"""Geoms up to which the ball is tested against every bounding box in turn. MuJoCo's tree of boxes
(the midphase) finds the same contacts, to the bit; measured, it costs 0.3 to 0.5 us of a step of 6
on 62 geoms and saves 2.4 of 9 on 600."""


def build_spec(level: Level, preset: PhysicsPreset) -> mujoco.MjSpec:
    """Return the level as an MjSpec that simulates and carries no scenery."""
    spec = mujoco.MjSpec()
    spec.modelname = level.name
    _set_options(spec, level, preset)
    _add_ball(spec, level)
    everything = expand(level)
    merged = merge_solids(everything.ground)
    names = {solid.material for solid in (*merged, *everything.at_the_start)}
    contacts = {name: _contact(level, preset, level.material(name)) for name in names}
    for number, solid in enumerate(merged):
        _add_solid(spec, solid, contacts[solid.material], f"solid_{number}_{solid.material}")
    for solid in everything.machines:
        _add_solid(spec, solid, contacts[solid.material], machine_name(solid))
    for mover in everything.movers:
        _add_mover(spec, level, mover, contacts[mover.solid.material])
    if len(spec.geoms) <= MIDPHASE_GEOMS:
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
    return spec


def _set_options(spec: mujoco.MjSpec, level: Level, preset: PhysicsPreset) -> None:
    option = spec.option
    option.timestep = preset.dt_s
    option.gravity = [0.0, 0.0, -level.gravity]
    option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{preset.integrator.upper()}")
    option.cone = getattr(mujoco.mjtCone, f"mjCONE_{preset.cone.upper()}")
    option.impratio = preset.impratio
    option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{preset.solver.upper()}")
    option.iterations = preset.iterations
    option.tolerance = preset.tolerance
    # Islands are solved apart where many bodies touch; one ball is one island, and looking for it
    # costs 7 % of a step.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    # Nothing of a level can fall asleep, for everything that moves has actuators. What the flag
    # spares is posing every fixed geom anew in every step: a tenth of it on 60 geoms, half on 600.
    option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    # MuJoCo 4.0.0's sparse Newton Hessian is wrong (fixed in 4.0.1), and "auto" may choose it.
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE


def _add_ball(spec: mujoco.MjSpec, level: Level) -> None:
    body = spec.worldbody.add_body(name=BALL, pos=level.start.at)
    body.add_freejoint(name=BALL)
    body.add_geom(
        name=BALL,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[level.ball.radius, 0.0, 0.0],
        mass=level.ball.mass_kg,
        contype=BALL_BIT,
        conaffinity=0,
        condim=3,
    )
    for name, axis in zip(FORCE_ACTUATORS, np.eye(3), strict=True):
        motor = spec.add_actuator(
            name=name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=BALL,
            gear=[*axis, 0.0, 0.0, 0.0],
        )
        motor.set_to_motor()


def _contact(level: Level, preset: PhysicsPreset, material: Material) -> dict[str, object]:
    """Return the geom attributes that give the ball the wanted contact with ``material``.

    The geom's priority is above the ball's, so its numbers count alone, not a mix of both.
    """
    parameters = contact_parameters(
        friction=level.ball.friction * material.friction,
        elasticity=level.ball.elasticity * material.elasticity,
        preset=preset,
    )
    return {
        "contype": 0,
        "conaffinity": BALL_BIT,
        "priority": 1,
        "condim": 3,
        "friction": [parameters.friction, 0.0, 0.0],
        "solref": parameters.solref,
        "solimp": parameters.solimp,
    }


def machine_name(solid: Solid) -> str:
    """Return ``lift_pad_0``, the geom of what stands still and does something: ``lift_pads[0]``."""
    kind, number = path_of(solid.source)
    return f"{str(kind).removesuffix('s')}_{number}"


def _add_solid(spec: mujoco.MjSpec, solid: Solid, contact: dict[str, object], name: str) -> None:
    shape: dict[str, object] = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": solid.half_size}
    if isinstance(solid, ConvexSolid):
        # About its middle: MuJoCo keeps vertices in single precision.
        corners = solid.corners() - solid.centre
        spec.add_mesh(name=name, uservert=corners.ravel())
        shape = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name}
    spec.worldbody.add_geom(
        name=name,
        **shape,
        pos=solid.centre,
        quat=quaternion(np.array(solid.rotation)),
        **contact,
    )


def _add_mover(spec: mujoco.MjSpec, level: Level, mover: Mover, contact: dict[str, object]) -> None:
    """Add a slab that an integrated-velocity servo moves along its slide joint.

    The servo's control is the slab's velocity in m/s; its activation is the set-point, clamped
    where the slab stands still.
    """
    name, solid = mover.name, mover.solid
    mass = MOVER_MASS_RATIO * level.ball.mass_kg
    kp = mass * SERVO_FREQUENCY**2
    body = spec.worldbody.add_body(
        name=name,
        pos=solid.centre,
        quat=quaternion(np.array(solid.rotation)),
        gravcomp=1.0,
    )
    # The joint's axis is the body's.
    axis = np.array(mover.along) @ np.array(solid.rotation)
    body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=solid.half_size,
        mass=mass,
        **contact,
    )
    servo = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
    # MuJoCo's intvelocity, spelt out: the shortcut would write an attribute that 3.x does not know.
    servo.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
    servo.gainprm[0] = kp
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.biasprm[1:3] = [-kp, -2.0 * mass * SERVO_FREQUENCY]
    servo.actlimited = True
    servo.actrange = [mover.travel, 0.0]
    most = SERVO_G * mass * STANDARD_GRAVITY
    servo.forcelimited = True
    servo.forcerange = [-most, most]


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix (3, 3)."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, rotation.reshape(9))
    return quaternion
