"""What the environment checkers of Gymnasium and Stable-Baselines3 say of every environment."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, get_args

import gymnasium as gym
import pytest
from gymnasium.utils import env_checker
from stable_baselines3.common import env_checker as sb3_checker

from roller_env import ENV_IDS
from roller_env.game.actions import ActionMode
from roller_env.game.observations import ObservationMode

ACTIONS = get_args(ActionMode)
# Small pictures, but not so small that SB3's convolutions would not fit.
SMALL: dict[str, Any] = {"width": 48, "height": 40}


@pytest.fixture(params=get_args(ObservationMode))
def observation(request: pytest.FixtureRequest) -> str:
    """Every observation mode; pixels where there is OpenGL."""
    if request.param == "pixels":
        request.getfixturevalue("opengl")
    return str(request.param)


@contextmanager
def no_warnings_but_of_unbounded_observations() -> Iterator[None]:
    """Make warnings errors, except that some observations have no bounds.

    Positions, velocities and directions to things have none: a level may be of any size, and
    nothing limits the ball's speed.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for bound in ("minimum value is -infinity", "maximum value is infinity"):
            warnings.filterwarnings("ignore", message=f".*Box observation space {bound}.*")
        yield


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


@pytest.mark.parametrize("action", ACTIONS)
@pytest.mark.parametrize("env_id", ENV_IDS)
def test_stable_baselines_finds_nothing_wrong(env_id: str, action: str, observation: str) -> None:
    with no_warnings_but_of_unbounded_observations():
        env = gym.make(env_id, action=action, observation=observation, **SMALL)
        sb3_checker.check_env(env, warn=True)
        env.close()


def test_rendering_without_a_render_mode_warns_and_draws_nothing() -> None:
    env = gym.make("Roller/Flat-v0").unwrapped
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode='rgb_array'"):
        assert env.render() is None
