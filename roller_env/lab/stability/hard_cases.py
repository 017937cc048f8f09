"""The hardest things that the game's own pieces can do to the ball, under every preset.

What is acceptable comes from the game: the ball must not leave the level through a floor, nothing
may give it energy, and what a player sees must look like contact. Depths are of the deepest
contact of any start of a case.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any, Final

import numpy as np

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.game import (
    DECK_M,
    GATE_SPEED_M_S,
    GROUND,
    PLATE_SPEED_M_S,
    RADIUS_M,
    THROUGH_M,
    TUBE_FALL_M,
    Course,
    Run,
    make_level,
    play,
)
from roller_env.lab.simulate import Float64
from roller_env.lab.stability.cases import Effort
from roller_env.lab.stability.failures import (
    VISIBLE_HOP,
    VISIBLE_HOP_MM,
    hanging_gate_level,
    seam_level,
    skid_level,
)
from roller_env.level import Level, load_level
from roller_env.physics.presets import PRESETS, PhysicsPreset
from roller_env.units import quants

FULL_SPEED_M_S: Final = 15.0
"""Two keys held over the classic's start deck of 22 m: sqrt(2 · 5.08 sqrt 2 / 1.4 · 22)."""

LOOKS_LIKE_CONTACT_M: Final = RADIUS_M / 10
_THROUGH: Final = "deeper, the ball's centre is past the middle of a deck and it falls through"
_STILL: Final = "neither a floor nor a wall gives energy; 1 mm of height for rounding"
_MOVING: Final = "a moving slab can drag the ball along as fast as it goes itself; and 1 mm"
_LOOKS: Final = "a tenth of the radius still looks like contact"


@dataclass(frozen=True, slots=True)
class Reading:
    """One quantity of a hard case, and what is acceptable.

    Attributes:
        quantity: with its unit.
        value: measured; the worst of all starts.
        limit: largest acceptable value.
        reason: why that.
    """

    quantity: str
    value: float
    limit: float
    reason: str


@dataclass(frozen=True)
class HardCase:
    """A situation and how it is judged.

    Attributes:
        name: its key.
        title: what happens, for a table.
        runs: simulations of it under a preset, from so many starts.
        read: what is read off them.
        note: why it fails, where it does.
    """

    name: str
    title: str
    runs: Callable[[PhysicsPreset, int], list[Run]]
    read: Callable[[Sequence[Run], PhysicsPreset], Iterator[Reading]]
    note: str = ""


# What is read off ----------------------------------------------------------------------------


def _depth(runs: Sequence[Run], limit: float, reason: str) -> Reading:
    deepest = 1e3 * max(float(run.depth.max()) for run in runs)
    return Reading("deepest contact, mm", deepest, 1e3 * limit, reason)


def _gain(runs: Sequence[Run], gravity: float, slab_m_s: float) -> Reading:
    gain = max(float(np.nanmax(run.energy) - run.energy[0]) for run in runs) / gravity
    limit = 1.0 + 1e3 * slab_m_s**2 / (2.0 * gravity)
    reason = _MOVING if slab_m_s else _STILL
    return Reading("energy gained, as height, mm", 1e3 * gain, limit, reason)


def _finite(runs: Sequence[Run]) -> Reading:
    diverged = sum(not run.finite for run in runs)
    return Reading("starts that diverge", float(diverged), 0.0, "a game must never end this way")


def _contact(
    limit: float, reason: str, slab_m_s: float = 0.0
) -> Callable[[Sequence[Run], PhysicsPreset], Iterator[Reading]]:
    """Return readings of depth, energy and whether it is finite; slabs move at ``slab_m_s``."""

    def read(runs: Sequence[Run], _preset: PhysicsPreset) -> Iterator[Reading]:
        yield _depth(runs, limit, reason)
        yield _gain(runs, skid_level().gravity, slab_m_s)
        yield _finite(runs)

    return read


# The cases -----------------------------------------------------------------------------------


def _gate_coming_down(preset: PhysicsPreset, starts: int) -> list[Run]:
    compiled = compile_level(hanging_gate_level(0.0), preset)
    offsets = np.linspace(0.0, 0.5, starts)
    return [
        play(Course(compiled, (float(x), 0.0, RADIUS_M), movers_m_s=-GATE_SPEED_M_S), 2.5)
        for x in offsets
    ]


def _read_gate(runs: Sequence[Run], _preset: PhysicsPreset) -> Iterator[Reading]:
    yield _depth(runs, THROUGH_M, _THROUGH)
    fastest = max(float(np.nanmax(run.speed)) for run in runs)
    # A rigid ball under a rigid gate has nowhere to go, so that physics gives no number.
    reason = "faster than any ball that a player has pushed, it is shot out by a spring"
    yield Reading("greatest speed, m/s", fastest, FULL_SPEED_M_S, reason)
    yield _finite(runs)


def _on_the_gate(preset: PhysicsPreset, starts: int) -> list[Run]:
    compiled = compile_level(load_level("gate"), preset)
    gate = compiled.level.gates[0]
    top = gate.at[2] + gate.size[2] / 2 + RADIUS_M
    return [
        play(Course(compiled, (gate.at[0] + float(x), 0.3, top), movers_m_s=-GATE_SPEED_M_S), 4.0)
        for x in np.linspace(0.0, gate.size[0] / 2, starts)
    ]


def _pressed_to_the_gate(preset: PhysicsPreset, starts: int) -> list[Run]:
    compiled = compile_level(load_level("gate"), preset)
    gate = compiled.level.gates[0]
    face = gate.at[0] - gate.size[0] / 2 - RADIUS_M
    floor = compiled.level.start.at[2]
    return [
        play(
            Course(
                compiled,
                (face, float(y), floor),
                force_n=(KEY_FORCE_N, 0.0, 0.0),
                movers_m_s=-GATE_SPEED_M_S,
            ),
            3.0,
        )
        for y in np.linspace(0.0, 1.2, starts)
    ]


@cache
def _wedge_level(yaw_deg: float) -> Level:
    gate = {
        "name": "gate",
        "at": (0.0, 0.0, 1.0),
        "size": (6.0, 0.4, 4.0),
        "yaw_deg": yaw_deg,
        "lowers_to": -2.0,
    }
    plate = {
        "name": "plate",
        "at": (-30.0, 0.0, 0.0),
        "size": (1.0, 1.0, 0.6),
        "opens": ["gate"],
        "sinks_to": -0.5,
    }
    wall = {"start": (-3.0, -1.2), "end": (6.0, -1.2), "bottom": 0.0, "height": 3.0}
    return make_level(gates=[gate], plates=[plate], walls=[wall])


def _wedged(preset: PhysicsPreset, starts: int) -> list[Run]:
    runs = []
    for yaw in (10.0, 25.0, 45.0):
        compiled = compile_level(_wedge_level(yaw), preset)
        for speed in np.linspace(1.0, FULL_SPEED_M_S, max(2, starts // 3)):
            course = Course(
                compiled,
                (2.6, -1.09 + RADIUS_M, RADIUS_M),
                velocity=(-float(speed), 0.0, 0.0),
                force_n=(-KEY_FORCE_N, 0.0, 0.0),
                movers_m_s=-GATE_SPEED_M_S,
            )
            runs.append(play(course, 2.5))
    return runs


def _on_a_sinking_plate(preset: PhysicsPreset, starts: int) -> list[Run]:
    compiled = compile_level(load_level("gate"), preset)
    plate = compiled.level.plates[0]
    x, y, z = plate.at
    top = z + plate.size[2] / 2 + RADIUS_M
    # From the middle to over the slot between the plate's corner and the deck.
    shares = np.linspace(0.0, 1.0, starts)
    return [
        play(
            Course(
                compiled,
                (x + s * plate.size[0] / 2, y + s * plate.size[1] / 2, top + 0.001),
                movers_m_s=-PLATE_SPEED_M_S,
            ),
            4.0,
        )
        for s in shares
    ]


def _landing_level() -> Level:
    deck = {"at": (0.0, 0.0, -DECK_M / 2), "size": (50.0, 50.0, DECK_M)}
    return make_level(boxes=[deck], start={"at": (0.0, 0.0, RADIUS_M)})


def _landing(preset: PhysicsPreset, starts: int) -> list[Run]:
    compiled = compile_level(_landing_level(), preset)
    return [
        play(Course(compiled, (0.0, 0.0, RADIUS_M + TUBE_FALL_M + float(more))), 4.0)
        for more in np.linspace(0.0, 0.3, starts)
    ]


def _rolling(compiled: CompiledLevel, at: Sequence[float], speed: float) -> Course:
    return Course(compiled, at, velocity=(speed, 0.0, 0.0), spin=(0.0, speed / RADIUS_M, 0.0))


def _over_the_bridge(preset: PhysicsPreset, starts: int) -> list[Run]:
    """Roll from the classic level's bridge over two seams onto the island."""
    compiled = compile_level(load_level("classic"), preset)
    begin, way = quants(660.0), quants(440.0)
    speeds = np.repeat(np.linspace(3.0, FULL_SPEED_M_S, 5), starts)
    # The same speeds from starts that are a whole step's way apart.
    shares = np.tile(np.linspace(0.0, 1.0, starts, endpoint=False), 5)
    height = compiled.level.start.at[2]
    runs = []
    for speed, share in zip(speeds, shares, strict=True):
        x = begin + float(speed * share) * preset.dt_s
        runs.append(play(_rolling(compiled, (x, 0.0, height), float(speed)), way / float(speed)))
    return runs


def _over_a_lane_of_seams(preset: PhysicsPreset, starts: int) -> list[Run]:
    compiled = compile_level(seam_level(seams=True), preset)
    return [
        play(_rolling(compiled, (0.0, 0.0, RADIUS_M), float(speed)), 80.0 / float(speed))
        for speed in np.linspace(FULL_SPEED_M_S / 2, FULL_SPEED_M_S, starts)
    ]


def _bump(run: Run) -> float:
    # What the ball sinks into the floor at the start is no bump.
    height: Float64 = run.position[len(run.position) // 4 :, 2]
    return float(height.max() - np.median(height))


def _read_seams(runs: Sequence[Run], preset: PhysicsPreset) -> Iterator[Reading]:
    bump = 1e3 * max(_bump(run) for run in runs)
    reason = "one quant: the ball does not get over anything by it"
    yield Reading("greatest bump, mm", bump, 1e3 * quants(1.0), reason)
    lost = 100.0 * max(1.0 - float(run.speed[-1] / run.speed[0]) for run in runs)
    yield Reading("speed lost on the way, %", lost, 2.0, "less than a player can feel")
    yield from _contact(LOOKS_LIKE_CONTACT_M, _LOOKS)(runs, preset)


def _at_a_corner(preset: PhysicsPreset, starts: int) -> list[Run]:
    box = {"at": (0.0, 0.0, 1.0), "size": (2.0, 2.0, 2.0)}
    compiled = compile_level(make_level(boxes=[dict(GROUND), box]), preset)
    runs = []
    for index, angle in enumerate(np.radians(np.linspace(0.0, 90.0, starts))):
        # Every other one along the ground to the edge, or from above to the corner.
        falls, low = index % 2 == 1, RADIUS_M
        way = np.array([math.cos(angle), math.sin(angle), 1.5 if falls else 0.0])
        way /= np.linalg.norm(way)
        at = np.array([1.0, 1.0, 2.0 if falls else low]) + 2.0 * way
        runs.append(play(Course(compiled, tuple(at), tuple(-FULL_SPEED_M_S * way)), 1.0))
    return runs


HOP_SPEEDS_M_S: Final = (1.0, 2.0, 4.0, 8.0)


def _skidding(preset: PhysicsPreset, _starts: int) -> list[Run]:
    compiled = compile_level(skid_level(), preset)
    return [
        play(Course(compiled, (0.0, 0.0, RADIUS_M), velocity=(speed, 0.0, 0.0)), 1.0)
        for speed in HOP_SPEEDS_M_S
    ]


def _read_hop(runs: Sequence[Run], preset: PhysicsPreset) -> Iterator[Reading]:
    at_four = runs[HOP_SPEEDS_M_S.index(4.0)]
    hop = 1e3 * (float(at_four.position[:, 2].max()) - RADIUS_M)
    yield Reading("hop at 4 m/s of slip, mm", hop, VISIBLE_HOP_MM, VISIBLE_HOP)
    wrong = 100.0 * max(
        abs(float(run.speed[-1]) / (5.0 / 7.0 * speed) - 1.0)
        for run, speed in zip(runs[:3], HOP_SPEEDS_M_S, strict=False)
    )
    yield Reading("rolls off 5/7 of the speed by, %", wrong, 0.5, "the rigid ball's closed form")
    yield from _contact(LOOKS_LIKE_CONTACT_M, _LOOKS)(runs, preset)


def _spinning(preset: PhysicsPreset, _starts: int) -> list[Run]:
    compiled = compile_level(skid_level(), preset)
    return [play(Course(compiled, (0.0, 0.0, RADIUS_M), spin=(0.0, 0.0, 20.0)), 10.0)]


def _read_spin(runs: Sequence[Run], preset: PhysicsPreset) -> Iterator[Reading]:
    strayed = float(np.linalg.norm(runs[0].position[:, :2], axis=1).max())
    yield Reading("way from the spot, mm", 1e3 * strayed, 1.0, "it spins on the spot")
    yield from _contact(LOOKS_LIKE_CONTACT_M, _LOOKS)(runs, preset)


HARD_CASES: Final[dict[str, HardCase]] = {
    case.name: case
    for case in (
        HardCase(
            "gate_closing_on_the_ball",
            "a hanging gate comes down on the ball until it is shut",
            _gate_coming_down,
            _read_gate,
            "no shipped level has a hanging gate; what keeps the ball from being shot out is the "
            "limit of the servo's force: see the failure 'crush'",
        ),
        HardCase(
            "riding_a_sinking_gate",
            "the ball lies on a gate that sinks into the deck",
            _on_the_gate,
            _contact(LOOKS_LIKE_CONTACT_M, _LOOKS, GATE_SPEED_M_S),
        ),
        HardCase(
            "pressed_to_a_sinking_gate",
            "a key presses the ball to a gate that sinks, and over it when it is open",
            _pressed_to_the_gate,
            _contact(LOOKS_LIKE_CONTACT_M, _LOOKS, GATE_SPEED_M_S),
        ),
        HardCase(
            "wedged_between_gate_and_wall",
            "a key and its speed drive the ball between a slanting gate and a wall",
            _wedged,
            _contact(
                RADIUS_M / 2, "half the radius: it is thrown in, and gets out", GATE_SPEED_M_S
            ),
        ),
        HardCase(
            "plate_sinking_under_the_ball",
            "a plate sinks under the ball; from its middle to the slot at its corner",
            _on_a_sinking_plate,
            _contact(LOOKS_LIKE_CONTACT_M, _LOOKS, PLATE_SPEED_M_S),
        ),
        HardCase(
            "landing_from_the_tube",
            "the ball falls 46.9 m onto a deck of 16 quants",
            _landing,
            _contact(THROUGH_M, _THROUGH),
        ),
        HardCase(
            "tile_seams_at_full_speed",
            "the ball rolls off the classic level's bridge, over two seams, at 3 to 15 m/s",
            _over_the_bridge,
            _read_seams,
            "merging leaves seams where the material or the slab's outline changes",
        ),
        HardCase(
            "lane_of_seams",
            "the ball rolls over 49 seams in a row that cannot be merged, at 7.5 to 15 m/s",
            _over_a_lane_of_seams,
            _read_seams,
            "no shipped level has one. Each bump lands the ball deeper in the next tile, whose "
            "edge then kicks harder: bumps grow from seam to seam",
        ),
        HardCase(
            "box_corner_at_full_speed",
            "the ball hits the edge or the corner of a box at 15 m/s",
            _at_a_corner,
            _contact(RADIUS_M, "deeper, the nearest way out is another face"),
        ),
        HardCase(
            "skidding",
            "the ball slides without spin and hops while friction spins it",
            _skidding,
            _read_hop,
            "the convex cone's v_normal >= mu v_slip; see the failure 'hop'",
        ),
        HardCase(
            "spinning_on_the_spot",
            "the ball spins about the vertical at 20 rad/s for 10 s",
            _spinning,
            _read_spin,
            "contacts have no torsional friction (condim 3), so the spin never dies",
        ),
    )
}
"""By name."""


def run_case(
    case: HardCase, presets: Iterable[PhysicsPreset], effort: Effort
) -> list[dict[str, Any]]:
    """Return the case's rows under each preset.

    Returns:
        ``case``, ``preset``, ``title``, and of each `Reading` the ``quantity``, ``value``,
        ``limit``, ``reason`` and ``verdict`` (holds or fails); ``starts`` and the ``note``.
    """
    rows = []
    for preset in presets:
        runs = case.runs(preset, effort.starts)
        rows += [
            {"case": case.name, "preset": preset.name, "title": case.title}
            | asdict(reading)
            | {
                "verdict": "holds" if reading.value <= reading.limit else "fails",
                "starts": len(runs),
                "note": case.note,
            }
            for reading in case.read(runs, preset)
        ]
    return rows


ALL_PRESETS: Final = tuple(PRESETS.values())
