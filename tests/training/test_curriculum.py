"""A start-state curriculum lets some games practise what is achieved least surely, and says so."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.envs.sb3 import TRUNCATED, RollerVecEnv
from roller_env.envs.spaces import shape_observation
from roller_env.level import Level
from roller_env.pieces.coin import COIN
from roller_env.training.curriculum import FROM_START, LOOKS_BACK, TICK_S, StartStateCurriculum
from tests.builders import make_level

ROWS = 4
EXPLORERS = 4
FORWARD = np.full(ROWS, 1)
ALL = ROWS + EXPLORERS


def with_curriculum(
    fraction: float, level: str | Level = "flat", explorers: int = EXPLORERS, **options: Any
) -> StartStateCurriculum:
    fast = {"physics": "fast", "control_dt_s": 0.1, "max_episode_steps": 60}
    environments = RollerVecEnv(level, ROWS + explorers, seed=1, **fast | options)
    curriculum = StartStateCurriculum(environments, fraction, seed=2, explorers=explorers)
    curriculum.reset()
    return curriculum


def played(curriculum: StartStateCurriculum, steps: int) -> list[tuple[int, dict[str, Any]]]:
    """Roll forward; return the rows whose episodes ended and what was told of each."""
    ended = []
    for _ in range(steps):
        _, _, dones, infos = curriculum.step(FORWARD)
        ended += [(row, infos[row]) for row in np.flatnonzero(dones).tolist()]
    return ended


def test_without_a_fraction_every_episode_begins_at_the_start() -> None:
    curriculum = with_curriculum(0.0, explorers=0)
    assert all(info[FROM_START] for _, info in played(curriculum, 130))


def test_the_rows_that_practise_begin_elsewhere_once_something_was_achieved() -> None:
    curriculum = with_curriculum(0.5)
    ended = played(curriculum, 200)
    assert {info[FROM_START] for row, info in ended if row >= ROWS // 2} == {True}
    assert {info[FROM_START] for row, info in ended[ROWS:] if row < ROWS // 2} == {False}


def test_a_kept_game_lies_at_most_as_far_back_as_its_task_says() -> None:
    curriculum = with_curriculum(0.5)
    played(curriculum, 200)
    games = curriculum.snapshot().games
    assert len({task // len(LOOKS_BACK) for task in games}) > 2, "several coins were found"
    for task, kept in games.items():
        goal = task // len(LOOKS_BACK)
        for game in kept:
            assert len(game) == 1
            achieved = game.game.achieved[0]
            assert goal == len(achieved) or not achieved[goal], "it is still to be achieved"


def test_the_coin_to_be_practised_is_within_the_way_of_its_time() -> None:
    curriculum = with_curriculum(0.5)
    played(curriculum, 200)
    coins = curriculum.environments.simulation.table.of(COIN).at[0]
    fastest_m_s, reach_m = 8.0, 1.0
    for task, kept in curriculum.snapshot().games.items():
        goal, look = divmod(task, len(LOOKS_BACK))
        longest_s = LOOKS_BACK[look] * TICK_S
        for game in kept:
            if goal < len(coins):
                away = np.linalg.norm(game.bodies.position[0] - coins[goal])
                assert away <= reach_m + fastest_m_s * longest_s


def test_practice_that_takes_too_long_is_cut_off_and_told_as_such() -> None:
    curriculum = with_curriculum(1.0, max_episode_steps=400)
    played(curriculum, 60)  # at the finish for the first time
    stand_still = np.zeros(ROWS, dtype=np.int64)
    cut = []
    for _ in range(200):
        _, _, dones, infos = curriculum.step(stand_still)
        cut += [info for info, done in zip(infos, dones, strict=True) if done and info[TRUNCATED]]
    assert len(cut) > ROWS
    for info in cut:
        assert info["terminal_observation"].shape == curriculum.observation_space.shape
        assert not info[FROM_START]


def test_a_game_from_the_start_that_stalls_is_over_for_good() -> None:
    curriculum = with_curriculum(0.5, max_episode_steps=400)
    ended = []
    for _ in range(100):
        _, _, dones, infos = curriculum.step(np.zeros(ROWS, dtype=np.int64))
        ended += [infos[row] for row in np.flatnonzero(dones).tolist()]
    assert [info["episode"]["l"] for info in ended] == [100] * (ROWS // 2)
    assert not any(info[TRUNCATED] or info["success"] for info in ended)
    steps = curriculum.environments.simulation.state.steps[ROWS // 2 : ROWS]
    assert steps.tolist() == [0] * (ROWS // 2)


def test_a_game_that_is_on_its_way_does_not_stall() -> None:
    curriculum = with_curriculum(0.5, make_level(), max_episode_steps=400)
    nothing = np.zeros(ROWS, dtype=np.int64)
    for step in range(250):
        _, _, dones, _ = curriculum.step(FORWARD if step < 5 else nothing)
        assert not dones.any(), step
    assert curriculum.environments.simulation.ball_position[ROWS - 1, 0] > 20.0


def test_the_time_limit_ends_a_game_for_good_since_the_agent_sees_it_coming() -> None:
    curriculum = with_curriculum(0.0, explorers=0, max_episode_steps=10)
    ended = played(curriculum, 10)
    assert [info[TRUNCATED] for _, info in ended] == [False] * ROWS


def test_the_explorers_are_hidden_from_the_learner() -> None:
    curriculum = with_curriculum(0.5)
    assert curriculum.num_envs == ROWS
    observations, rewards, dones, infos = curriculum.step(FORWARD)
    assert isinstance(observations, np.ndarray)
    assert (len(observations), len(rewards), len(dones), len(infos)) == (ROWS,) * 4


@pytest.mark.parametrize("action", ["directions", "keys", "force"])
def test_explorers_find_the_coins_of_a_level_in_every_action_mode(action: str) -> None:
    curriculum = with_curriculum(0.5, explorers=16, physics="rigid", action=action)
    space = curriculum.action_space
    actions = np.zeros((ROWS, *(space.shape or ())), dtype=space.dtype)
    for _ in range(300):
        curriculum.step(actions)
    found = {task // len(LOOKS_BACK) for task in curriculum.snapshot().games}
    assert len(found & set(range(12))) >= 9, "of the 12 coins"


def test_what_fails_is_practised_more_than_what_succeeds() -> None:
    curriculum = with_curriculum(0.5)
    played(curriculum, 200)
    tasks = sorted(curriculum.snapshot().games)
    curriculum._success[:] = 1.0
    curriculum._success[tasks[0]] = 0.0
    drawn, _ = curriculum._drawn(2000)
    expected = 1.1 / (1.1 + 0.1 * (len(tasks) - 1))
    assert np.mean(drawn == tasks[0]) == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize("observation", ["state", "rays", "dict"])
def test_what_is_shown_is_the_game_that_goes_on(observation: str) -> None:
    curriculum = with_curriculum(1.0, observation=observation)
    simulation = curriculum.environments.simulation
    begun = 0
    for _ in range(150):
        shown, _, dones, _ = curriculum.step(FORWARD)
        begun += int(dones.sum())
        seen = simulation.observe(np.arange(ROWS))
        expected = shape_observation(simulation.config, simulation.entries, seen)
        if isinstance(shown, dict):
            assert all(np.array_equal(shown[name], expected[name]) for name in expected)
        else:
            assert np.array_equal(shown, expected)
    assert begun > 2 * ROWS


def test_a_row_keeps_its_own_random_generator() -> None:
    curriculum = with_curriculum(1.0)
    played(curriculum, 130)
    generators = curriculum.environments.simulation.snapshot().generators
    assert len({str(generator) for generator in generators}) == ALL


@settings(max_examples=5, deadline=None)
@given(before=st.integers(1, 120))
def test_a_restored_curriculum_goes_on_bit_for_bit(before: int) -> None:
    first, second = with_curriculum(0.5), with_curriculum(0.5)
    played(first, before)
    second.restore(pickle.loads(pickle.dumps(first.snapshot())))
    for _ in range(60):
        one, other = first.step(FORWARD), second.step(FORWARD)
        assert isinstance(one[0], np.ndarray)
        assert isinstance(other[0], np.ndarray)
        assert one[0].tobytes() == other[0].tobytes()
        assert one[1].tobytes() == other[1].tobytes()
        for row in np.flatnonzero(one[2]).tolist():
            assert one[3][row][FROM_START] == other[3][row][FROM_START]
            assert one[3][row].get("episode", {}).get("r") == other[3][row].get("episode", {}).get(
                "r"
            )
