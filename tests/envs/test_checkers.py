"""What Gymnasium's environment checker says of every environment."""

from __future__ import annotations

from typing import get_args

import gymnasium as gym
import pytest
from gymnasium.utils import env_checker

from roller_env import ENV_IDS
from roller_env.game.actions import ActionMode
from roller_env.game.observations import ObservationMode
from tests.envs.checking import SMALL, no_warnings_but_of_unbounded_observations

ACTIONS = get_args(ActionMode)


@pytest.fixture(params=get_args(ObservationMode))
def observation(request: pytest.FixtureRequest) -> str:
    """Every observation mode; pixels where there is OpenGL."""
    if request.param == "pixels":
        request.getfixturevalue("opengl")
    return str(request.param)


@pytest.mark.parametrize("action", ACTIONS)
@pytest.mark.parametrize("env_id", ENV_IDS)
def test_gymnasium_finds_nothing_wrong(env_id: str, action: str, observation: str) -> None:
    with no_warnings_but_of_unbounded_observations():
        env = gym.make(env_id, action=action, observation=observation, **SMALL)
        env_checker.check_env(env.unwrapped, skip_render_check=True)
        env.close()


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("env_id", ENV_IDS)
def test_gymnasium_finds_nothing_wrong_with_the_pictures(env_id: str) -> None:
    with no_warnings_but_of_unbounded_observations():
        env = gym.make(env_id, render_mode="rgb_array", **SMALL)
        env_checker.check_env(env.unwrapped, skip_close_check=True)
        env.close()


def test_rendering_without_a_render_mode_warns_and_draws_nothing() -> None:
    env = gym.make("Roller/Flat-v0").unwrapped
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode='rgb_array'"):
        assert env.render() is None
