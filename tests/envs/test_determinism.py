from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from tests.envs.playing import bytes_of, row_of, wandering_actions

SEED, STEPS = 40, 320
MODES: list[dict[str, Any]] = [
    {"level": "bridge", "observation": "state", "reward": "shaped"},
    {"level": "classic", "observation": "rays", "reward": "points"},
    {"level": "gate", "observation": "dict", "reward": "shaped"},
]
# Short enough for several resets, which draw from the rows' generators.
LIMIT: dict[str, Any] = {"max_episode_steps": 85}

Trace = list[tuple[bytes, float, bool, bool]]


def single_trace(seed: int, **options: Any) -> Trace:
    """Play one game on through its resets; return the bits of all that was seen."""
    env = RollerEnv(**LIMIT, **options)
    observation, _ = env.reset(seed=seed)
    trace: Trace = [(bytes_of(observation), 0.0, False, False)]
    for action, _ in zip(wandering_actions(1, seed), range(STEPS), strict=False):
        observation, reward, terminated, truncated, _ = env.step(action[0])
        if terminated or truncated:
            observation, _ = env.reset()
        trace.append((bytes_of(observation), reward, terminated, truncated))
    return trace


def vector_traces(num_envs: int, threads: int, **options: Any) -> list[Trace]:
    """Play ``num_envs`` games on through their resets; return what each row saw."""
    env = RollerVectorEnv(
        num_envs, autoreset_mode="SameStep", num_threads=threads, **LIMIT, **options
    )
    observation, _ = env.reset(seed=SEED)
    rows = range(num_envs)
    traces: list[Trace] = [[(bytes_of(row_of(observation, i)), 0.0, False, False)] for i in rows]
    for action, _ in zip(wandering_actions(num_envs, SEED), range(STEPS), strict=False):
        observation, reward, terminated, truncated, _ = env.step(action)
        for i in rows:
            seen = (reward[i].item(), terminated[i].item(), truncated[i].item())
            traces[i].append((bytes_of(row_of(observation, i)), *seen))
    return traces


@pytest.mark.parametrize("options", MODES, ids=lambda options: options["level"])
def test_a_row_is_the_single_game_of_its_seed_in_any_number_of_rows_and_threads(
    options: dict[str, Any],
) -> None:
    singles = [single_trace(SEED + row, **options) for row in range(6)]
    assert sum(fell or timed_out for trace in singles for *_, fell, timed_out in trace) > 6
    for num_envs, threads in [(1, 1), (3, 2), (6, 3)]:
        assert vector_traces(num_envs, threads, **options) == singles[:num_envs]


def test_the_same_seed_gives_the_same_game_again_in_a_used_and_in_a_new_environment() -> None:
    first = single_trace(7, level="classic", observation="state")
    assert single_trace(7, level="classic", observation="state") == first
    used = RollerEnv(level="classic", **LIMIT)
    used.reset(seed=1)
    for action, _ in zip(wandering_actions(1), range(60), strict=False):
        used.step(action[0])
    observation, _ = used.reset(seed=7)
    assert bytes_of(observation) == first[0][0]
    for action, seen in zip(wandering_actions(1, 7), first[1:60], strict=False):
        assert bytes_of(used.step(action[0])[0]) == seen[0]


def test_rows_start_differently_and_so_do_seeds_and_episodes() -> None:
    env = RollerVectorEnv(64, level="flat")
    first, _ = env.reset(seed=0)
    second, _ = env.reset()
    elsewhere, _ = env.reset(seed=1000)
    starts = np.concatenate([first, second, elsewhere])[:, :2]
    assert len(np.unique(starts, axis=0)) == 3 * 64


def test_without_a_seed_no_two_environments_are_alike() -> None:
    starts = [RollerEnv(level="flat").reset()[0][:2].tobytes() for _ in range(3)]
    vector, _ = RollerVectorEnv(8, level="flat").reset()
    starts += [row[:2].tobytes() for row in vector]
    assert len(set(starts)) == len(starts)


def test_seeds_may_be_given_row_by_row_and_none_goes_on_with_the_rows_generator() -> None:
    env, other = (RollerVectorEnv(3, level="flat") for _ in range(2))
    consecutive, _ = env.reset(seed=5)
    listed, _ = other.reset(seed=[5, 6, 7])
    assert consecutive.tobytes() == listed.tobytes()
    unseeded, _ = env.reset()
    partly, _ = other.reset(seed=[None, 99, None])
    assert (unseeded == partly).all(axis=1).tolist() == [True, False, True]


def test_a_seed_counts_for_the_rows_that_are_reset() -> None:
    env = RollerVectorEnv(3, level="flat")
    first, _ = env.reset(seed=5)
    masked, _ = env.reset(seed=50, options={"reset_mask": np.array([False, True, False])})
    fresh, _ = RollerVectorEnv(3, level="flat").reset(seed=50)
    assert masked[1].tobytes() == fresh[1].tobytes()
    assert masked[[0, 2]].tobytes() == first[[0, 2]].tobytes()


@pytest.mark.parametrize("seed", [[1, 2], [1, 2, 3, 4], -1, "1", 1.5])
def test_seeds_that_do_not_fit_are_refused(seed: Any) -> None:
    env = RollerVectorEnv(3, level="flat")
    with pytest.raises((ValueError, TypeError, gym.error.Error), match=r"[Ss]eed"):
        env.reset(seed=seed)


@pytest.mark.usefixtures("opengl")
def test_pixels_are_each_rows_own_picture_as_the_single_game_shows_it() -> None:
    options: dict[str, Any] = {"level": "flat", "observation": "pixels", "width": 48, "height": 40}
    vector = RollerVectorEnv(2, autoreset_mode="SameStep", max_episode_steps=3, **options)
    singles = [RollerEnv(max_episode_steps=3, **options) for _ in range(2)]
    pictures, _ = vector.reset(seed=SEED)
    shown = [env.reset(seed=SEED + row)[0] for row, env in enumerate(singles)]
    for _ in range(3):
        assert (pictures.shape, pictures.dtype) == ((2, 40, 48, 3), np.uint8)
        assert pictures in vector.observation_space
        assert [picture.tobytes() for picture in pictures] == [one.tobytes() for one in shown]
        pictures, *_, info = vector.step(np.array([1, 3]))
        shown = [env.step(action)[0] for env, action in zip(singles, (1, 3), strict=True)]
    assert [picture.tobytes() for picture in info["final_obs"]] == [one.tobytes() for one in shown]
    begun = [env.reset()[0].tobytes() for env in singles]
    assert [picture.tobytes() for picture in pictures] == begun
    vector.close()
    for env in singles:
        env.close()
