"""Every episode of an evaluation can be kept, and is the episode that was evaluated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.replay import load_replay, verify
from roller_env.training.evaluate import Evaluation, evaluate
from roller_env.training.files import RunError
from roller_env.training.normalisation import Observations
from roller_env.training.replays import save_replays
from tests.training.small import small_config

CONFIG = small_config(evaluation_environment={"max_episode_steps": 120})


def each_row_another_way(observations: Observations) -> npt.NDArray[Any]:
    return np.arange(len(observations)) % 9


@pytest.fixture(scope="module")
def evaluation() -> Evaluation:
    environments = RollerVecEnv("flat", 6, **CONFIG.evaluation_options)
    return evaluate(each_row_another_way, environments, seed=5, episodes_per_row=2)


def test_every_episode_is_kept_as_it_was_evaluated(evaluation: Evaluation, tmp_path: Path) -> None:
    files = save_replays(evaluation, CONFIG, tmp_path / "new", "policy of a test")
    assert [file.name for file in files] == [f"episode-{i:04d}.replay" for i in range(12)]
    assert len({episode.outcome for episode in evaluation.episodes}) == 3
    for episode, file in zip(evaluation.episodes, files, strict=True):
        replay = load_replay(file)
        assert verify(replay).is_exact
        assert replay.player == "policy of a test"
        assert replay.result.outcome == episode.outcome
        assert replay.result.total_reward == pytest.approx(episode.total_reward)
        assert len(replay) == episode.steps
        assert np.array_equal(replay.force_n, episode.force_n)


def test_an_episode_that_does_not_come_out_the_same_is_not_passed_off_as_it(
    evaluation: Evaluation, tmp_path: Path
) -> None:
    first, *others = evaluation.episodes
    richer = replace(evaluation, episodes=(replace(first, coins=first.coins + 1), *others))
    with pytest.raises(RunError, match=r"episode 0: found .* it had been"):
        save_replays(richer, CONFIG, tmp_path, "nobody")
    # The others are kept.
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        f"episode-{number:04d}.replay" for number in range(1, 12)
    ]
