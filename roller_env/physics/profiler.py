"""MuJoCo's profiler reads the clock ten times a step: a seventh of what a rolling ball costs.

Its readings (``MjData.timer``) are not used here. MuJoCo takes them while the global ``mjcb_time``
is set, and its Python bindings set it with the first ``MjData``; they have no way to unset it.
"""

from __future__ import annotations

import ctypes
import os
import threading
from contextlib import AbstractContextManager

from roller_env.physics.library import mujoco_library


def _timer_callback() -> ctypes.c_void_p | None:
    """Return MuJoCo's global ``mjcb_time``; None where its library has it not or is not found.

    The profiler then stays on, and all that is lost is time.
    """
    library = mujoco_library()
    try:
        return None if library is None else ctypes.c_void_p.in_dll(library, "mjcb_time")
    except ValueError:
        return None


class _Switch:
    """MuJoCo's profiler: off while anybody wants it off, then as it was before the first did."""

    def __init__(self) -> None:
        self._callback = _timer_callback()
        self._lock = threading.Lock()
        self._wanted_off = 0
        self._before: int | None = None

    def __enter__(self) -> None:
        if self._callback is None:
            return
        with self._lock:
            if self._wanted_off == 0:
                self._before, self._callback.value = self._callback.value, None
            self._wanted_off += 1

    def __exit__(self, *_error: object) -> None:
        if self._callback is None:
            return
        with self._lock:
            self._wanted_off -= 1
            if self._wanted_off == 0:
                self._callback.value = self._before

    def fork(self) -> None:
        """Forget, in a forked process, who wanted it off: none of those threads is here."""
        self._lock = threading.Lock()
        if self._callback is not None and self._wanted_off:
            self._callback.value, self._wanted_off = self._before, 0


_SWITCH = _Switch()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_SWITCH.fork)


def profiler_off() -> AbstractContextManager[None]:
    """Let MuJoCo step without its profiler; afterwards it is as it was.

    The callback is the process's: other threads that step meanwhile are not timed either.
    """
    return _SWITCH
