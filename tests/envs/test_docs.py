"""docs/environments.md does what it says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from roller_env.envs.arguments import OPTIONS, RESET_MASK
from roller_env.envs.single import RollerEnv

PAGE = (Path(__file__).parents[2] / "docs" / "environments.md").read_text(encoding="utf-8")


def test_the_examples_of_the_page_run_one_after_the_other() -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    assert len(blocks) >= 4
    names: dict[str, Any] = {}
    for block in blocks:
        exec(block, names)  # noqa: S102  the project's own page


def test_the_page_has_every_reset_option_and_every_key_of_an_info() -> None:
    _, info = RollerEnv(level="flat").reset(seed=0)
    for name in (*OPTIONS, RESET_MASK, *info):
        assert f"| `{name}` |" in PAGE, name
