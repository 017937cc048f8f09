"""Numba for CUDA, told what it must know of our kernels: the functions are those of the CPU."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import SimpleNamespace
from typing import Any, Final

from roller_env.compiled import DeviceFunction

# Numba's own types say less of it than there is.
numba: Any = import_module("numba")
cuda: Any = import_module("numba.cuda")

HOPPER: Final = (9, 0)
"""Compute capability of an H100, for which PTX is made where there is no card."""


@cache
def _know_device_functions() -> None:
    """Have Numba for CUDA compile a `DeviceFunction` as it does what Numba itself decorates."""
    typing: Any = import_module("numba.cuda.descriptor").cuda_target.typing_context

    def type_of(function: DeviceFunction[..., Any], context: Any) -> Any:
        return typing.resolve_value_type(function.dispatcher)

    import_module("numba.cuda.extending").typeof_impl.register(DeviceFunction, type_of)


@contextmanager
def _as_written() -> Iterator[None]:
    """Compile IEEE arithmetic in the order written, as the CPU's: no product is fused with a sum.

    Numba has no option for that switch of NVIDIA's compiler.
    """
    nvvm: Any = import_module("numba.cuda.cudadrv.nvvm")
    original = nvvm.compile_ir

    def compile_ir(modules: Any, **options: Any) -> Any:
        return original(modules, **{**options, "fma": 0})

    nvvm.compile_ir = compile_ir
    try:
        yield
    finally:
        nvvm.compile_ir = original


def compiled_for_card(kernel: Any, arguments: tuple[Any, ...], registers: int | None) -> Any:
    """Return a kernel compiled for the card and for arguments of these types.

    Args:
        kernel: Python function.
        arguments: that it may be called with.
        registers: of a thread, at most; None: as many as the compiler likes.
    """
    if numba.config.ENABLE_CUDASIM:
        return cuda.jit(kernel)
    _know_device_functions()
    with _as_written():
        # Optimised when linked it would be fused there.
        return cuda.jit(kernel, lto=False, max_registers=registers).specialize(*arguments)


@contextmanager
def _card(capability: tuple[int, int]) -> Iterator[None]:
    """Have Numba believe that there is a card: it asks one before it compiles a device function."""
    dispatcher: Any = import_module("numba.cuda.dispatcher")
    original = dispatcher.get_current_device
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=capability)
    try:
        yield
    finally:
        dispatcher.get_current_device = original


def ptx_of(kernel: Any, arguments: tuple[Any, ...]) -> str:
    """Return the PTX of a kernel for an H100, whether or not there is one.

    Args:
        kernel: Python function.
        arguments: that it would be called with; arrays may be NumPy's.
    """
    _know_device_functions()
    types = [numba.typeof(each) for each in arguments]
    with _as_written(), _card(HOPPER):
        ptx, _ = cuda.compile(
            kernel, numba.void(*types), cc=HOPPER, device=False, abi="numba", output="ptx"
        )
    return str(ptx)


@dataclass(frozen=True, slots=True)
class Machine:
    """What NVIDIA's assembler says of a kernel.

    Attributes:
        bytes: of machine code.
        registers: of a thread.
        stack: bytes of a thread's local memory.
    """

    bytes: int
    registers: int
    stack: int


def assembled(ptx: str) -> Machine:
    """Assemble PTX for an H100, which needs no card."""
    nvjitlink: Any = import_module("cuda.bindings.nvjitlink")
    options = ["-arch=sm_90", "-verbose", "-O3"]
    linker = nvjitlink.create(len(options), options)
    text = ptx.encode() + b"\0"
    nvjitlink.add_data(linker, nvjitlink.InputType.PTX, text, len(text), "kernel")
    nvjitlink.complete(linker)
    log = bytearray(nvjitlink.get_info_log_size(linker))
    nvjitlink.get_info_log(linker, log)
    found = re.findall(r"used (\d+) registers.*?(\d+) stack", log.decode())
    registers, stack = max((int(a), int(b)) for a, b in found)
    return Machine(nvjitlink.get_linked_cubin_size(linker), registers, stack)
