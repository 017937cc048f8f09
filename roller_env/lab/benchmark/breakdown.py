"""Where the time of a step goes, by the part of the house that it is spent in.

pyinstrument samples the stack; the time of a function that belongs to no part (NumPy, torch, what
no Python frame shows) counts for the one that called it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import gymnasium
import mujoco
import stable_baselines3
from matplotlib.figure import Figure
from pyinstrument import Profiler
from pyinstrument.frame import Frame as Sampled

import roller_env
from roller_env.lab import chart
from roller_env.lab.table import Frame

INTERVAL_S: Final = 0.0005
"""Between two samples: a hundredth of a vector step of 256 environments."""

OTHER: Final = "all else"

_ROLLER, _MUJOCO, _GYMNASIUM, _SB3 = (
    Path(inspect.getfile(package)).parent.as_posix()
    for package in (roller_env, mujoco, gymnasium, stable_baselines3)
)

_PARTS: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "physics: MuJoCo": ("#1f4e8c", (f"{_MUJOCO}/",)),
    "physics: around it": ("#7fb2e5", (f"{_ROLLER}/physics/",)),
    "observation": ("#1b998b", (f"{_ROLLER}/game/observations.py",)),
    "reward": ("#9bd3a8", (f"{_ROLLER}/game/rewards.py",)),
    "rules": ("#3a8f5c", (f"{_ROLLER}/game/",)),
    "Python: simulation and faces": ("#b58900", (f"{_ROLLER}/simulation.py", f"{_ROLLER}/envs/")),
    "Python: Gymnasium's wrappers": ("#e3c567", (f"{_GYMNASIUM}/wrappers/",)),
    "training: practice, records": ("#f0a58f", (f"{_ROLLER}/training/",)),
    "training: normalisation": ("#d1495b", (f"{_SB3}/common/vec_env/vec_normalize.py",)),
    "training: policy, buffer": (
        "#c77dba",
        (f"{_SB3}/common/on_policy_algorithm.py collect_rollouts",),
    ),
    "training: update": ("#7a5bb5", (f"{_SB3}/ppo/ppo.py train",)),
    OTHER: ("#9a9a9a", ()),
}
"""Colour of every part, and with what its functions begin: the path of the file and, after a space,
the name; the first part that fits counts."""


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
    rows = Frame({"what": what, "part": list(seconds), "us_per_env_step": seconds.values()})
    rows["share"] = rows.us_per_env_step / rows.us_per_env_step.sum()
    rows["us_per_env_step"] *= 1e6 / env_steps
    return rows.sort_values("share", ascending=False, ignore_index=True)


def _count(sampled: Sampled, part: str, seconds: dict[str, float]) -> None:
    """Add the time of a function, and of those that it called, to the parts they belong to."""
    name = f"{sampled.file_path or ''} {sampled.function}"
    part = next((p for p, (_, begins) in _PARTS.items() if name.startswith(begins)), part)
    own = sampled.time - sum(child.time for child in sampled.children)
    if own > 0.0:
        seconds[part] = seconds.get(part, 0.0) + own
    for child in sampled.children:
        _count(child, part, seconds)


@chart.styled
def draw(rows: Frame) -> Figure:
    """Draw where the time of every profiled step goes, one bar each."""
    shares = rows.pivot_table("share", "what", "part", sort=False)
    shares = shares.reindex(columns=[part for part in _PARTS if part in shares])
    shape, margins = (8.6, 0.7 * len(shares)), (2.2, 0.4, 0.9, 1.6)
    figure, ((axes,),) = chart.grid((1, 1), "Where the time goes", "", panel=shape, margins=margins)
    shares.plot.barh(
        stacked=True,
        ax=axes,
        width=0.55,
        color={part: _PARTS[part][0] for part in shares},
        legend=False,
        zorder=2,
    )
    for bars in axes.containers:
        shown = [f"{100 * v:.0f} %" if v > 0.035 else "" for v in bars.datavalues]
        axes.bar_label(bars, shown, label_type="center", fontsize=9)
    whole = rows.groupby("what").us_per_env_step.sum()
    names = [f"{what}\n{whole[what]:,.0f} µs an env. step" for what in shares.index]
    axes.set_yticks(range(len(shares)), names)
    axes.set(xlim=(0.0, 1.0), ylim=(len(shares) - 0.4, -0.6), ylabel="")
    axes.grid(visible=False, axis="y")
    axes.xaxis.set_major_formatter("{x:.0%}")
    chart.legend_of(figure, axes)
    return figure
