"""The pages of docs/ say what the code does, and what they name and link to exists.

Pages with examples have tests of their own beside what they are about; `make docs` follows the
links from page to page, headings included.
"""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest
from PIL import Image

import roller_env
from roller_env.config import EnvConfig
from roller_env.game.observations import (
    MORE_ENTRIES,
    RAY_ENTRIES,
    STATE_ENTRIES,
    STATE_SIZE,
    markdown_table,
)
from roller_env.game.rewards import RewardWeights
from roller_env.level import LevelError, parse_level
from scripts import draw_architecture

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
ENVIRONMENTS = (DOCS / "environments.md").read_text(encoding="utf-8")
LEVELS = (DOCS / "levels.md").read_text(encoding="utf-8")

every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def test_the_observation_table_is_the_one_the_code_makes() -> None:
    assert markdown_table(STATE_ENTRIES + RAY_ENTRIES) in ENVIRONMENTS
    assert markdown_table(MORE_ENTRIES, STATE_SIZE) in ENVIRONMENTS


def test_every_option_is_in_the_table() -> None:
    table = ENVIRONMENTS.split("## Options\n")[1].split("## ")[0]
    for name in EnvConfig.__dataclass_fields__:
        assert re.search(rf"^\|[^|]*`{name}`", table, flags=re.M), name


def test_every_weight_of_the_reward_is_on_the_page_of_the_rules() -> None:
    rules = (DOCS / "rules.md").read_text(encoding="utf-8")
    for name in RewardWeights.__dataclass_fields__:
        assert f"`{name}`" in rules, name


def test_every_id_is_named() -> None:
    for name in roller_env.ENV_IDS:
        assert f"`{name}`" in ENVIRONMENTS, name


def sample_level() -> str:
    """Return the level of docs/levels.md whose mistake is shown."""
    (sample,) = re.findall(r"```yaml\n([^`]*name: hop\n.*?)```", LEVELS, flags=re.S)
    return str(sample)


def test_the_sample_level_is_valid() -> None:
    assert parse_level(sample_level()).name == "hop"


def test_the_sample_mistake_is_told_as_printed() -> None:
    wrong = sample_level().replace("thickness:", "thicknes:")
    assert wrong != sample_level()
    with pytest.raises(LevelError) as raised:
        parse_level(wrong, "hop.yaml")
    assert f"```text\n{raised.value}\n```" in LEVELS


@every_page
def test_every_link_and_picture_of_a_page_is_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", text):
        if "://" not in target and not target.startswith("#"):
            assert (page.parent / target.split("#")[0]).is_file(), target


@every_page
def test_every_name_of_the_code_that_a_page_mentions_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for name in re.findall(r"`(roller_env(?:\.\w+)+)`", text) + re.findall(
        r"^::: (\S+)$", text, flags=re.M
    ):
        parts = name.split(".")
        if not (ROOT / name).is_file():
            exists(parts)


def exists(parts: list[str]) -> None:
    """Import the longest module that the parts begin with, and look the rest up in it."""
    for length in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError as missing:
            if missing.name is None or not missing.name.startswith("roller_env"):
                raise
            continue
        for name in parts[length:]:
            fields = getattr(found, "__dataclass_fields__", {}) | getattr(found, "model_fields", {})
            found = fields[name] if name in fields else getattr(found, name)
        return


@every_page
def test_every_file_of_the_project_that_a_page_mentions_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"\b(?:scripts|tests|assets|configs|roller_env)/[\w./*-]*\w", text)
    for path in named:
        assert list(ROOT.glob(path)), path


def test_the_drawing_of_the_architecture_shows_the_imports_as_they_are() -> None:
    with Image.open(draw_architecture.PICTURE) as picture:
        shown = picture.info["House"]
    assert shown == draw_architecture.read_house().digest, "run scripts/draw_architecture.py"


def test_in_the_drawing_a_part_stands_over_all_that_it_imports() -> None:
    house = draw_architecture.read_house()
    row = {node: number for number, nodes in enumerate(house.rows) for node in nodes}
    assert {part.name for part in house.parts} >= {"level", "game", "simulation", "envs"}
    for part in house.parts:
        for other in part.imports:
            way = [row[node] for node in house.way(part.name, other)]
            assert way == list(range(row[part.name], row[other] - 1, -1))
