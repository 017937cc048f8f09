"""Fingerprints: what Gymnasium's ids stand for, so that nobody changes it without noticing.

An id's name ends in a version, and results under it are compared for years (docs/baselines.md).
Of every id its level is kept as a hash, and a short game on every physics preset as a few numbers.
Numbers, since the bits of a game are one machine's own; the same game elsewhere is as near as
`ALIKE`.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import gymnasium as gym
import numpy as np

from roller_env import ENV_IDS, GENERATED_IDS
from roller_env.config import EnvConfig
from roller_env.envs.generated import DIFFICULTY
from roller_env.game.actions import DIRECTIONS
from roller_env.level import Level, load_level
from roller_env.level.proved import proved_levels
from roller_env.physics.presets import PRESETS
from roller_env.replay import load_replay, shipped_replays

FILE: Final = Path(__file__).parents[2] / "tests" / "envs" / "fingerprints.json"
"""Where they are kept, in a checkout."""

GAME_S: Final = 4.0
"""Most of a game that is looked at: after twice as much, 1e-13 m at the start show in `rails`."""

ALIKE: Final = 1e-6
"""Relative difference of two numbers from which on they are of different games."""

ASKED: Final[Mapping[str, Mapping[str, Any]]] = {
    "fast": {},
    "default": {},
    "accurate": {},
    "rigid": {"observation": "rays", "reward": "nearness"},
    "relaxed": {"kinds": "all", "reward": "shaped"},
}
"""By physics preset the other options of its game: between them, all that is seen and rewarded."""

_WORDS: Final = {"title", "description", "par_time_s"}
"""What people read of a level, and nothing depends on."""

_GENERATED: Final = 3
"""Generated levels that are looked at, of all that there are."""

Game = dict[str, float]


def fingerprints() -> dict[str, Any]:
    """Return what all ids stand for, in JSON's values."""
    options = EnvConfig().to_json()
    del options["level"], options["num_threads"]
    ids = {name: of_level(name, given["level"]) for name, given in ENV_IDS.items() if given}
    generated = {name: of_generated(name, own["version"]) for name, own in GENERATED_IDS.items()}
    return {
        "options": options,
        "presets": {name: asdict(preset) for name, preset in PRESETS.items()},
        "ids": ids | generated,
    }


def of_level(name: str, level: str) -> dict[str, Any]:
    """Return an id's fingerprint: its level, and a game on every preset."""
    actions, dt_s = played(level)
    return {
        "level": _hash([load_level(level)]),
        "games": {
            physics: game(name, actions, physics=physics, control_dt_s=dt_s, **options)
            for physics, options in ASKED.items()
        },
    }


def played(level: str) -> tuple[list[int], float]:
    """Return the first actions of a level's shipped demonstration, and how long each is held, s."""
    replay = load_replay(shipped_replays()[level])
    dt_s = replay.options.control_dt_s
    return replay.actions[: round(GAME_S / dt_s)].tolist(), dt_s


def of_generated(name: str, version: int) -> dict[str, Any]:
    """Return the fingerprint of generated levels; any keys do, since nobody has played them."""
    own: dict[str, Any] = {"num_levels": _GENERATED}
    actions = [step // 8 * 5 % len(DIRECTIONS) for step in range(round(GAME_S / 0.05))]
    return {
        "level": _hash(proved_levels(_GENERATED, 0, DIFFICULTY, version=version)),
        "games": {
            physics: game(name, actions, physics=physics, **own, **options)
            for physics, options in ASKED.items()
            if PRESETS[physics].engine == "rigid"
        },
    }


def game(name: str, actions: Iterable[int], **options: Any) -> Game:
    """Return a game in numbers: how long it was, what it paid, what was seen.

    Args:
        name: the id.
        actions: from the start on, until they or the game are over.
        options: of the environment.
    """
    env = gym.make(name, disable_env_checker=True, **options)
    steps, paid, seen = 0, 0.0, []
    env.reset(seed=0)
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        steps, paid = steps + 1, paid + float(reward)
        seen.append(observation.astype(np.float64))
        if terminated or truncated:
            break
    env.close()
    # Weighted by their places, so that entries that change places are another sum.
    weights = np.arange(1.0, seen[0].size + 1.0) / seen[0].size
    return {
        "steps": steps,
        "coins": int(info["coins"]),
        "reward": paid,
        "seen": float(np.mean(seen @ weights)),
        "entries": int(weights.size),
    }


def differences(known: Mapping[str, Any], found: Mapping[str, Any]) -> list[str]:
    """Return in what two sets of fingerprints differ, a line each: name, before and now."""
    return list(_differences("", known, found))


def _differences(where: str, known: Any, found: Any) -> Iterator[str]:
    if isinstance(known, Mapping) and isinstance(found, Mapping):
        for name in {**known, **found}:
            inner = f"{where}, {name}" if where else str(name)
            yield from _differences(inner, known.get(name), found.get(name))
    elif isinstance(known, float) and isinstance(found, float):
        if not math.isclose(known, found, rel_tol=ALIKE, abs_tol=ALIKE):
            yield f"{where}: {known:.9g} before, {found:.9g} now"
    elif known != found:
        shown = ("nothing" if value is None else str(value) for value in (known, found))
        yield f"{where}: {' before, '.join(shown)} now"


def _hash(levels: Iterable[Level]) -> str:
    """Return a hash of all that levels say: not of their words, comments or units."""
    told = [
        level.model_dump(mode="json", exclude_defaults=True, exclude=_WORDS) for level in levels
    ]
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:16]
