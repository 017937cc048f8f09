"""Each way to fail, seen: the setting that fails beside those that cure it, and what a cure costs.

``failures.csv`` has what people read of them: the ``title`` of a picture, the ``quantity`` that it
shows, which counts ``after_s`` of the ``seconds`` simulated, the largest ``acceptable`` value, its
``reason``, and the ``note`` that says why it fails.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np

from roller_env.arrays import Float64
from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.lab.game import GATE_SPEED_M_S, RADIUS_M, Course, make_level
from roller_env.lab.runner import interleaved, timed
from roller_env.lab.simulate import Path, Start, record, settled, started
from roller_env.lab.stability import contacts
from roller_env.lab.stability.contacts import EULER, SETTLE_S, TAU_S, WALL_M, ball_on_box, thrown
from roller_env.lab.stability.limits import words
from roller_env.level import Level, load_level
from roller_env.physics.materials import contact_parameters, restitution
from roller_env.physics.presets import MUJOCO_PRESETS, PhysicsPreset
from roller_env.units import quants

DEFAULT: Final = MUJOCO_PRESETS["default"]

WORDS: Final = words("failures", after_s=-1.0)

Curve = tuple[Float64, Float64]
"""Times, s, and a quantity at each."""


class Setting(NamedTuple):
    """A scene, what is different about it, and what puts fresh data to the beginning."""

    label: str
    model: mujoco.MjModel
    prepare: Start


Failure = tuple[Callable[[Path], Float64], Sequence[Setting]]
"""A quantity of a path, (S + 1,), whose greatest value tells failed from cured; and the setting
that fails, then those that cure it."""


def time_ratios(settings: Sequence[Setting], seconds: float, repeats: int) -> list[float]:
    """Return each setting's CPU time over the first's: medians of ratios of interleaved runs."""

    def run(setting: Setting) -> None:
        # A single one is too short for the clock.
        for _ in range(10):
            settled(setting.model, seconds, setting.prepare)

    turns = {one.label: partial(timed, partial(run, one), time.thread_time) for one in settings}
    first, *_ = taken = list(interleaved(turns, repeats).values())
    return [statistics.median(np.divide(own, first)) for own in taken]


def _evaluations_per_s(model: mujoco.MjModel) -> float:
    rk4 = model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    return float((4 if rk4 else 1) / model.opt.timestep)


def rows(name: str, repeats: int) -> tuple[list[dict[str, Any]], list[Curve]]:
    """Return a row for each setting of a failure, and what the quantity did where it counts.

    The case's words, the ``setting``, its ``role`` (fails or cures), ``value``, ``verdict`` (fails
    or holds) and whether that is ``good``; its time and evaluations of the forces over the first's.
    """
    case, (quantity, settings) = WORDS[name], FAILURES[name]()
    ratios = time_ratios(settings, case["seconds"], repeats)
    found: list[dict[str, Any]] = []
    curves: list[Curve] = []
    for setting, ratio in zip(settings, ratios, strict=True):
        steps = round(case["seconds"] / setting.model.opt.timestep)
        path = record(setting.model, started(setting.model, setting.prepare), steps)
        counts = path.time > case["after_s"]
        curves.append((path.time[counts], quantity(path)[counts]))
        value, role = float(curves[-1][1].max()), "cures" if found else "fails"
        verdict = "holds" if value <= case["acceptable"] else "fails"
        row = case | {"case": name, "setting": setting.label, "role": role, "value": value}
        row |= {"verdict": verdict, "good": (verdict == "fails") == (role == "fails")}
        evaluations = _evaluations_per_s(setting.model) / _evaluations_per_s(settings[0].model)
        found.append(row | {"time_ratio": ratio, "evaluations_ratio": evaluations})
    return found, curves


def seam_level(*, seams: bool) -> Level:
    """Return a lane of tiles of 64 quants, which two materials keep the compiler from merging."""
    edge, count = quants(64.0), 60
    tiles = [
        {
            "at": (index * edge, 0.0, -quants(8.0)),
            "size": (edge, 8.0, quants(16.0)),
            "material": "other" if seams and index % 2 else "default",
        }
        for index in range(-2, count)
    ]
    return make_level(boxes=tiles, materials={"other": {}}, start={"at": (0.0, 0.0, RADIUS_M)})


def gate_level(gate: dict[str, Any], **pieces: Any) -> Level:
    """Return a level with a gate, and far away the plate that opens it."""
    plate: dict[str, Any] = {"name": "plate", "opens": ["gate"], "sinks_to": -0.5}
    plate |= {"at": (-30.0, 0.0, 0.0), "size": (1.0, 1.0, 0.6)}
    return make_level(gates=[{"name": "gate"} | gate], plates=[plate], **pieces)


def hanging_gate_level(stop_m: float) -> Level:
    """Return a gate that hangs over the ground and comes down to ``stop_m`` over it.

    No shipped level has one (they sink into the ground), but the format allows it.
    """
    size = (quants(16.0), quants(128.0), 2.6)
    return gate_level({"at": (0.0, 0.0, 2.5), "size": size, "lowers_to": 1.3 + stop_m})


def _course(
    label: str, compiled: CompiledLevel, at: Sequence[float] = (0.0, 0.0, RADIUS_M), **motion: Any
) -> Setting:
    return Setting(label, compiled.model, Course(compiled, at, **motion).prepare)


def _skid(label: str, preset: PhysicsPreset, angle_deg: float = 0.0) -> Setting:
    angle = math.radians(angle_deg)
    velocity = (4.0 * math.cos(angle), 4.0 * math.sin(angle), 0.0)
    return _course(label, compile_level(make_level(), preset), velocity=velocity)


def _unlimited(compiled: CompiledLevel) -> CompiledLevel:
    """Let a level's servos pull as hard as they like; changes its model."""
    compiled.model.actuator_forcelimited[:] = 0
    return compiled


def blow_up() -> Failure:
    """Return the gate's servo, whose damper plain Euler takes from before the step."""
    gate, euler = load_level("gate"), replace(DEFAULT, integrator="Euler")
    address = int(compile_level(gate, DEFAULT).gate_qpos[0])

    def setting(label: str, preset: PhysicsPreset) -> Setting:
        compiled = _unlimited(compile_level(gate, preset))
        return _course(label, compiled, gate.start.at, movers_m_s=-GATE_SPEED_M_S)

    return lambda path: 1e3 * np.abs(path.qpos[:, address] + GATE_SPEED_M_S * path.time), (
        setting("Euler, 1/240 s", euler),
        setting("implicitfast, 1/240 s", DEFAULT),
        setting("Euler, 1/480 s", replace(euler, dt_s=1 / 480)),
    )


def tunnelling() -> Failure:
    """Return a ball that is shot through a wall."""
    dt_s, speed = 0.002, 40.0

    def setting(label: str, tau_s: float, **options: Any) -> Setting:
        model = ball_on_box(EULER, dt_s, solref=(tau_s, 1.0), thickness=WALL_M, **options)
        return Setting(label, model, thrown(10.2 * speed * dt_s, -speed))

    return lambda path: -1e3 * path.qpos[:, 2], (
        setting("tau = 20 ms", TAU_S),
        setting("tau = 20 ms, speculative contacts", TAU_S, enableflags=contacts.SPECULATIVE),
        setting("tau = 5 ms", 0.005),
    )


def bent_heading() -> Failure:
    """Return a skid that the pyramidal cone bends."""
    angle_deg = 22.5
    return lambda path: np.abs(np.degrees(np.arctan2(*path.qvel[:, 1::-1].T)) - angle_deg), (
        _skid("pyramidal cone", replace(DEFAULT, cone="pyramidal"), angle_deg),
        _skid("elliptic cone", DEFAULT, angle_deg),
    )


def restitution_gain() -> Failure:
    """Return a bouncy contact that gives back more than it got."""
    ratio, drop, fast, gravity = 0.1, 0.24, MUJOCO_PRESETS["fast"], contacts.GRAVITY
    direct = contact_parameters(0.3, restitution(ratio), fast)

    def setting(label: str, **contact: Any) -> Setting:
        model = ball_on_box(EULER, fast.dt_s, gravity=gravity, **contact)
        return Setting(label, model, thrown(drop))

    def energy(path: Path) -> Float64:
        height = path.qpos[:, 2] + path.qvel[:, 2] ** 2 / (2.0 * gravity)
        return np.asarray(np.maximum(height, 1e-4) / drop)

    said = "direct form of the same bounce: ({:.0f}, {:.0f})".format(*direct.solref)
    return energy, (
        setting("solref = (0.02, 0.1)", solref=(TAU_S, ratio)),
        setting(said, solref=direct.solref, impedance=direct.solimp[0]),
    )


def seam_bump() -> Failure:
    """Return a ball that rolls over tiles, and over the box into which the compiler merges them."""
    speed = 5.0

    def setting(label: str, *, seams: bool) -> Setting:
        compiled = compile_level(seam_level(seams=seams), DEFAULT)
        spin = (0.0, speed / RADIUS_M, 0.0)
        return _course(label, compiled, velocity=(speed, 0.0, 0.0), spin=spin)

    def bump(path: Path) -> Float64:
        rest = np.median(path.qpos[path.time > SETTLE_S, 2])
        return np.asarray(1e3 * (path.qpos[:, 2] - rest))

    return bump, (
        setting("tiles with seams", seams=True),
        setting("merged into one box", seams=False),
    )


def crush() -> Failure:
    """Return the ball under a gate that comes down."""
    level = hanging_gate_level(0.0)
    limited, unlimited = compile_level(level, DEFAULT), _unlimited(compile_level(level, DEFAULT))
    address = int(limited.gate_qpos[0])
    return lambda path: 100.0 * (1.0 - (path.qpos[:, address] + 1.2) / (2.0 * RADIUS_M)), (
        _course("servo without limit", unlimited, movers_m_s=-GATE_SPEED_M_S),
        _course("the game's servo, at most 10 kN", limited, movers_m_s=-GATE_SPEED_M_S),
    )


def hop() -> Failure:
    """Return a skidding ball that hops; B h is the share of the slip that one step removes."""
    default = _skid("default, 1/240 s", DEFAULT)
    soft = contacts.soft_friction_model(DEFAULT, 0.3)
    return lambda path: 1e3 * (path.qpos[:, 2] - RADIUS_M), (
        default,
        Setting("friction's own damper, B h = 0.3", soft, default.prepare),
        _skid("RK4, 1/240 s", replace(DEFAULT, integrator="RK4")),
        _skid("accurate: RK4, 1/960 s", MUJOCO_PRESETS["accurate"]),
    )


FAILURES: Final[dict[str, Callable[[], Failure]]] = {
    make.__name__: make
    for make in (blow_up, tunnelling, bent_heading, restitution_gain, seam_bump, crush, hop)
}
"""By name."""
