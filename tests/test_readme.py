"""The README says what the code does."""

from __future__ import annotations

from pathlib import Path

import pytest

import roller_env
from roller_env.config import EnvConfig
from roller_env.game.observations import RAY_ENTRIES, STATE_ENTRIES, markdown_table
from roller_env.level import LevelError, parse_level

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def test_the_observation_table_is_the_one_the_code_makes() -> None:
    assert markdown_table(STATE_ENTRIES + RAY_ENTRIES) in README


def test_every_option_is_in_the_table() -> None:
    for name in EnvConfig.__dataclass_fields__:
        assert f"`{name}`" in README, name


def test_every_id_is_named() -> None:
    for name in roller_env.ENV_IDS:
        assert f"`{name}`" in README, name


def sample_level() -> str:
    return README.split("```yaml\n")[1].split("```")[0]


def test_the_sample_level_is_valid() -> None:
    assert parse_level(sample_level()).name == "hop"


def test_the_sample_mistake_is_told_as_printed() -> None:
    wrong = sample_level().replace("thickness:", "thicknes:")
    assert wrong != sample_level()
    with pytest.raises(LevelError) as raised:
        parse_level(wrong, "hop.yaml")
    assert str(raised.value) in README


def test_every_picture_is_there() -> None:
    root = Path(__file__).parents[1]
    for part in README.split("](")[1:]:
        target = part.split(")")[0]
        if not target.startswith("http"):
            assert (root / target).exists(), target
