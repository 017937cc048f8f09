"""Play whole games on a graphics card, one thread an env, by the kernels that the CPU runs.

Needs ``numba-cuda`` with NVIDIA's compiler (``pip install 'numba-cuda[cu13]'``), as no other part
of Roller does.

Examples::

    python scripts/gpu.py --ptx              # compile for an H100; no card is needed
    python scripts/gpu.py                    # is a card right, and how fast is it? two minutes
"""

from __future__ import annotations

import csv
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Literal

import numpy as np
import tyro

from roller_env.config import EnvConfig, make_config
from roller_env.lab.runner import header, provenance


@dataclass(frozen=True, slots=True)
class Arguments:
    """Play whole games on a graphics card."""

    level: str = "classic"
    """Name of a shipped level, or path of a file."""

    physics: Literal["rigid", "relaxed"] = "rigid"
    """Law of friction and impact."""

    reward: Literal["points", "shaped", "nearness"] = "shaped"
    """What is paid."""

    ptx: bool = False
    """Compile, say how large it is, and end."""

    registers: int | None = None
    """Of a thread, at most; as many as the compiler likes unless told otherwise."""

    sizes: tuple[int, ...] = tuple(2**k for k in range(10, 21, 2))
    """Numbers of envs on the card."""

    compared: int = 4096
    """Envs that are played on the CPU too."""

    after: tuple[int, ...] = (1, 60, 600)
    """Control steps after which they are compared."""

    seconds: float = 1.0
    """Of timing, of each size."""

    cpu: Literal["beside", "alone", "none"] = "beside"
    """Whether the CPU is timed: by a process that this one starts, by this one, or not."""

    out: Path = Path("docs/results/cuda.csv")
    """Table of the speeds."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    config = make_config(
        level=arguments.level,
        physics=arguments.physics,
        reward=arguments.reward,
        num_threads=1,
    )
    if arguments.cpu == "alone":
        _time_cpu(config, arguments.seconds)
        return
    _say(header(provenance(("numpy", "numba", "numba-cuda"))))
    if arguments.ptx:
        _compile(config)
        return
    _play(config, arguments)


def _compile(config: EnvConfig) -> None:
    """Say how large the kernels are."""
    from roller_env.lab.cuda.compiler import assembled, ptx_of
    from roller_env.lab.cuda.games import Player

    player = Player(config)
    games = player.host_games(count=8)
    force_n = np.zeros((8, 2), order="F")
    choices, out = np.zeros((9, 2)), np.zeros((8, player.entries), np.float32, order="F")
    arguments = {"step": (games, force_n, out), "draw": (games.random, choices, force_n)}
    for name, given in arguments.items():
        begun = time.perf_counter()
        ptx = ptx_of(player.kernels[name], given)
        compiled = time.perf_counter()
        machine = assembled(ptx)
        _say(
            f"{name}: {len(ptx):,} characters of PTX in {compiled - begun:.1f} s, assembled for an "
            f"H100 in {time.perf_counter() - compiled:.1f} s to {machine.bytes:,} bytes; "
            f"{machine.registers} registers and {machine.stack:,} bytes of local memory a thread"
        )


def _play(config: EnvConfig, arguments: Arguments) -> None:
    """Compare a card with the CPU, and time both."""
    from roller_env.lab.cuda.games import CudaGames, Player
    from roller_env.lab.cuda.measure import Speed, agreement, card_speeds

    beside = _beside(arguments) if arguments.cpu == "beside" else None
    begun = time.perf_counter()
    player = Player(config, arguments.registers)
    games = CudaGames(player, 64)
    games.draw()
    games.step()
    games.state()
    _say(f"compiled for the card in {time.perf_counter() - begun:.1f} s")
    if beside is not None and beside.stdout is not None:
        beside.stdout.readline()  # It has compiled, and what it has is kept for this process too.
        _say(f"and for the CPU after {time.perf_counter() - begun:.1f} s")
    for compared in agreement(player, arguments.compared, arguments.after):
        _say(
            f"after {compared.steps} steps: of {compared.envs} games {compared.played} are in "
            f"their first episode on both; {compared.same} of these are the same to the bit, of "
            f"{compared.other_rules} the rules' state differs; the balls are "
            f"{compared.mean_m:.2e} m apart in the mean and {compared.largest_m:.2e} m at most"
        )
    names = [field.name for field in fields(Speed)]
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    with arguments.out.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, names, lineterminator="\n")
        table.writeheader()
        for speed in card_speeds(player, arguments.sizes, arguments.seconds):
            row = {name: _number(value) for name, value in asdict(speed).items()}
            _say(_line(row))
            table.writerow(row)
            file.flush()
        for row in _cpu_rows(beside, names):
            table.writerow(row)
    _say(f"{arguments.out} is written")


def _beside(arguments: Arguments) -> subprocess.Popen[str]:
    """Start a process that compiles for the CPU and waits to be told to time it."""
    names = ("level", "physics", "reward", "seconds")
    given = [part for name in names for part in (f"--{name}", str(getattr(arguments, name)))]
    return subprocess.Popen(
        [sys.executable, __file__, *given, "--cpu", "alone"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def _cpu_rows(beside: subprocess.Popen[str] | None, names: list[str]) -> Iterator[dict[str, str]]:
    """Have the CPU timed, while nothing else is done; yield its rows."""
    if beside is None or beside.stdin is None or beside.stdout is None:
        return
    beside.stdin.write("go\n")
    beside.stdin.flush()
    for line in beside.stdout:
        row = dict(zip(names, line.strip().split(","), strict=True))
        _say(_line(row))
        yield row
    if beside.wait() != 0:
        raise RuntimeError(f"timing the CPU ended with status {beside.returncode}")


def _time_cpu(config: EnvConfig, seconds: float) -> None:
    """Time the CPU when standard input says so, and print a row for each number of threads."""
    from roller_env.lab.cuda.measure import cpu_speeds

    def ready() -> None:
        print("ready", flush=True)
        sys.stdin.readline()

    for speed in cpu_speeds(config, seconds, ready):
        print(",".join(_number(value) for value in asdict(speed).values()), flush=True)


def _number(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _line(row: dict[str, str]) -> str:
    threads = f"{row['threads']} threads, " if row["threads"] != "0" else ""
    speed = f"{float(row['steps_per_s']):,.0f} environment steps a second"
    return f"{row['device']}: {threads}{int(row['envs']):,} envs: {speed}"


def _say(what: str) -> None:
    print(what, flush=True)


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except ValueError as error:
        sys.exit(f"error: {error}")
