"""Things run against the clock, on machines that are shared and noisy, and where results stem from.

Only what ran side by side can be compared. So everything that is compared takes turns, round by
round, and a ratio is the median of the rounds' ratios: a machine that slows down meanwhile slows
both sides.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from difflib import get_close_matches
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final, TypeVar

import numpy as np
from pandas import DataFrame as Frame
from tqdm import tqdm

from roller_env import __version__

Name = TypeVar("Name")

REPEATS: Final = 7
"""Repetitions of which the median is taken."""


def timed(work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Do ``work`` once and return the seconds by a clock: wall, this thread's or this process's."""
    start = clock()
    work()
    return clock() - start


def cpu_seconds(work: Callable[[], object], repeats: int = REPEATS) -> list[float]:
    """Do ``work`` once to warm the caches and then ``repeats`` times; return CPU seconds.

    They are this thread's own: on a busy machine still the work's.
    """
    work()
    return [timed(work, time.thread_time) for _ in range(repeats)]


def spread(values: Sequence[float]) -> float:
    """Return (largest - smallest) / median: how far the machine can be believed."""
    return float(np.ptp(values) / np.median(values))


def interleaved(
    runs: Mapping[Name, Callable[[], float]], rounds: int, *, shuffled: bool = False
) -> dict[Name, tuple[float, ...]]:
    """Let ``runs``, each of which returns its seconds, take turns; return them round by round.

    Args:
        runs: what takes turns, by name.
        rounds: turns of each.
        shuffled: in another order every round: who comes after the dearest, or while the machine is
            slow, would otherwise be the same every time.
    """
    seconds: dict[Name, list[float]] = {name: [] for name in runs}
    order, random = list(runs), np.random.default_rng(0)
    for _ in range(rounds):
        if shuffled:
            random.shuffle(order)
        for name in order:
            seconds[name].append(runs[name]())
    return {name: tuple(taken) for name, taken in seconds.items()}


@dataclass(frozen=True, slots=True)
class Config:
    """How long an interleaved run is."""

    rounds: int  # turns of every case; medians are over these
    round_s: float  # about how long one turn lasts, wall
    warm_up_s: float  # game time before the first round, so that the states have spread

    def __post_init__(self) -> None:
        """Refuse what measures nothing."""
        if self.rounds < 1:
            raise ValueError(f"rounds: found {self.rounds}; at least 1")
        for name in ("round_s", "warm_up_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name}: found {getattr(self, name)}; must be more than 0")


class Case(ABC):
    """A benchmark case: something that can be stepped against the clock.

    Attributes:
        name: what tables call it.
        env_steps: environment steps in one of its steps, such as the number of environments.
        simulated_s: simulated time of one environment step.
        steps_done: its steps so far.
        steps_a_round: its steps in one turn; 0 before `prepare`.
    """

    def __init__(self, name: str, env_steps: int, simulated_s: float) -> None:
        self.name, self.env_steps, self.simulated_s = name, env_steps, simulated_s
        self.steps_done = self.steps_a_round = 0

    def run(self, steps: int) -> float:
        """Do ``steps`` steps and return the wall seconds that they took."""
        self.steps_done += steps
        return self._run(steps)

    @abstractmethod
    def _run(self, steps: int) -> float:
        """Do ``steps`` steps; preparations that a user would not pay for are not counted."""

    def prepare(self, config: Config) -> None:
        """Warm up, and find out how many steps fill a round."""
        self.run(max(1, round(config.warm_up_s / self.simulated_s)))
        steps = 1
        while (taken := self.run(steps)) < config.round_s / 4:
            steps *= 2
        self.steps_a_round = max(1, round(steps * config.round_s / taken))

    def verify(self) -> None:  # noqa: B027 - most have nothing to verify
        """Raise if what was timed was not what should have been."""

    def close(self) -> None:  # noqa: B027 - most hold nothing
        """Give back what it holds, such as processes."""


def compare(cases: Sequence[Case], config: Config) -> Frame:
    """Let cases take turns; a case that follows another stands behind it.

    Returns:
        (rounds, cases) wall seconds of one environment step, by the cases' names.
    """
    for case in cases:
        case.prepare(config)

    def turn(case: Case) -> float:
        return case.run(case.steps_a_round) / (case.steps_a_round * case.env_steps)

    seconds = interleaved({case.name: partial(turn, case) for case in cases}, config.rounds)
    for case in cases:
        case.verify()
    return Frame(seconds)


_PACKAGES: Final = ("mujoco", "numpy", "numba", "scipy")
_CPU_INFO: Final = Path("/proc/cpuinfo")


def provenance(packages: tuple[str, ...] = _PACKAGES) -> dict[str, str]:
    """Return what a measurement depends on, by name.

    Args:
        packages: distributions whose versions are told; ``not installed`` for those that are not.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "command": " ".join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "machine": f"{_processor()}, {cores} cores, {platform.system()}",
        "python": platform.python_version(),
        "roller": __version__,
        **{name: _version(name) for name in packages},
    }


def header(facts: Mapping[str, str]) -> str:
    """Return provenance as one line for people."""
    return " · ".join(f"{name} {value}" for name, value in facts.items())


def _processor() -> str:
    lines = _CPU_INFO.read_text(encoding="utf-8").splitlines() if _CPU_INFO.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def watched(names: Sequence[str], unit: str) -> Iterator[str]:
    """Yield names while a bar says which is at work."""
    with tqdm(names, unit=unit, dynamic_ncols=True) as bar:
        for name in bar:
            bar.set_postfix_str(name)
            yield name


def known(what: str, name: str, names: Sequence[str]) -> str:
    """Return ``name``, which is to be one of ``names``.

    Raises:
        ValueError: it is none; the message has the nearest one.
    """
    if name not in names:
        near = get_close_matches(name, names, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"no {what} {name!r}: there are {', '.join(names)}{hint}")
    return name
