"""A real browser for the tests of the page."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any, Final

import pytest

NAMES: Final = ("chromium", "chromium-browser", "google-chrome")

FLAGS: Final = (
    "--headless",
    "--no-sandbox",
    # WebGL in software.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # Nothing but the page under test.
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-quic",
    "--disable-sync",
)


def missing_chromium() -> str | None:
    """Return what is missing for a test in a browser, and how to get it."""
    if find_spec("playwright") is None:
        return "playwright is not installed: pip install '.[dev]'"
    if not any(map(shutil.which, NAMES)):
        return f"none of {', '.join(NAMES)} is installed: apt-get install chromium"
    return None


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """A headless Chromium; skip without one, fail where ROLLER_REQUIRE_CHROMIUM=1 promises it."""
    missing = missing_chromium()
    if missing is not None:
        if os.environ.get("ROLLER_REQUIRE_CHROMIUM") == "1":
            pytest.fail(missing)
        pytest.skip(missing)
    from playwright.sync_api import sync_playwright

    executable = next(path for path in map(shutil.which, NAMES) if path)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=list(FLAGS))
        yield browser
        browser.close()
