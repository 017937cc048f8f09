"""The agents that come with Roller play their levels as docs/baselines.md says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roller_env.assets import LEVELS, SHIPPED
from roller_env.cli import main, play
from roller_env.lab import baselines_page
from roller_env.play.offers import offers_of
from roller_env.training import load_policy
from roller_env.training.files import RunError
from roller_env.training.run import evaluate_policy
from roller_env.training.shipped import run_of

RESULTS = Path(__file__).parents[2] / "docs" / "results"

EPISODES = 8

SLACK = 0.25
"""Two games of eight, and their coins: another engine and other starts than the table's."""


@pytest.mark.parametrize("level", LEVELS)
def test_an_agent_plays_its_level_on_a_fast_engine_as_its_row_of_the_baselines_says(
    level: str,
) -> None:
    policy = load_policy(run_of(SHIPPED, level))
    config = policy.config
    assert config.evaluation_environment.level == level
    rows = baselines_page.rows_of(RESULTS)
    (row,) = rows[(rows.level == level) & (rows.seed == config.seed)].itertuples()
    fast = replace(config.evaluation_environment, physics="relaxed", num_threads=1)
    there = config.model_copy(update={"evaluation_environment": fast})
    results = evaluate_policy(policy, there, EPISODES).results
    assert np.mean([one.success for one in results]) >= row.finish - SLACK
    assert np.mean([one.score_percent for one in results]) / 100.0 >= row.coins - SLACK


def test_a_level_of_ones_own_has_no_agent() -> None:
    with pytest.raises(RunError, match=r"no agent of 'mine.yaml' comes with Roller; of 'flat', "):
        run_of(SHIPPED, "mine.yaml")
    assert run_of(Path("runs/mine"), "mine.yaml") == Path("runs/mine")


def test_a_page_that_goes_to_another_level_gets_the_agent_of_that_level() -> None:
    arguments = play.Arguments(level="flat", policy=SHIPPED, agents=3)
    config, agent = play.game_of(arguments)
    crowd = play.crowd_of(agent, arguments)
    assert agent is not None
    assert crowd is not None
    shipped = play.those_shipped(agent, crowd, arguments)
    open_game = play.game_opener(config, agent, arguments, offers_of("flat"), shipped)
    for level in ("flat", "wind"):
        game = open_game(level, (crowd,))
        assert agent.policy.config.level == crowd.policy.config.level == level
        game.warm_up()
        game.start()
        game.skip_intro()
        game.advance(0.1, "")
        assert game.simulation.time_s[0] > 0.0


def test_they_are_evaluated_by_the_name_of_their_level(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "shipped", "--level", "bridge", "--episodes", "2"]) == 0
    assert "| success rate | 100" in capsys.readouterr().out
