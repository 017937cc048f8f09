"""The physics settings that are compared: one knob at a time from ``default``, then combinations.

A setting is a preset and the further knobs of MuJoCo that are tried on it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import mujoco

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.compile.mjcf import BALL, build_spec
from roller_env.level import Level
from roller_env.physics.presets import MUJOCO_PRESETS, PhysicsPreset

DEFAULT: Final = MUJOCO_PRESETS["default"]
FAST: Final = MUJOCO_PRESETS["fast"]
RK4: Final = MUJOCO_PRESETS["accurate"]


@dataclass(frozen=True, slots=True)
class Setting:
    """How the game's levels are simulated."""

    name: str  # what tables and charts call it
    knob: str  # what it is about; settings of one knob form a group
    preset: PhysicsPreset = DEFAULT  # what the product can be given
    options: Mapping[str, float] = field(default_factory=dict)  # further fields of ``mjOption``
    flags: Mapping[str, bool] = field(default_factory=dict)  # that differ from the compiler's
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
        spec.option.timestep = self.preset.dt_s
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        for name, value in self.options.items():
            setattr(spec.option, name, value)
        for name, on in self.flags.items():
            set_flag(spec.option, name, on)
        for geom in [geom for geom in spec.geoms if geom.name != BALL]:
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
        pair = spec.add_pair(geomname1=geom.name, geomname2=BALL, condim=3)
        pair.friction = [geom.friction[0], geom.friction[0], 0.0, 0.0, 0.0]
        pair.solref, pair.solimp = list(geom.solref), list(geom.solimp)
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


def _rate(hz: int, preset: PhysicsPreset = DEFAULT, **others: Any) -> PhysicsPreset:
    return replace(preset, dt_s=1 / hz, **others)


_EULER: Final = {"integrator": mujoco.mjtIntegrator.mjINT_EULER}
_IMPLICIT: Final = {"integrator": mujoco.mjtIntegrator.mjINT_IMPLICIT}
_DISCRETE: Final = {"integrator": mujoco.mjtIntegrator.mjINT_DISCRETE}
_CG: Final = {"solver": mujoco.mjtSolver.mjSOL_CG}
_PGS: Final = {"solver": mujoco.mjtSolver.mjSOL_PGS}
_SPECULATIVE: Final = {"speculative": True, "midphase": True}

SETTINGS: Final[dict[str, Setting]] = {
    one.name: one
    for one in (
        *(Setting(name, "presets", preset) for name, preset in MUJOCO_PRESETS.items()),
        *(Setting(f"1/{hz}", "time step", _rate(hz)) for hz in (60, 80, 480, 960)),
        *(Setting(f"RK4 1/{hz}", "RK4", _rate(hz, RK4)) for hz in (60, 120, 240, 480)),
        Setting("Euler", "integrator", options=_EULER),
        Setting("implicit", "integrator", options=_IMPLICIT),
        Setting("discrete", "integrator", options=_DISCRETE, flags={"sleep": False}),
        Setting("pyramidal", "cone", replace(DEFAULT, cone="pyramidal")),
        Setting("impratio 10", "cone", replace(DEFAULT, impratio=10.0)),
        Setting("impratio 100", "cone", replace(DEFAULT, impratio=100.0)),
        Setting("impedance 0.99", "contacts", impedance=0.99),
        Setting("impedance 0.9999", "contacts", impedance=0.9999),
        Setting("contacts ×0.5", "contacts", stiffness=0.5),
        Setting("contacts ×0.7", "contacts", stiffness=0.7),
        Setting("contacts ×1.1", "contacts", stiffness=1.1),
        Setting("contacts of 1/120", "contacts", contacts_at_s=1 / 120),
        Setting("1/480, contacts of 1/240", "contacts", _rate(480), contacts_at_s=DEFAULT.dt_s),
        Setting("1/960, contacts of 1/240", "contacts", _rate(960), contacts_at_s=DEFAULT.dt_s),
        Setting("contact pairs", "contacts", pairs=True),
        Setting("friction ×0.55", "contacts", friction_steps=0.5),
        Setting("friction ×0.33", "contacts", friction_steps=0.3),
        Setting("solver CG", "solver", options=_CG),
        Setting("solver PGS", "solver", options=_PGS),
        Setting("PGS, 500 iterations", "solver", replace(DEFAULT, iterations=500), _PGS),
        *(Setting(f"iterations {n}", "solver", options={"iterations": n}) for n in (1, 2, 4, 8)),
        Setting("ls_iterations 5", "solver", options={"ls_iterations": 5}),
        Setting("ls_tolerance 0.1", "solver", options={"ls_tolerance": 0.1}),
        Setting("tolerance 1e-4", "solver", replace(DEFAULT, tolerance=1e-4)),
        Setting("tolerance 1e-12", "solver", replace(DEFAULT, tolerance=1e-12)),
        Setting("warmstart off", "flags", flags={"warmstart": False}),
        Setting("island on", "flags", flags={"island": True}),
        Setting("midphase on", "flags", flags={"midphase": True}),
        Setting("sleep off", "flags", flags={"sleep": False}),
        Setting("speculative on", "flags", flags={"speculative": True}),
        Setting("1/60 speculative", "combinations", _rate(60), flags=_SPECULATIVE),
        Setting("1/80 speculative", "combinations", _rate(80), flags=_SPECULATIVE),
        Setting("1/120 Newton", "combinations", _rate(120)),
        Setting("1/100 PGS", "combinations", _rate(100, FAST)),
        Setting("1/110 PGS", "combinations", _rate(110, FAST)),
        Setting("fast, 50 iterations", "combinations", replace(FAST, iterations=50)),
        Setting("1/480 contacts ×0.5", "combinations", _rate(480), stiffness=0.5),
        Setting("1/120 Euler", "combinations", _rate(120), _EULER),
        Setting("1/480 Euler", "combinations", _rate(480), _EULER),
        Setting("1/80 impedance 0.99", "combinations", _rate(80), impedance=0.99),
        Setting("RK4 1/480, 20 it.", "combinations", _rate(480, RK4, iterations=20)),
    )
}
"""By name."""

FEW: Final = ("fast", "default", "1/60", "pyramidal", "iterations 1")
"""For a quick look."""
