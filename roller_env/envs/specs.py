"""The spec that Gymnasium keeps of an environment, in values that JSON can carry."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gymnasium.envs.registration import EnvSpec

from roller_env.simulation import Simulation


def plain_spec(spec: EnvSpec | None, plain: dict[str, Any]) -> EnvSpec | None:
    """Return a spec whose keywords are written as JSON has them.

    ``EnvSpec.to_json`` then works whatever Python objects the environment was made from, and
    `gymnasium.make` of what comes back makes an equal one.

    Args:
        spec: as Gymnasium made it from the keywords that it was given.
        plain: the same options, and others, as plain values.
    """
    if spec is None:
        return None
    return replace(spec, kwargs={k: plain.get(k, value) for k, value in spec.kwargs.items()})


def plain_options(simulation: Simulation) -> dict[str, Any]:
    """Return the options of a simulation, and its levels if they are several, as plain JSON."""
    plain: dict[str, Any] = dict(simulation.config.to_json())
    if len(simulation.levels) > 1:
        plain["levels"] = [
            level.model_dump(mode="json", exclude_defaults=True) for level in simulation.levels
        ]
    return plain
