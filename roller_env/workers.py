"""Threads of this process that share work which runs without Python's lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Share = TypeVar("Share")


class Workers:
    """Threads that do shares of some work at once; a fork has none of its parent's.

    The caller takes the first share itself: waking a thread takes as long as some hundred games.
    """

    def __init__(self) -> None:
        self._pool: tuple[int, int, ThreadPoolExecutor] | None = None

    def share(self, work: Callable[[Share], None], shares: Sequence[Share]) -> None:
        """Do ``work`` for every share, and return when all is done; raises what one raised."""
        first, *others = shares
        if not others:
            work(first)
            return
        pool = self._ready_pool(len(others))
        waiting = [pool.submit(work, other) for other in others]
        try:
            work(first)
        finally:
            # Whatever happens, nobody works on when this returns.
            errors = [one.exception() for one in waiting]
        for error in errors:
            if error is not None:
                raise error

    def _ready_pool(self, threads: int) -> ThreadPoolExecutor:
        if self._pool is None or self._pool[0] != os.getpid() or self._pool[1] < threads:
            self._pool = os.getpid(), threads, ThreadPoolExecutor(threads, "roller-worker")
        return self._pool[2]
