"""The vector environment against Gymnasium's own definition of the three autoreset modes."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv
from tests.envs.playing import wandering_actions

ENVS, STEPS, SEED = 5, 320, 11
# Some balls fall off the bridges before this and some do not.
OPTIONS: dict[str, Any] = {"level": "bridge", "physics": "fast", "max_episode_steps": 85}


def both(mode: AutoresetMode, **options: Any) -> tuple[RollerVectorEnv, SyncVectorEnv]:
    """Return our vector of games and Gymnasium's vector of single games, in the same mode."""
    ours = RollerVectorEnv(ENVS, autoreset_mode=mode, **OPTIONS, **options)
    singles = [lambda: RollerEnv(**OPTIONS, **options)] * ENVS
    return ours, SyncVectorEnv(singles, autoreset_mode=mode)


@pytest.mark.parametrize(
    "options",
    [
        {"observation": "state", "action": "directions", "reward": "points"},
        {"observation": "rays", "action": "keys", "reward": "shaped"},
        {"observation": "dict", "action": "force", "reward": "shaped"},
    ],
    ids=lambda options: options["observation"],
)
@pytest.mark.parametrize("mode", AutoresetMode)
def test_every_step_is_that_of_gymnasiums_vector_of_single_games(
    mode: AutoresetMode, options: dict[str, Any]
) -> None:
    ours, theirs = both(mode, **options)
    found: Any = ours.reset(seed=SEED)
    expected: Any = theirs.reset(seed=SEED)
    assert data_equivalence(found, expected, exact=True)
    fell = timed_out = 0
    actions = wandering_actions(ENVS, SEED, ours.config.action)
    for action, _ in zip(actions, range(STEPS), strict=False):
        found, expected = ours.step(action), theirs.step(action)
        assert data_equivalence(found, expected, exact=True), describe(found, expected)
        _, _, terminated, truncated, _ = found
        fell += int(terminated.sum())
        timed_out += int(truncated.sum())
        done = terminated | truncated
        if mode is AutoresetMode.DISABLED and done.any():
            found = ours.reset(options={"reset_mask": done})
            expected = theirs.reset(options={"reset_mask": done.copy()})
            assert data_equivalence(found, expected, exact=True)
    assert min(fell, timed_out) > 3, f"{fell} fell, {timed_out} timed out"


def describe(found: tuple[Any, ...], expected: tuple[Any, ...]) -> str:
    names = ("observation", "reward", "terminated", "truncated", "info")
    return "\n".join(
        f"{name}: found {ours!r}, expected {theirs!r}"
        for name, ours, theirs in zip(names, found, expected, strict=True)
        if not data_equivalence(ours, theirs, exact=True)
    )


@pytest.mark.parametrize("mode", AutoresetMode)
def test_make_vec_makes_the_same_games_from_either_entry_point(mode: AutoresetMode) -> None:
    options: dict[str, Any] = {"level": "bridge", "observation": "dict"}
    ours = gym.make_vec(
        "Roller/Level-v0",
        ENVS,
        vectorization_mode="vector_entry_point",
        autoreset_mode=mode,
        **options,
    )
    theirs = gym.make_vec(
        "Roller/Level-v0",
        ENVS,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        **options,
    )
    assert ours.metadata == theirs.metadata
    assert ours.single_observation_space == theirs.single_observation_space
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    found: Any = ours.reset(seed=3)
    expected: Any = theirs.reset(seed=3)
    for action, _ in zip(wandering_actions(ENVS), range(40), strict=False):
        assert data_equivalence(found, expected, exact=True)
        found, expected = ours.step(action), theirs.step(action)


@pytest.mark.parametrize("mode", AutoresetMode)
def test_the_intro_holds_the_keys_in_a_vector_as_in_a_single_game(mode: AutoresetMode) -> None:
    ours, theirs = both(mode)
    found: Any = ours.reset(seed=1, options={"intro": True})
    expected: Any = theirs.reset(seed=1, options={"intro": True})
    for _ in range(30):
        assert data_equivalence(found, expected, exact=True)
        found, expected = ours.step(np.ones(ENVS, int)), theirs.step(np.ones(ENVS, int))
    rolled = RollerVectorEnv(ENVS, **OPTIONS)
    rolled.reset(seed=1)
    for _ in range(30):
        moved = rolled.step(np.ones(ENVS, int))
    assert not data_equivalence(found[0], moved[0])


def test_a_mask_resets_its_rows_alone_and_stays_as_the_caller_made_it() -> None:
    env = RollerVectorEnv(3, autoreset_mode="Disabled", **OPTIONS)
    env.reset(seed=0)
    for action, _ in zip(wandering_actions(3), range(10), strict=False):
        before, *_ = env.step(action)
    options = {"reset_mask": np.array([False, True, False])}
    after, _ = env.reset(options=options)
    assert (after == before).all(axis=1).tolist() == [True, False, True]
    assert options["reset_mask"].tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("mask", "error"),
    [
        ([True, False, True], TypeError),
        (np.array([1, 0, 1]), TypeError),
        (np.array([True, False]), ValueError),
    ],
)
def test_a_mask_that_is_none_is_refused(mask: Any, error: type[Exception]) -> None:
    env = RollerVectorEnv(3, autoreset_mode="Disabled", **OPTIONS)
    env.reset(seed=0)
    with pytest.raises(error, match="reset_mask"):
        env.reset(options={"reset_mask": mask})


def test_an_empty_mask_resets_nothing() -> None:
    env = RollerVectorEnv(3, autoreset_mode="Disabled", **OPTIONS)
    env.reset(seed=0)
    before, *_ = env.step(np.ones(3, int))
    after, _ = env.reset(options={"reset_mask": np.zeros(3, dtype=bool)})
    assert (after == before).all()


def test_without_autoreset_a_step_of_a_game_that_is_over_is_an_error() -> None:
    env = RollerVectorEnv(2, autoreset_mode="Disabled", level="bridge", max_episode_steps=2)
    env.reset(seed=0)
    for _ in range(2):
        env.step(np.zeros(2, int))
    with pytest.raises(gym.error.ResetNeeded, match=r"rows \[0, 1\] are over.*reset_mask"):
        env.step(np.zeros(2, int))


@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_step_before_the_first_reset_is_an_error(mode: AutoresetMode) -> None:
    env = RollerVectorEnv(2, autoreset_mode=mode, **OPTIONS)
    with pytest.raises(gym.error.ResetNeeded, match=r"reset\(\)"):
        env.step(np.zeros(2, int))
    single = RollerEnv(**OPTIONS)
    with pytest.raises(gym.error.ResetNeeded, match=r"reset\(\)"):
        single.step(0)


def test_a_single_game_that_is_over_asks_for_a_reset() -> None:
    env = RollerEnv(level="flat", max_episode_steps=1)
    env.reset(seed=0)
    assert env.step(0)[3]
    with pytest.raises(gym.error.ResetNeeded, match=r"reset\(\)"):
        env.step(0)
