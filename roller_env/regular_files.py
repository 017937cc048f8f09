"""Read a file of a stranger: a regular one, of bounded size, or nothing at all.

A pipe or a terminal would be waited for without end, and a device may be endless; so neither is
opened to be read.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from roller_env.platforms import AT_ONCE

LOOK_EVERY_S: Final = 0.3
"""How often to look whether a file has been saved."""

_KINDS: Final = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFDIR: "a directory",
}


def read_regular_file(path: Path, most_bytes: int) -> bytes:
    """Return the content of a regular file, at once.

    Args:
        path: the file; symbolic links are followed.
        most_bytes: the most that the file may hold.

    Raises:
        FileNotFoundError: there is no such file.
        OSError: it is a pipe, a socket, a device or a directory, it is too large, or it cannot be
            read; ``strerror`` says which, in words.
    """
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, ValueError):  # the latter for a NUL character in the name
        raise FileNotFoundError(errno.ENOENT, "there is no such file") from None
    _check_kind(mode)
    # Without blocking, for what has become a pipe since; so it is asked again.
    with open(path, "rb", opener=_open_at_once) as file:
        _check_kind(os.fstat(file.fileno()).st_mode)
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        message = f"the file is too large; allowed are at most {most_bytes} bytes"
        raise OSError(errno.EFBIG, message)
    return content


def _open_at_once(path: str, flags: int) -> int:
    return os.open(path, flags | AT_ONCE)


def _check_kind(mode: int) -> None:
    if not stat.S_ISREG(mode):
        kind = _KINDS.get(stat.S_IFMT(mode), "something else")
        raise OSError(errno.EINVAL, f"found {kind}; wanted a regular file")


class SavedFile:
    """A file that somebody writes: says whether it has been saved since it was asked last.

    An editor may write the file in place or put another in its place; while there is none, nothing
    was saved.
    """

    def __init__(
        self, path: Path, files_of: Callable[[Path], Sequence[Path]] = lambda path: [path]
    ):
        """Look at a file, and at those that belong to it.

        Args:
            path: the file.
            files_of: returns it and the others; asked anew whenever one of them has been saved. By
                default there are none.
        """
        self._path, self._files_of = path, files_of
        self._files: Sequence[Path] = [path]
        self._before: list[tuple[int, ...] | None] = []

    def is_new(self) -> bool:
        """Say whether one has been saved; so it is at the first time, there or not."""
        now = list(map(_signature, self._files))
        if now == self._before or (now[0] is None and self._before):
            return False
        if self._files_of is not None:
            self._files = self._files_of(self._path)
        self._before = list(map(_signature, self._files))
        return True


def _signature(path: Path) -> tuple[int, ...] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
