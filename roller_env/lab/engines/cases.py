"""What each preset makes of motions whose rigid answer is known, and in which domain.

The rigid ball: Newton's restitution along the normal, Coulomb's friction along the surface with
tangential restitution 0, no softness. A case is run from so many starts that differ by parts of a
step, since a soft contact's answer depends on when in a step the ball arrives.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from roller_env.arrays import Float64
from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.engines.thrown import Thrown
from roller_env.lab.game import DECK_M, GRAVITY_M_S2, GROUND, RADIUS_M, TUBE_FALL_M, make_level
from roller_env.lab.stability.failures import hanging_gate_level, seam_level
from roller_env.level import Level
from roller_env.physics.presets import PhysicsPreset

STARTS: Final = 32
"""Of each case: arrivals at as many moments of a step."""

Reading = Callable[[PhysicsPreset], Float64]


@dataclass(frozen=True, slots=True)
class Case:
    """A motion, and what is read of it.

    Attributes:
        name: what tables call it.
        unit: of the reading; empty for a ratio.
        exact: what the rigid ball does.
        read: returns the reading of each start under a preset.
        kind: the group it stands in.
    """

    name: str
    unit: str
    exact: float
    read: Reading
    kind: str


def _level(friction: float = 0.3, elasticity: float = 0.0, **pieces: Any) -> Level:
    ball = {"friction": friction, "elasticity": elasticity} | pieces.pop("ball", {})
    return make_level(ball=ball, **pieces)


def _parts() -> Float64:
    """Return where in a step each start arrives, as its share."""
    return (np.arange(STARTS) + 0.5) / STARTS


def _run(balls: Thrown, seconds: float) -> Thrown:
    for _ in range(round(seconds / balls.step_s)):
        balls.step()
    return balls


# --- motions in closed form -------------------------------------------------------------------


def _rolling(preset: PhysicsPreset) -> Float64:
    """Push a resting ball for 5 s: it goes 5/7 of what it would without its spin."""
    balls = Thrown(_level(), preset, 1, preset.dt_s).put((-150.0, 0.0, RADIUS_M))
    balls.bodies.force_n[:, 0] = KEY_FORCE_N
    way = _run(balls, 5.0).bodies.position[:, 0] + 150.0
    return np.abs(way - 0.5 * KEY_FORCE_N / 1.4 * 5.0**2)


def _slope(preset: PhysicsPreset, degrees: float) -> Float64:
    """Let a ball roll, or slide, down a slope for 2 s."""
    angle = math.radians(degrees)
    normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
    box = {"at": tuple(-2.0 * normal), "size": (90.0, 90.0, 4.0), "pitch_deg": degrees}
    at = tuple(RADIUS_M * normal)
    level = make_level(boxes=[box], start={"at": at})
    balls = Thrown(level, preset, 1, preset.dt_s).put(at)
    _run(balls, 2.0)
    rolls = 5.0 / 7.0 * GRAVITY_M_S2 * math.sin(angle)
    slides = GRAVITY_M_S2 * (math.sin(angle) - 0.3 * math.cos(angle))
    along = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    way = (balls.bodies.position - RADIUS_M * normal) @ along
    return np.asarray(np.abs(way - 0.5 * max(rolls, slides) * 2.0**2))


def _skid_way(preset: PhysicsPreset, speed: float) -> Float64:
    """Let a ball slide without spin until it rolls, 2 s in all."""
    balls = Thrown(_level(), preset, 1, preset.dt_s).put((0.0, 0.0, RADIUS_M), (speed, 0.0, 0.0))
    end = 2.0 * speed / (7.0 * 0.3 * GRAVITY_M_S2)
    way = speed * end - 0.5 * 0.3 * GRAVITY_M_S2 * end**2 + 5.0 / 7.0 * speed * (2.0 - end)
    return np.abs(_run(balls, 2.0).bodies.position[:, 0] - way)


def _along_a_wall(preset: PhysicsPreset) -> Float64:
    """Press a resting ball into a wall and along it for 1 s: it rolls on both, F / 1.8 m."""
    wall = {"at": (0.0, 1.0 + RADIUS_M, 2.0), "size": (90.0, 2.0, 8.0)}
    level = _level(friction=3.0, boxes=[dict(GROUND), wall])
    balls = Thrown(level, preset, 1, preset.dt_s).put((0.0, 0.0, RADIUS_M))
    balls.bodies.force_n[:, :2] = KEY_FORCE_N
    return np.abs(_run(balls, 1.0).bodies.position[:, 0] - 0.5 * KEY_FORCE_N / 1.8)


def _landing(preset: PhysicsPreset) -> Float64:
    """Let a ball fall 46 m with 1 m/s along x, and roll on: 6 s in all."""
    balls = Thrown(_level(), preset, STARTS, preset.dt_s)
    more = math.sqrt(2.0 * GRAVITY_M_S2 * 46.0) * preset.dt_s * _parts()
    balls.put((0.0, 0.0, RADIUS_M + 46.0), (1.0, 0.0, 0.0)).bodies.position[:, 2] += more
    fall = np.sqrt(2.0 * (46.0 + more) / GRAVITY_M_S2)
    way = _run(balls, 6.0).bodies.position[:, 0]
    return np.abs(way - (fall + 5.0 / 7.0 * (6.0 - fall)))


# --- impacts ----------------------------------------------------------------------------------


def _arriving(
    preset: PhysicsPreset, velocity: tuple[float, float], elasticity: float, friction: float = 0.3
) -> Thrown:
    """Return balls without spin that are about to arrive on flat ground with a velocity."""
    along, down = velocity
    level = _level(friction, elasticity)
    balls = Thrown(level, preset, STARTS, preset.dt_s)
    gap = -down * preset.dt_s * _parts()
    balls.put((0.0, 0.0, RADIUS_M), (along, 0.0, 0.0)).bodies.position[:, 2] += gap
    balls.bodies.velocity[:, 2] = -np.sqrt(np.maximum(down**2 - 2.0 * GRAVITY_M_S2 * gap, 0.0))
    return balls


def _leaves(balls: Thrown, seconds: float) -> Float64:
    """Return the upward speeds at which balls leave the ground, m/s."""
    highest = np.full(len(balls.bodies.position), -np.inf)
    turned = np.zeros(len(highest), dtype=np.bool_)
    for _ in range(round(seconds / balls.step_s)):
        balls.step()
        turned |= balls.bodies.velocity[:, 2] >= 0.0
        highest = np.where(turned, np.maximum(highest, balls.rise()), highest)
    # The rigid engine keeps contacts half a nanometre open.
    height: Float64 = np.maximum(highest - RADIUS_M - 1e-9, 0.0)
    return np.sqrt(2.0 * GRAVITY_M_S2 * height)


def _dropped(preset: PhysicsPreset, elasticity: float, height: float) -> Float64:
    """Drop balls, and return which share of their speed they keep."""
    down = math.sqrt(2.0 * GRAVITY_M_S2 * height)
    balls = _arriving(preset, (0.0, -down), elasticity)
    return _leaves(balls, 0.06 + 2.0 * elasticity * down / GRAVITY_M_S2) / down


def _thrown_up(preset: PhysicsPreset, velocity: tuple[float, float], elasticity: float) -> Float64:
    return _leaves(_arriving(preset, velocity, elasticity), 0.1)


def _thrown_along(
    preset: PhysicsPreset, velocity: tuple[float, float], elasticity: float, spin: bool = False
) -> Float64:
    """Throw balls, and return the speed along the ground, or the rim's, after the impact."""
    balls = _run(_arriving(preset, velocity, elasticity), 0.05)
    return balls.angular_velocity()[:, 1] * RADIUS_M if spin else balls.bodies.velocity[:, 0].copy()


def _into_a_wall(preset: PhysicsPreset, friction: float, speed: float = 4.0) -> Float64:
    """Roll into a wall, and return the upward speed that it gives."""
    wall = {"at": (3.0, 0.0, 2.0), "size": (2.0, 90.0, 8.0), "material": "wall"}
    materials = {"wall": {"friction": friction / 0.3}}
    level = _level(boxes=[dict(GROUND), wall], materials=materials)
    balls = Thrown(level, preset, STARTS, preset.dt_s)
    balls.roll((2.0 - RADIUS_M - 0.2, 0.0, RADIUS_M), speed)
    balls.bodies.position[:, 0] += speed * preset.dt_s * _parts()
    return _leaves(balls, 0.4)


# --- friction ---------------------------------------------------------------------------------

_ENDED: Final = 0.01
"""Share of a skid's speed below which it counts as ended."""


def _skid_time(preset: PhysicsPreset, friction: float, speed: float = 4.0) -> Float64:
    """Return how long a skid lasts, over 2 v / 7 mu g."""
    balls = Thrown(_level(friction), preset, 1, preset.dt_s)
    balls.put((0.0, 0.0, RADIUS_M), (speed, 0.0, 0.0))
    slips = [speed]
    while slips[-1] > _ENDED * speed and len(slips) * balls.step_s < 5.0:
        balls.step()
        spin = balls.angular_velocity()[0, 1]
        slips.append(float(balls.bodies.velocity[0, 0] - RADIUS_M * spin))
    # In the step in which it ends the slip falls as in the one before, if it did there.
    rate = slips[-3] - slips[-2] if slips[-3] > slips[-2] else slips[-2] - slips[-1]
    steps = len(slips) - 2 + min((slips[-2] - _ENDED * speed) / rate, 1.0)
    exact = (1.0 - _ENDED) * 2.0 * speed / (7.0 * friction * GRAVITY_M_S2)
    return np.array([steps * balls.step_s / exact])


def _hop(preset: PhysicsPreset, friction: float, speed: float = 4.0) -> Float64:
    """Return how high a skid lifts the ball, metres."""
    balls = Thrown(_level(friction), preset, 1, preset.dt_s)
    balls.put((0.0, 0.0, RADIUS_M), (speed, 0.0, 0.0))
    return _highest(balls, 1.0)


def _light(preset: PhysicsPreset, mass_kg: float) -> Float64:
    """Hold W for 3 s on flat ground, and return how high the ball rises, metres."""
    level = _level(ball={"mass_kg": mass_kg})
    balls = Thrown(level, preset, 1, preset.dt_s).put((-150.0, 0.0, RADIUS_M))
    balls.bodies.force_n[:, 0] = KEY_FORCE_N
    return _highest(balls, 3.0)


def _highest(balls: Thrown, seconds: float) -> Float64:
    highest = balls.bodies.position[:, 2].copy()
    for _ in range(round(seconds / balls.step_s)):
        balls.step()
        highest = np.maximum(highest, balls.bodies.position[:, 2])
    return np.maximum(highest - RADIUS_M - 1e-9, 0.0)


# --- hard cases -------------------------------------------------------------------------------


def _seams(preset: PhysicsPreset) -> Float64:
    """Roll over 49 seams that cannot be merged, at 7.5 to 15 m/s, and return the highest bumps."""
    balls = Thrown(seam_level(seams=True), preset, STARTS, preset.dt_s)
    balls.roll((0.0, 0.0, RADIUS_M), np.linspace(7.5, 15.0, STARTS))
    _run(balls, 0.3)
    rests = balls.bodies.position[:, 2] - RADIUS_M
    return _highest(balls, 5.0) - np.minimum(rests, 0.0)


def _fastest_stopped(preset: PhysicsPreset, thickness: float) -> Float64:
    """Return the lowest of 64 speeds, 20 to 1,000 m/s, at which a deck lets balls fall through."""
    deck = {"at": (0.0, 0.0, -thickness / 2.0), "size": (90.0, 90.0, thickness)}
    level = make_level(boxes=[deck], start={"at": (0.0, 0.0, RADIUS_M)}, kill_height=-4000.0)
    speeds = np.geomspace(20.0, 1000.0, 64)
    passed = np.zeros(len(speeds), dtype=np.bool_)
    for part in _parts()[::4]:
        balls = Thrown(level, preset, len(speeds), preset.dt_s)
        balls.put((0.0, 0.0, RADIUS_M + 0.5))
        balls.bodies.position[:, 2] += speeds * preset.dt_s * part
        balls.bodies.velocity[:, 2] = -speeds
        _run(balls, 0.2)
        passed |= balls.bodies.position[:, 2] < -thickness
    return np.array([speeds[passed].min() if passed.any() else np.inf])


def _depth(preset: PhysicsPreset, height: float) -> Float64:
    """Let balls fall onto ground, and return how deep they get, metres."""
    balls = Thrown(_level(), preset, STARTS, preset.dt_s).put((0.0, 0.0, RADIUS_M + height))
    down = math.sqrt(2.0 * GRAVITY_M_S2 * height)
    balls.bodies.position[:, 2] += down * preset.dt_s * _parts()
    deepest = np.zeros(STARTS)
    for _ in range(round((down / GRAVITY_M_S2 + 0.2) / balls.step_s)):
        balls.step()
        deepest = np.maximum(deepest, RADIUS_M - balls.bodies.position[:, 2])
    return deepest


def _under_a_gate(preset: PhysicsPreset) -> Float64:
    """Let a gate come down on balls, and return how deep they are in it or the ground, metres."""
    level = hanging_gate_level(0.0)
    balls = Thrown(level, preset, STARTS, preset.dt_s).put((0.0, 0.0, RADIUS_M))
    balls.bodies.position[:, 0] += np.linspace(0.0, 0.15, STARTS)
    gate = level.gates[0]
    balls.bodies.pull[:] = [-gate.speed if slab == 1 else 0.0 for slab in range(2)]
    lower = gate.at[2] - gate.size[2] / 2.0
    deepest = np.zeros(STARTS)
    for _ in range(round(2.5 / balls.step_s)):
        balls.step()
        place, bodies = balls.bodies.position, balls.bodies
        under = np.abs(place[:, 0]) <= gate.size[0] / 2.0
        room = lower + bodies.displacement[:, 1] - place[:, 2]
        squeezed = np.where(under & (place[:, 2] < 1.0), RADIUS_M - room, 0.0)
        deepest = np.maximum(deepest, np.maximum(squeezed, RADIUS_M - place[:, 2]))
    return deepest


def _corner(preset: PhysicsPreset) -> Float64:
    """Throw balls at 15 m/s at the corner of a box, and return the energy gained, as metres."""
    box = {"at": (0.0, 0.0, 1.0), "size": (2.0, 2.0, 2.0)}
    balls = Thrown(make_level(boxes=[dict(GROUND), box]), preset, STARTS, preset.dt_s)
    angle = np.radians(np.linspace(0.0, 90.0, STARTS))
    way = np.stack([np.cos(angle), np.sin(angle), np.full(STARTS, 1.5)], axis=1)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    balls.put(np.array([1.0, 1.0, 2.0]) + 2.0 * way, -15.0 * way)
    before, most = balls.energy(), np.full(STARTS, -np.inf)
    for _ in range(round(1.0 / balls.step_s)):
        balls.step()
        most = np.maximum(most, balls.energy())
    # Sinking into the soft ground gives height back as speed: never more than this says.
    return np.asarray((most - before) / GRAVITY_M_S2)


def _v_groove(preset: PhysicsPreset, degrees: float = 45.0) -> Float64:
    """Roll along a V for 2 s, pushed by 1 N: about the line through both contacts."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    sides = [
        {"at": (side * s, 0.0, -c), "size": (90.0, 500.0, 2.0), "pitch_deg": -side * degrees}
        for side in (1.0, -1.0)
    ]
    level = make_level(boxes=sides, start={"at": (0.0, 0.0, RADIUS_M / c)})
    balls = Thrown(level, preset, 1, preset.dt_s).put((0.0, 0.0, RADIUS_M / c))
    balls.bodies.force_n[:, 1] = 1.0
    way = 0.5 / (1.0 + 0.4 / c**2) * 2.0**2
    return np.abs(_run(balls, 2.0).bodies.position[:, 1] - way)


_WAY: Final = "Motions in closed form: how far from it, m"
_IMPACT: Final = "Impacts"
_FRICTION: Final = "Friction"
_HARD: Final = "Hard cases"

CASES: Final = (
    Case("rolls for 5 s under a key", "m", 0.0, _rolling, _WAY),
    Case("rolls down 20° for 2 s", "m", 0.0, partial(_slope, degrees=20.0), _WAY),
    Case("slides down 50° for 2 s", "m", 0.0, partial(_slope, degrees=50.0), _WAY),
    Case("skids at 4 m/s, then rolls, 2 s", "m", 0.0, partial(_skid_way, speed=4.0), _WAY),
    Case("rolls along a wall, pressed to it, 1 s", "m", 0.0, _along_a_wall, _WAY),
    Case("rolls in a V of 45° for 2 s", "m", 0.0, _v_groove, _WAY),
    Case("falls 46 m at 1 m/s along, rolls on, 6 s", "m", 0.0, _landing, _WAY),
    *(
        Case(
            f"elasticity {e:g}, dropped {height:g} m: share of the speed kept",
            "",
            e,
            partial(_dropped, elasticity=e, height=height),
            _IMPACT,
        )
        for e, height in ((0.0, 1.0), (0.2, 0.1), (0.2, 1.0), (0.5, 1.0), (0.8, 1.0), (0.95, 1.0))
    ),
    Case(
        "elasticity 0, arriving at (4, -1): speed up",
        "m/s",
        0.0,
        partial(_thrown_up, velocity=(4.0, -1.0), elasticity=0.0),
        _IMPACT,
    ),
    Case(
        "elasticity 0, arriving at (8, -2): speed up",
        "m/s",
        0.0,
        partial(_thrown_up, velocity=(8.0, -2.0), elasticity=0.0),
        _IMPACT,
    ),
    Case(
        "elasticity 0.8, arriving at (8, -2): speed up",
        "m/s",
        1.6,
        partial(_thrown_up, velocity=(8.0, -2.0), elasticity=0.8),
        _IMPACT,
    ),
    Case(
        "elasticity 0.8, arriving at (4, -4): speed along",
        "m/s",
        20.0 / 7.0,
        partial(_thrown_along, velocity=(4.0, -4.0), elasticity=0.8),
        _IMPACT,
    ),
    Case(
        "elasticity 0.8, arriving at (4, -4): speed of the rim",
        "m/s",
        20.0 / 7.0,
        partial(_thrown_along, velocity=(4.0, -4.0), elasticity=0.8, spin=True),
        _IMPACT,
    ),
    Case(
        "rolls at 4 m/s into a wall without friction: speed up",
        "m/s",
        0.0,
        partial(_into_a_wall, friction=0.0),
        _IMPACT,
    ),
    Case(
        "rolls at 4 m/s into a wall of friction 0.3: speed up",
        "m/s",
        8.0 / 7.0,
        partial(_into_a_wall, friction=0.3),
        _IMPACT,
    ),
    *(
        Case(
            f"skid at 4 m/s, friction {mu:g}: its time over 2 v / 7 mu g",
            "",
            1.0,
            partial(_skid_time, friction=mu),
            _FRICTION,
        )
        for mu in (0.3, 0.6, 1.0, 2.0)
    ),
    Case("skid at 4 m/s, friction 0.3: rises", "m", 0.0, partial(_hop, friction=0.3), _FRICTION),
    Case("W for 3 s, ball of 1 kg: rises", "m", 0.0, partial(_light, mass_kg=1.0), _FRICTION),
    Case("W for 3 s, ball of 0.1 kg: rises", "m", 0.0, partial(_light, mass_kg=0.1), _FRICTION),
    Case("49 seams that cannot be merged, 7.5 to 15 m/s: bump", "m", 0.0, _seams, _HARD),
    Case(
        f"falls through a deck of {DECK_M:.2g} m from",
        "m/s",
        math.inf,
        partial(_fastest_stopped, thickness=DECK_M),
        _HARD,
    ),
    Case(
        "falls through a deck of 1 mm from",
        "m/s",
        math.inf,
        partial(_fastest_stopped, thickness=1e-3),
        _HARD,
    ),
    Case("falls 46.9 m: depth", "m", 0.0, partial(_depth, height=TUBE_FALL_M), _HARD),
    Case("a gate comes down on the ball: depth", "m", 0.0, _under_a_gate, _HARD),
    Case("thrown at 15 m/s at a corner: energy gained, as height", "m", 0.0, _corner, _HARD),
)
"""What is measured under every preset, in the order of the tables."""


def readings(case: Case, preset: PhysicsPreset) -> tuple[float, float]:
    """Return the lowest and the highest reading of all starts."""
    values = case.read(preset)
    return float(values.min()), float(values.max())
