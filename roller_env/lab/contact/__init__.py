"""Scenes in which bodies touch: rolling, skidding, bouncing, piles, and the game's own movers.

Only MuJoCo simulates them; the rigid body of the report knows no contact.
"""

from __future__ import annotations

from typing import Final

from roller_env.lab.contact import course, impact, rolling, simbenchmark
from roller_env.lab.contact.scene import ContactScene

CONTACT_SCENES: Final[tuple[ContactScene, ...]] = (
    *(rolling.INCLINE, rolling.PUSH, *rolling.SKIDS),
    *(impact.BOUNCE, impact.RESTITUTION),
    *(course.GATE_PUSH, course.COURSE),
    *simbenchmark.SCENES,
)
"""Every contact scene, the simple ones first."""
