"""Where the time of a step goes, by the part of the house that it is spent in.

A timer interrupts the work again and again, and whose function was running then gets the point.
That costs next to nothing, so that small functions are not blamed for being watched. What no Python
frame shows (NumPy, MuJoCo, torch) counts for the function that called it.
"""

from __future__ import annotations

import inspect
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType
from typing import Final

import gymnasium
import mujoco
import stable_baselines3

import roller_env

INTERVAL_S: Final = 0.0005
"""Between two looks: a hundredth of a vector step of 256 environments."""

OTHER: Final = "all else"

_ROLLER, _MUJOCO, _GYMNASIUM, _SB3 = (
    Path(inspect.getfile(package)).parent.as_posix()
    for package in (roller_env, mujoco, gymnasium, stable_baselines3)
)

_PARTS: Final = (
    (f"{_MUJOCO}/", "", "physics: MuJoCo"),
    (f"{_ROLLER}/physics/", "", "physics: around it"),
    (f"{_ROLLER}/game/observations.py", "", "observation"),
    (f"{_ROLLER}/game/rewards.py", "", "reward"),
    (f"{_ROLLER}/game/", "", "rules"),
    (f"{_ROLLER}/simulation.py", "", "Python: simulation and faces"),
    (f"{_ROLLER}/envs/", "", "Python: simulation and faces"),
    (f"{_GYMNASIUM}/wrappers/", "", "Python: Gymnasium's wrappers"),
    (f"{_ROLLER}/training/", "", "training: practice, records"),
    (f"{_SB3}/common/vec_env/vec_normalize.py", "", "training: normalisation"),
    (f"{_SB3}/common/on_policy_algorithm.py", "collect_rollouts", "training: policy, buffer"),
    (f"{_SB3}/ppo/ppo.py", "train", "training: update"),
)
"""Beginning of a file's path, function (any, if empty), part; the first that fits counts."""

PARTS: Final = (*dict.fromkeys(part for _, _, part in _PARTS), OTHER)
"""Every part, from the physics outwards."""


@dataclass(frozen=True, slots=True)
class PartRow:
    """One part of a step.

    Attributes:
        what: which step.
        part: where the time was spent.
        us_per_env_step: microseconds of wall time an environment step.
        share: of the whole, 0 to 1.
        looks: how often the whole was looked at.
    """

    what: str
    part: str
    us_per_env_step: float
    share: float
    looks: int


def where_the_time_goes(what: str, work: Callable[[], object], env_steps: int) -> list[PartRow]:
    """Watch ``work``, which does ``env_steps`` environment steps; return the largest part first.

    Raises:
        ValueError: the work was over before it was looked at.
    """
    start = time.perf_counter()
    with _watched() as looks:
        work()
    seconds = time.perf_counter() - start
    total = looks.total()
    if not total:
        raise ValueError(f"{what}: over within {seconds:.2g} s; must last {INTERVAL_S:g} s or more")
    return [
        PartRow(what, part, 1e6 * seconds * count / total / env_steps, count / total, total)
        for part, count in looks.most_common()
    ]


@contextmanager
def _watched() -> Iterator[Counter[str]]:
    """Count, while the context lasts, in which part the main thread is found."""
    looks: Counter[str] = Counter()
    parts: dict[CodeType, str | None] = {}
    start, counted = time.perf_counter(), 0

    def look(_: int, frame: FrameType | None) -> None:
        # Python hears of the timer only when a call into C returns. All looks that were due by
        # then belong to that call.
        nonlocal counted
        due = int((time.perf_counter() - start) / INTERVAL_S)
        looks[_part_of(frame, parts)] += due - counted
        counted = due

    before = signal.signal(signal.SIGALRM, look)
    signal.setitimer(signal.ITIMER_REAL, INTERVAL_S, INTERVAL_S)
    try:
        yield looks
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _part_of(frame: FrameType | None, known: dict[CodeType, str | None]) -> str:
    """Return the part of the innermost function that has one."""
    while frame is not None:
        code = frame.f_code
        if code not in known:
            known[code] = _part_of_code(code)
        part = known[code]
        if part is not None:
            return part
        frame = frame.f_back
    return OTHER


def _part_of_code(code: CodeType) -> str | None:
    for path, function, part in _PARTS:
        if code.co_filename.startswith(path) and function in ("", code.co_name):
            return part
    return None
