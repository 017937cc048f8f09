"""The game or a replay on a page, served by a process of its own.

A process of its own, because Studio (MuJoCo 4.0.0) can have one page in the life of a process: the
second one's viewer never ends.
"""

from __future__ import annotations

import json
import multiprocessing
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Final, NamedTuple
from urllib.request import ProxyHandler, build_opener

import numpy as np

from roller_env.play.app import Choices, GamePlugin, ScreenPlugin
from roller_env.play.panels import Choice
from roller_env.play.replay_page import replay_plugins
from roller_env.play.scene import PlayScene
from roller_env.play.server import LOOPBACK, Plugins, open_page, run
from roller_env.play.session import GameFrame, Phase
from roller_env.play.sound import CoinSound
from roller_env.replay import load_replay, shipped_replays
from tests.patience import STALLED_S
from tests.play.lane import Witness, game, lane


class Status(NamedTuple):
    """The game as it stands in the other process.

    Attributes:
        phase: what the game is doing.
        episode: number of the episode.
        ball_x: how far forward the ball is, metres.
        pushed: whether any key pushes it.
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


def wait_until_served(is_served: Callable[[], bool]) -> None:
    """Wait for a page that comes up; whoever says whether it is there also says if it is dead."""
    end = time.monotonic() + STALLED_S
    while not is_served():
        assert time.monotonic() < end, f"the page was not served in {STALLED_S} s"
        time.sleep(0.02)


def free_port() -> int:
    """Return a port on which nobody listens."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


EMPTY_SCENE_BYTES: Final = 100_000
"""More than Studio's empty scene, and less than any level with its textures."""

WITHOUT_PROXY: Final = build_opener(ProxyHandler({}))


def is_served(url: str) -> bool:
    """Say whether a level is served there.

    Studio serves an empty scene first. A page that is opened before the level takes its place may
    say "Parsing model..." for ever, and show the panels over nothing (seen with MuJoCo 4.0.0).
    """
    try:
        with WITHOUT_PROXY.open(f"{url}model?total_bytes", timeout=STALLED_S) as reply:
            return int(json.load(reply)["total_bytes"]) > EMPTY_SCENE_BYTES
    except OSError:
        return False


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
        wait_until_served(self._is_served)

    def close(self) -> int | None:
        """Stop serving, and return the process's exit code."""
        self._line.send("end")
        self._process.join(STALLED_S)
        return self._process.exitcode

    def _ask(self) -> Any:
        self._line.send("status")
        return self._line.recv()

    def _is_served(self) -> bool:
        assert self._process.is_alive(), f"it ended with {self._process.exitcode}"
        return is_served(self.url)


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
    """Serve what is made, in the other process, until ``line`` says "end" or is cut."""
    plugins, asked = make()
    ended = threading.Event()

    def answer() -> None:
        # A test run that is killed says nothing more, and leaves nobody behind.
        with suppress(EOFError):
            while line.recv() == "status":
                line.send(asked())
        ended.set()

    threading.Thread(target=answer, daemon=True).start()
    run(open_page(plugins, port=port, host=host), ended.is_set)


LONG_LANE: Final = lane(
    boxes=[{"at": (15.0, 0.0, -0.5), "size": (40.0, 8.0, 1.0)}],
    finish={"at": (30.0, 0.0, 0.5), "size": (0.5, 6.0, 1.0)},
)
"""While a slow machine lets go of a key, the game goes on: no push is to end at the finish."""


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
    session = game(LONG_LANE, started=False, observers=[witness])
    plugin = GamePlugin(lambda _: session, choices, CoinSound(muted=True), "low")
    screen = TimedScreen(choices)

    def asked() -> Status:
        frame, force = plugin.latest, witness.forces[-1][-1:]
        return Status(
            phase=frame.phase,
            episode=frame.episode,
            ball_x=float(frame.after[0]),
            pushed=frame.phase is Phase.PLAYING and bool(np.any(force)),
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
