"""Where the time of a step goes, by the part of the house that it is spent in.

pyinstrument samples the stack; the time of a function that belongs to no part (NumPy, torch, what
no Python frame shows) counts for the one that called it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import gymnasium
import mujoco
import stable_baselines3
from matplotlib.figure import Figure
from pyinstrument import Profiler
from pyinstrument.frame import Frame as Sampled

import roller_env
from roller_env.lab import chart
from roller_env.lab.table import Frame, frame

INTERVAL_S: Final = 0.0005
"""Between two samples: a hundredth of a vector step of 256 environments."""

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

_COLOURS: Final = dict(
    zip(
        PARTS,
        (
            *("#1f4e8c", "#7fb2e5"),  # physics
            *("#1b998b", "#9bd3a8", "#3a8f5c"),  # observation, reward, rules
            *("#b58900", "#e3c567"),  # Python
            *("#f0a58f", "#d1495b", "#c77dba", "#7a5bb5"),  # training
            "#9a9a9a",
        ),
        strict=True,
    )
)


def where_the_time_goes(what: str, work: Callable[[], object], env_steps: int) -> Frame:
    """Watch ``work``, which does ``env_steps`` environment steps.

    Returns:
        ``what``, ``part``, ``us_per_env_step`` (wall) and ``share``, the largest first.

    Raises:
        ValueError: the work was over before it was sampled.
    """
    profiler = Profiler(interval=INTERVAL_S, async_mode="disabled")
    with profiler:
        work()
    assert profiler.last_session is not None
    root = profiler.last_session.root_frame(trim_stem=False)
    if root is None:
        raise ValueError(f"{what}: over at once; must last {INTERVAL_S:g} s or more")
    seconds: dict[str, float] = {}
    _count(root, OTHER, seconds)
    whole = sum(seconds.values())
    return frame(
        [
            {
                "what": what,
                "part": part,
                "us_per_env_step": 1e6 * taken / env_steps,
                "share": taken / whole,
            }
            for part, taken in sorted(seconds.items(), key=lambda one: -one[1])
        ]
    )


def _count(sampled: Sampled, part: str, seconds: dict[str, float]) -> None:
    """Add the time of a function, and of those that it called, to the parts they belong to."""
    part = _part_of(sampled) or part
    own = sampled.time - sum(child.time for child in sampled.children)
    if own > 0.0:
        seconds[part] = seconds.get(part, 0.0) + own
    for child in sampled.children:
        _count(child, part, seconds)


def _part_of(sampled: Sampled) -> str | None:
    for path, function, part in _PARTS:
        if (sampled.file_path or "").startswith(path) and function in ("", sampled.function):
            return part
    return None


def draw(rows: Frame) -> Figure:
    """Draw where the time of every profiled step goes, one bar each."""
    whats = list(dict.fromkeys(rows.what))
    figure, ((axes,),) = chart.grid(
        (1, 1),
        "Where the time goes",
        "",
        panel=(8.6, 0.7 * len(whats)),
        margins=(2.2, 0.4, 0.9, 1.6),
    )
    for place, what in enumerate(whats):
        own, left = rows[rows.what == what].set_index("part").share, 0.0
        for part in [part for part in PARTS if part in own.index]:
            axes.barh(place, own[part], left=left, height=0.55, color=_COLOURS[part], label=part)
            if own[part] > 0.035:
                said: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9}
                axes.text(left + 0.5 * own[part], place, f"{100 * own[part]:.0f} %", **said)
            left += own[part]
    whole = rows.groupby("what").us_per_env_step.sum()
    names = [f"{what}\n{whole[what]:,.0f} µs an env. step" for what in whats]
    axes.set_yticks(range(len(whats)), names)
    axes.set(xlim=(0.0, 1.0), ylim=(len(whats) - 0.4, -0.6))
    axes.grid(visible=False, axis="y")
    axes.xaxis.set_major_formatter("{x:.0%}")
    chart.legend_of(figure, axes)
    return figure
