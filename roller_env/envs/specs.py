"""The spec that Gymnasium keeps of an environment, in values that JSON can carry."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gymnasium.envs.registration import EnvSpec


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
