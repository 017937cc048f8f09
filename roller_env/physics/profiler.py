"""MuJoCo's profiler reads the clock ten times a step: a seventh of what a rolling ball costs.

Its readings (``MjData.timer``) are not used here. MuJoCo takes them while the global ``mjcb_time``
is set, and its Python bindings set it with the first ``MjData``; they have no way to unset it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco


def _timer_callback() -> ctypes.c_void_p | None:
    """Return MuJoCo's global ``mjcb_time``; None where its library is not a file of its package."""
    for library in Path(mujoco.__file__).parent.glob(f"libmujoco*{mujoco.mj_versionString()}*"):
        # Loaded already, so this is a handle of the library that the bindings use.
        return ctypes.c_void_p.in_dll(ctypes.CDLL(str(library)), "mjcb_time")
    return None


_CALLBACK = _timer_callback()


@contextmanager
def profiler_off() -> Iterator[None]:
    """Let MuJoCo step without its profiler; afterwards it is as it was.

    The callback is the process's: other threads that step meanwhile are not timed either.
    """
    if _CALLBACK is None:
        yield
        return
    before = _CALLBACK.value
    _CALLBACK.value = None
    try:
        yield
    finally:
        _CALLBACK.value = before
