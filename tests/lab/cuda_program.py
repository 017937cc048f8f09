"""Plays on the graphics card that Numba simulates, and prints what `test_cuda` looks at, as JSON.

Numba must be told to simulate before it is imported, so that this is a process of its own.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from typing import Any

import numpy as np

from roller_env.config import make_config
from roller_env.lab.cuda.games import CudaGames, Player
from roller_env.lab.cuda.measure import agreement

ENVS = 4
EPISODE_STEPS = 3


def compared(level: str, steps: int) -> list[dict[str, Any]]:
    """Return how games of a level compare after some steps."""
    player = Player(make_config(level=level, physics="rigid", reward="shaped"))
    return [asdict(each) for each in agreement(player, ENVS, (1, steps))]


def repeated() -> list[dict[str, Any]]:
    """Return what is seen of short episodes, step by step, while W is held."""
    config = make_config(level="flat", physics="rigid", max_episode_steps=EPISODE_STEPS)
    games = CudaGames(Player(config), ENVS)
    games.push(np.tile([5.08, 0.0], (ENVS, 1)))
    seen = []
    for _ in range(2 * (EPISODE_STEPS + 1)):
        games.step()
        state, observation = games.state(), games.observe()
        seen.append(
            {
                "steps": state["steps"].tolist(),
                "truncated": state["truncated"].tolist(),
                "x": state["physics"][:, 0].tolist(),
                "shown_x": observation[:, 0].tolist(),
            }
        )
    return seen


if __name__ == "__main__":
    levels = {level: compared(level, int(steps)) for level, steps in json.loads(sys.argv[1])}
    print(json.dumps({"levels": levels, "repeated": repeated()}))
