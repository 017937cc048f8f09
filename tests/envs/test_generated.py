"""``Roller/Generated-v1``: another level in every episode, each of them proved winnable."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import roller_env
from roller_env.envs.single import RollerEnv
from roller_env.level.generate import VERSIONS, generate
from roller_env.level.proved import proved_levels, read_verdicts, verdicts, write_verdicts
from roller_env.solver import Search
from roller_env.solver.search import GENERATED_BUDGET

ID = "Roller/Generated-v1"


def test_it_is_a_correct_environment() -> None:
    check_env(gym.make(ID, num_levels=5).unwrapped, skip_render_check=True)


def test_every_episode_may_be_on_another_of_its_levels() -> None:
    env = gym.make(ID, num_levels=4, difficulty=0.25)
    seen = {env.reset(seed=seed)[1]["level"] for seed in range(40)}
    assert seen == {0, 1, 2, 3}
    assert env.reset(seed=7)[1]["level"] == env.reset(seed=7)[1]["level"]


def test_a_vector_of_it_plays_the_same_levels_as_single_ones() -> None:
    vector = gym.make_vec(ID, num_envs=3, num_levels=6)
    single = gym.make(ID, num_levels=6)
    seen, info = vector.reset(seed=3)
    for row in range(3):
        alone, told = single.reset(seed=3 + row)
        np.testing.assert_array_equal(seen[row], alone)
        assert told["level"] == info["level"][row]
    for _ in range(30):
        seen, *_ = vector.step(np.full(3, 1))
        alone, *_ = single.step(1)
        np.testing.assert_array_equal(seen[2], alone)


def test_train_and_test_sets_are_ranges_of_seeds() -> None:
    assert proved_levels(3, 1_000_000) == [
        generate(seed, 0.25, verdicts()[0.25][seed]) for seed in range(1_000_000, 1_000_003)
    ]


def test_each_id_keeps_to_its_version_of_the_generator() -> None:
    for name, options in roller_env.GENERATED_IDS.items():
        env = gym.make(name, num_levels=2, disable_env_checker=True)
        inner = env.unwrapped
        assert isinstance(inner, RollerEnv)
        levels = inner.simulation.levels
        assert list(levels) == proved_levels(2, version=options["version"])
        assert options["num_levels"] <= len(verdicts(options["version"])[0.25])


def test_an_agent_fits_every_range_of_levels() -> None:
    few = gym.make(ID, num_levels=1, start_level=1_000_000, disable_env_checker=True)
    many = gym.make(ID, num_levels=20, disable_env_checker=True)
    assert few.observation_space == many.observation_space


def test_it_is_made_again_from_its_spec() -> None:
    env = gym.make(ID, num_levels=2, start_level=5)
    assert env.spec is not None
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    np.testing.assert_array_equal(env.reset(seed=1)[0], again.reset(seed=1)[0])


def test_a_level_that_nobody_proved_is_refused_and_what_there_is_is_told() -> None:
    with pytest.raises(ValueError, match=r"found seed 77777 .* of version 2 there are difficulty"):
        gym.make(ID, start_level=77_777)
    with pytest.raises(ValueError, match="difficulty"):
        gym.make(ID, difficulty=0.123)
    with pytest.raises(ValueError, match="num_levels: found 0"):
        gym.make(ID, num_levels=0)


@pytest.mark.parametrize("version", VERSIONS)
def test_what_the_table_says_is_won_is_won(version: int) -> None:
    """Some of the two easiest difficulties, searched anew."""
    for difficulty in sorted(verdicts(version))[:2]:
        known = verdicts(version)[difficulty]
        seeds = sorted(known)
        for seed in (seeds[0], seeds[len(seeds) // 2], seeds[-1]):
            attempt = known[seed]
            solution = Search(generate(seed, difficulty, attempt, version=version)).run(
                GENERATED_BUDGET
            )
            assert solution is not None


def test_a_table_is_read_as_it_was_written(tmp_path: Path) -> None:
    table = {0.5: {3: 0, 4: 19, 9: 1}, 1.0: {0: 2}}
    write_verdicts(table, tmp_path / "table.csv")
    assert read_verdicts(tmp_path / "table.csv") == table


@pytest.mark.usefixtures("opengl")
def test_each_level_is_drawn_as_itself() -> None:
    look: dict[str, Any] = {"render_mode": "rgb_array", "width": 96, "height": 64}
    env = gym.make(ID, num_levels=3, **look)
    levels, seen = proved_levels(3), set()
    for seed in range(8):
        _, info = env.reset(seed=seed)
        ball = env.unwrapped.simulation.ball_position[0]  # type: ignore[attr-defined]
        alone = gym.make("Roller/Level-v0", level=levels[info["level"]], physics="rigid", **look)
        alone.reset(seed=0, options={"position": ball})
        np.testing.assert_array_equal(env.render(), alone.render())
        alone.close()
        seen.add(info["level"])
    assert len(seen) > 1
    env.close()
