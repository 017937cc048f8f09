"""The game or a replay on a page, served by a process of its own, and a person's eyes and hands.

A process of its own, because Studio (MuJoCo 4.0.0) can have one page in the life of a process: the
second one's viewer never ends.
"""

from __future__ import annotations

import io
import multiprocessing
import os
import socket
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from roller_env.play.app import Choices, GamePlugin, ScreenPlugin
from roller_env.play.panels import Choice
from roller_env.play.replay_page import replay_plugins
from roller_env.play.scene import PlayScene
from roller_env.play.server import LOOPBACK, Plugins, open_page, run
from roller_env.play.session import GameFrame, Phase
from roller_env.play.sound import CoinSound
from roller_env.replay import load_replay, shipped_replays
from tests.play.lane import Witness, game

Picture = npt.NDArray[np.int64]

PATIENCE_S: Final = 60.0
"""How long a test waits for what must come: a machine that draws in software and has other things
to do takes its time."""

SIZE: Final = {"width": 420, "height": 320}
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


class Status(NamedTuple):
    """The game as it stands in the other process.

    Attributes:
        phase: what the game is doing.
        episode: number of the episode.
        ball_x: how far forward the ball is, metres.
        pushed: whether any key pushed it in the last step.
        coins: collected.
        success: at the finish.
        camera: the mode of the player's.
        answer_s: shortest time so far from reading a change of the keys to handing the picture
            with it to the drawing, seconds.
    """

    phase: Phase
    episode: int
    ball_x: float
    pushed: bool
    coins: int
    success: bool
    camera: int
    answer_s: float


class ReplayStatus(NamedTuple):
    """A replay as it stands in the other process.

    Attributes:
        phase: playing or paused.
        time_s: the moment shown.
        duration_s: of the whole replay.
    """

    phase: Phase
    time_s: float
    duration_s: float


def wait_for(what: str, holds: Callable[[], bool], pause: Callable[[], Any] | None = None) -> None:
    """Wait until something holds."""
    end = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end, f"waited {PATIENCE_S} s in vain until {what}"
        if pause is None:
            time.sleep(0.02)
        else:
            pause()


def free_port() -> int:
    """Return a port on which nobody listens."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def is_served(host: str, port: int) -> bool:
    """Say whether somebody listens there."""
    with socket.socket() as probe:
        return probe.connect_ex((host, port)) == 0


class HasUrl(Protocol):
    """Something with a page."""

    url: str


class Served:
    """What `make` makes, served on a free port until `close`."""

    def __init__(self, make: Make, host: str = LOOPBACK) -> None:
        self.host = host
        self.port = free_port()
        self.url = f"http://{host}:{self.port}/"
        spawn = multiprocessing.get_context("spawn")
        self._line, theirs = spawn.Pipe()
        self._process = spawn.Process(target=_serve, args=(make, host, self.port, theirs))
        self._process.start()
        wait_for("the page is served", self._is_served)

    def close(self) -> int | None:
        """Stop serving, and return the process's exit code."""
        self._line.send("end")
        self._process.join(PATIENCE_S)
        return self._process.exitcode

    def _ask(self) -> Any:
        self._line.send("status")
        return self._line.recv()

    def _is_served(self) -> bool:
        assert self._process.is_alive(), f"it ended with {self._process.exitcode}"
        return is_served(self.host, self.port)


class Stand(Served):
    """A game on the lane."""

    def __init__(self, host: str = LOOPBACK) -> None:
        super().__init__(_game, host)

    @property
    def status(self) -> Status:
        """The game as it stands."""
        status = self._ask()
        assert isinstance(status, Status)
        return status


class ReplayStand(Served):
    """The shipped replay of the flat level."""

    def __init__(self) -> None:
        super().__init__(_replay)

    @property
    def status(self) -> ReplayStatus:
        """The replay as it stands."""
        status = self._ask()
        assert isinstance(status, ReplayStatus)
        return status


Asked = Callable[[], NamedTuple]
Make = Callable[[], tuple[Plugins, Asked]]
"""Makes plugins and what tells how they stand; importable, for the other process."""


def _serve(make: Make, host: str, port: int, line: Connection[Any, Any]) -> None:
    """Serve what is made, in the other process, until ``line`` says "end"."""
    plugins, asked = make()
    ended = threading.Event()

    def answer() -> None:
        while line.recv() == "status":
            line.send(asked())
        ended.set()

    threading.Thread(target=answer, daemon=True).start()
    run(open_page(plugins, port=port, host=host), ended.is_set)


class TimedScreen(ScreenPlugin):
    """A screen that tells how soon keys are in what is drawn."""

    def __init__(self, choices: Choices) -> None:
        super().__init__(choices)
        self.answer_s = np.inf
        self._changed_s: float | None = None

    def _wait_for_answer(self, told_s: float) -> None:
        self._changed_s = told_s
        super()._wait_for_answer(told_s)

    def _draw(self, frame: GameFrame, scene: PlayScene, now: float) -> None:
        super()._draw(frame, scene, now)
        if self._changed_s is not None and self._answered_s >= self._changed_s:
            self.answer_s = min(self.answer_s, time.monotonic() - self._changed_s)
            self._changed_s = None


def _game() -> tuple[Plugins, Asked]:
    """Make a game on the lane."""
    witness = Witness()
    choices = Choices((Choice("lane", "Lane"),), "lane")
    session = game(started=False, observers=[witness])
    plugin = GamePlugin(lambda _: session, choices, CoinSound(muted=True), "low")
    screen = TimedScreen(choices)

    def asked() -> Status:
        frame, force = plugin.latest, witness.forces[-1][-1:]
        return Status(
            phase=frame.phase,
            episode=frame.episode,
            ball_x=float(frame.after[frame.ball]),
            pushed=bool(np.any(force)),
            coins=frame.result.coins,
            success=frame.result.success,
            camera=screen.camera.mode,
            answer_s=screen.answer_s,
        )

    return (plugin, screen), asked


def _replay() -> tuple[Plugins, Asked]:
    """Make the page of a replay."""
    plugin, screen = replay_plugins(
        load_replay(shipped_replays()["flat"]), CoinSound(muted=True), "low"
    )
    session = plugin.replay_session

    def asked() -> ReplayStatus:
        return ReplayStatus(session.phase, session.time_s, session.duration_s)

    return (plugin, screen), asked


_FRAMES_OF_A_RELEASE = 4
_FRAMES_PASS = """async count => {
    while (count--) await new Promise(requestAnimationFrame)
}"""


class Browser:
    """One page of the browser, with the game or the replay on it."""

    def __init__(self, chromium: Any, stand: HasUrl, *, controls: bool = True) -> None:
        self._context = chromium.new_context(viewport=SIZE)
        self.page = self._context.new_page()
        self.page.set_default_timeout(1000.0 * PATIENCE_S)
        self.keyboard = self.page.keyboard
        log: list[str] = []
        self.page.on("console", lambda message: log.append(message.text))
        self.page.goto(stand.url)
        # Studio's page tells its console what it has.
        telling = "First remote draw frame" if controls else "scene initialized"
        self.wait("the page is there", lambda: any(telling in line for line in log))
        self.wait("it draws the level", lambda: colours(self.picture()[SCENE]) > 500)

    def picture(self) -> Picture:
        """Return what is seen, (height, width, 3)."""
        with Image.open(io.BytesIO(self.page.screenshot())) as image:
            return np.asarray(image.convert("RGB")).astype(np.int64)

    def settled(self) -> Picture:
        """Return what is seen when it no longer changes, but for a coin that turns."""
        seen = [self.picture()]

        def still() -> bool:
            seen.append(self.picture())
            return differing(seen[-2][SCENE], seen[-1][SCENE]) < 0.02

        self.wait("the picture is still", still)
        return seen[-1]

    def wait(self, what: str, holds: Callable[[], bool]) -> None:
        """Wait until something holds, while the page goes on."""
        wait_for(what, holds, lambda: self.page.wait_for_timeout(20))

    def wait_for_change(self, what: str, before: Picture, part: Any, share: float = 0.02) -> None:
        """Wait until more than a share of a part's pixels are not as they were ``before``."""
        self.wait(what, lambda: differing(self.picture()[part], before) > share)

    def press(self, key: str, what: str, holds: Callable[[], bool]) -> None:
        """Press a key until it has its effect, and let it go until the page has seen that too.

        A page that draws slowly reads its keys slowly: it takes a key that is let go and pressed
        again between two of its frames for one that was held.
        """
        self.keyboard.down(key)
        self.wait(what, holds)
        self.keyboard.up(key)
        self.page.evaluate(_FRAMES_PASS, _FRAMES_OF_A_RELEASE)

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


needs_a_steady_browser = pytest.mark.skipif(
    "ROLLER_STEADY_BROWSER" not in os.environ,
    reason="in vain in one run of three where software draws two pages at once: set "
    "ROLLER_STEADY_BROWSER=1 and run tests/play on one worker",
)
"""For tests that wait for a picture to follow the mouse or a key in a replay or a recorded game."""
