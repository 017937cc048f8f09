"""Where the time of a step goes, by the part of the house that it is spent in.

pyinstrument samples the stack; the time of a function that belongs to no part (NumPy, torch, what
no Python frame shows) counts for the one that called it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
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

_COLOURS: Final = {
    "physics: MuJoCo": "#1f4e8c",
    "physics: around it": "#7fb2e5",
    "observation": "#1b998b",
    "reward": "#9bd3a8",
    "rules": "#3a8f5c",
    "Python: simulation and faces": "#b58900",
    "Python: Gymnasium's wrappers": "#e3c567",
    "training: practice, records": "#f0a58f",
    "training: normalisation": "#d1495b",
    "training: policy, buffer": "#c77dba",
    "training: update": "#7a5bb5",
    OTHER: "#9a9a9a",
}
"""Of every part, from the physics outwards."""


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
    path, function = sampled.file_path or "", sampled.function
    for begin, wanted, belonging in reversed(_PARTS):
        if path.startswith(begin) and wanted in ("", function):
            part = belonging
    own = sampled.time - sum(child.time for child in sampled.children)
    if own > 0.0:
        seconds[part] = seconds.get(part, 0.0) + own
    for child in sampled.children:
        _count(child, part, seconds)


@chart.styled
def draw(rows: Frame) -> Figure:
    """Draw where the time of every profiled step goes, one bar each."""
    shares = rows.pivot_table("share", "what", "part", sort=False)
    shares = shares.reindex(columns=[part for part in _COLOURS if part in shares])
    shape, margins = (8.6, 0.7 * len(shares)), (2.2, 0.4, 0.9, 1.6)
    figure, ((axes,),) = chart.grid((1, 1), "Where the time goes", "", panel=shape, margins=margins)
    shares.plot.barh(stacked=True, ax=axes, width=0.55, color=_COLOURS, legend=False, zorder=2)
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
