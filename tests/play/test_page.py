"""The page, in a real browser: what a person sees and can do."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, Final

import pytest
from mujoco.studio.web.web_server import _SessionMessage as StudioMessage
from websockets.sync.client import connect

from roller_env.play.app import ANSWER_S
from roller_env.play.server import STALE_PAGE_S
from roller_env.play.session import Phase
from tests.patience import STALLED_S
from tests.play.browser import (
    MIDDLE,
    PANEL,
    POINTS,
    SCENE,
    WATCHED_BALL,
    Browser,
    dark,
    differing,
    gold,
)
from tests.play.lane import FRAME_S
from tests.play.stand import Stand

pytestmark = pytest.mark.xdist_group("browser")

TRIES: Final = 20
"""A machine that has other things to do may keep the game from answering at once."""


@pytest.fixture(scope="module")
def person(chromium: Any, stand: Stand) -> Iterator[Browser]:
    browser = Browser(chromium, stand)
    yield browser
    browser.close()


@pytest.fixture
def page(person: Browser, stand: Stand) -> Browser:
    """The person's page with a new game, the ball at rest."""
    before = stand.status
    waits = before.phase is Phase.START
    person.press(
        "Enter" if waits else "r",
        "a new game begins",
        lambda: stand.status.phase is Phase.PLAYING and (waits or is_later(stand, before.episode)),
    )
    return person


def is_later(stand: Stand, episode: int) -> bool:
    """Say whether a later episode is played."""
    return stand.status.episode > episode


def test_the_start_panel_waits_for_enter(person: Browser, stand: Stand) -> None:
    assert stand.status.phase is Phase.START
    person.wait("the panel is there", lambda: dark(person.picture[PANEL]) > 0.9)
    person.press("Enter", "the game begins", lambda: stand.status.phase is Phase.PLAYING)
    person.wait("the panel is gone", lambda: dark(person.picture[PANEL]) < 0.1)


def test_the_picture_moves_while_w_is_held(page: Browser, stand: Stand) -> None:
    before = page.settled()[SCENE]
    page.press("w", "the ball has moved", lambda: stand.status.ball_x > 1.0)
    page.wait_for_change("the picture changes", before, SCENE)


@pytest.mark.parametrize("key", ["w", "ArrowUp"])
def test_the_ball_is_pushed_forward_while_the_key_is_down_and_not_after(
    page: Browser, stand: Stand, key: str
) -> None:
    assert stand.status.ball_x == pytest.approx(0.0, abs=0.01)
    page.keyboard.down(key)
    page.wait("the ball moves forward", lambda: stand.status.ball_x > 0.2)
    page.wait("it is pushed on", lambda: stand.status.pushed)
    page.keyboard.up(key)
    page.wait("the push ends", lambda: not stand.status.pushed)
    x = stand.status.ball_x
    page.wait("the ball rolls on by itself", lambda: stand.status.ball_x > x + 0.2)


def test_keys_are_let_go_when_the_page_loses_the_focus(page: Browser, stand: Stand) -> None:
    page.keyboard.down("w")
    page.wait("the ball is pushed", lambda: stand.status.pushed)
    page.page.evaluate("window.dispatchEvent(new Event('blur'))")
    page.wait("the push ends", lambda: not stand.status.pushed)
    page.page.evaluate("window.dispatchEvent(new Event('focus'))")
    page.keyboard.up("w")


def test_the_points_panel_counts_a_coin(page: Browser, stand: Stand) -> None:
    nothing = gold(page.settled()[POINTS])
    assert stand.status.coins == 0
    page.press("w", "the coin is collected", lambda: stand.status.coins == 1)

    def changed() -> bool:
        return abs(gold(page.picture[POINTS]) - nothing) > 0.05 * nothing

    # Ten points; where the page is slow the ball is at the finish by now, and its panel over them.
    # What is written there, `test_panels.py` reads.
    page.wait("the number changes", changed)
    page.press("r", "a new game begins", lambda: stand.status.coins == 0)
    page.wait("it is nought again", lambda: not changed())


def test_the_finish_shows_the_end_panel_and_enter_plays_again(page: Browser, stand: Stand) -> None:
    page.press("w", "the finish is reached", lambda: stand.status.phase is Phase.ENDED)
    assert stand.status.success
    page.wait("the end panel is there", lambda: dark(page.picture[PANEL]) > 0.9)
    page.press("Enter", "a new game begins", lambda: stand.status.phase is Phase.PLAYING)
    page.wait("the panel is gone", lambda: dark(page.picture[PANEL]) < 0.1)


def test_r_puts_the_ball_back_to_the_start(page: Browser, stand: Stand) -> None:
    page.press("w", "the ball has moved", lambda: stand.status.ball_x > 0.5)
    page.press("r", "it is back", lambda: abs(stand.status.ball_x) < 0.01)
    assert stand.status.phase is Phase.PLAYING


def test_p_pauses_and_escape_goes_on(page: Browser, stand: Stand) -> None:
    page.press("p", "time stands still", lambda: stand.status.phase is Phase.PAUSED)
    page.press("Escape", "time goes on", lambda: stand.status.phase is Phase.PLAYING)


def test_h_shows_the_keys_and_hides_them(page: Browser) -> None:
    before = dark(page.settled()[MIDDLE])
    page.press("h", "the help is there", lambda: dark(page.picture[MIDDLE]) > before + 0.4)
    page.press("h", "it is gone", lambda: dark(page.picture[MIDDLE]) < before + 0.1)


def test_c_changes_the_camera(page: Browser, stand: Stand) -> None:
    before, mode = page.settled()[SCENE], stand.status.camera
    page.press("c", "the mode changes", lambda: stand.status.camera != mode)
    page.wait_for_change("the picture is another", before, SCENE, share=0.2)


def test_neither_the_mouse_nor_keys_of_studio_change_the_view(page: Browser, stand: Stand) -> None:
    before = page.settled()[MIDDLE]
    page.page.mouse.move(210, 200)
    page.page.mouse.down()
    page.tell()
    page.page.mouse.move(330, 240, steps=5)
    for key in ("Space", "Backspace", "F1", "F2", "Tab", "q", "e", "["):
        page.tap(key)
    after = page.settled()[MIDDLE]
    page.page.mouse.up()
    assert differing(after, before) < 0.05
    assert stand.status.phase is Phase.PLAYING


def test_a_page_that_draws_nothing_is_sent_little(page: Browser) -> None:
    # It would have to draw all of that before it shows what is now.
    page.look()
    # What was on its way while the browser had no time comes all at once: it does not count.
    hear(page, 40)
    began_s = time.monotonic()
    hear(page, 60)
    # Panels and state thirty times each; a page that draws is sent them in half a second.
    assert time.monotonic() - began_s > 15 * STALE_PAGE_S


def hear(page: Browser, messages: int) -> None:
    """Wait until the page, which draws nothing, has heard so many more messages of the server."""
    page.page.evaluate("window.before = heard()")
    page.page.wait_for_function("count => heard() >= before + count", arg=messages, polling=20)


def test_a_second_browser_watches_and_cannot_steer(
    page: Browser, stand: Stand, chromium: Any
) -> None:
    guest = Browser(chromium, stand, controls=False)
    try:
        before, episode = guest.settled()[WATCHED_BALL], stand.status.episode
        guest.keyboard.down("s")
        guest.tap("r")
        assert not stand.status.pushed
        page.press("w", "the ball has moved", lambda: stand.status.ball_x > 1.0)
        page.wait("the push ends", lambda: not stand.status.pushed)
        guest.keyboard.up("s")
        guest.wait_for_change("the guest sees the ball leave", before, WATCHED_BALL, share=0.3)
        assert stand.status.episode == episode
    finally:
        guest.close()


def test_a_second_browser_cannot_take_the_controls_but_ask_for_them(
    page: Browser, stand: Stand
) -> None:
    told: list[str | bytes] = []
    with connect(f"ws://{stand.host}:{stand.port}/state?sid=guest") as guest:
        guest.send(StudioMessage.FORCE_CONTROL)
        guest.send(StudioMessage.REQUEST_CONTROL)
        while not any("role=spectator;queue_pos=1" in str(line) for line in told):
            told.append(guest.recv(timeout=STALLED_S))
        page.press("w", "the player still steers", lambda: stand.status.ball_x > 1.0)
    assert "grant" not in told


def test_a_key_is_in_the_picture_that_is_drawn_when_it_is_read(page: Browser, stand: Stand) -> None:
    assert ANSWER_S < FRAME_S
    for _ in range(TRIES):
        page.press("w", "the ball is pushed", lambda: stand.status.pushed)
        page.wait("the push ends", lambda: not stand.status.pushed)
        if stand.status.answer_s < ANSWER_S:
            return
    pytest.fail(f"at best after {stand.status.answer_s} s")
