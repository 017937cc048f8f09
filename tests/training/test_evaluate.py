"""Evaluation counts whole episodes, each row equally, and its intervals are the textbook's."""

from __future__ import annotations

import math
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.envs.spaces import Observations
from roller_env.envs.vector import RollerVectorEnv
from roller_env.level import load_level
from roller_env.replay import load_replay, verify
from roller_env.training.evaluate import (
    MAX_ENVS,
    Estimate,
    envs_and_repeats,
    evaluate,
    mean_with_interval,
    proportion,
)
from roller_env.training.files import RunError

Z95 = NormalDist().inv_cdf(0.975)
FORWARD = 1


def all_but_the_first_row_wait(observations: Observations) -> npt.NDArray[Any]:
    actions = np.zeros(len(observations), dtype=np.int64)
    actions[0] = FORWARD
    return actions


@pytest.mark.parametrize("episodes", [0, -1, 10**9])
def test_a_number_of_episodes_that_cannot_be_played_is_refused(episodes: int) -> None:
    with pytest.raises(RunError, match=f"episodes: found {episodes}; must be 1 to 1000000"):
        envs_and_repeats(episodes)


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
    rows, repeats = envs_and_repeats(episodes)
    assert rows <= MAX_ENVS
    assert episodes <= rows * repeats < episodes + repeats


def test_every_row_counts_equally_though_one_has_shorter_episodes() -> None:
    envs = RollerVectorEnv(3, level="flat", physics="fast", max_episode_steps=120)
    evaluation = evaluate(all_but_the_first_row_wait, envs, seed=0, episodes_per_env=2)
    lengths = [len(replay) for replay in evaluation.replays]
    assert len(lengths) == len(evaluation) == 6
    assert lengths[2:] == [120] * 4
    assert max(lengths[:2]) < 120


def test_an_episode_is_told_as_it_went() -> None:
    envs = RollerVectorEnv(2, level="flat", physics="fast", max_episode_steps=120)
    evaluation = evaluate(all_but_the_first_row_wait, envs, seed=5)
    runner, waiter = evaluation.results
    assert (runner.outcome, waiter.outcome) == ("finish", "time limit")
    assert runner.coins > 0
    assert runner.score_percent == pytest.approx(100 * runner.coins / evaluation.coins_in_level)
    assert waiter.time_s == pytest.approx(120 / 20)
    for replay in evaluation.replays:
        assert replay.result.time_s == pytest.approx(len(replay) / 20)
        assert verify(replay).is_exact


def test_the_same_seed_gives_the_same_evaluation() -> None:
    played = []
    for _ in range(2):
        envs = RollerVectorEnv(2, level="flat", physics="fast", max_episode_steps=30)
        evaluation = evaluate(all_but_the_first_row_wait, envs, seed=11)
        played.append([replay.checksums.table.tobytes() for replay in evaluation.replays])
    assert played[0] == played[1]


def test_the_table_has_the_finish_time_of_the_finished_only() -> None:
    envs = RollerVectorEnv(4, level="flat", physics="fast", max_episode_steps=120)
    evaluation = evaluate(all_but_the_first_row_wait, envs, seed=0)
    table = evaluation.table()
    assert table["success rate"] == proportion(1, 4)
    assert table["fall rate"] == proportion(0, 4)
    assert table["time to the finish (s)"].mean == evaluation.results[0].time_s
    assert table["time of an episode (s)"].mean > evaluation.results[0].time_s


def each_row_another_way(observations: Observations) -> npt.NDArray[Any]:
    return np.arange(len(observations)) % 9


def test_every_episode_is_kept_as_it_was_evaluated(tmp_path: Path) -> None:
    envs = RollerVectorEnv(6, level="flat", physics="fast", max_episode_steps=120)
    evaluation = evaluate(
        each_row_another_way, envs, seed=5, episodes_per_env=2, player="policy of a test"
    )
    files = evaluation.save_replays(tmp_path / "new")
    assert [file.name for file in files] == [f"episode-{i:04d}.replay" for i in range(12)]
    assert len({result.outcome for result in evaluation.results}) == 3
    for number, (result, file) in enumerate(zip(evaluation.results, files, strict=True)):
        replay = load_replay(file)
        assert verify(replay).is_exact
        assert replay.player == "policy of a test"
        assert replay.result == result
        assert (replay.actions == number // 2).all()


def test_environments_that_do_not_leave_the_end_to_be_recorded_are_refused() -> None:
    envs = RollerVectorEnv(2, level="flat", autoreset_mode="SAME_STEP")
    with pytest.raises(ValueError, match=r"envs: found .*SAME_STEP; must be .*NEXT_STEP"):
        evaluate(each_row_another_way, envs, seed=0)


def test_episodes_that_no_replay_can_hold_are_refused_before_they_are_played() -> None:
    level = load_level("flat").model_copy(update={"time_limit_s": 86_400.0})
    envs = RollerVectorEnv(2, level=level)
    with pytest.raises(RunError, match=r"1728000 control steps .*; set max_episode_steps"):
        evaluate(each_row_another_way, envs, seed=0)
    envs = RollerVectorEnv(2, level=level, max_episode_steps=4)
    assert len(evaluate(each_row_another_way, envs, seed=0)) == 2
