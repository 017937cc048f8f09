from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium.wrappers import TimeLimit
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecCheckNan, VecNormalize

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.envs.single import RollerEnv
from roller_env.game.observations import STATE_ENTRIES, layout
from tests.envs.playing import bytes_of, row_of, wandering_actions

ENVS, SEED = 4, 11
OPTIONS: dict[str, Any] = {"level": "bridge", "physics": "fast", "max_episode_steps": 85}


@pytest.mark.parametrize("observation", ["state", "dict", "rays"])
def test_it_does_what_stable_baselines_own_vector_of_monitored_games_does(observation: str) -> None:
    options = {**OPTIONS, "observation": observation, "reward": "shaped"}
    ours = RollerVecEnv(num_envs=ENVS, **options)
    theirs = DummyVecEnv([lambda: Monitor(RollerEnv(**options))] * ENVS)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.seed(SEED) == theirs.seed(SEED)
    found, expected = ours.reset(), theirs.reset()
    assert bytes_of(found) == bytes_of(expected)
    fell = timed_out = 0
    for action, _ in zip(wandering_actions(ENVS, SEED), range(320), strict=False):
        found, reward, done, infos = ours.step(action)
        expected, their_reward, their_done, their_infos = theirs.step(action)
        assert bytes_of(found) == bytes_of(expected)
        assert reward.dtype == their_reward.dtype
        assert reward.tobytes() == their_reward.tobytes()
        assert done.tolist() == their_done.tolist()
        for row in range(ENVS):
            compare_infos(infos[row], their_infos[row], ended=bool(done[row]))
            timed_out += infos[row].get("TimeLimit.truncated", False)
            fell += infos[row].get("fall", False)
    assert min(fell, timed_out) > 1


def compare_infos(found: dict[str, Any], expected: dict[str, Any], ended: bool) -> None:
    """Compare all that an episode's last info says; SB3 has one key in the others too."""
    if not ended:
        assert found == {}
        assert expected == {"TimeLimit.truncated": False}
        return
    found, expected = dict(found), dict(expected)
    last, their_last = found.pop("terminal_observation"), expected.pop("terminal_observation")
    assert bytes_of(last) == bytes_of(their_last)
    episode, their_episode = found.pop("episode"), expected.pop("episode")
    assert episode["r"] == pytest.approx(their_episode["r"], abs=1e-6)
    assert (episode["l"], set(episode)) == (their_episode["l"], set(their_episode))
    assert found == expected


def test_the_terminal_observation_is_where_the_episode_ended() -> None:
    env = RollerVecEnv("bridge", 1, seed=0)
    env.reset()
    backwards = np.array([5])
    for _ in range(300):
        observation, _, done, infos = env.step(backwards)
        if done[0]:
            break
    height = layout(STATE_ENTRIES)["position"].start + 2
    kill_height = env.level.kill_height
    begun = row_of(observation, 0)
    assert infos[0]["terminal_observation"][height] <= kill_height < begun[height]
    assert infos[0]["fall"]
    assert not infos[0]["TimeLimit.truncated"]


def test_seeds_are_for_the_next_reset_only_and_rows_differ() -> None:
    env = RollerVecEnv("flat", 3, seed=8)
    first, second = env.reset(), env.reset()
    env.seed(8)
    again = env.reset()
    assert first.tobytes() == again.tobytes() != second.tobytes()
    assert len({row.tobytes() for row in first}) == 3
    alone, _ = RollerEnv(level="flat").reset(seed=9)
    assert row_of(first, 1).tobytes() == alone.tobytes()


def test_options_reach_the_next_reset_only() -> None:
    env = RollerVecEnv("flat", 2, seed=0)
    env.set_options({"intro": True})
    env.reset()
    assert env.simulation.state.control_delay_s.tolist() == [6.0, 6.0]
    env.reset()
    assert env.simulation.state.control_delay_s.tolist() == [0.0, 0.0]
    env.set_options([{"intro": True}, {}])
    with pytest.raises(ValueError, match="options"):
        env.reset()


def test_attributes_and_methods_are_found_as_callbacks_look_for_them() -> None:
    env = RollerVecEnv(num_envs=3, **OPTIONS)
    assert env.get_attr("render_mode") == [None, None, None]
    assert [config.level for config in env.get_attr("config", indices=[0, 2])] == ["bridge"] * 2
    assert env.has_attr("simulation")
    assert not env.has_attr("nothing_of_that_name")
    with pytest.raises(AttributeError, match="nothing_of_that_name"):
        env.env_method("nothing_of_that_name")
    env.set_attr("note", "hello")
    assert env.get_attr("note", indices=1) == ["hello"]
    with pytest.raises(ValueError, match="share"):
        env.set_attr("note", "other", indices=[1])
    assert env.env_is_wrapped(TimeLimit) == [False] * 3
    assert env.env_is_wrapped(Monitor, indices=[0]) == [True]


def test_without_a_render_mode_there_are_no_images() -> None:
    assert list(RollerVecEnv(num_envs=2, **OPTIONS).get_images()) == [None, None]


@pytest.mark.usefixtures("opengl")
def test_images_are_one_a_row_and_a_tiled_one_for_all() -> None:
    env = RollerVecEnv(
        num_envs=3, level="bridge", render_mode="rgb_array", width=48, height=40, seed=0
    )
    env.reset()
    for action, _ in zip(wandering_actions(3), range(25), strict=False):
        env.step(action)
    images = np.array(env.get_images())
    assert images.shape == (3, 40, 48, 3)
    assert (images[0] != images[1]).any()
    (picture,) = env.env_method("render", indices=[1])
    assert (picture == images[1]).all()
    tiled = env.render()
    assert tiled is not None
    assert tiled.shape == (80, 96, 3)
    env.close()


@pytest.fixture
def one_torch_thread() -> Iterator[None]:
    """More threads than one slow networks of this size down, most of all beside other tests."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.mark.usefixtures("one_torch_thread")
@pytest.mark.parametrize("observation", ["state", "dict"])
def test_ppo_learns_from_it_without_a_warning(observation: str) -> None:
    env = RollerVecEnv(num_envs=8, observation=observation, seed=0, **OPTIONS)
    policy = "MultiInputPolicy" if observation == "dict" else "MlpPolicy"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        normalised = VecNormalize(VecCheckNan(env, raise_exception=True), gamma=0.99)
        agent = PPO(policy, normalised, n_steps=64, batch_size=128, n_epochs=1, device="cpu")
        agent.learn(1024)
        assert agent.num_timesteps == 1024
        assert len(agent.ep_info_buffer or ()) > 0
        rewards, lengths = evaluate_policy(
            agent, normalised, n_eval_episodes=8, return_episode_rewards=True
        )
    assert np.shape(rewards) == np.shape(lengths) == (8,)
    assert np.max(lengths) <= 85


def test_stable_baselines_makes_the_registered_ids_too() -> None:
    env = make_vec_env("Roller/Bridge-v0", n_envs=2, seed=3, env_kwargs={"action": "keys"})
    found = env.reset()
    ours = RollerVecEnv("bridge", 2, action="keys", seed=3)
    assert bytes_of(found) == bytes_of(ours.reset())
