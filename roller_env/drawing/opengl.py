"""An OpenGL context to draw in, or one line that says what to install.

MuJoCo chooses its OpenGL backend while it is imported, from ``MUJOCO_GL``: by default GLFW, which
needs a display; and with ``egl`` its import fails on machines without EGL. Both are wrong for a
package whose physics must work anywhere, so the choice is made here, at the first picture, and
``MUJOCO_GL`` is read but never set.

A context is current only while it is drawn in, so that any thread may draw; one does at a time. No
OpenGL library works on in a process forked from one that has drawn, and those that look as if they
did wait for ever: drawing there is refused, and nothing that was inherited is freed.
"""

from __future__ import annotations

import importlib
import os
import platform
import sys
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from typing import Any, Final, Protocol

import mujoco

from roller_env.forks import never_freed

DEBIAN_PACKAGES: Final = ("libegl1", "libgl1-mesa-dri")
"""What EGL with software drawing needs on Debian and Ubuntu."""

FORKED: Final = (
    "cannot draw: this process was forked from one that had drawn, and OpenGL does not work in "
    "both; start it with 'spawn' or 'forkserver' (AsyncVectorEnv(..., context='spawn'), "
    "SubprocVecEnv(..., start_method='spawn')), or draw nothing before the fork"
)

_SWITCHED_OFF: Final = ("disable", "disabled", "off", "false", "0")
_BACKENDS: Final = {"egl": "egl", "osmesa": "osmesa", "glfw": "glfw", "glx": "glfw"}


class DrawingUnavailable(RuntimeError):
    """No picture can be drawn in this process; the message says in one line what is missing."""


class Context(Protocol):
    """What MuJoCo's GLContext classes can do."""

    def as_current(self) -> AbstractContextManager[None]:
        """Let the OpenGL calls of this thread go here; afterwards they go where they went."""

    def free(self) -> None:
        """Give the context back."""


class _Process:
    """What this process has to do with OpenGL."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.reached_for_opengl = False
        self.forked = False

    def fork(self) -> None:
        """Take over from the parent, in the child; only the thread that forked is here."""
        self.lock = threading.RLock()
        egl: Any = sys.modules.get("mujoco.egl")
        # By the program's own use of MuJoCo, if not by ours.
        displayed = egl is not None and egl.EGL_DISPLAY is not None
        self.forked = self.forked or self.reached_for_opengl or displayed
        if displayed:
            # Or MuJoCo would terminate the parent's display when this process ends, and wait.
            egl.EGL_DISPLAY = None


_PROCESS: Final = _Process()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_PROCESS.fork)


def missing_opengl() -> str | None:
    """Return one line that says what drawing lacks in this process, or None if it works."""
    return _working()[1]


def new_context(width: int, height: int) -> Context:
    """Return a new OpenGL context for pictures of that size; draw in it with `current`.

    Raises:
        DrawingUnavailable: there is no OpenGL here.
    """
    with _PROCESS.lock:
        backend, missing = _working()
        if backend is None:
            raise DrawingUnavailable(missing)
        return _open(backend, width, height)


@contextmanager
def drawing() -> Iterator[None]:
    """Draw, while no other thread of this process does.

    Raises:
        DrawingUnavailable: this process was forked from one that had drawn.
    """
    with _PROCESS.lock:
        if _PROCESS.forked:
            raise DrawingUnavailable(FORKED)
        yield


@contextmanager
def current(context: Context) -> Iterator[None]:
    """Let this thread's OpenGL calls go to ``context``, while no other thread draws.

    Raises:
        DrawingUnavailable: this process was forked from one that had drawn.
    """
    with drawing(), context.as_current():
        yield


def free(context: Context, resources: mujoco.MjrContext) -> None:
    """Free what was loaded into a context, and the context; from any thread.

    Left to itself, MuJoCo would free resources in whatever context is current then, and so spoil
    another's pictures.
    """
    if _PROCESS.forked:
        never_freed(context)
        never_freed(resources)
        return
    with current(context):
        resources.free()
    context.free()


def _working() -> tuple[str | None, str | None]:
    """Return the module of the backend that draws here, or None and why there is none."""
    with _PROCESS.lock:
        if _PROCESS.forked:
            return None, FORKED
        return _probe()


@cache
def _probe() -> tuple[str | None, str | None]:
    """Return the module of the first backend that draws, or None and why there is none."""
    wanted = os.environ.get("MUJOCO_GL", "").strip().lower()
    if wanted in _SWITCHED_OFF:
        return None, f"cannot draw: MUJOCO_GL={wanted} switches OpenGL off; unset it"
    failures = []
    for backend in _candidates(wanted):
        try:
            context = _open(backend, 1, 1)
            with context.as_current():
                mujoco.MjrContext(mujoco.MjModel.from_xml_string("<mujoco/>"), 100).free()
        # The libraries that are missing show as any of these, by platform and by what is missing.
        except (ImportError, AttributeError, OSError, RuntimeError, mujoco.FatalError) as error:
            failures.append(f"{backend.rpartition('.')[2]}: {_first_line(error)}")
        else:
            context.free()
            return backend, None
    packages = " ".join(DEBIAN_PACKAGES)
    return None, (
        "cannot draw: no OpenGL library works here; on Debian or Ubuntu: apt-get install "
        f"{packages} ({'; '.join(failures)})"
    )


def _candidates(wanted: str) -> tuple[str, ...]:
    """Return the modules of the backends to try."""
    if wanted in _BACKENDS:
        return (f"mujoco.{_BACKENDS[wanted]}",)
    if platform.system() != "Linux":
        return ("mujoco.rendering.classic.gl_context",)
    displayed = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    return ("mujoco.egl", "mujoco.glfw") if displayed else ("mujoco.egl",)


def _open(backend: str, width: int, height: int) -> Context:
    _PROCESS.reached_for_opengl = True
    module: Any = importlib.import_module(backend)
    context: Context = module.GLContext(width, height)
    if not getattr(context, "_context", True):
        raise RuntimeError("no context was made")
    return context


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
