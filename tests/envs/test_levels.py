"""A vector in which every episode may be of another level."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from roller_env.envs.vector import RollerVectorEnv
from roller_env.level.generate import generate

NAMES = ("flat", "gate", "lift", "classic", "bridge")
ROWS = 20


def several(**options: Any) -> RollerVectorEnv:
    given: dict[str, Any] = {
        "physics": "rigid",
        "autoreset_mode": "SameStep",
        "num_threads": 1,
    } | options
    return RollerVectorEnv(ROWS, levels=NAMES, **given)


def actions(steps: int) -> list[np.ndarray]:
    random = np.random.default_rng(4)
    return [random.integers(0, 9, ROWS) for _ in range(steps)]


@pytest.mark.parametrize("observation", ["state", "rays"])
def test_each_row_does_what_its_level_does_alone_to_the_bit(observation: str) -> None:
    env = several(observation=observation, max_episode_steps=120)
    env.reset(seed=0)
    alone = {
        name: RollerVectorEnv(
            1,
            level=name,
            physics="rigid",
            observation=observation,
            max_episode_steps=120,
            autoreset_mode="Disabled",
        )
        for name in NAMES
    }
    level_of, starts = env.simulation.level_of, env.simulation.ball_position
    played = actions(119)
    seen = [env.step(action) for action in played]
    assert len(set(level_of)) == len(NAMES)
    for row, number in enumerate(level_of):
        one = alone[NAMES[number]]
        one.reset(seed=0)
        snapshot = one.get_state()
        snapshot.bodies.position[:] = starts[row]
        one.set_state(snapshot)
        for action, (ours, reward, terminated, truncated, _) in zip(played, seen, strict=True):
            theirs, *others, _ = one.step(action[row : row + 1])
            assert [values[0] for values in others] == [
                values[row] for values in (reward, terminated, truncated)
            ]
            if terminated[row] or truncated[row]:
                break
            assert theirs[0].tobytes() == ours[row].tobytes()


def test_every_reset_draws_a_level_and_says_which() -> None:
    env = several(max_episode_steps=2)
    _, info = env.reset(seed=3)
    drawn = [info["level"]]
    for action in actions(80):
        *_, info = env.step(action)
        assert info["_level"].all()
        drawn.append(info["level"])
    counts = np.bincount(np.concatenate(drawn), minlength=len(NAMES))
    assert counts.min() > 0.7 * counts.mean()
    _, again = several(max_episode_steps=2).reset(seed=3)
    assert again["level"].tolist() == drawn[0].tolist()


def test_the_time_limit_is_that_of_the_level() -> None:
    env = several()
    env.reset(seed=0)
    limits = {"flat": 60, "gate": 60, "lift": 60, "classic": 120, "bridge": 60}
    lengths = env.simulation._games.concluding.max_steps * env.simulation.duration_s
    for number, length in zip(env.simulation.level_of, lengths, strict=True):
        assert length == pytest.approx(limits[NAMES[number]], abs=60.1)
        assert length == pytest.approx(env.simulation.levels[number].time_limit_s)


def test_a_copy_a_pickle_and_a_state_go_on_with_the_same_bits() -> None:
    env = several(max_episode_steps=30)
    env.reset(seed=1)
    for action in actions(50):
        env.step(action)
    state = env.get_state()
    others = [copy.deepcopy(env), pickle.loads(pickle.dumps(env)), several(max_episode_steps=30)]
    others[2].reset(seed=9)
    others[2].set_state(state)
    for action in actions(50):
        observation, reward, *_ = env.step(action)
        for other in others:
            theirs = other.step(action)
            assert theirs[0].tobytes() == observation.tobytes()
            assert theirs[1].tobytes() == reward.tobytes()
    assert several().spec is None


def test_hundreds_of_generated_levels_are_played_at_once() -> None:
    levels = [generate(seed, (seed % 11) / 10, version=1) for seed in range(200)]
    env = RollerVectorEnv(64, levels=levels, physics="rigid", max_episode_steps=20)
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(60):
        observation, *_ = env.step(env.action_space.sample())
        assert np.isfinite(observation).all()
    assert len(set(env.simulation.level_of)) > 30


@pytest.mark.parametrize("physics", ["fast", "default", "accurate"])
def test_mujoco_plays_one_level(physics: str) -> None:
    with pytest.raises(ValueError, match=rf"levels: found 2 with physics '{physics}'"):
        RollerVectorEnv(2, levels=["flat", "gate"], physics=physics)
    one = RollerVectorEnv(2, levels=["gate"], physics=physics)
    assert one.simulation.level.name == "gate"


def test_what_asks_for_one_level_is_refused() -> None:
    env = several()
    env.reset(seed=0)
    with pytest.raises(ValueError, match="found 5 levels in one simulation"):
        env.reset(options={"position": np.zeros((ROWS, 3))})
    with pytest.raises(ValueError, match="levels: found none"):
        RollerVectorEnv(2, levels=[], physics="rigid")
    other = RollerVectorEnv(ROWS, level="flat", physics="rigid")
    other.reset(seed=0)
    with pytest.raises(ValueError, match="snapshot: found one of level 'flat'"):
        env.set_state(other.get_state())


def test_gymnasium_makes_it() -> None:
    env = gym.make_vec(
        "roller_env:Roller/Level-v0",
        num_envs=4,
        vectorization_mode="vector_entry_point",
        levels=["flat", "gate"],
        physics="rigid",
    )
    env.reset(seed=0)
    assert env.spec is not None
    assert '"levels"' in env.spec.to_json()
    env.close()
