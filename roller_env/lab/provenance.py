"""Where figures come from: the machine, the versions and the command, for every result's header."""

from __future__ import annotations

import os
import platform
import sys
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from roller_env import __version__

_PACKAGES: Final = ("mujoco", "numpy", "numba", "scipy")
_CPU_INFO: Final = Path("/proc/cpuinfo")


def provenance(packages: tuple[str, ...] = _PACKAGES) -> dict[str, str]:
    """Return what a measurement depends on, by name.

    Args:
        packages: distributions whose versions are told; ``not installed`` for those that are not.
    """
    command = [Path(sys.argv[0]).name, *sys.argv[1:]]
    return {
        "command": " ".join(command),
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "machine": f"{_processor()}, {_usable_cores()} cores, {platform.system()}",
        "python": platform.python_version(),
        "roller": __version__,
        **{name: _version(name) for name in packages},
    }


def header(facts: dict[str, str]) -> str:
    """Return provenance as one line for people."""
    return " · ".join(f"{name} {value}" for name, value in facts.items())


def _processor() -> str:
    if _CPU_INFO.exists():
        for line in _CPU_INFO.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _usable_cores() -> int:
    """Return the cores that this process may run on, which a container can limit."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
