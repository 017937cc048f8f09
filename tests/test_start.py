"""docs/start.md: what it shows runs, and its commands and options are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from roller_env.training.config import TrainingConfig

PAGE = (Path(__file__).parents[1] / "docs" / "start.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: str(block).splitlines()[-1][:40])
def test_every_block_of_the_page_runs(block: str) -> None:
    exec(block, {})  # noqa: S102 - the project's own page


def test_every_setting_that_the_page_changes_is_one_of_a_training() -> None:
    changed = re.findall(r"--set (\w+)", PAGE)
    assert len(changed) >= 2
    assert set(changed) <= set(TrainingConfig.model_fields)
