"""A release is one version in all places, with its entry in the changelog."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest
import yaml

from scripts import release

ROOT = Path(__file__).parents[1]
DAY = datetime.date(2030, 2, 1)


@pytest.fixture
def texts() -> dict[str, str]:
    """Return the project's own files, as they are before a release."""
    return {
        name: (ROOT / name).read_text(encoding="utf-8")
        for name in ("CHANGELOG.md", "CITATION.cff", "roller_env/__init__.py")
    }


def test_a_release_says_its_version_and_day_everywhere(texts: dict[str, str]) -> None:
    written = release.released(texts, "90.0.1", DAY)
    assert '__version__ = "90.0.1"\n' in written["roller_env/__init__.py"]
    cited = yaml.safe_load(written["CITATION.cff"])
    assert (cited["version"], cited["date-released"]) == ("90.0.1", DAY)
    assert "## Unreleased\n\n## 90.0.1 - 2030-02-01\n\n### " in written["CHANGELOG.md"]
    kept = written["CHANGELOG.md"].replace("\n## 90.0.1 - 2030-02-01\n", "", 1)
    assert kept == texts["CHANGELOG.md"]


def test_the_next_release_takes_the_place_of_the_last_in_the_citation(
    texts: dict[str, str],
) -> None:
    first = release.released(texts, "90.0.1", DAY)
    news = first["CHANGELOG.md"].replace("## Unreleased\n", "## Unreleased\n\n### Fixed\n- A.\n", 1)
    later = datetime.date(2030, 3, 1)
    second = release.released(first | {"CHANGELOG.md": news}, "90.1.0", later)
    cited = yaml.safe_load(second["CITATION.cff"])
    assert (cited["version"], cited["date-released"]) == ("90.1.0", later)
    assert second["CITATION.cff"].count("date-released") == 1


@pytest.mark.parametrize("version", ["0.0.1", "1", "1.2", "v90.0.1", "90.0.1rc1", "90.0.01", ""])
def test_an_earlier_version_or_no_version_is_refused(texts: dict[str, str], version: str) -> None:
    with pytest.raises(release.ReleaseError, match=r"^version: found "):
        release.released(texts, version, DAY)


def test_what_is_out_is_not_released_again(texts: dict[str, str]) -> None:
    first = release.released(texts, "90.0.1", DAY)
    news = first["CHANGELOG.md"].replace("## Unreleased\n", "## Unreleased\n\n- News.\n", 1)
    with pytest.raises(release.ReleaseError, match=r"released after 90\.0\.1"):
        release.released(first | {"CHANGELOG.md": news}, "90.0.1", DAY)


def test_nothing_new_is_nothing_to_release(texts: dict[str, str]) -> None:
    first = release.released(texts, "90.0.1", DAY)
    with pytest.raises(release.ReleaseError, match="nothing under Unreleased"):
        release.released(first, "90.1.0", DAY)
