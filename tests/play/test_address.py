"""An address on which no page can be served is refused at once, in one line."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from roller_env.play.server import LOOPBACK, PlayError, check_address

ROOT = Path(__file__).parents[2]


@pytest.fixture
def taken() -> Iterator[int]:
    """Return a port on which somebody listens."""
    with socket.create_server((LOOPBACK, 0)) as server:
        yield server.getsockname()[1]


@pytest.mark.parametrize("port", [-1, 65536, 99999, 2**40])
def test_a_port_that_there_is_none_of_is_refused(port: int) -> None:
    with pytest.raises(PlayError, match=f"port: found {port}; must be a whole number from 0 to"):
        check_address(LOOPBACK, port)


def test_a_port_that_is_taken_is_refused_and_free_as_soon_as_it_is_left() -> None:
    with socket.create_server((LOOPBACK, 0)) as server:
        port = server.getsockname()[1]
        with pytest.raises(PlayError, match=f"port {port} of 127.0.0.1: Address already in use"):
            check_address(LOOPBACK, port)
        # Somebody is in the middle of reading the page when it is closed.
        with socket.create_connection((LOOPBACK, port)):
            server.accept()[0].close()
    check_address(LOOPBACK, port)
    check_address(LOOPBACK, port)


def test_a_host_that_is_none_of_this_machines_is_refused() -> None:
    for host in ("nowhere.invalid", "8.8.8.8"):
        with pytest.raises(PlayError, match=f"host '{host}': .*; --host says where to listen"):
            check_address(host, 0)


@pytest.mark.parametrize("host", [LOOPBACK, "localhost", "0.0.0.0"])
def test_any_free_port_will_do(host: str) -> None:
    check_address(host, 0)


@pytest.mark.parametrize("command", [("play.py", "--mute"), ("replay.py", "flat", "--show")])
def test_a_taken_port_is_told_before_anything_is_loaded(taken: int, command: list[str]) -> None:
    script, *arguments = command
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / script), *arguments, f"--port={taken}"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 1
    assert done.stderr.startswith(f"error: port {taken} of 127.0.0.1: Address already in use")
    assert done.stderr.count("\n") == 1
    # What a replay or a level is, is told when it is loaded.
    assert done.stdout == ""
