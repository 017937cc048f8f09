"""The settings that are compared: one knob at a time from ``default``, then combinations."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from roller_env.lab.presets.setting import Setting
from roller_env.physics.presets import PRESETS, PhysicsPreset

DEFAULT: Final = PRESETS["default"]
FAST: Final = PRESETS["fast"]
RK4: Final = PRESETS["accurate"]


def _rate(hz: int, preset: PhysicsPreset = DEFAULT) -> PhysicsPreset:
    return replace(preset, dt_s=1 / hz)


def _integrator(name: str) -> Setting:
    return Setting(name, "integrator", options=(("integrator", name),))


def _option(knob: str, name: str, value: float | str) -> Setting:
    return Setting(f"{name} {value}", knob, options=((name, value),))


def _flag(name: str, on: bool) -> Setting:
    return Setting(f"{name} {'on' if on else 'off'}", "flags", flags=((name, on),))


_FAST_CONTACTS: Final = 1 / 120
_PGS: Final = (("solver", "PGS"),)
_DISCRETE: Final = (("integrator", "discrete"),)
_MANY: Final = replace(DEFAULT, iterations=500)
_SPECULATIVE: Final = (("speculative", True), ("midphase", True))

SETTINGS: Final[dict[str, Setting]] = {
    one.name: one
    for one in (
        *(Setting(name, "presets", preset) for name, preset in PRESETS.items()),
        *(Setting(f"1/{hz}", "time step", _rate(hz)) for hz in (60, 80, 480, 960)),
        *(Setting(f"RK4 1/{hz}", "RK4", _rate(hz, RK4)) for hz in (60, 120, 240, 480)),
        *(_integrator(name) for name in ("Euler", "implicit")),
        Setting("discrete", "integrator", options=_DISCRETE, flags=(("sleep", False),)),
        Setting("pyramidal", "cone", replace(DEFAULT, cone="pyramidal")),
        Setting("impratio 10", "cone", replace(DEFAULT, impratio=10.0)),
        Setting("impratio 100", "cone", replace(DEFAULT, impratio=100.0)),
        Setting("impedance 0.99", "contacts", impedance=0.99),
        Setting("impedance 0.9999", "contacts", impedance=0.9999),
        Setting("contacts ×0.5", "contacts", stiffness=0.5),
        Setting("contacts ×0.7", "contacts", stiffness=0.7),
        Setting("contacts ×1.1", "contacts", stiffness=1.1),
        Setting("contacts of 1/120", "contacts", contacts_at_s=_FAST_CONTACTS),
        Setting("1/480, contacts of 1/240", "contacts", _rate(480), contacts_at_s=DEFAULT.dt_s),
        Setting("1/960, contacts of 1/240", "contacts", _rate(960), contacts_at_s=DEFAULT.dt_s),
        Setting("contact pairs", "contacts", pairs=True),
        Setting("friction ×0.55", "contacts", friction_steps=0.5),
        Setting("friction ×0.33", "contacts", friction_steps=0.3),
        _option("solver", "solver", "CG"),
        _option("solver", "solver", "PGS"),
        Setting("PGS, 500 iterations", "solver", _MANY, _PGS),
        *(_option("solver", "iterations", count) for count in (1, 2, 4, 8)),
        _option("solver", "ls_iterations", 5),
        _option("solver", "ls_tolerance", 0.1),
        Setting("tolerance 1e-4", "solver", replace(DEFAULT, tolerance=1e-4)),
        Setting("tolerance 1e-12", "solver", replace(DEFAULT, tolerance=1e-12)),
        _flag("warmstart", False),
        _flag("island", True),
        _flag("midphase", True),
        _flag("sleep", False),
        _flag("speculative", True),
        Setting("1/60 speculative", "combinations", _rate(60), flags=_SPECULATIVE),
        Setting("1/80 speculative", "combinations", _rate(80), flags=_SPECULATIVE),
        Setting("1/120 Newton", "combinations", _rate(120)),
        Setting("1/100 PGS", "combinations", _rate(100, FAST)),
        Setting("1/110 PGS", "combinations", _rate(110, FAST)),
        Setting("fast, 50 iterations", "combinations", replace(FAST, iterations=50)),
        Setting("1/480 contacts ×0.5", "combinations", _rate(480), stiffness=0.5),
        Setting("1/120 Euler", "combinations", _rate(120), options=(("integrator", "Euler"),)),
        Setting("1/480 Euler", "combinations", _rate(480), options=(("integrator", "Euler"),)),
        Setting("1/80 impedance 0.99", "combinations", _rate(80), impedance=0.99),
        Setting("RK4 1/480, 20 it.", "combinations", _rate(480, replace(RK4, iterations=20))),
    )
}
"""By name."""

FEW: Final = ("fast", "default", "1/60", "pyramidal", "iterations 1")
"""For a quick look."""
