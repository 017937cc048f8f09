"""Roller: a ball, four keys, and MuJoCo. Importing this registers the Gymnasium ids.

It imports neither mujoco nor torch; an environment's module is imported when one is made.
"""

from __future__ import annotations

from typing import Any, Final

import gymnasium as gym

__version__ = "0.1.0"

ENV_IDS: Final[dict[str, dict[str, Any]]] = {
    "Roller/Classic-v0": {"level": "classic"},
    "Roller/Flat-v0": {"level": "flat"},
    "Roller/Bridge-v0": {"level": "bridge"},
    "Roller/Gate-v0": {"level": "gate"},
    "Roller/Lift-v0": {"level": "lift"},
    "Roller/Level-v0": {},
}
"""Every Gymnasium id with the options it sets; `Roller/Level-v0` takes ``level=`` of any kind."""

for _id, _options in ENV_IDS.items():
    gym.register(
        _id,
        entry_point="roller_env.envs.single:RollerEnv",
        vector_entry_point="roller_env.envs.vector:RollerVectorEnv",
        kwargs=_options,
    )
