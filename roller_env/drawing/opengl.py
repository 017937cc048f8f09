"""An OpenGL context to draw in, or one line that says what to install.

MuJoCo chooses its OpenGL backend while it is imported, from ``MUJOCO_GL``: by default GLFW, which
needs a display; and with ``egl`` its import fails on machines without EGL. Both are wrong for a
package whose physics must work anywhere, so the choice is made here, at the first picture, and
``MUJOCO_GL`` is read but never set.
"""

from __future__ import annotations

import importlib
import os
import sys
from functools import cache
from typing import Any, Final, Protocol

import mujoco

DEBIAN_PACKAGES: Final = ("libegl1", "libgl1-mesa-dri")
"""What EGL with software drawing needs on Debian and Ubuntu."""

_SWITCHED_OFF: Final = ("disable", "disabled", "off", "false", "0")
_BACKENDS: Final = {"egl": "egl", "osmesa": "osmesa", "glfw": "glfw", "glx": "glfw"}


class DrawingUnavailable(RuntimeError):
    """No picture can be drawn on this machine; the message says in one line what is missing."""


class Context(Protocol):
    """What MuJoCo's GLContext classes can do."""

    def make_current(self) -> None:
        """Let the OpenGL calls of this thread go here."""

    def free(self) -> None:
        """Give the context back."""


def missing_opengl() -> str | None:
    """Return one line that says what drawing lacks on this machine, or None if it works."""
    return _probe()[1]


def new_context(width: int, height: int) -> Context:
    """Return a new OpenGL context for pictures of that size, and make it current.

    Raises:
        DrawingUnavailable: there is no OpenGL here.
    """
    backend, missing = _probe()
    if backend is None:
        raise DrawingUnavailable(missing)
    return _open(backend, width, height)


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
    if sys.platform != "linux":
        return ("mujoco.rendering.classic.gl_context",)
    displayed = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    return ("mujoco.egl", "mujoco.glfw") if displayed else ("mujoco.egl",)


def _open(backend: str, width: int, height: int) -> Context:
    module: Any = importlib.import_module(backend)
    context: Context = module.GLContext(width, height)
    if not getattr(context, "_context", True):
        raise RuntimeError("no context was made")
    context.make_current()
    return context


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
