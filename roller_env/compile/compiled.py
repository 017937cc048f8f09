"""CompiledLevel: what never changes while playing."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from roller_env.compile.mjcf import BALL, FORCE_ACTUATORS, build_spec
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.physics.presets import PhysicsPreset, physics_preset
from roller_env.pieces.gate import Gate
from roller_env.pieces.plate import Plate

Addresses = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CompiledLevel:
    """A level, the MuJoCo model it was compiled to, and where its pieces are in that model.

    Attributes:
        level: what the designer wrote.
        preset: the physics settings the model was compiled with.
        model: the model; shared by every environment and never written to.
        ball_qpos: index of the ball's x in ``qpos``; position (3) and quaternion (4) follow.
        ball_qvel: index of its x velocity in ``qvel``; world-frame linear velocity (3) and
            body-frame angular velocity (3) follow.
        plate_qpos: (plates,) indices in ``qpos`` of the plates' displacement from ``at``, metres.
        gate_qpos: (gates,) likewise of the gates.
        force_ctrl: (3,) indices in ``ctrl`` of the forces on the ball, newtons, world frame.
        plate_ctrl: (plates,) indices in ``ctrl`` of the plates' velocities, m/s, up positive.
        gate_ctrl: (gates,) likewise of the gates.
        ball_body: id of the ball's body, for rays that must not see it.
    """

    level: Level
    preset: PhysicsPreset
    model: mujoco.MjModel
    ball_qpos: int
    ball_qvel: int
    plate_qpos: Addresses
    gate_qpos: Addresses
    force_ctrl: Addresses
    plate_ctrl: Addresses
    gate_ctrl: Addresses
    ball_body: int

    def __deepcopy__(self, memo: dict[int, object]) -> CompiledLevel:
        """Return this: nothing of it ever changes."""
        return self

    def __reduce__(self) -> tuple[object, ...]:
        """Be pickled as what it was compiled from, a fraction of the size."""
        return compile_level, (self.level, self.preset)


def compile_level(level: Level, physics: str | PhysicsPreset = "default") -> CompiledLevel:
    """Compile a level that `roller_env.level.load_level` has accepted.

    Raises:
        ValueError: no preset is called ``physics``.
    """
    preset = physics_preset(physics)
    model = build_spec(level, preset).compile()
    # A diverging ball must be seen and ended by the simulation, not silently put back. Set here
    # since the MJCF flag for it is one that MuJoCo before 3.3 does not load.
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    joint = model.joint(BALL)
    plates, gates = (
        [mover.name for mover in expand(level).movers_of(kind)] for kind in (Plate, Gate)
    )
    return CompiledLevel(
        level=level,
        preset=preset,
        model=model,
        ball_qpos=int(joint.qposadr[0]),
        ball_qvel=int(joint.dofadr[0]),
        plate_qpos=_indices(model.joint(name).qposadr[0] for name in plates),
        gate_qpos=_indices(model.joint(name).qposadr[0] for name in gates),
        force_ctrl=_indices(model.actuator(name).id for name in FORCE_ACTUATORS),
        plate_ctrl=_indices(model.actuator(name).id for name in plates),
        gate_ctrl=_indices(model.actuator(name).id for name in gates),
        ball_body=int(model.body(BALL).id),
    )


def _indices(values: object) -> Addresses:
    return np.fromiter(values, dtype=np.int64)  # type: ignore[call-overload, no-any-return]


def level_mjcf(level: Level, physics: str | PhysicsPreset = "default") -> str:
    """Return the level as MJCF text that MuJoCo loads without this package."""
    spec = build_spec(level, physics_preset(physics))
    # Only a batch gains by it, and older MuJoCo does not know it.
    spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    spec.compile()
    return str(spec.to_xml())
