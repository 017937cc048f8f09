"""A stranger's path is read at once or refused at once."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from roller_env.regular_files import read_regular_file


def test_a_file_is_read_up_to_its_bound(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    (tmp_path / "link").symlink_to(path)
    assert read_regular_file(path, 5) == read_regular_file(tmp_path / "link", 5) == b"12345"
    with pytest.raises(OSError, match="the file is too large; allowed are at most 4 bytes"):
        read_regular_file(path, 4)


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="found a pipe; wanted a regular file"):
        read_regular_file(tmp_path / "pipe", 10)


def test_what_became_a_pipe_after_it_was_looked_at_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_bytes(b"")
    before = (tmp_path / "file").stat()
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr(Path, "stat", lambda *_arguments, **_options: before)
    with pytest.raises(OSError, match="found a pipe"):
        read_regular_file(tmp_path / "pipe", 10)


@pytest.mark.parametrize(
    ("path", "kind"), [("/dev/zero", "a device"), ("/dev/null", "a device"), ("/", "a directory")]
)
def test_a_device_or_a_directory_is_refused(path: str, kind: str) -> None:
    with pytest.raises(OSError, match=f"found {kind}; wanted a regular file"):
        read_regular_file(Path(path), 10)


def test_a_socket_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # since the name of a socket is short
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("socket")
        with pytest.raises(OSError, match="found a socket; wanted a regular file"):
            read_regular_file(Path("socket"), 10)


def test_a_file_that_is_missing_is_told_apart(tmp_path: Path) -> None:
    for name in ("nothing", "a\0b"):
        with pytest.raises(FileNotFoundError, match="there is no such file"):
            read_regular_file(tmp_path / name, 10)
