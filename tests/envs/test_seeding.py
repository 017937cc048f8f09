"""Seeds as callers pass them, against what Gymnasium's own vector does with them."""

from __future__ import annotations

import sys
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv

from roller_env.envs.single import RollerEnv
from roller_env.envs.vector import RollerVectorEnv

SEEDS: list[Any] = [
    7,
    np.int64(7),
    np.array(7),
    [4, 5, 6],
    (4, 5, 6),
    [np.int64(4), np.uint8(5), 6],
    [4, None, 6],
    np.arange(3),
    np.arange(3, dtype=np.uint16),
    2**70,
]


def plain(seed: Any) -> Any:
    """Return the seed in the integers that Gymnasium's vector takes."""
    if isinstance(seed, list | tuple):
        return [None if one is None else int(one) for one in seed]
    return seed.tolist() if isinstance(seed, np.ndarray | np.generic) else seed


@pytest.mark.parametrize("seed", SEEDS, ids=repr)
def test_a_vector_is_seeded_as_gymnasiums_own(seed: Any) -> None:
    ours = RollerVectorEnv(3, level="flat")
    theirs = SyncVectorEnv([lambda: RollerEnv(level="flat")] * 3)
    for given in (1, seed):
        found, _ = ours.reset(seed=given)
        expected, _ = theirs.reset(seed=plain(given))
        assert found.tobytes() == expected.tobytes()
        assert ours.np_random_seed == theirs.np_random_seed
        assert all(type(one) is int for one in ours.np_random_seed)
        states = [generator.bit_generator.state for generator in theirs.np_random]
        assert [generator.bit_generator.state for generator in ours.np_random] == states
    assert ours.reset()[0].tobytes() == theirs.reset()[0].tobytes()


def test_only_the_rows_that_are_reset_are_seeded() -> None:
    env = RollerVectorEnv(3, level="flat")
    env.reset(seed=1)
    env.reset(seed=50, options={"reset_mask": np.array([False, True, False])})
    assert env.np_random_seed == (1, 51, 3)


def test_a_vector_has_generators_of_its_own_before_any_seed() -> None:
    one, two = RollerVectorEnv(2, level="flat"), RollerVectorEnv(2, level="flat")
    seeds = (*one.np_random_seed, *two.np_random_seed)
    assert len(set(seeds)) == 4
    assert one.reset()[0].tobytes() != two.reset()[0].tobytes()
    again = RollerVectorEnv(2, level="flat")
    again.reset(seed=list(seeds[:2]))
    one.reset(seed=list(one.np_random_seed))
    assert again.np_random_seed == one.np_random_seed


@pytest.mark.parametrize("seed", [7, np.int64(7), np.array(7)], ids=repr)
def test_a_game_takes_numpys_integers_as_seeds(seed: Any) -> None:
    env, usual = RollerEnv(level="flat"), RollerEnv(level="flat")
    assert env.reset(seed=seed)[0].tobytes() == usual.reset(seed=7)[0].tobytes()
    assert env.np_random_seed == 7
    wrapped = gym.make("Roller/Flat-v0")
    assert wrapped.reset(seed=seed)[0].tobytes() == usual.reset(seed=7)[0].tobytes()


@pytest.mark.parametrize("seed", [-1, 1.5, "7", True, [1, 2], [1, 2, -3], np.ones(3), [[1], [2]]])
def test_a_seed_that_is_none_is_refused_before_anything_changes(seed: Any) -> None:
    for env in (RollerVectorEnv(3, level="flat"), RollerEnv(level="flat")):
        env.reset(seed=5)
        before = env.get_state()
        with pytest.raises((TypeError, ValueError), match="seed: found"):
            env.reset(seed=seed)
        assert env.get_state().generators == before.generators
        assert env.get_state().physics.tobytes() == before.physics.tobytes()


def test_options_that_are_none_are_refused_by_a_vector_too() -> None:
    env = RollerVectorEnv(2, level="flat")
    mask = np.array([True, False])
    with pytest.raises(ValueError, match=r"'reset_maks'; allowed are .*mean 'reset_mask'"):
        env.reset(options={"reset_maks": mask})
    with pytest.raises(TypeError, match="options: found 5; must be None or a mapping"):
        env.reset(options=5)  # type: ignore[arg-type]
    single = RollerEnv(level="flat")
    with pytest.raises(ValueError, match="unknown key 'reset_mask'"):
        single.reset(options={"reset_mask": mask[:1]})
    single.reset(options={"position": None, "intro": np.bool_(True)})
    assert single.simulation.state.control_delay_s[0] == 6.0


def test_a_bad_option_of_a_vector_leaves_no_second_error_behind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Gymnasium before 1.3 closes a vector when it is collected, however little of it was made."""

    class OfOldGymnasium(RollerVectorEnv):
        def __del__(self) -> None:
            if not getattr(self, "closed", True):
                self.close()

    unraisable: list[Any] = []
    monkeypatch.setattr(sys, "unraisablehook", unraisable.append)
    with pytest.raises(ValueError, match="level"):
        OfOldGymnasium(2, level=3)
    with pytest.raises(TypeError, match="frameskip"):
        OfOldGymnasium(2, frameskip=3)
    assert unraisable == []
