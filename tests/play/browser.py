"""A person's eyes and hands on the page.

Without a graphics processor software draws the page, beside whatever else the machine does: a
picture may take a second. So nothing here waits for pictures or counts seconds: what is waited for
is what the page is sent and what stands on it.
"""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable
from typing import Any, Final

from tests.patience import STALLED_S

PHASES: Final = ("start", "intro", "playing", "paused", "ended")
_SETTINGS: Final = json.dumps({"keys": "world", "camera": "game", "quality": "low"})
SIZE: Final = {"width": 640, "height": 400}


class Person:
    """Somebody at a browser's page.

    Attributes:
        page: Playwright's page.
        sent: what the page has sent, as it is.
    """

    def __init__(self, chromium: Any, url: str, **context: Any) -> None:
        """Open a page in a browser of its own."""
        self._context = chromium.new_context(**{"viewport": SIZE, **context})
        self.page = self._context.new_page()
        self.page.set_default_timeout(1000 * STALLED_S)
        self.faults: list[str] = []
        self.asked: list[str] = []
        self.sent: list[dict[str, Any]] = []
        self._frame = b""
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("websocket", self._on_socket)
        # The keys of the agents: W is +x, however the camera turns.
        self.page.add_init_script(f"localStorage.setItem('roller settings', '{_SETTINGS}')")
        self.page.goto(url)

    def close(self) -> None:
        """Close it; nothing in it may have failed."""
        self._context.close()
        assert self.faults == []

    def _on_socket(self, socket: Any) -> None:
        def received(payload: str | bytes) -> None:
            if isinstance(payload, bytes):
                self._frame = payload

        socket.on("framereceived", received)
        socket.on("framesent", lambda payload: self.sent.append(json.loads(payload)))

    @property
    def phase(self) -> str:
        """What the game does, as the page was told last."""
        return PHASES[self._frame[1]] if self._frame else ""

    @property
    def x(self) -> float:
        """How far forward the ball is, metres."""
        return float(struct.unpack_from("<f", self._frame, 32)[0])

    @property
    def keys(self) -> int:
        """The keys that push."""
        return self._frame[30]

    @property
    def ghost(self) -> bool:
        """Whether a ghost is there."""
        return bool(self._frame[2] & 8)

    def wait(self, what: str, condition: Callable[[], bool]) -> None:
        """Wait until something is so."""
        begin = time.monotonic()
        while not condition():
            assert time.monotonic() < begin + STALLED_S, what
            self.page.wait_for_timeout(20)

    def wait_for_phase(self, phase: str) -> None:
        """Wait until the game does something."""
        self.wait(f"the game is {phase}", lambda: self.phase == phase)

    def press(self, key: str) -> None:
        """Press a key and let it go."""
        self.page.keyboard.press(key)

    def start(self) -> None:
        """Start the game from the start page."""
        self.wait_for_phase("start")
        self.page.get_by_role("button", name="Start", exact=True).wait_for()
        self.press("Enter")
        self.wait_for_phase("playing")

    def hold_until(self, key: str, what: str, condition: Callable[[], bool]) -> None:
        """Hold a key until something is so."""
        self.page.keyboard.down(key)
        self.wait(what, condition)
        self.page.keyboard.up(key)

    def sees(self, text: str) -> None:
        """Wait until a text stands on the page."""
        self.page.get_by_text(text).filter(visible=True).first.wait_for()
