"""MuJoCo's log file: warnings of every simulation, appended in whatever directory one works in.

They are counted where they arise, said on the terminal by MuJoCo and, where a game ends, by a
Python warning; the file is a surprise.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Final

from roller_env.physics.library import mujoco_library

_DEFAULT: Final = b"MUJOCO_LOG.TXT"


class _LogConfig(ctypes.Structure):
    """``mjLogConfig``, as in MuJoCo's ``mjtype.h``."""

    _fields_ = (
        ("logto_console", ctypes.c_bool),
        ("logto_file", ctypes.c_bool),
        ("logfile", ctypes.c_char * 1024),
        ("topics", ctypes.c_int),
    )


@cache
def no_log_file() -> None:
    """Keep MuJoCo from writing MUJOCO_LOG.TXT in this process, from the first call on.

    A file of another name was chosen by somebody, and stays; so does what is said on the terminal.
    """
    library = mujoco_library()
    if library is None or not hasattr(library, "mju_setLogConfig"):
        return
    library.mju_getLogConfig.restype = _LogConfig
    library.mju_setLogConfig.argtypes = (_LogConfig,)
    library.mju_setLogConfig.restype = None
    config = library.mju_getLogConfig()
    if config.logfile == _DEFAULT:
        config.logto_file = False
        library.mju_setLogConfig(config)
