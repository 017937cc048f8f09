"""Loops over rows, compiled to machine code by Numba.

In NumPy a step of a single game is a hundred calls on arrays of three numbers, which cost several
times the physics. What runs in every step is therefore written as what it is, loops over games and
pieces, and compiled. With ``NUMBA_DISABLE_JIT=1`` all of it runs as plain Python, to the same bits.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core import event

_P = ParamSpec("_P")
_R = TypeVar("_R")


def compiled(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function`` compiled at its first call.

    The machine code is kept for the next process: beside the module, or in the user's cache
    directory, or not at all where neither can be written to. Numba keeps no record of what a
    function takes from *other* files, so one uses only functions and constants of its own module;
    the rest are its arguments.

    Arithmetic is IEEE's, in the order written: no fused or reassociated operations, so a result
    depends neither on the number of rows nor on the processor. Indices are not checked.
    """
    return cast("Callable[_P, _R]", _dispatcher(function))


def compiled_with_package(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function`` compiled as `compiled` does, to run without Python's lock.

    It may use functions and constants of all modules in its own directory: what was kept of it is
    compiled anew when any of them has changed. It makes no arrays, so that none has to be counted:
    counting the references to arguments, an atomic operation each, cost as much as the work.
    """
    dispatcher = _dispatcher(function, nogil=True, _nrt=False)
    file = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if file is not None:
        # Of the function's own file, as Numba has it; it has no name for a stamp of several.
        file._source_stamp = _stamp(Path(function.__code__.co_filename).parent)
    return cast("Callable[_P, _R]", dispatcher)


def part_of_package(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function`` compiled as a part of what `compiled_with_package` compiles.

    Python cannot call it, and nothing is kept of it alone, which takes a fifth of the time off.
    """
    return _part(function, inline=False)


def inlined_in_package(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function`` compiled as `part_of_package` does, into whatever calls it.

    For what has one caller, and arguments that cost more to pass than it takes to work on them: an
    array is seven numbers.
    """
    return _part(function, inline=True)


def _part(function: Callable[_P, _R], *, inline: bool) -> Callable[_P, _R]:
    # Numba has public names for neither the switch of its counting runtime nor those of the
    # wrappers it makes for Python and C; see `numba.core.options`.
    options: dict[str, Any] = {
        "error_model": "numpy",
        "nogil": True,
        "forceinline": inline,
        "_nrt": False,
        "no_cpython_wrapper": True,
        "no_cfunc_wrapper": True,
    }
    return cast("Callable[_P, _R]", numba.njit(**options)(function))


def _dispatcher(function: Callable[..., Any], **options: Any) -> Any:
    try:
        return numba.njit(cache=True, error_model="numpy", **options)(function)
    except RuntimeError:
        # Nowhere to write: neither beside the package nor in the user's cache directory.
        _WAIT.kept = False
        return numba.njit(error_model="numpy", **options)(function)


@cache
def _stamp(directory: Path) -> tuple[tuple[str, float, int], ...]:
    """Return what changes when a module of a directory does, or how it is compiled."""
    files = [Path(__file__), *sorted(directory.glob("*.py"))]
    states = [(file.name, file.stat()) for file in files]
    return tuple((name, state.st_mtime, state.st_size) for name, state in states)


class _Wait(event.Listener):
    """Says on the terminal, once a process, what the first step waits for when it has to.

    Numba broadcasts the event when it compiles, and not when it finds what it had compiled before.
    """

    def __init__(self) -> None:
        self.said = False
        self.kept = True

    def on_start(self, event: event.Event) -> None:
        """Say it, if it is our function that Numba begins with."""
        module = event.data["dispatcher"].py_func.__module__
        if self.said or module.partition(".")[0] != __name__.partition(".")[0]:
            return
        self.said = True
        if self.kept:
            how_often = "once for this machine"
        else:
            how_often = (
                "in every process, since Numba finds no directory to keep them in; set "
                "NUMBA_CACHE_DIR to one that can be written to"
            )
        print(f"Roller: compiling the rules (up to half a minute), {how_often}", file=sys.stderr)

    def on_end(self, event: event.Event) -> None:
        """Say nothing."""


_WAIT = _Wait()
event.register("numba:compile", _WAIT)  # type: ignore[no-untyped-call]
