"""What Stable-Baselines3's environment checker says of every environment."""

from __future__ import annotations

from typing import get_args

import gymnasium as gym
import pytest
from stable_baselines3.common import env_checker

from roller_env import ENV_IDS
from roller_env.game.actions import ActionMode
from roller_env.game.observations import ObservationMode
from tests.envs.checking import SMALL, no_warnings_but_of_unbounded_observations


@pytest.mark.parametrize("action", get_args(ActionMode))
@pytest.mark.parametrize("env_id", ENV_IDS)
@pytest.mark.parametrize("observation", get_args(ObservationMode))
def test_stable_baselines_finds_nothing_wrong(
    env_id: str, action: str, observation: str, request: pytest.FixtureRequest
) -> None:
    if observation == "pixels":
        request.getfixturevalue("opengl")
    with no_warnings_but_of_unbounded_observations():
        env = gym.make(env_id, action=action, observation=observation, **SMALL)
        env_checker.check_env(env, warn=True)
        env.close()
