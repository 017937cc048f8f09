"""Gymnasium's vector of processes, started by a process that has stepped and drawn."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from roller_env.drawing.opengl import DrawingUnavailable
from roller_env.envs.vector import RollerVectorEnv

PATIENCE_S = 120.0
SMALL: dict[str, Any] = {"observation": "pixels", "width": 32, "height": 24}


def processes(num_envs: int, context: str, **options: Any) -> gym.vector.AsyncVectorEnv:
    """Return games that are played each in a process of its own."""
    envs = gym.make_vec(
        "roller_env:Roller/Flat-v0",
        num_envs,
        vectorization_mode="async",
        vector_kwargs={"context": context, "shared_memory": False},
        **options,
    )
    assert isinstance(envs, gym.vector.AsyncVectorEnv)
    return envs


def test_games_in_forked_processes_are_those_of_the_vector_that_was_stepped_before() -> None:
    actions = np.array([1, 3])
    ours = RollerVectorEnv(2, level="flat", num_threads=2)
    expected = [ours.reset(seed=4)[0], *(ours.step(actions)[0] for _ in range(3))]
    theirs = processes(2, "fork")
    theirs.reset_async(seed=4)
    found = [theirs.reset_wait(timeout=PATIENCE_S)[0]]
    for _ in range(3):
        theirs.step_async(actions)
        found.append(theirs.step_wait(timeout=PATIENCE_S)[0])
    theirs.close()
    assert np.array_equal(found, expected)


# Whoever asks for OpenGL has drawn.
@pytest.mark.usefixtures("opengl")
@pytest.mark.filterwarnings("ignore:.*ERROR. (Received|Raising)")
def test_pictures_from_forked_processes_are_refused_at_once_with_what_to_do() -> None:
    envs = processes(1, "fork", **SMALL)
    envs.reset_async(seed=0)
    with pytest.raises(DrawingUnavailable, match=r"forked .*context='spawn'"):
        envs.reset_wait(timeout=PATIENCE_S)
    envs.close(terminate=True)


@pytest.mark.usefixtures("opengl")
def test_spawned_processes_draw_what_their_parent_draws() -> None:
    ours = RollerVectorEnv(1, level="flat", **SMALL)
    expected, _ = ours.reset(seed=0)
    envs = processes(1, "spawn", **SMALL)
    envs.reset_async(seed=0)
    found, _ = envs.reset_wait(timeout=PATIENCE_S)
    envs.close()
    ours.close()
    assert np.array_equal(found, expected)
