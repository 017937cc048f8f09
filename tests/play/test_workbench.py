"""A level on the page while it is written."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest

from roller_env.level.template import new_level
from roller_env.play.workbench import Workbench
from tests.patience import STALLED_S
from tests.play.test_room import Somebody, apart, until


@pytest.fixture(autouse=True)
def looks_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roller_env.play.workbench.LOOK_EVERY_S", 0.01)


def beside(bench: Workbench, scene: Callable[[Somebody], object]) -> None:
    async def everything() -> None:
        doings = [asyncio.create_task(bench.room.run()), asyncio.create_task(bench.watch())]
        try:
            async with asyncio.timeout(STALLED_S):
                await scene(Somebody(bench.room))  # type: ignore[misc]
        finally:
            for doing in doings:
                doing.cancel()
            await asyncio.gather(*doings, return_exceptions=True)

    apart(everything)


def test_a_saved_level_is_loaded_anew_and_what_is_wrong_is_told_with_its_line(
    tmp_path: Path,
) -> None:
    file = tmp_path / "mine.yaml"
    good = new_level("mine")
    file.write_text(good)
    bench = Workbench(file, "rigid")

    async def scene(author: Somebody) -> None:
        await until(lambda: bool(author.frames))
        first = author.last("level")["scene"]
        assert author.last("problems")["errors"] == []
        file.write_text(good.replace("time_limit_s", "time_limt_s"))
        await until(lambda: bool(author.last("problems")["errors"]))
        error = author.last("problems")["errors"][0]
        assert error["line"] == good.splitlines().index("time_limit_s: 60") + 1
        assert "did you mean 'time_limit_s'" in error["text"]
        # The level that was right is still there to be played.
        assert author.last("level")["scene"] == first
        file.write_text(good.replace("A first level", "A second level"))
        await until(lambda: author.last("level")["scene"] != first)
        assert author.last("problems")["errors"] == []

    beside(bench, scene)


def test_a_file_that_is_not_there_yet_is_waited_for(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    bench = Workbench(file, "rigid")

    async def scene(author: Somebody) -> None:
        await until(lambda: bool(author.frames))
        assert "there is no such" in author.last("problems")["errors"][0]["text"]
        file.write_text(new_level("mine"))
        await until(lambda: author.last("problems")["errors"] == [])

    beside(bench, scene)
