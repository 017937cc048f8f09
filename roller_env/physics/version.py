"""The versions of the physics, one for each engine, which whoever keeps a game writes beside it."""

from __future__ import annotations

from typing import Final

from roller_env.physics.presets import Engine

PHYSICS_VERSION: Final[dict[Engine, int]] = {"mujoco": 1, "rigid": 1}
"""By engine. Raised by every change after which the same forces on the same ball could give another
motion: masses, shapes, materials, contacts, motors, what is compiled of a level, how the engine is
called. Neither by a preset's values, which a replay holds, nor by a new version of MuJoCo, NumPy or
the like, which it names. `docs/replays.md` says what follows."""
