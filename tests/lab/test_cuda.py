"""Games on a graphics card are those of the CPU; shown on the card that Numba simulates."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roller_env.level import load_level
from tests.lab.cuda_program import ENVS, EPISODE_STEPS

ROOT = Path(__file__).parents[2]
LEVELS = [("classic", 40), ("ferry", 30), ("finale", 30)]


@pytest.fixture(scope="module")
def played() -> dict[str, Any]:
    """What `tests.lab.cuda_program` prints."""
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "tests.lab.cuda_program", json.dumps(LEVELS)],
        cwd=ROOT,
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    found: dict[str, Any] = json.loads(run.stdout)
    return found


@pytest.mark.parametrize(("level", "steps"), LEVELS)
def test_a_game_on_a_card_is_that_of_the_cpu_to_the_bit(
    played: dict[str, Any], level: str, steps: int
) -> None:
    first, last = played["levels"][level]
    assert (first["steps"], last["steps"]) == (1, steps)
    for each in (first, last):
        assert each["envs"] == each["played"] == each["same"] == ENVS
        assert each["other_rules"] == each["largest_m"] == 0


def test_an_episode_that_is_over_begins_anew_in_the_step_after(played: dict[str, Any]) -> None:
    steps = [seen["steps"] for seen in played["repeated"]]
    assert steps == [[step] * ENVS for step in (*range(EPISODE_STEPS + 1),) * 2]
    for seen in played["repeated"]:
        assert seen["truncated"] == [seen["steps"][0] == EPISODE_STEPS] * ENVS


def test_every_episode_begins_within_the_jitter_of_the_start(played: dict[str, Any]) -> None:
    level = load_level("flat")
    begun = np.array([seen["x"] for seen in played["repeated"] if seen["steps"][0] == 0])
    away = np.abs(begun - level.start.at[0])
    assert (away <= level.start.jitter[0]).all()
    assert len(np.unique(begun)) == begun.size


def test_what_is_seen_is_where_the_ball_is(played: dict[str, Any]) -> None:
    for seen in played["repeated"]:
        np.testing.assert_array_equal(seen["shown_x"], np.float32(seen["x"]))
