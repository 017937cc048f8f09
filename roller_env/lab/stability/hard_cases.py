"""The hardest things that the game's own pieces can do to the ball, under every preset.

``hard_cases.csv`` has the requirements, with their reasons, which come from the game: the ball must
not leave the level through a floor, nothing may give it energy, and what a player sees must look
like contact. A value is the worst of all starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from pandas import read_csv

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab import game
from roller_env.lab.game import GATE_SPEED_M_S, RADIUS_M, Course, Run
from roller_env.lab.stability.failures import gate_level, hanging_gate_level, seam_level
from roller_env.lab.stability.limits import Effort
from roller_env.level import load_level
from roller_env.physics.presets import MUJOCO_PRESETS, PhysicsPreset
from roller_env.units import quants

REQUIREMENTS: Final = read_csv(Path(__file__).with_suffix(".csv")).fillna({"note": ""})
"""``case``, ``quantity``, ``limit`` (the largest acceptable value), its ``reason``, and a ``note``
where a preset does not keep to it."""

FULL_SPEED_M_S: Final = 15.0
"""Two keys held over the classic's start deck of 22 m: sqrt(2 · 5.08 sqrt 2 / 1.4 · 22)."""

HOP_SPEEDS_M_S: Final = (1.0, 2.0, 4.0, 8.0)

Starts = Iterator[tuple[Course, float]]
"""Courses, and how many seconds each is simulated."""


def gate_closing_on_the_ball(preset: PhysicsPreset, starts: int) -> Starts:
    """Let a hanging gate come down on the ball until it is shut."""
    compiled = compile_level(hanging_gate_level(0.0), preset)
    for x in np.linspace(0.0, 0.5, starts):
        yield Course(compiled, (x, 0.0, RADIUS_M), movers_m_s=-GATE_SPEED_M_S), 2.5


def riding_a_sinking_gate(preset: PhysicsPreset, starts: int) -> Starts:
    """Put the ball on a gate that sinks into the deck."""
    compiled = compile_level(load_level("gate"), preset)
    gate = compiled.level.gates[0]
    top = gate.at[2] + gate.size[2] / 2 + RADIUS_M
    for x in np.linspace(0.0, gate.size[0] / 2, starts):
        yield Course(compiled, (gate.at[0] + x, 0.3, top), movers_m_s=-GATE_SPEED_M_S), 4.0


def pressed_to_a_sinking_gate(preset: PhysicsPreset, starts: int) -> Starts:
    """Press the ball with a key to a gate that sinks, and over it when it is open."""
    compiled = compile_level(load_level("gate"), preset)
    gate = compiled.level.gates[0]
    face, floor = gate.at[0] - gate.size[0] / 2 - RADIUS_M, compiled.level.start.at[2]
    press = (KEY_FORCE_N, 0.0, 0.0)
    for y in np.linspace(0.0, 1.2, starts):
        at = (face, y, floor)
        yield Course(compiled, at, force_n=press, movers_m_s=-GATE_SPEED_M_S), 3.0


def wedged_between_gate_and_wall(preset: PhysicsPreset, starts: int) -> Starts:
    """Drive the ball by a key and its speed between a slanting gate and a wall."""
    wall = {"start": (-3.0, -1.2), "end": (6.0, -1.2), "bottom": 0.0, "height": 3.0}
    gate = {"at": (0.0, 0.0, 1.0), "size": (6.0, 0.4, 4.0), "lowers_to": -2.0}
    motion: dict[str, Any] = {"force_n": (-KEY_FORCE_N, 0, 0), "movers_m_s": -GATE_SPEED_M_S}
    at = (2.6, -1.09 + RADIUS_M, RADIUS_M)
    for yaw in (10.0, 25.0, 45.0):
        compiled = compile_level(gate_level(gate | {"yaw_deg": yaw}, walls=[wall]), preset)
        for speed in np.linspace(1.0, FULL_SPEED_M_S, max(2, starts // 3)):
            yield Course(compiled, at, (-speed, 0.0, 0.0), **motion), 2.5


def plate_sinking_under_the_ball(preset: PhysicsPreset, starts: int) -> Starts:
    """Put the ball on a sinking plate, from its middle to over the slot at its corner."""
    compiled = compile_level(load_level("gate"), preset)
    plate = compiled.level.plates[0]
    top = np.add(plate.at, (0.0, 0.0, plate.size[2] / 2 + RADIUS_M + 0.001))
    corner = np.array([plate.size[0] / 2, plate.size[1] / 2, 0.0])
    for share in np.linspace(0.0, 1.0, starts):
        yield Course(compiled, tuple(top + share * corner), movers_m_s=-game.PLATE_SPEED_M_S), 4.0


def landing_from_the_tube(preset: PhysicsPreset, starts: int) -> Starts:
    """Let the ball fall 46.9 m onto a deck of 16 quants."""
    deck = {"at": (0.0, 0.0, -game.DECK_M / 2), "size": (50.0, 50.0, game.DECK_M)}
    level = game.make_level(boxes=[deck], start={"at": (0.0, 0.0, RADIUS_M)})
    compiled = compile_level(level, preset)
    for more in np.linspace(0.0, 0.3, starts):
        yield Course(compiled, (0.0, 0.0, RADIUS_M + game.TUBE_FALL_M + more)), 4.0


def _rolling(compiled: CompiledLevel, x: float, height: float, speed: float) -> Course:
    spin = (0.0, speed / RADIUS_M, 0.0)
    return Course(compiled, (x, 0.0, height), velocity=(speed, 0.0, 0.0), spin=spin)


def tile_seams_at_full_speed(preset: PhysicsPreset, starts: int) -> Starts:
    """Roll from the classic level's bridge, over two seams onto the island, at 3 to 15 m/s."""
    compiled = compile_level(load_level("classic"), preset)
    begin, way, height = quants(660.0), quants(440.0), compiled.level.start.at[2]
    for speed in np.linspace(3.0, FULL_SPEED_M_S, 5):
        # The same speed from starts that are a whole step's way apart.
        for share in np.linspace(0.0, 1.0, starts, endpoint=False):
            x = begin + speed * share * preset.dt_s
            yield _rolling(compiled, x, height, speed), way / speed


def lane_of_seams(preset: PhysicsPreset, starts: int) -> Starts:
    """Roll over 49 seams in a row that cannot be merged, at 7.5 to 15 m/s."""
    compiled = compile_level(seam_level(seams=True), preset)
    for speed in np.linspace(FULL_SPEED_M_S / 2, FULL_SPEED_M_S, starts):
        yield _rolling(compiled, 0.0, RADIUS_M, speed), 80.0 / speed


def box_corner_at_full_speed(preset: PhysicsPreset, starts: int) -> Starts:
    """Throw the ball at 15 m/s by turns along the ground at an edge and from above at a corner."""
    box = {"at": (0.0, 0.0, 1.0), "size": (2.0, 2.0, 2.0)}
    compiled = compile_level(game.make_level(boxes=[dict(game.GROUND), box]), preset)
    for index, angle in enumerate(np.radians(np.linspace(0.0, 90.0, starts))):
        falls = index % 2 == 1
        way = np.array([math.cos(angle), math.sin(angle), 1.5 if falls else 0.0])
        way /= np.linalg.norm(way)
        at = np.array([1.0, 1.0, 2.0 if falls else RADIUS_M]) + 2.0 * way
        yield Course(compiled, tuple(at), tuple(-FULL_SPEED_M_S * way)), 1.0


def skidding(preset: PhysicsPreset, _starts: int) -> Starts:
    """Let the ball slide without spin; it hops while friction spins it."""
    compiled = compile_level(game.make_level(), preset)
    for speed in HOP_SPEEDS_M_S:
        yield Course(compiled, (0.0, 0.0, RADIUS_M), velocity=(speed, 0.0, 0.0)), 1.0


def spinning_on_the_spot(preset: PhysicsPreset, _starts: int) -> Starts:
    """Spin the ball about the vertical at 20 rad/s for 10 s."""
    compiled = compile_level(game.make_level(), preset)
    yield Course(compiled, (0.0, 0.0, RADIUS_M), spin=(0.0, 0.0, 20.0)), 10.0


HARD_CASES: Final[dict[str, Callable[[PhysicsPreset, int], Starts]]] = {
    make.__name__: make
    for make in (
        gate_closing_on_the_ball,
        riding_a_sinking_gate,
        pressed_to_a_sinking_gate,
        wedged_between_gate_and_wall,
        plate_sinking_under_the_ball,
        landing_from_the_tube,
        tile_seams_at_full_speed,
        lane_of_seams,
        box_corner_at_full_speed,
        skidding,
        spinning_on_the_spot,
    )
}
"""Each case's simulations, from so many starts; by name."""


def _bump_mm(run: Run) -> float:
    # What the ball sinks into the floor at the start is no bump.
    height = run.position[len(run.position) // 4 :, 2]
    return float(1e3 * (height.max() - np.median(height)))


def _wrong_roll_percent(runs: Sequence[Run]) -> float:
    ends = [float(run.speed[-1]) for run in runs[:3]]
    wrong = [abs(v / (5.0 / 7.0 * v0) - 1.0) for v, v0 in zip(ends, HOP_SPEEDS_M_S, strict=False)]
    return 100.0 * max(wrong)


READERS: Final[dict[str, Callable[[Sequence[Run]], float]]] = {
    "deepest contact, mm": lambda runs: 1e3 * max(run.depth.max() for run in runs),
    "energy gained, as height, mm": lambda runs: (
        1e3 * max(np.nanmax(run.energy) - run.energy[0] for run in runs) / game.GRAVITY_M_S2
    ),
    "starts that diverge": lambda runs: sum(not run.finite for run in runs),
    "greatest speed, m/s": lambda runs: max(np.nanmax(run.speed) for run in runs),
    "greatest bump, mm": lambda runs: max(map(_bump_mm, runs)),
    "speed lost on the way, %": lambda runs: (
        100.0 * max(1.0 - run.speed[-1] / run.speed[0] for run in runs)
    ),
    "hop at 4 m/s of slip, mm": lambda runs: 1e3 * (runs[2].position[:, 2].max() - RADIUS_M),
    "rolls off 5/7 of the speed by, %": _wrong_roll_percent,
    "way from the spot, mm": lambda runs: (
        1e3 * np.linalg.norm(runs[0].position[:, :2], axis=1).max()
    ),
}
"""By what they read."""


def rows(name: str, effort: Effort) -> list[dict[str, Any]]:
    """Return a case's requirements under every ``preset``.

    With the ``value``, the worst of so many ``starts``, the ``verdict`` (holds or fails) and
    whether that is ``good``.
    """
    found = []
    for preset in MUJOCO_PRESETS.values():
        starts = HARD_CASES[name](preset, effort.starts)
        runs = [game.play(course, seconds) for course, seconds in starts]
        for row in REQUIREMENTS[REQUIREMENTS.case == name].to_dict("records"):
            value = float(READERS[row["quantity"]](runs))
            good = value <= row["limit"]
            row |= {"preset": preset.name, "value": value, "good": good, "starts": len(runs)}
            found.append(row | {"verdict": "holds" if good else "fails"})
    return found
