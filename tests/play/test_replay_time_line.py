"""The page of a replay, in a real browser: its time line and its keys."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from roller_env.play.session import Phase
from tests.play.browser import MIDDLE, SCENE, TIME_LINE, Browser, dark, gold_pixels
from tests.play.stand import ReplayStand

pytestmark = pytest.mark.xdist_group("browser")


@pytest.fixture(scope="module")
def person(chromium: Any, replay_stand: ReplayStand) -> Iterator[Browser]:
    browser = Browser(chromium, replay_stand)
    yield browser
    browser.close()


@pytest.fixture
def page(person: Browser, replay_stand: ReplayStand) -> Browser:
    """The page, standing still at the start."""
    person.press("r", "it plays", lambda: replay_stand.status.phase is Phase.PLAYING)
    person.press("p", "it stands still", lambda: replay_stand.status.phase is Phase.PAUSED)
    # While a slow page tells its keys the replay goes on.
    while replay_stand.status.time_s > 0.0:
        go_back(person, replay_stand)
    return person


def go_back(page: Browser, replay_stand: ReplayStand) -> None:
    """Go back by a second, or to the start."""
    began_s = replay_stand.status.time_s
    page.press("ArrowLeft", "it is earlier", lambda: replay_stand.status.time_s < began_s)


def grab(page: Browser) -> tuple[float, float]:
    """Return where the time line's golden grab is, pixels from the left and from the top.

    (0, 0) while none is seen.
    """
    rows, columns = np.nonzero(gold_pixels(page.picture[TIME_LINE]))
    if len(rows) == 0:
        return 0.0, 0.0
    return float(columns.mean()) + TIME_LINE[1].start, float(rows.mean()) + TIME_LINE[0].start


def test_whoever_drags_the_time_line_sees_that_moment(
    page: Browser, replay_stand: ReplayStand
) -> None:
    duration_s, before = replay_stand.status.duration_s, page.settled()[SCENE]
    page.wait("the time line is there", lambda: grab(page) > (0.0, 0.0))
    x, y = grab(page)
    with dragged(page, x, x + 120.0, y):
        page.wait("it went there", lambda: replay_stand.status.time_s > 0.4 * duration_s)
    page.wait("the grab stays", lambda: grab(page)[0] == pytest.approx(x + 120.0, abs=15.0))
    page.wait_for_change("the picture is of then", before, SCENE, share=0.1)
    assert replay_stand.status.phase is Phase.PAUSED
    assert replay_stand.status.time_s < 0.6 * duration_s
    with dragged(page, x + 120.0, x - 60.0, y):
        page.wait("it is back at the start", lambda: replay_stand.status.time_s == 0.0)


@contextmanager
def dragged(page: Browser, begin_x: float, end_x: float, y: float) -> Iterator[None]:
    """Drag with the mouse, and let go at the end."""
    mouse = page.page.mouse
    mouse.move(begin_x, y)
    page.tell()
    mouse.down()
    page.tell()
    try:
        mouse.move(end_x, y, steps=4)
        yield
    finally:
        mouse.up()
        page.tell()


def test_arrow_keys_go_a_second_forward_and_back(page: Browser, replay_stand: ReplayStand) -> None:
    began_s = replay_stand.status.time_s
    page.press("ArrowRight", "a second on", lambda: replay_stand.status.time_s > began_s + 0.9)
    there_s = replay_stand.status.time_s
    page.press("ArrowLeft", "a second back", lambda: replay_stand.status.time_s < there_s - 0.9)
    assert replay_stand.status.phase is Phase.PAUSED


def test_space_lets_it_play_and_stand_still(page: Browser, replay_stand: ReplayStand) -> None:
    began_s, before = replay_stand.status.time_s, page.settled()[SCENE]
    page.press(" ", "it plays", lambda: replay_stand.status.phase is Phase.PLAYING)
    page.wait("time passes", lambda: replay_stand.status.time_s > began_s + 1.0)
    page.wait_for_change("the picture moves", before, SCENE)
    page.press(" ", "it stands still", lambda: replay_stand.status.phase is Phase.PAUSED)


def test_h_shows_the_keys_of_a_replay_and_hides_them(page: Browser) -> None:
    before = dark(page.settled()[MIDDLE])
    page.press("h", "the help is there", lambda: dark(page.picture[MIDDLE]) > before + 0.4)
    page.press("h", "it is gone", lambda: dark(page.picture[MIDDLE]) < before + 0.1)
