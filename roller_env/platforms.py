"""What one operating system says otherwise than another, both halves side by side.

Roller is tested on Linux only. What is here for Windows has been checked by mypy alone, which
`make lint` runs over the package as it is there: a name that Windows lacks fails it.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Final, TextIO

ENDING_SIGNALS: Final = tuple(
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""What ends a program: somebody asks it to, or closes its terminal, which Windows does not say."""

if sys.platform == "win32":
    import msvcrt

    AT_ONCE: Final = 0
    """Flags of `os.open` that never wait; Windows has no pipes among its files to wait for."""

    def lock(file: TextIO) -> None:
        """Lock an open file until it is closed or the process ends.

        Raises:
            BlockingIOError: another process holds it.
        """
        file.seek(0)
        try:
            # One byte, which need not be there: it stands for the file.
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            raise BlockingIOError(error.errno, error.strerror) from error

    def flush_directory(directory: Path) -> None:
        """Do nothing: Windows opens no directory, and writes new names by itself."""

else:
    import fcntl

    AT_ONCE: Final = os.O_NONBLOCK | os.O_NOCTTY
    """Flags of `os.open` that never wait: for the other end of a pipe, or a terminal."""

    def lock(file: TextIO) -> None:
        """Lock an open file until it is closed or the process ends.

        Raises:
            BlockingIOError: another process holds it.
        """
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def flush_directory(directory: Path) -> None:
        """Let a directory's new names reach the disk now, not in its own time.

        Raises:
            OSError: the directory cannot be opened or written.
        """
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
