"""Who can reach the page, and what it is sent."""

from __future__ import annotations

import contextlib
import gzip
import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from roller_env.play.server import LOOPBACK, MAX_GUESTS, PlayError, listen, warning_of
from tests.patience import STALLED_S
from tests.play.served import ROOT, Served

pytestmark = pytest.mark.xdist_group("page")


def play(records: Path, *arguments: str) -> Served:
    """Start a game."""
    return Served("play", "flat", "--physics=rigid", f"--records={records}", *arguments)


def connected(game: Served, **options: Any) -> ClientConnection:
    """Connect as a browser does."""
    # A connection that nobody reads takes its time to say good bye.
    options = {"close_timeout": 0.1, **options}
    connection: ClientConnection = connect(f"ws://localhost:{game.port}/ws", **options)
    return connection


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    game = play(tmp_path_factory.mktemp("records") / "records.sqlite3")
    yield game
    assert game.end()[0] == 0


def messages(connection: ClientConnection, kind: str) -> Any:
    """Return the next message of a kind."""
    while True:
        found = connection.recv(timeout=STALLED_S)
        if isinstance(found, str) and json.loads(found)["type"] == kind:
            return json.loads(found)


def frame(connection: ClientConnection) -> bytes:
    """Return the next frame."""
    while True:
        found = connection.recv(timeout=STALLED_S)
        if isinstance(found, bytes):
            return found


def code_of_end(connection: ClientConnection) -> int | None:
    """Return why the server ends a connection."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            connection.recv(timeout=STALLED_S)
    return connection.close_code


def get(url: str, **headers: str) -> tuple[int, bytes, Any]:
    request = urllib.request.Request(url, headers={"Accept-Encoding": "gzip", **headers})
    try:
        with urllib.request.urlopen(request, timeout=STALLED_S) as answer:
            return answer.status, answer.read(), answer.headers
    except urllib.error.HTTPError as error:
        return error.code, b"", error.headers


def test_a_page_gets_its_level_and_frames(served: Served) -> None:
    with connected(served) as connection:
        hello = messages(connection, "hello")
        assert (hello["seat"], hello["mode"]) == ("player", "play")
        assert [row["number"] for row in hello["levels"]] == list(range(1, 21))
        level = messages(connection, "level")
        status, content, headers = get(served.url(level["scene"]))
        assert status == 200
        assert headers["Content-Encoding"] == "gzip"
        assert json.loads(gzip.decompress(content))["name"] == "flat"
        assert len(frame(connection)) == 98 + 2


def test_the_page_asks_no_other_host_for_anything(served: Served) -> None:
    status, content, headers = get(served.url())
    assert status == 200
    assert "default-src 'self'" in headers["Content-Security-Policy"]
    if headers.get("Content-Encoding") == "gzip":
        content = gzip.decompress(content)
    assert b"://" not in content.replace(b"http://www.w3.org", b"")


@pytest.mark.parametrize("path", ["/sounds/coin.wav", "/pictures/classic.jpg"])
def test_sounds_and_pictures_are_served(served: Served, path: str) -> None:
    assert get(served.url(path))[0] == 200


@pytest.mark.parametrize("path", ["/../pyproject.toml", "/%2e%2e/pyproject.toml", "/scene/x.json"])
def test_nothing_else_is_served(served: Served, path: str) -> None:
    assert get(served.url(path))[0] == 404


@pytest.mark.parametrize("name", ["evil.example", "localhost.evil.example", "10.0.0.1", ""])
def test_the_page_is_reached_by_no_other_name(served: Served, name: str) -> None:
    assert get(served.url(), Host=name)[0] == 400


@pytest.mark.parametrize("name", ["localhost", "127.0.0.1:80", "[::1]:9999", "LOCALHOST"])
def test_the_page_is_reached_by_this_machines_names(served: Served, name: str) -> None:
    assert get(served.url(), Host=name)[0] == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://localhost.evil.example", "https://localhost"]
)
def test_a_page_of_another_origin_is_not_let_in(served: Served, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        connected(served, origin=Origin(origin))


def test_a_page_of_a_tunnels_other_end_is_let_in(served: Served) -> None:
    with connected(served, origin=Origin("http://localhost:9999")) as connection:
        assert messages(connection, "hello")["type"] == "hello"


@pytest.mark.parametrize("text", ["", "{}", '{"type":"quit"}', "x" * 400, '{"type":"keys"}'])
def test_who_sends_what_is_no_message_is_sent_away_and_the_game_goes_on(
    served: Served, text: str
) -> None:
    with connected(served) as connection:
        messages(connection, "hello")
        connection.send(text)
        assert code_of_end(connection) == 1008
    with connected(served) as connection:
        assert frame(connection)


def test_a_message_without_end_is_not_read(served: Served) -> None:
    with connected(served) as connection:
        connection.send("x" * 100_000)
        assert code_of_end(connection) == 1009


def test_no_more_browsers_than_there_is_room_for(served: Served) -> None:
    with contextlib.ExitStack() as there:
        for _ in range(MAX_GUESTS):
            messages(there.enter_context(connected(served)), "hello")
        with connected(served) as connection:
            assert code_of_end(connection) == 1013


def test_a_browser_that_takes_nothing_holds_up_nobody(served: Served) -> None:
    with connected(served) as player, connected(served, max_queue=1) as slow:
        messages(player, "hello")
        player.send('{"type":"start"}')
        player.send('{"type":"skip"}')
        # It stops reading; the player's frames come as before.
        begin, frames = time.monotonic(), 0
        while frames < 60:
            frame(player)
            frames += 1
        assert time.monotonic() - begin < STALLED_S
        assert slow.close_code is None


def test_an_idle_page_costs_next_to_nothing(served: Served) -> None:
    psutil = pytest.importorskip("psutil")
    process = psutil.Process(served.process.pid)
    with connected(served) as connection:
        for _ in range(5):
            frame(connection)
        before, begin = sum(process.cpu_times()[:2]), time.monotonic()
        while time.monotonic() < begin + 3.0:
            frame(connection)
        share = (sum(process.cpu_times()[:2]) - before) / (time.monotonic() - begin)
    assert share < 0.03


def test_records_outlive_the_program_even_a_killed_one(tmp_path: Path) -> None:
    records = tmp_path / "records.sqlite3"
    game = play(records, "--skip-intro")
    with connected(game) as connection:
        messages(connection, "level")
        connection.send('{"type":"start"}')
        told: dict[str, Any] = {}
        while told.get("type") != "result":
            found = connection.recv(timeout=STALLED_S)
            connection.send('{"type":"keys","held":"w"}')
            told = json.loads(found) if isinstance(found, str) else {}
        assert told["best_time"]
    game.end(signal.SIGKILL)
    game = play(records)
    with connected(game) as connection:
        row = messages(connection, "levels")["levels"][0]
        assert row["name"] == "flat"
        assert row["best_time_s"] > 1.0
    assert game.end(signal.SIGTERM)[0] == 0


@pytest.fixture
def taken() -> Iterator[int]:
    """Return a port on which somebody listens."""
    with socket.create_server((LOOPBACK, 0)) as server:
        yield server.getsockname()[1]


@pytest.mark.parametrize("port", [-1, 65536, 99999, 2**40])
def test_a_port_that_there_is_none_of_is_refused(port: int) -> None:
    with pytest.raises(PlayError, match=f"port: found {port}; must be a whole number from 0 to"):
        listen(LOOPBACK, port)


def test_a_port_that_is_taken_is_refused(taken: int) -> None:
    with pytest.raises(PlayError, match=f"port {taken} of 127.0.0.1: Address already in use"):
        listen(LOOPBACK, taken)


def test_a_host_that_is_none_of_this_machines_is_refused() -> None:
    for host in ("nowhere.invalid", "8.8.8.8"):
        with pytest.raises(PlayError, match=f"host '{host}': .*; --host says where to listen"):
            listen(host, 0)


@pytest.mark.parametrize("host", [LOOPBACK, "localhost", "0.0.0.0"])
def test_any_free_port_will_do(host: str) -> None:
    listen(host, 0).close()


@pytest.mark.parametrize("command", [("play.py",), ("replay.py", "flat", "--show")])
def test_a_taken_port_is_told_before_anything_is_loaded(taken: int, command: list[str]) -> None:
    script, *arguments = command
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / script), *arguments, f"--port={taken}"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=STALLED_S,
    )
    assert done.returncode == 1
    assert done.stderr.startswith(f"error: port {taken} of 127.0.0.1: Address already in use")
    assert done.stderr.count("\n") == 1
    # What a replay or a level is, is told when it is loaded.
    assert done.stdout == ""


def test_listening_elsewhere_is_said_to_be_open_to_everybody() -> None:
    warning = warning_of("0.0.0.0")
    assert warning is not None
    assert "no password" in warning
    assert warning_of("127.0.0.1") is None
