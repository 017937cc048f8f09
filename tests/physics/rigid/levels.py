"""The shipped levels as the rigid engine takes them."""

from __future__ import annotations

from roller_env.compile import rigid
from roller_env.level import Level, load_level
from roller_env.physics.rigid.scene import RigidLevel

NAMES = ("flat", "bridge", "lift", "gate", "classic")


def rigid_level(name: str) -> tuple[Level, RigidLevel]:
    """Return a shipped level, and the same for the rigid engine; its plates come before gates."""
    level = load_level(name)
    return level, rigid.rigid_level(level)
