"""Stable-Baselines3's vector of processes beside ours."""

from __future__ import annotations

import multiprocessing

import numpy as np
import pytest
from stable_baselines3.common.vec_env import SubprocVecEnv

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.envs.single import RollerEnv


@pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="nothing forks here"
)
def test_forked_processes_play_the_games_of_the_vector_that_was_stepped_before() -> None:
    actions = np.array([1, 3])
    ours = RollerVecEnv("flat", 2, seed=4, num_threads=2)
    expected = [np.array(ours.reset())]
    expected += [np.array(ours.step(actions)[0]) for _ in range(3)]
    theirs = SubprocVecEnv([lambda: RollerEnv(level="flat")] * 2, start_method="fork")
    theirs.seed(4)
    found = [np.array(theirs.reset())]
    found += [np.array(theirs.step(actions)[0]) for _ in range(3)]
    theirs.close()
    ours.close()
    assert np.array_equal(found, expected)
