"""Infos have one shape: the same keys in every step and every reset."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import DictInfoToList

from roller_env.envs.infos import rows_of
from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.result import REWARD_TERMS
from tests.envs.playing import wandering_actions

KEYS = {"success", "is_success", "score_percent", "coins", "time_s", "fall", "diverged"}
OPTIONS: dict[str, Any] = {"level": "bridge", "physics": "fast", "max_episode_steps": 60}


def test_every_info_of_a_game_has_the_same_keys_of_the_same_types() -> None:
    env = gym.make("Roller/Bridge-v0", physics="fast", max_episode_steps=85)
    kinds = {name: type(value) for name, value in env.reset(seed=11)[1].items()}
    assert set(kinds) == KEYS
    ends = set()
    for action, _ in zip(wandering_actions(1, 11), range(900), strict=False):
        _, _, terminated, truncated, info = env.step(action[0])
        terms = info.pop("reward_terms", None)
        # Gymnasium's own limit says nothing to the game, for which the episode goes on.
        assert (terms is not None) == env.unwrapped.simulation.state.over[0]  # type: ignore[attr-defined]
        assert {name: type(value) for name, value in info.items()} == kinds
        assert info["is_success"] == info["success"]
        if terminated or truncated:
            ends.add("fall" if info["fall"] else "time")
            assert {name: type(value) for name, value in env.reset()[1].items()} == kinds
    assert ends == {"fall", "time"}, "also the one that Gymnasium's own limit cuts"


def test_an_info_tells_how_the_game_stands() -> None:
    env = RollerEnv(level="flat")
    env.reset(seed=0, options={"coins": [0]})
    for step in range(1, 6):
        info = env.step(0)[4]
        count = int(env.simulation.coins_in_level[0])
        assert info["time_s"] == pytest.approx(step * 0.05)
        assert info["coins"] == count - 1
        assert info["score_percent"] == pytest.approx(100 * (count - 1) / count)


@pytest.mark.parametrize("mode", AutoresetMode)
def test_every_info_of_a_vector_tells_of_all_rows(mode: AutoresetMode) -> None:
    env = RollerVectorEnv(4, autoreset_mode=mode, **OPTIONS)
    _, info = env.reset(seed=11)
    ended = 0
    for action, _ in zip(wandering_actions(4, 11), range(150), strict=False):
        ends = {name for name in info if "final" in name or "reward_terms" in name}
        assert set(info) - ends == KEYS | {f"_{name}" for name in KEYS}
        assert all(info[f"_{name}"].all() for name in KEYS)
        _, _, terminated, truncated, info = env.step(action)
        done = terminated | truncated
        ended += int(done.sum())
        if mode is AutoresetMode.SAME_STEP and done.any():
            final = info["final_info"]
            told = KEYS | {"reward_terms"}
            assert set(final) == told | {f"_{name}" for name in told}
            assert (final["_time_s"] == done).all()
            assert (info["time_s"][done] == 0.0).all()
        if mode is AutoresetMode.DISABLED and done.any():
            _, reset_info = env.reset(options={"reset_mask": done})
            assert all((reset_info[f"_{name}"] == done).all() for name in KEYS)
    assert ended >= 4


def ended_in(mode: AutoresetMode, done: np.ndarray[Any, Any], info: dict[str, Any]) -> Any:
    """Return the infos, one a row, of the rows that have just ended in a vector."""
    told = info["final_info"] if mode is AutoresetMode.SAME_STEP else info
    assert (told["_reward_terms"] == done).all()
    assert all((told["reward_terms"][f"_{name}"] == done).all() for name in REWARD_TERMS)
    return rows_of(told)


@pytest.mark.parametrize("reward", ["points", "shaped"])
@pytest.mark.parametrize("mode", AutoresetMode)
def test_at_its_end_an_episode_tells_what_its_rewards_were_for(
    mode: AutoresetMode, reward: str
) -> None:
    env = RollerVectorEnv(4, autoreset_mode=mode, reward=reward, **OPTIONS)
    env.reset(seed=11)
    total, ends, progress = np.zeros(4), 0, 0.0
    for action, _ in zip(wandering_actions(4, 11), range(150), strict=False):
        _, rewards, terminated, truncated, info = env.step(action)
        total += rewards
        done = terminated | truncated
        assert ("reward_terms" in info.get("final_info", info)) == done.any()
        if not done.any():
            continue
        for row in np.flatnonzero(done):
            terms = ended_in(mode, done, info)[row]["reward_terms"]
            assert tuple(terms) == REWARD_TERMS
            assert sum(terms.values()) == pytest.approx(total[row], abs=1e-12)
            assert terms["fall"] == -1.0 * terminated[row]
            progress += abs(terms["progress"])
            ends += 1
        total[done] = 0.0
        if mode is AutoresetMode.DISABLED:
            env.reset(options={"reset_mask": done})
    assert ends >= 4
    assert (progress > 0.0) == (reward == "shaped")


def test_gymnasiums_own_vector_tells_the_terms_in_the_same_form() -> None:
    ours = RollerVectorEnv(2, **OPTIONS, num_threads=1)
    theirs = gym.vector.SyncVectorEnv([lambda: RollerEnv(**OPTIONS)] * 2)
    ours.reset(seed=11)
    theirs.reset(seed=11)
    for action, _ in zip(wandering_actions(2, 11), range(70), strict=False):
        told, expected = (env.step(action)[4] for env in (ours, theirs))
        assert told.keys() == expected.keys()
        if "reward_terms" in told:
            assert told["reward_terms"].keys() == expected["reward_terms"].keys()
            for name, values in told["reward_terms"].items():
                np.testing.assert_array_equal(values, expected["reward_terms"][name])
                assert values.dtype == expected["reward_terms"][name].dtype


def test_gymnasium_makes_one_info_a_row_of_a_vectors() -> None:
    env = DictInfoToList(RollerVectorEnv(2, **OPTIONS))
    _, infos = env.reset(seed=0)
    assert [set(info) for info in infos] == [KEYS] * 2
    assert [set(info) for info in env.step(np.zeros(2, int))[4]] == [KEYS] * 2


def test_an_info_stays_as_it_was_told() -> None:
    env = RollerVectorEnv(2, **OPTIONS)
    _, first = env.reset(seed=0)
    kept = {name: values.copy() for name, values in first.items()}
    for _ in range(30):
        _, _, _, _, info = env.step(np.ones(2, int))
    info["success"][:] = True
    assert not env.simulation.state.finished.any()
    assert all((first[name] == kept[name]).all() for name in kept)
