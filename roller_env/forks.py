"""What a process forked from another must not touch: threads do not follow their process there.

A native object that ends its threads when it is freed would wait for ever for those that are not
there. It is left alone instead, for the little time that such a process lives.
"""

from __future__ import annotations

import ctypes


def never_freed(thing: object) -> None:
    """Keep an object until the process is gone, also while the interpreter shuts down."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))
