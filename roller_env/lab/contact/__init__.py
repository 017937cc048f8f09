"""Scenes in which bodies touch: rolling, skidding, bouncing, piles, and the game's own movers.

Only MuJoCo simulates them; the rigid body of the report knows no contact.
"""

from __future__ import annotations

from typing import Final

from roller_env.lab.contact.course import GAME_SCENES
from roller_env.lab.contact.impact import IMPACTS
from roller_env.lab.contact.rolling import ROLLING
from roller_env.lab.contact.scene import ContactScene
from roller_env.lab.contact.simbenchmark import SIMBENCHMARK

CONTACT_SCENES: Final[tuple[ContactScene, ...]] = (
    *ROLLING,
    *IMPACTS,
    *GAME_SCENES,
    *SIMBENCHMARK,
)
"""Every contact scene, the simple ones first."""
