"""The picture of `scale`: cost against every axis, and memory."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from roller_env.lab.benchmark.scale import MEMORY_ENVS, MEMORY_GOAL, MemoryRow, ScaleRow
from roller_env.lab.style import STYLE, save

_LABELS: Final = {
    "environments": "environments",
    "substeps": "physics steps of an environment step",
    "boxes": "boxes of the level",
    "coins": "coins of the level",
}
_COLOUR: Final = "#2f6db3"
_THREADS: Final = ("#9ec5ea", "#2f6db3", "#173a61")
_QUIET: Final = "#666666"
_MEGABYTES: Final = 1e3
_LEAST_FACTOR: Final = 10.0
"""Between the ends of an axis of costs."""


def draw_scale(
    rows: Sequence[ScaleRow],
    memory: Sequence[MemoryRow],
    leak: Sequence[MemoryRow],
    facts: dict[str, str],
    stem: Path,
) -> tuple[Path, Path]:
    """Draw all that `roller_env.lab.benchmark.scale` measures; return PNG and SVG."""
    usual = next(row for row in rows if row.axis == "boxes")
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(14.0, 8.0))
        panels = figure.subplots(2, 4).ravel()
        figure.subplots_adjust(
            left=0.045, right=0.985, top=0.83, bottom=0.1, wspace=0.28, hspace=0.5
        )
        figure.text(0.012, 0.95, "How cost and memory grow", fontsize=15, weight="bold")
        figure.text(
            0.012,
            0.912,
            "Wall µs of one environment step, median and range of the rounds. Where the axis does "
            f"not say otherwise: {usual.environments} environments, {usual.threads} threads, "
            f"{usual.substeps} physics steps.",
            color=_QUIET,
        )
        for panel, axis in zip(panels, _LABELS, strict=False):
            own = [row for row in rows if row.axis == axis]
            _draw_costs(panel, own, _COLOUR, "")
            _scale_costs(panel)
            panel.set_title(_LABELS[axis], loc="left", fontsize=10, weight="bold")
        _draw_threads(panels[4], rows)
        _draw_memory(panels[5], memory)
        _draw_leak(panels[6], leak)
        panels[7].set_visible(False)
        return save(figure, facts, stem)


def _draw_costs(panel: Axes, rows: Sequence[ScaleRow], colour: str, label: str) -> None:
    values = [row.value for row in rows]
    medians = [row.us_per_env_step for row in rows]
    below = [row.us_per_env_step - row.smallest for row in rows]
    above = [row.largest - row.us_per_env_step for row in rows]
    panel.errorbar(
        values,
        medians,
        yerr=(below, above),
        color=colour,
        marker="o",
        markersize=4,
        elinewidth=1,
        capsize=2,
        label=label,
    )
    # A level may have no coins: the axis is then straight up to the first size.
    panel.set_xscale("symlog", linthresh=max(1, min(value for value in values if value)))
    _tick(panel, values)


def _scale_costs(panel: Axes) -> None:
    """Set a logarithmic axis, wide enough that the noise of a machine does not look like growth."""
    panel.set_yscale("log")
    low, high = panel.get_ylim()
    widen = max(1.0, _LEAST_FACTOR / (high / low)) ** 0.5
    panel.set_ylim(low / widen, high * widen)
    panel.yaxis.set_major_locator(LogLocator(base=10.0, subs=(1.0, 2.0, 5.0)))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    panel.yaxis.set_minor_locator(NullLocator())


def _tick(panel: Axes, values: Sequence[int]) -> None:
    panel.set_xticks(values)
    panel.xaxis.set_minor_locator(NullLocator())
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    panel.tick_params(axis="x", labelsize=8)


def _draw_threads(panel: Axes, rows: Sequence[ScaleRow]) -> None:
    axes = dict.fromkeys(row.axis for row in rows if row.axis.startswith("threads"))
    for axis, colour in zip(axes, _THREADS, strict=False):
        own = [row for row in rows if row.axis == axis]
        _draw_costs(panel, own, colour, axis.removeprefix("threads of "))
    _scale_costs(panel)
    low, high = panel.get_ylim()
    panel.set_ylim(low, 5.0 * high)
    panel.legend(fontsize=8)
    panel.set_title("threads of the physics", loc="left", fontsize=10, weight="bold")


def _draw_memory(panel: Axes, rows: Sequence[MemoryRow]) -> None:
    sizes = [row.environments for row in rows]
    panel.plot(sizes, [_MEGABYTES * row.resident_gb for row in rows], color=_COLOUR, marker="o")
    bound = _MEGABYTES * MEMORY_GOAL[2]
    panel.plot([MEMORY_ENVS], [bound], marker="v", color=_QUIET)
    panel.text(
        0.97,
        0.2,
        f"▼ goal: at most {bound:,.0f} MB\nwith {MEMORY_ENVS:,} environments",
        transform=panel.transAxes,
        color=_QUIET,
        fontsize=8,
        ha="right",
        va="top",
    )
    _tick(panel, sizes)
    panel.set_ylim(0.0, 1.1 * bound)
    panel.set_title("MB resident, by environments", loc="left", fontsize=10, weight="bold")


def _draw_leak(panel: Axes, rows: Sequence[MemoryRow]) -> None:
    steps = [row.env_steps / 1e6 for row in rows]
    panel.plot(steps, [_MEGABYTES * row.resident_gb for row in rows], color=_COLOUR)
    panel.set_ylim(0.0, 1.3 * _MEGABYTES * max(row.resident_gb for row in rows))
    panel.set_title(
        f"MB resident of {rows[0].environments}, by million steps",
        loc="left",
        fontsize=10,
        weight="bold",
    )
