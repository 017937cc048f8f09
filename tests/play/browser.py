"""A person's eyes and hands on the page, in a browser that draws only when somebody looks.

Left to itself a page draws as often as it can. Without a graphics processor that is software's
work, of all processors for all pages: beside other work one page came to four pictures a second and
two pages to two each, some of them 1.7 s apart, while the server sent what is new 60 times a
second. A key that is pressed and let go between two pictures is not seen, what is sent piles up,
and no number of seconds is enough to wait for a picture. So here a page's own clock is taken away:
it draws one picture when a test looks, of two pages one stands still, and a wait is in vain after
so many pictures and messages, not after so many seconds.
"""

from __future__ import annotations

import base64
import io
import time
from collections.abc import Callable
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt
from PIL import Image

Picture = npt.NDArray[np.int64]

PICTURES: Final = 60
MESSAGES: Final = 3000
"""Drawn by the page, and heard by it of the server, which sends 20 to 120 a second: what has not
come after both does not come."""

ANSWERED: Final = 6
"""Messages after which the server has heard what the page told it."""

SILENCE_S: Final = 300.0
"""After which a server that says nothing at all is taken for dead."""

SIZE: Final = {"width": 420, "height": 320}
SCALE: Final = 0.5
"""Pixels that are drawn for each of the page's, along each side: a quarter of the work."""
STATUS_ROWS: Final = 34
"""At the bottom, of Studio's own status bar."""
SCENE: Final = (slice(0, -STATUS_ROWS), slice(None))
"""Rows and columns of the picture."""
POINTS: Final = (slice(10, 95), slice(10, 125))
"""Of the points panel."""
PANEL: Final = (slice(120, 180), slice(25, 42))
"""Of the left margin of the start, pause and end panels, where nothing is written."""
WATCHED_BALL: Final = (slice(120, 165), slice(190, 230))
"""Of the ball at the start, as a second browser sees it."""
MIDDLE: Final = (slice(110, 260), slice(60, 360))
"""Of the ball, and of the floor round it."""
TIME_LINE: Final = (slice(230, 266), slice(110, 385))
"""Of a replay's time line."""

DRAWS_WHEN_TOLD: Final = """(() => {
    const due = []
    let heard = 0
    window.requestAnimationFrame = callback => due.push(callback)
    window.WebSocket = class extends WebSocket {
        constructor(...address) {
            super(...address)
            this.addEventListener("message", () => { heard += 1 })
        }
    }
    window.heard = () => heard
    // What is drawn stays on the canvas until this task is over.
    window.look = () => {
        for (const callback of due.splice(0)) callback(performance.now())
        return [document.querySelector("canvas").toDataURL(), heard]
    }
})()"""
"""Before anything of the page runs: its frames wait until it is looked at, and it counts what the
server sends."""


class HasUrl(Protocol):
    """Something with a page."""

    url: str


class Browser:
    """One page of the browser, with the game or the replay on it.

    Attributes:
        page: Playwright's.
        keyboard: its keys.
        picture: what was seen last, (height, width, 3), as large as the page.
        heard: messages of the server before it was drawn.
    """

    picture: Picture
    heard: int

    def __init__(self, chromium: Any, stand: HasUrl, *, controls: bool = True) -> None:
        self._context = chromium.new_context(viewport=SIZE, device_scale_factor=SCALE)
        self.page = self._context.new_page()
        self.page.set_default_timeout(1000.0 * SILENCE_S)
        self.page.add_init_script(DRAWS_WHEN_TOLD)
        self.keyboard = self.page.keyboard
        log: list[str] = []
        self.page.on("console", lambda message: log.append(message.text))
        self.page.goto(stand.url)
        # Studio's page tells its console what it has.
        telling = "First remote draw frame" if controls else "scene initialized"
        self.wait("the page is there", lambda: any(telling in line for line in log))
        self.wait("it draws the level", lambda: colours(self.picture[SCENE]) > 500)

    def look(self) -> Picture:
        """Let the page draw, and return what is seen."""
        url, self.heard = self.page.evaluate("look()")
        with Image.open(io.BytesIO(base64.b64decode(url.split(",")[1]))) as image:
            page = image.convert("RGB").resize(
                (SIZE["width"], SIZE["height"]), Image.Resampling.NEAREST
            )
            self.picture = np.asarray(page).astype(np.int64)
        return self.picture

    def wait(self, what: str, holds: Callable[[], bool]) -> None:
        """Look until something holds."""
        self.look()
        begin, drawn, silent_since_s = self.heard, 1, time.monotonic()
        while not holds():
            before = self.heard
            self.look()
            drawn += 1
            if self.heard > before:
                silent_since_s = time.monotonic()
            silent_s, heard = time.monotonic() - silent_since_s, self.heard - begin
            assert silent_s < SILENCE_S, (
                f"the server said nothing for {silent_s:.0f} s until {what}"
            )
            assert drawn < PICTURES or heard < MESSAGES, (
                f"{drawn} pictures and {heard} messages in vain until {what}"
            )

    def settled(self) -> Picture:
        """Return what is seen when it no longer changes, but for a coin that turns."""
        before = self.look()

        def still() -> bool:
            nonlocal before
            before, now = self.picture, before
            return differing(before[SCENE], now[SCENE]) < 0.02

        self.wait("the picture is still", still)
        return self.picture

    def wait_for_change(self, what: str, before: Picture, part: Any, share: float = 0.02) -> None:
        """Wait until more than a share of a part's pixels are not as they were ``before``."""
        self.wait(what, lambda: differing(self.picture[part], before) > share)

    def tell(self) -> None:
        """Wait until the server has heard what keys and mouse did."""
        self.look()
        enough = self.heard + ANSWERED
        self.wait("the server answers", lambda: self.heard >= enough)

    def press(self, key: str, what: str, holds: Callable[[], bool]) -> None:
        """Press a key until it has its effect, and let it go."""
        self.keyboard.down(key)
        self.wait(what, holds)
        self.keyboard.up(key)
        self.tell()

    def tap(self, key: str) -> None:
        """Press a key until the server has heard of it, and let it go."""
        self.keyboard.down(key)
        self.tell()
        self.keyboard.up(key)
        self.tell()

    def close(self) -> None:
        """Leave the page."""
        self._context.close()


def differing(first: Picture, second: Picture) -> float:
    """Return the share of pixels that are clearly not the same."""
    return float((np.abs(first - second).max(axis=-1) > 24).mean())


def colours(part: Picture) -> int:
    """Return how many different colours there are."""
    return len(np.unique(part.reshape(-1, 3), axis=0))


def dark(part: Picture) -> float:
    """Return the share of pixels as dark as a panel."""
    return float((part.max(axis=-1) < 110).mean())


def gold_pixels(part: Picture) -> npt.NDArray[np.bool_]:
    """Say which pixels are of the gold of the points and of the time line's grab."""
    red, green, blue = (part[..., channel] for channel in range(3))
    of_gold: npt.NDArray[np.bool_] = (red > 180) & (green > 130) & (blue < 120)
    return of_gold


def gold(part: Picture) -> int:
    """Return how many pixels are of that gold."""
    return int(gold_pixels(part).sum())
