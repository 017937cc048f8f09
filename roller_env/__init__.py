"""Roller: a ball, four keys, and MuJoCo. Importing this registers the Gymnasium ids.

It imports neither mujoco nor torch; an environment's module is imported when one is made.
"""

from __future__ import annotations

from typing import Any, Final

import gymnasium as gym

from roller_env.assets import LEVELS

__version__ = "0.1.0"

ENV_IDS: Final[dict[str, dict[str, Any]]] = {
    **{f"Roller/{level.title()}-v0": {"level": level} for level in LEVELS},
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

GENERATED_IDS: Final[dict[str, dict[str, Any]]] = {
    "Roller/Generated-v0": {"version": 1, "num_levels": 500},
    "Roller/Generated-v1": {"version": 2, "num_levels": 200, "kinds": "all"},
}
"""Games on generated levels, another one in every episode, by the version of the generator: an id's
levels never change. All of the second's levels are seen alike, whichever pieces a range has."""

for _id, _options in GENERATED_IDS.items():
    gym.register(
        _id,
        entry_point="roller_env.envs.generated:GeneratedEnv",
        vector_entry_point="roller_env.envs.generated:GeneratedVectorEnv",
        kwargs=_options,
    )
