"""MuJoCo's own library, for the few of its functions that the Python bindings leave out."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import mujoco


@cache
def mujoco_library() -> ctypes.CDLL | None:
    """Return the library that the bindings use; None where it is not found."""
    for library in Path(mujoco.__file__).parent.glob(f"libmujoco*{mujoco.mj_versionString()}*"):
        try:
            # Loaded already, so this is a handle of the same.
            return ctypes.CDLL(str(library))
        except OSError:
            continue
    return None
