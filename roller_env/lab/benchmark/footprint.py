"""How much memory environments take, in a process of their own; that process is this module."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from roller_env.envs.vector import RollerVectorEnv
from roller_env.lab.benchmark.recording import SEED, random_actions

_STATM: Final = Path("/proc/self/statm")


@dataclass(frozen=True, slots=True)
class Footprint:
    """Memory at one moment.

    Attributes:
        env_steps: environment steps done by then, over all environments.
        resident_bytes: resident set of the process, all libraries included.
    """

    env_steps: int
    resident_bytes: int


@dataclass(frozen=True, slots=True)
class Stay:
    """What a process does while its memory is watched.

    Attributes:
        num_envs: environments of the vector.
        env_steps: environment steps in all.
        looks: how often memory is looked at, evenly over the steps, the last at the end.
        options: of `roller_env.config.EnvConfig` that JSON can carry.
    """

    num_envs: int
    env_steps: int
    looks: int
    options: dict[str, Any] = field(default_factory=dict)


def watch(stay: Stay) -> Iterator[Footprint]:
    """Yield the footprints of a fresh process, as they are made.

    Raises:
        RuntimeError: the process failed; its message is on standard error.
    """
    command = [sys.executable, "-m", __name__, json.dumps(asdict(stay))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            yield Footprint(**json.loads(line))
    if process.returncode:
        raise RuntimeError(f"{__name__} ended with code {process.returncode}; see its message")


def stay_here(stay: Stay) -> Iterator[Footprint]:
    """Do it in this process."""
    env = RollerVectorEnv(stay.num_envs, **stay.options)
    env.reset(seed=SEED)
    actions = random_actions(stay.num_envs)
    done = 0
    for look in range(1, stay.looks + 1):
        while done < stay.env_steps * look / stay.looks:
            env.step(next(actions))
            done += stay.num_envs
        yield Footprint(done, resident_bytes())


def resident_bytes() -> int:
    """Return this process's resident set.

    Raises:
        OSError: not Linux.
    """
    pages = int(_STATM.read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    for footprint in stay_here(Stay(**json.loads(sys.argv[1]))):
        print(json.dumps(asdict(footprint)), flush=True)
