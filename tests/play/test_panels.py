"""What the panels say, in words. That they are drawn, `tests/play/test_page.py` looks at."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from roller_env.game.cameras import MODE_BEHIND, MODE_FIRST_PERSON
from roller_env.game.result import EpisodeResult
from roller_env.play.panels import end_rows, points_lines

RESULT = EpisodeResult(
    success=True,
    fall=False,
    diverged=False,
    truncated=False,
    coins=15,
    score_percent=62.5,
    time_s=12.34,
    total_reward=15.0,
)
COINS_IN_LEVEL = 24


@pytest.mark.parametrize(("coins", "points"), [(0, "0"), (1, "10"), (15, "150"), (120, "1200")])
def test_a_coin_is_worth_ten_points_on_the_points_panel(coins: int, points: str) -> None:
    lines = points_lines(replace(RESULT, coins=coins), COINS_IN_LEVEL, MODE_BEHIND)
    assert lines == [points, "points   12.3 s", f"{coins} of 24 coins"]


def test_the_points_panel_names_a_camera_that_is_not_behind_the_ball() -> None:
    assert points_lines(RESULT, COINS_IN_LEVEL, MODE_FIRST_PERSON)[3:] == ["camera: first person"]


def test_a_coin_is_worth_ten_points_on_the_end_panel_and_percent_are_percent() -> None:
    """`digits` with factor 10 for the points and for the level's coins, with 1 for the score."""
    rows = dict(end_rows(RESULT, COINS_IN_LEVEL))
    assert rows["Points"] == "150 of 240"
    assert rows["Coins"] == "15 of 24"
    assert rows["Score"] == "62 %"


@pytest.mark.parametrize(
    ("changes", "medal"),
    [
        ({"score_percent": 100.0, "time_s": 20.0}, "gold"),
        ({"score_percent": 100.0, "time_s": 20.1}, "silver"),
        ({"score_percent": 99.0, "time_s": 20.0}, "silver"),
        ({"score_percent": 99.0, "time_s": 20.1}, "bronze"),
        ({"success": False, "fall": True}, None),
    ],
)
def test_gold_is_every_coin_within_par_and_silver_one_of_both(
    changes: dict[str, Any], medal: str | None
) -> None:
    rows = dict(end_rows(replace(RESULT, **changes), COINS_IN_LEVEL, 20.0))
    assert rows.get("Medal") == medal
    assert rows["Time"].endswith(" s, par 20 s")


def test_a_level_without_a_par_time_has_no_medals() -> None:
    assert RESULT.medal(None) is None
