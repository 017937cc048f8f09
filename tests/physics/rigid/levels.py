"""The shipped levels as the rigid engine takes them."""

from __future__ import annotations

from collections.abc import Sequence

from roller_env.compile.merge import merge_solids
from roller_env.compile.mjcf import SCRIPT_RATE_HZ
from roller_env.level import load_level
from roller_env.level.expand import rotation_matrix, solids
from roller_env.level.schema import Gate, Level, Material, Plate
from roller_env.physics.rigid.scene import STATIC, RigidLevel, SolidBox

NAMES = ("flat", "bridge", "lift", "gate", "classic")


def rigid_level(name: str) -> tuple[Level, RigidLevel]:
    """Return a shipped level, and the same for the rigid engine; its plates come before gates."""
    level = load_level(name)
    boxes = [
        _box(level, level.material(solid.material), solid.centre, solid.half_size, solid.rotation)
        for solid in merge_solids(solids(level))
    ]
    boxes += [
        _box(level, Material(), pad.at, [edge / 2 for edge in pad.size], rotation_matrix())
        for pad in level.lift_pads
    ]
    stops: list[float] = []
    pieces: list[tuple[Plate | Gate, float, float]] = [
        *((plate, plate.sinks_to, 0.0) for plate in level.plates),
        *((gate, gate.lowers_to, gate.yaw_deg) for gate in level.gates),
    ]
    for piece, stop, yaw in pieces:
        half = [edge / 2 for edge in piece.size]
        box = _box(level, Material(), piece.at, half, rotation_matrix(yaw), len(stops))
        boxes.append(box)
        stops.append(stop - 0.5 * piece.speed / SCRIPT_RATE_HZ - piece.at[2])
    ball = level.ball
    return level, RigidLevel(boxes, ball.radius, level.gravity, ball.mass_kg, stops)


def _box(
    level: Level,
    material: Material,
    centre: Sequence[float],
    half: Sequence[float],
    rotation: Sequence[Sequence[float]],
    slab: int = STATIC,
) -> SolidBox:
    return SolidBox(
        centre,
        half,
        rotation,
        level.ball.friction * material.friction,
        level.ball.elasticity * material.elasticity,
        slab,
    )
