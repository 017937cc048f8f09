"""Who can reach the page."""

from __future__ import annotations

import os
import signal
import socket
import sys
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from roller_env.play import server
from roller_env.play.server import PlayError, open_page, open_window, run, warning_of
from tests.patience import STALLED_S
from tests.play.stand import Stand

pytestmark = pytest.mark.xdist_group("browser")

LISTEN = "0A"
"""State of a listening socket in /proc/net/tcp."""


def listening_addresses(port: int) -> set[str]:
    """Return the addresses on which this machine listens on a port, in the kernel's own words."""
    found = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            local, state = line.split()[1], line.split()[3]
            address, _, local_port = local.rpartition(":")
            if state == LISTEN and int(local_port, 16) == port:
                found.add(address)
    return found


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="no /proc/net/tcp on this system")
def test_the_page_is_served_on_the_loopback_address_alone(stand: Stand) -> None:
    # 127.0.0.1 as a little-endian number in hexadecimal.
    assert listening_addresses(stand.port) == {"0100007F"}


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="no /proc/net/tcp on this system")
def test_a_host_that_was_asked_for_is_listened_on_until_the_game_is_closed() -> None:
    stand = Stand("127.0.0.2")
    assert listening_addresses(stand.port) == {"0200007F"}
    assert stand.close() == 0
    assert not listening_addresses(stand.port)


def test_listening_elsewhere_is_said_to_be_open_to_everybody() -> None:
    warning = warning_of("0.0.0.0")
    assert warning is not None
    assert "no password" in warning
    assert warning_of("127.0.0.1") is None


@pytest.mark.parametrize("path", ["ui", "state", "drop"])
@pytest.mark.parametrize("origin", ["http://evil.example", "https://localhost.evil.example"])
def test_a_page_from_elsewhere_is_refused(stand: Stand, path: str, origin: str) -> None:
    with pytest.raises(InvalidStatus) as refusal:
        connect(f"ws://127.0.0.1:{stand.port}/{path}", origin=Origin(origin))
    assert refusal.value.response.status_code == 403


@pytest.mark.parametrize("name", ["localhost", "127.0.0.1"])
def test_the_games_own_page_is_let_in_also_through_a_tunnel(stand: Stand, name: str) -> None:
    origin = f"http://{name}:9999"
    with connect(f"ws://127.0.0.1:{stand.port}/state", origin=Origin(origin)) as state:
        assert "role=" in str(state.recv(timeout=STALLED_S))


def test_a_port_that_is_taken_is_said_to_be() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(RuntimeError, match=f"Port {port} is already in use"):
            run(open_page([], port=port))


@pytest.mark.skipif(sys.version_info >= server.NATIVE_PYTHON, reason="this Python opens windows")
def test_a_window_on_an_old_python_is_refused_with_what_helps() -> None:
    with pytest.raises(PlayError, match=r"needs Python 3\.12 or newer.*--viewer web"):
        open_window([])


class InterruptedGame:
    """What `run` runs, whose step is under way when a signal comes."""

    def __init__(self, number: signal.Signals) -> None:
        self.number = number
        self.begun = self.ended = 0

    def __enter__(self) -> InterruptedGame:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        assert error is None

    def dispatch(self, message: object) -> None:
        pass

    def is_running(self) -> bool:
        return True

    def sync(self) -> None:
        self.begun += 1
        if self.begun == 3:
            os.kill(os.getpid(), self.number)
        self.ended += 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_game_that_is_told_to_end_makes_its_step_first(
    number: signal.Signals, capsys: pytest.CaptureFixture[str]
) -> None:
    before = signal.getsignal(number)
    game: Any = InterruptedGame(number)
    run(game)
    assert (game.begun, game.ended) == (3, 3)
    assert "Good bye." in capsys.readouterr().out
    assert signal.getsignal(number) is before
