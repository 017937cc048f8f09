"""Loops over rows, compiled to machine code by Numba.

In NumPy a step of a single game is a hundred calls on arrays of three numbers, which cost several
times the physics. What runs in every step is therefore written as what it is, loops over games and
pieces, and compiled. With ``NUMBA_DISABLE_JIT=1`` all of it runs as plain Python, to the same bits.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Final, Generic, ParamSpec, TypeVar, cast

import numpy as np

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


def compiled_with_packages(
    *others: str,
) -> Callable[[Callable[_P, _R]], Callable[_P, _R]]:
    """Return a decorator that compiles as `compiled` does, to run without Python's lock.

    The function may use functions and constants of all modules in its own directory, and in those
    of the packages ``others``: what was kept of it is compiled anew when any of them has changed.
    It makes no arrays, and consists of device functions.
    """

    def decorate(function: Callable[_P, _R]) -> Callable[_P, _R]:
        dispatcher = _dispatcher(function, nogil=True, _nrt=False)
        file = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
        if file is not None:
            # Of the function's own file, as Numba has it; it has no name for a stamp of several.
            packages = [Path(str(import_module(name).__file__)) for name in others]
            files = [Path(function.__code__.co_filename), *packages]
            file._source_stamp = tuple(_stamp(file.parent) for file in files)
        return cast("Callable[_P, _R]", dispatcher)

    return decorate


class Bound(Generic[_R]):
    """A kernel whose first arguments never change, which costs less to launch.

    Numba looks at every array of every argument anew to find out which of its versions of a
    function is meant. For tuples of dozens of arrays that takes thirty times as long as the call.
    Here it is looked at once, and then only at the arrays that may differ.
    """

    def __init__(self, kernel: Callable[..., _R], *fixed: Any):
        """Bind a kernel to its first arguments, arrays, numbers and tuples of them."""
        self._kernel, self._fixed = kernel, fixed
        self._entries: dict[tuple[object, ...], Callable[..., _R]] = {}

    def __call__(self, *others: Any) -> _R:
        """Call it with the arguments that are left, arrays or numbers."""
        types = tuple(map(_type_of, others))
        entry = self._entries.get(types)
        if entry is None:
            entry = self._entries[types] = self._entry_for(*self._fixed, *others)
        return entry(*self._fixed, *others)

    def _entry_for(self, *arguments: Any) -> Callable[..., _R]:
        """Return what is called in the end."""
        kernel: Any = self._kernel
        if not hasattr(kernel, "typeof_pyval"):  # Numba is switched off.
            return self._kernel
        compiled: Callable[..., _R] = kernel.compile(tuple(map(kernel.typeof_pyval, arguments)))
        return compiled


def _type_of(value: Any) -> object:
    """Return what decides, for Numba, the type of an array or a number."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num & _LAYOUT
    return type(value)


_LAYOUT: Final = 0x0001 | 0x0002 | 0x0100 | 0x0400
"""Of an array's flags: C or Fortran order, aligned, writeable."""


compiled_with_package = compiled_with_packages()
"""Decorates a function that uses those of its own directory alone."""


class DeviceFunction(Generic[_P, _R]):
    """A function that is compiled as part of the kernels that use it, and kept with them.

    It makes no arrays. So Numba need not count who holds the dozens that are handed from one to the
    other, which took longer than all that is computed; and a graphics card could run it.

    Numba is asked for it when it is first needed, since who only reads a level does not wait for
    Numba.
    """

    def __init__(self, function: Callable[_P, _R]):
        """Wrap ``function``."""
        self.function = function
        update_wrapper(self, function)

    @cached_property
    def dispatcher(self) -> Any:
        """What Numba has of it."""
        return _jit(self.function, nogil=True, _nrt=False, forceinline=False)

    def __call__(self, *arguments: _P.args, **named: _P.kwargs) -> _R:
        """Call it from Python."""
        return cast("_R", self.dispatcher(*arguments, **named))


def device_function(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function`` as a `DeviceFunction`."""
    return DeviceFunction(function)


def inlined(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function`` compiled as a device function, and put where it is called.

    For what is handed dozens of arrays, which would be copied for the call, or has one caller.
    Python cannot call it.
    """
    return _hidden(function, inline=True)


def part(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function`` compiled as a device function that Python cannot call.

    That takes a fifth of the time of compiling.
    """
    return _hidden(function, inline=False)


def _hidden(function: Callable[_P, _R], *, inline: bool) -> Callable[_P, _R]:
    # Numba has public names for neither the switch of its counting runtime nor those of the
    # wrappers it makes for Python and C; see `numba.core.options`.
    hidden = _jit(
        function,
        nogil=True,
        _nrt=False,
        no_cpython_wrapper=True,
        no_cfunc_wrapper=True,
        # Said of each: what says nothing of it takes it from its caller.
        forceinline=inline,
    )
    return cast("Callable[_P, _R]", hidden)


def spliced(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return ``function``, whose text becomes its callers' before anything is compiled."""
    return cast("Callable[_P, _R]", _jit(function, nogil=True, _nrt=False, inline="always"))


def _dispatcher(function: Callable[..., Any], **options: bool) -> Any:
    try:
        return _jit(function, cache=True, **options)
    except RuntimeError:
        # Nowhere to write: neither beside the package nor in the user's cache directory.
        _WAIT.kept = False
        return _jit(function, **options)


def _jit(function: Callable[..., Any], **options: Any) -> Any:
    return _numba().njit(error_model="numpy", **options)(function)


@cache
def _numba() -> ModuleType:
    """Return Numba, which knows what a `DeviceFunction` is and tells who waits for it."""
    import numba
    from numba.core import event
    from numba.extending import typeof_impl

    @typeof_impl.register(DeviceFunction)
    def _(function: DeviceFunction[..., Any], context: Any) -> Any:
        return numba.typeof(function.dispatcher)  # type: ignore[no-untyped-call]

    class Waiting(event.Listener):
        """Hears when Numba compiles, which it does not when it finds what it had compiled."""

        def on_start(self, event: event.Event) -> None:
            _WAIT.say(event.data["dispatcher"].py_func.__module__)

        def on_end(self, event: event.Event) -> None:
            pass

    event.register("numba:compile", Waiting())  # type: ignore[no-untyped-call]
    return numba


@cache
def _stamp(directory: Path) -> tuple[tuple[str, float, int], ...]:
    """Return what changes when a module of a directory does, or how it is compiled."""
    files = [Path(__file__), *sorted(directory.glob("*.py"))]
    states = [(file.name, file.stat()) for file in files]
    return tuple((name, state.st_mtime, state.st_size) for name, state in states)


class _Wait:
    """Says on the terminal, once a process, what the first step waits for when it has to."""

    def __init__(self) -> None:
        self.said = False
        self.kept = True

    def say(self, module: str) -> None:
        """Say it, if the function that Numba begins with is of a module of ours."""
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
        print(f"Roller: compiling the rules (up to a minute), {how_often}", file=sys.stderr)


_WAIT: Final = _Wait()
