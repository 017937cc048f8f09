"""`RollerVecEnv` is made, and refused, as Gymnasium's vector of the same games is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.level import load_level
from roller_env.level.load import levels_directory
from tests.envs.test_making import BAD, WRONG_ACTIONS


@pytest.mark.parametrize("kind", ["name", "string", "path", "level"])
def test_any_level_is_made_from_its_name_its_path_or_itself(kind: str) -> None:
    path = levels_directory() / "lift.yaml"
    source = {"name": "lift", "string": str(path), "path": path, "level": load_level("lift")}[kind]
    assert RollerVecEnv(source, 2).level.name == "lift"


@pytest.mark.parametrize(("options", "says"), BAD, ids=lambda value: str(value)[:40])
def test_a_bad_option_is_one_error_that_says_what_and_what_would_be_right(
    options: dict[str, Any], says: str
) -> None:
    with pytest.raises(ValueError, match=says) as caught:
        RollerVecEnv(num_envs=2, **options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("num_envs", [0, -1, 2.0, "2", True])
def test_a_number_of_games_that_is_none_is_refused(num_envs: Any) -> None:
    with pytest.raises(ValueError, match=r"num_envs: found .*; must be"):
        RollerVecEnv("flat", num_envs)


def test_numpys_numbers_are_numbers_of_games() -> None:
    number: Any = np.int64
    assert RollerVecEnv("flat", number(2), seed=number(3)).num_envs == 2


@pytest.mark.parametrize(("mode", "action", "says"), WRONG_ACTIONS)
def test_an_action_outside_the_space_is_refused(mode: str, action: Any, says: str) -> None:
    games = RollerVecEnv("flat", 2, action=mode)
    games.reset()
    with pytest.raises(ValueError, match=says):
        games.step(np.array([action, action]))


def test_the_autoreset_mode_is_not_the_callers_to_choose() -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'autoreset_mode'"):
        RollerVecEnv("flat", 2, autoreset_mode="NEXT_STEP")


@pytest.mark.parametrize(
    ("options", "error"), [(5, TypeError), ([{"intro": True}], ValueError), ([1, 2], TypeError)]
)
def test_options_that_do_not_fit_the_rows_are_refused_when_they_are_set(
    options: Any, error: type[Exception]
) -> None:
    with pytest.raises(error, match="options: found"):
        RollerVecEnv("flat", 2).set_options(options)


def test_a_row_that_is_not_there_is_told_by_its_number() -> None:
    with pytest.raises(IndexError, match=r"indices: found \[7\]; must be row numbers from 0 to 1"):
        RollerVecEnv("flat", 2).env_method("reset", indices=[7])
