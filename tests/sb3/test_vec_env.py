from __future__ import annotations

import copy
import pickle
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.wrappers import TimeLimit
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import KVWriter, Logger
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecCheckNan, VecEnv, VecNormalize

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
            timed_out += infos[row]["TimeLimit.truncated"]
            fell += infos[row]["fall"]
        assert ours.reset_infos == theirs.reset_infos
    assert min(fell, timed_out) > 1


def compare_infos(found: dict[str, Any], expected: dict[str, Any], ended: bool) -> None:
    """Compare all that an info says."""
    found, expected = dict(found), dict(expected)
    if ended:
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


def test_each_row_can_be_given_options_of_its_own() -> None:
    env, plain = RollerVecEnv("flat", 2, seed=0), RollerVecEnv("flat", 2, seed=0)
    env.set_options([{"intro": True, "coins": [0]}, {"position": (1.0, 0.5, 0.5)}])
    observation, usual = env.reset(), plain.reset()
    count = env.simulation.coins_in_level[0]
    assert [info["coins"] for info in env.reset_infos] == [count - 1, 0]
    assert env.simulation.state.control_delay_s.tolist() == [6.0, 0.0]
    assert env.simulation.ball_position[1].tolist() == [1.0, 0.5, 0.5]
    assert row_of(observation, 0)[:9].tobytes() == row_of(usual, 0)[:9].tobytes()
    env.set_options({"reset_maks": np.ones(2, dtype=bool)})
    with pytest.raises(ValueError, match="did you mean 'reset_mask'"):
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


def test_attributes_of_a_game_are_the_rows_own() -> None:
    env = RollerVecEnv(num_envs=3, seed=5, **OPTIONS)
    env.reset()
    theirs = DummyVecEnv([lambda: RollerEnv(**OPTIONS)] * 3)
    theirs.seed(5)
    theirs.reset()
    for name in ("action_space", "observation_space", "np_random_seed", "render_mode"):
        assert env.get_attr(name) == theirs.get_attr(name), name
        assert env.get_attr(name, indices=[2]) == theirs.get_attr(name, indices=[2]), name
    states = [generator.bit_generator.state for generator in env.get_attr("np_random")]
    assert states == [g.bit_generator.state for g in theirs.get_attr("np_random")]


def test_a_row_is_reset_alone_as_stable_baselines_own_vector_does_it() -> None:
    ours = RollerVecEnv(num_envs=3, seed=SEED, **OPTIONS)
    theirs = DummyVecEnv([lambda: Monitor(RollerEnv(**OPTIONS))] * 3)
    theirs.seed(SEED)
    ours.reset()
    theirs.reset()
    for step, action in zip(range(120), wandering_actions(3, SEED), strict=False):
        if step == 40:
            ways: list[dict[str, Any]] = [{}, {"seed": 3}, {"options": {"intro": True}}]
            for arguments in ways:
                ((found, info),) = ours.env_method("reset", indices=[1], **arguments)
                ((expected, their_info),) = theirs.env_method("reset", indices=[1], **arguments)
                assert bytes_of(found) == bytes_of(expected)
                assert info == their_info
        found, reward, done, infos = ours.step(action)
        expected, their_reward, their_done, their_infos = theirs.step(action)
        assert bytes_of(found) == bytes_of(expected)
        assert (reward.tobytes(), done.tolist()) == (their_reward.tobytes(), their_done.tolist())
        for row in range(3):
            compare_infos(infos[row], their_infos[row], ended=bool(done[row]))


def test_what_cannot_be_done_to_one_row_is_refused() -> None:
    env = RollerVecEnv(num_envs=2, **OPTIONS)
    env.reset()
    for method in ("step", "close"):
        with pytest.raises(ValueError, match=f"the rows share one environment, so '{method}'"):
            env.env_method(method, indices=[0])
    with pytest.raises(AttributeError, match=r"no method 'get_stat'; .*did you mean 'get_state'"):
        env.env_method("get_stat")
    with pytest.raises(IndexError):
        env.env_method("reset", indices=[2])
    assert len(env.env_method("reset", indices=np.int64(1))) == 1  # type: ignore[arg-type]
    assert len(env.env_method("reset", indices=-1)) == 1


def test_without_a_render_mode_nothing_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    env = RollerVecEnv(num_envs=2, **OPTIONS)
    env.reset()

    def draw(row: int) -> None:
        pytest.fail(f"row {row} was drawn")

    monkeypatch.setattr(env.vector, "picture", draw)
    assert list(env.get_images()) == [None, None]
    with pytest.warns(UserWarning, match="render_mode='rgb_array'"):
        assert env.env_method("render") == [None, None]


def test_a_seed_of_numpys_is_a_seed() -> None:
    ours, plain = RollerVecEnv("flat", 2, seed=np.int64(3)), RollerVecEnv("flat", 2, seed=3)
    assert ours.reset().tobytes() == plain.reset().tobytes()
    ours.seed(np.int32(8))  # type: ignore[arg-type]
    plain.seed(8)
    assert ours.reset().tobytes() == plain.reset().tobytes()
    for seed in (-1, 1.5, "3", True):
        with pytest.raises((TypeError, ValueError), match="seed: found"):
            RollerVecEnv("flat", 2, seed=seed)  # type: ignore[arg-type]


@pytest.mark.parametrize("how", ["copied", "pickled", "restored"])
def test_a_vector_for_training_goes_on_with_the_same_bits(how: str) -> None:
    """In the middle of episodes, between step_async and step_wait, a seed waiting for the reset."""
    one = RollerVecEnv(num_envs=3, seed=SEED, reward="shaped", **OPTIONS)
    one.reset()
    actions = wandering_actions(3, SEED)
    for action, _ in zip(actions, range(70), strict=False):
        one.step(action)
    one.step_async(next(actions))
    if how == "restored":
        two = RollerVecEnv(num_envs=3, reward="shaped", **OPTIONS)
        two.set_state(pickle.loads(pickle.dumps(one.get_state())))
        two.step_async(one._actions)
    else:
        one.seed(77)
        two = copy.deepcopy(one) if how == "copied" else pickle.loads(pickle.dumps(one))
    ended = 0
    for action, _ in zip(actions, range(100), strict=False):
        found, expected = two.step_wait(), one.step_wait()
        assert bytes_of(found[0]) == bytes_of(expected[0])
        assert found[1].tobytes() == expected[1].tobytes()
        for info, their_info, done in zip(found[3], expected[3], expected[2], strict=True):
            compare_infos(info, their_info, ended=bool(done))
        ended += int(expected[2].sum())
        one.step_async(action)
        two.step_async(action)
    assert ended >= 3
    assert two.reset().tobytes() == one.reset().tobytes()


def test_a_row_of_a_vector_for_training_is_put_back_alone() -> None:
    env = RollerVecEnv(num_envs=3, seed=SEED, **OPTIONS)
    env.reset()
    actions = list(zip(range(60), wandering_actions(3, SEED), strict=False))
    for _, action in actions[:20]:
        env.step(action)
    (state,) = env.env_method("get_state", indices=[1])
    first = [env.step(action) for _, action in actions[20:40]]
    before = env.get_state()
    env.env_method("set_state", state, indices=[1])
    after = env.get_state()
    assert (after.lengths - before.lengths).tolist() == [0, -20, 0]
    for _, action in actions[20:40]:
        (observation, *_), (seen, *_) = env.step(action), first.pop(0)
        assert row_of(observation, 1).tobytes() == row_of(seen, 1).tobytes()
    with pytest.raises(TypeError, match="get_state"):
        env.set_state(state.games)
    with pytest.raises(ValueError, match="rows"):
        env.set_state(state)


def test_monitored_games_in_stable_baselines_own_vector_can_be_copied_and_pickled() -> None:
    one = DummyVecEnv([lambda: Monitor(gym.make("Roller/Bridge-v0", max_episode_steps=50))] * 2)
    one.seed(3)
    one.reset()
    actions = wandering_actions(2)
    for action, _ in zip(actions, range(30), strict=False):
        one.step(action)
    copies = [copy.deepcopy(one), pickle.loads(pickle.dumps(one))]
    for action, _ in zip(actions, range(60), strict=False):
        expected = one.step(action)
        for other in copies:
            found = other.step(action)
            assert bytes_of(found[0]) == bytes_of(expected[0])
            assert found[2].tolist() == expected[2].tolist()


def test_a_monitor_finds_the_results_where_gymnasiums_time_limit_cuts(tmp_path: Path) -> None:
    keys = ("success", "score_percent", "coins", "fall", "diverged")
    env = Monitor(
        gym.make("Roller/Flat-v0", max_episode_steps=3),
        str(tmp_path / "log"),
        info_keywords=keys,
    )
    for _ in range(2):
        env.reset(seed=0)
        ended = False
        while not ended:
            _, _, terminated, truncated, info = env.step(0)
            ended = terminated or truncated
        assert {key: info["episode"][key] for key in keys} == {key: info[key] for key in keys}
    env.close()
    assert "success" in (tmp_path / "log.monitor.csv").read_text()


@pytest.mark.usefixtures("one_torch_thread")
@pytest.mark.parametrize("kind", ["ours", "theirs"])
def test_the_success_rate_is_logged(kind: str) -> None:
    options = {**OPTIONS, "max_episode_steps": 16}
    env: VecEnv = RollerVecEnv(num_envs=2, seed=0, **options)
    if kind == "theirs":
        env = DummyVecEnv([lambda: Monitor(RollerEnv(**options))] * 2)
    agent = PPO("MlpPolicy", env, n_steps=32, batch_size=64, n_epochs=1, device="cpu")
    logged: dict[str, Any] = {}
    agent.set_logger(Logger(None, [_Keeps(logged)]))
    agent.learn(128)
    assert logged["rollout/success_rate"] == 0.0


class _Keeps(KVWriter):
    """Keeps what is logged."""

    def __init__(self, logged: dict[str, Any]) -> None:
        self._logged = logged

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        self._logged.update(key_values)

    def close(self) -> None:
        pass


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
