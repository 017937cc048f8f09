"""`gymnasium.utils.play` presses keys through `get_keys_to_action`."""

from __future__ import annotations

from itertools import combinations
from typing import Any, get_args

import gymnasium as gym
import numpy as np
import pytest

from roller_env.envs.single import RollerEnv
from roller_env.game.actions import ActionMode, forces

KEY_N = 5.08
PUSHES = {"w": (KEY_N, 0.0), "s": (-KEY_N, 0.0), "a": (0.0, KEY_N), "d": (0.0, -KEY_N)}
HELD = [held for count in range(1, 5) for held in combinations("adsw", count)]


def mapping(mode: str) -> dict[tuple[int, ...], Any]:
    """Return the actions by the key codes that are down, as `play` makes them of the mapping."""
    env = gym.make("Roller/Flat-v0", action=mode)
    by_letters = env.get_wrapper_attr("get_keys_to_action")()
    return {tuple(sorted(map(ord, letters))): action for letters, action in by_letters.items()}


@pytest.mark.parametrize("mode", get_args(ActionMode))
@pytest.mark.parametrize("held", HELD, ids="".join)
def test_held_keys_push_as_far_as_they_do_not_cancel(held: tuple[str, ...], mode: Any) -> None:
    action = mapping(mode)[tuple(map(ord, held))]
    env = RollerEnv(level="flat", action=mode)
    assert action in env.action_space
    expected = np.sum([PUSHES[key] for key in held], axis=0)
    assert forces(mode, np.asarray(action)[None])[0] == pytest.approx(expected)


@pytest.mark.parametrize("mode", get_args(ActionMode))
def test_every_combination_of_the_four_keys_has_an_action_but_none_which_play_refuses(
    mode: str,
) -> None:
    assert sorted(mapping(mode)) == sorted(tuple(map(ord, held)) for held in HELD)


@pytest.mark.parametrize(
    ("mode", "noop"),
    [("directions", 0), ("keys", np.zeros(4, np.int8)), ("force", np.zeros(2, np.float32))],
)
def test_the_noop_that_the_documentation_gives_for_play_does_not_push(mode: Any, noop: Any) -> None:
    assert noop in RollerEnv(level="flat", action=mode).action_space
    assert forces(mode, np.asarray(noop)[None]).tolist() == [[0.0, 0.0]]
