"""A physics setting: a preset and the further knobs of MuJoCo that are tried on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import mujoco

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.compile.mjcf import BALL, build_spec
from roller_env.level import Level
from roller_env.physics.presets import PRESETS, PhysicsPreset

Option = float | int | str
ENUMS: Final[Mapping[str, Mapping[Option, int]]] = {
    "solver": {"CG": mujoco.mjtSolver.mjSOL_CG, "PGS": mujoco.mjtSolver.mjSOL_PGS},
    "integrator": {
        "Euler": mujoco.mjtIntegrator.mjINT_EULER,
        "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
        "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
    },
}
"""The values of `Setting.options` that are written as names."""


@dataclass(frozen=True, slots=True)
class Setting:
    """How the game's levels are simulated."""

    name: str  # what tables and charts call it
    knob: str  # what it is about; settings of one knob form a group
    preset: PhysicsPreset = PRESETS["default"]  # what the product can be given
    options: tuple[tuple[str, Option], ...] = ()  # further fields of MuJoCo's ``mjOption``
    flags: tuple[tuple[str, bool], ...] = ()  # MuJoCo's that differ from the compiler's
    contacts_at_s: float | None = None  # step that contacts are made for, if not the preset's
    stiffness: float = 1.0  # factor of plastic contacts' rate B; the spring goes with its square
    impedance: float | None = None  # of all contacts, if not the product's
    # Share of the slip that a step removes, if not that of the approach (`DAMPING_STEPS`). Only
    # explicit contact pairs can have it differ.
    friction_steps: float | None = None
    pairs: bool = False  # explicit contact pairs instead of contact bits

    def compile(self, level: Level) -> CompiledLevel:
        """Return the level compiled with this setting."""
        return replace(compile_level(level, self.preset), model=self.spec(level).compile())

    def spec(self, level: Level) -> mujoco.MjSpec:
        """Return the level's MjSpec with this setting."""
        contacts_at = self.contacts_at_s or self.preset.dt_s
        spec = build_spec(level, replace(self.preset, dt_s=contacts_at))
        option = spec.option
        option.timestep = self.preset.dt_s
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        for name, value in self.options:
            setattr(option, name, ENUMS.get(name, {}).get(value, value))
        for name, on in self.flags:
            set_flag(option, name, on)
        surfaces = [geom for geom in spec.geoms if geom.name != BALL]
        for geom in surfaces:
            self._change_contact(geom, contacts_at)
            if self.pairs or self.friction_steps is not None:
                self._add_pair(spec, geom)
                spec.geom(BALL).contype = 0
        return spec

    def _change_contact(self, geom: mujoco.MjsGeom, contacts_at: float) -> None:
        stiffness, damping = geom.solref
        # Plastic contacts are the only ones in which a step takes less than all of the approach.
        if -damping * contacts_at < 1.0:
            geom.solref = [stiffness * self.stiffness**2, damping * self.stiffness]
        if self.impedance is not None:
            geom.solimp = [self.impedance, self.impedance, *geom.solimp[2:]]

    def _add_pair(self, spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> None:
        """Add an explicit contact pair of the ball and a geom, with the geom's contact."""
        pair = spec.add_pair(
            geomname1=geom.name,
            geomname2=BALL,
            condim=3,
            friction=[geom.friction[0], geom.friction[0], 0.0, 0.0, 0.0],
            solref=list(geom.solref),
            solimp=list(geom.solimp),
        )
        if self.friction_steps is not None:
            pair.solreffriction = [0.0, -self.friction_steps / self.preset.dt_s]


def set_flag(option: mujoco.MjOption, name: str, on: bool) -> None:
    """Turn one of MuJoCo's flags on or off, whichever of its two sets of flags it is in."""
    enable = getattr(mujoco.mjtEnableBit, f"mjENBL_{name.upper()}", None)
    if enable is not None:
        option.enableflags = option.enableflags & ~int(enable) | (int(enable) if on else 0)
        return
    disable = int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}"))
    option.disableflags = option.disableflags & ~disable | (0 if on else disable)
