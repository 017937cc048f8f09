"""Evaluation counts whole episodes, each row equally, and its intervals are the textbook's."""

from __future__ import annotations

import math
from collections import Counter
from statistics import NormalDist
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.training.evaluate import (
    MAX_ROWS,
    Estimate,
    evaluate,
    mean_with_interval,
    proportion,
    rows_and_repeats,
)
from roller_env.training.files import RunError
from roller_env.training.normalisation import Observations

Z95 = NormalDist().inv_cdf(0.975)
FORWARD = 1


def all_but_the_first_row_wait(observations: Observations) -> npt.NDArray[Any]:
    actions = np.zeros(len(observations), dtype=np.int64)
    actions[0] = FORWARD
    return actions


@pytest.mark.parametrize("episodes", [0, -1, 10**9])
def test_a_number_of_episodes_that_cannot_be_played_is_refused(episodes: int) -> None:
    with pytest.raises(RunError, match=f"episodes: found {episodes}; must be 1 to 1000000"):
        rows_and_repeats(episodes)


@given(st.integers(1, 10_000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_ends_of_a_rates_interval_are_where_the_score_test_just_rejects(
    counts: tuple[int, int],
) -> None:
    successes, trials = counts
    estimate = proportion(successes, trials)
    assert estimate.mean == successes / trials
    for end in (estimate.low, estimate.high):
        squared = (estimate.mean - end) ** 2
        assert squared == pytest.approx(Z95**2 * end * (1 - end) / trials, rel=1e-6, abs=1e-12)


def test_a_perfect_rate_still_has_a_width() -> None:
    estimate = proportion(100, 100)
    assert estimate.high == pytest.approx(1.0)
    assert estimate.low == pytest.approx(100 / (100 + Z95**2))


def test_the_interval_of_a_mean_agrees_with_theory_where_theory_applies() -> None:
    sample = np.random.default_rng(1).normal(50.0, 4.0, 400)
    estimate = mean_with_interval(sample.tolist())
    half = Z95 * sample.std(ddof=1) / math.sqrt(sample.size)
    assert estimate.mean == pytest.approx(sample.mean())
    assert estimate.mean - estimate.low == pytest.approx(half, rel=0.05)
    assert estimate.high - estimate.mean == pytest.approx(half, rel=0.05)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30))
def test_the_interval_of_a_mean_stays_among_the_values_and_is_the_same_every_time(
    values: list[float],
) -> None:
    estimate = mean_with_interval(values)
    slack = 1e-9 * max(1.0, *map(abs, values))
    assert min(values) - slack <= estimate.low <= estimate.high <= max(values) + slack
    assert mean_with_interval(values) == estimate


@pytest.mark.parametrize("nothing", [proportion(0, 0), mean_with_interval([])])
def test_no_episodes_give_no_number(nothing: Estimate) -> None:
    assert all(math.isnan(value) for value in (nothing.mean, nothing.low, nothing.high))


@given(st.integers(1, 20_000))
def test_rows_play_at_least_what_was_asked_and_hardly_more(episodes: int) -> None:
    rows, repeats = rows_and_repeats(episodes)
    assert rows <= MAX_ROWS
    assert episodes <= rows * repeats < episodes + repeats


def test_every_row_counts_equally_though_one_has_shorter_episodes() -> None:
    environments = RollerVecEnv("flat", 3, physics="fast", max_episode_steps=120)
    evaluation = evaluate(all_but_the_first_row_wait, environments, seed=0, episodes_per_row=2)
    assert Counter(episode.row for episode in evaluation.episodes) == {0: 2, 1: 2, 2: 2}
    assert {e.steps for e in evaluation.episodes if e.row > 0} == {120}
    assert max(e.steps for e in evaluation.episodes if e.row == 0) < 120


def test_an_episode_is_told_as_it_went() -> None:
    environments = RollerVecEnv("flat", 2, physics="fast", max_episode_steps=120)
    evaluation = evaluate(all_but_the_first_row_wait, environments, seed=5)
    runner, waiter = evaluation.episodes
    assert (runner.outcome, waiter.outcome) == ("finish", "time limit")
    assert runner.coins > 0
    assert runner.score_percent == pytest.approx(100 * runner.coins / evaluation.coins_in_level)
    assert waiter.time_s == pytest.approx(120 / 20)
    for episode in evaluation.episodes:
        assert episode.path.shape == (episode.steps, 3)
        assert episode.time_s == pytest.approx(episode.steps / 20)
    assert np.ptp(waiter.path[:, 0]) < 0.01
    assert np.all(np.diff(runner.path[:, 0]) >= 0)


def test_the_same_seed_gives_the_same_evaluation() -> None:
    paths = []
    for _ in range(2):
        environments = RollerVecEnv("flat", 2, physics="fast", max_episode_steps=30)
        evaluation = evaluate(all_but_the_first_row_wait, environments, seed=11)
        paths.append([episode.path.tobytes() for episode in evaluation.episodes])
    assert paths[0] == paths[1]


def test_the_table_has_the_finish_time_of_the_finished_only() -> None:
    environments = RollerVecEnv("flat", 4, physics="fast", max_episode_steps=120)
    evaluation = evaluate(all_but_the_first_row_wait, environments, seed=0)
    table = evaluation.table()
    assert table["success rate"] == proportion(1, 4)
    assert table["fall rate"] == proportion(0, 4)
    assert table["time to the finish (s)"].mean == evaluation.episodes[0].time_s
    assert table["time of an episode (s)"].mean > evaluation.episodes[0].time_s
