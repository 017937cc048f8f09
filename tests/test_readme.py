"""The README is one page, and its quickstart works as it stands there."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def headings(page: Path) -> set[str]:
    """Return the names by which a page's headings can be linked to."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    titles = re.findall(r"^#+ (.*)$", text, flags=re.M)
    return {re.sub(r"[^\w -]", "", title).lower().replace(" ", "-") for title in titles}


def test_the_readme_is_one_page() -> None:
    assert len(README.split()) < 900


def test_the_quickstart_is_ten_lines_and_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    (quickstart,) = re.findall(r"```python\n(.*?)```", README, flags=re.S)
    assert len(list(filter(None, quickstart.splitlines()))) <= 10
    names: dict[str, Any] = {}
    # One rollout and one update instead of 25.
    exec(quickstart.replace("learn(100_000)", "learn(1)"), names)  # noqa: S102  the project's own
    assert names["model"].num_timesteps == 64 * 64
    assert names["info"]["time_s"] == pytest.approx(0.05)


def test_every_link_and_picture_of_the_readme_is_there() -> None:
    targets = [target for target in re.findall(r"\]\(([^)]+)\)", README) if "://" not in target]
    assert len(targets) > 20
    for target in targets:
        file, _, heading = target.partition("#")
        assert (ROOT / file).is_file(), target
        assert not heading or heading in headings(ROOT / file), target


def test_the_readme_leads_to_every_page_of_the_documentation() -> None:
    for page in (ROOT / "docs").glob("*.md"):
        if page.name != "index.md":
            assert f"](docs/{page.name})" in README, page.name
