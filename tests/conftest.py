"""Fixtures and settings that all tests share."""

from __future__ import annotations

import os

import pytest
from hypothesis import settings

from roller_env.drawing.opengl import missing_opengl

# How long an example takes says nothing on a machine that runs other tests at the same time.
settings.register_profile("roller", deadline=None)
settings.load_profile("roller")


def pytest_itemcollected(item: pytest.Item) -> None:
    """Let one worker run all of a laboratory's module (``--dist loadgroup``).

    It computes for seconds what its tests look at, and two workers would do so twice.
    """
    if item.path.parent.name == "lab":
        item.add_marker(pytest.mark.xdist_group(item.path.stem))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with trainings, so that what is left for the end, after such groups, is short."""
    items.sort(key=lambda item: item.path.parent.name != "training")


@pytest.fixture(scope="session")
def opengl() -> None:
    """Skip what cannot be drawn on this machine; fail where ROLLER_REQUIRE_OPENGL=1 promises it."""
    missing = missing_opengl()
    if missing is None:
        return
    if os.environ.get("ROLLER_REQUIRE_OPENGL") == "1":
        pytest.fail(missing)
    pytest.skip(missing)
