"""What is said of an agent when its training is over."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from roller_env.envs.vector import RollerVectorEnv
from roller_env.training.evaluate import Evaluation, evaluate
from roller_env.training.report import advice
from tests.training.small import small_config


@cache
def stood_still() -> Evaluation:
    envs = RollerVectorEnv(2, level="flat", physics="rigid", max_episode_steps=5)
    evaluation = evaluate(
        lambda seen: np.zeros(len(seen), dtype=np.int64), envs, seed=0, episodes_per_env=2
    )
    envs.close()
    return evaluation


def ended(outcome: str, coins: float) -> Evaluation:
    """Return an evaluation whose games ended like this, with this share of the coins."""
    evaluation = stood_still()
    replays = [
        replace(
            replay,
            result=replace(
                replay.result,
                success=outcome == "finish",
                fall=outcome == "fall",
                score_percent=100.0 * coins,
            ),
        )
        for replay in evaluation.replays
    ]
    return replace(evaluation, replays=tuple(replays))


def test_an_agent_that_has_learnt_its_level_needs_no_advice() -> None:
    assert advice(ended("finish", 0.96), small_config()) == ""


@pytest.mark.parametrize(
    ("outcome", "coins", "said"),
    [
        ("finish", 0.7, "completeness=8"),
        ("fall", 0.96, "fall=-10"),
        ("time limit", 0.96, "it stood still"),
    ],
)
def test_an_agent_that_fell_short_is_told_where_and_what_to_try(
    outcome: str, coins: float, said: str
) -> None:
    config = small_config()
    text = advice(ended(outcome, coins), config)
    finished = "100%" if outcome == "finish" else "0%"
    assert text.startswith(f"It fell short: {finished} at the finish, {coins:.0%} of the coins.")
    assert f"total_steps={2 * config.total_steps}" in text
    assert said in text
