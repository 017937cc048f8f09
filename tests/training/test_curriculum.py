"""A start-state curriculum begins episodes where the agent has been, and says so."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.envs.spaces import shape_observation
from roller_env.training.curriculum import FROM_START, StartStateCurriculum

ROWS = 4
FORWARD = np.full(ROWS, 1)


def with_curriculum(fraction: float, **options: Any) -> StartStateCurriculum:
    fast = {"physics": "fast", "reward": "shaped", "max_episode_steps": 30}
    return StartStateCurriculum(
        RollerVecEnv("flat", ROWS, seed=1, **fast | options), fraction, seed=2
    )


def played(
    environments: StartStateCurriculum, steps: int
) -> tuple[list[bool], npt.NDArray[np.int64]]:
    """Roll forward; return where each ended episode had begun, and the steps its successor has."""
    from_start, steps_at_begin = [], []
    for _ in range(steps):
        _, _, dones, infos = environments.step(FORWARD)
        for row in np.flatnonzero(dones):
            from_start.append(infos[row][FROM_START])
            steps_at_begin.append(environments.environments.simulation.state.steps[row])
    return from_start, np.array(steps_at_begin)


def test_without_a_share_every_episode_begins_at_the_start() -> None:
    environments = with_curriculum(0.0)
    environments.reset()
    from_start, steps_at_begin = played(environments, 90)
    assert from_start == [True] * 3 * ROWS
    assert not steps_at_begin.any()


def test_with_all_of_the_share_only_the_first_episodes_begin_at_the_start() -> None:
    environments = with_curriculum(1.0)
    environments.reset()
    from_start, steps_at_begin = played(environments, 60)
    assert from_start[:ROWS] == [True] * ROWS
    assert set(from_start[ROWS:]) == {False}
    assert (steps_at_begin > 0).all()


def test_a_share_between_gives_both() -> None:
    environments = with_curriculum(0.5)
    environments.reset()
    from_start, _ = played(environments, 300)
    assert 0.25 < np.mean(from_start) < 0.75


@pytest.mark.parametrize("observation", ["state", "rays", "dict"])
def test_what_is_shown_is_the_game_that_goes_on(observation: str) -> None:
    environments = with_curriculum(1.0, observation=observation)
    environments.reset()
    simulation = environments.environments.simulation
    begun = 0
    for _ in range(70):
        shown, _, dones, _ = environments.step(FORWARD)
        begun += int(dones.sum())
        expected = shape_observation(simulation.config, simulation.observe())
        if isinstance(shown, dict):
            assert all(np.array_equal(shown[name], expected[name]) for name in expected)
        else:
            assert np.array_equal(shown, expected)
    assert begun > 0


def test_a_row_keeps_its_own_random_generator() -> None:
    environments = with_curriculum(1.0)
    environments.reset()
    played(environments, 60)
    generators = environments.environments.simulation.snapshot().generators
    assert len({str(generator) for generator in generators}) == ROWS


def test_a_restored_curriculum_goes_on_bit_for_bit() -> None:
    first, second = with_curriculum(0.5), with_curriculum(0.5)
    first.reset()
    second.reset()
    played(first, 45)
    second.restore(pickle.loads(pickle.dumps(first.snapshot())))
    for _ in range(90):
        one, other = first.step(FORWARD), second.step(FORWARD)
        assert isinstance(one[0], np.ndarray)
        assert isinstance(other[0], np.ndarray)
        assert one[0].tobytes() == other[0].tobytes()
        assert one[1].tobytes() == other[1].tobytes()
        for row in np.flatnonzero(one[2]):
            assert one[3][row][FROM_START] == other[3][row][FROM_START]
            assert one[3][row]["episode"]["r"] == other[3][row]["episode"]["r"]
