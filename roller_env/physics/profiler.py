"""MuJoCo's profiler reads the clock ten times a step: a seventh of what a rolling ball costs.

Its readings (``MjData.timer``) are not used here. MuJoCo takes them while the global ``mjcb_time``
is set, and its Python bindings set it with the first ``MjData``; they have no way to unset it.
"""

from __future__ import annotations

import ctypes
import threading
from contextlib import AbstractContextManager
from pathlib import Path

import mujoco


def _timer_callback() -> ctypes.c_void_p | None:
    """Return MuJoCo's global ``mjcb_time``; None where its library has it not or is not found.

    The profiler then stays on, and all that is lost is time.
    """
    for library in Path(mujoco.__file__).parent.glob(f"libmujoco*{mujoco.mj_versionString()}*"):
        try:
            # Loaded already, so this is a handle of the library that the bindings use.
            return ctypes.c_void_p.in_dll(ctypes.CDLL(str(library)), "mjcb_time")
        except (OSError, ValueError):
            continue
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


_SWITCH = _Switch()


def profiler_off() -> AbstractContextManager[None]:
    """Let MuJoCo step without its profiler; afterwards it is as it was.

    The callback is the process's: other threads that step meanwhile are not timed either.
    """
    return _SWITCH
