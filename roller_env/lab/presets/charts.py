"""The charts: error against cost, the promises one by one, and what modelling less saves."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Final

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from roller_env.lab.presets.economies import AS_CHOSEN, EconomyRow
from roller_env.lab.presets.errors import CRITERIA, Criterion
from roller_env.lab.presets.results import SettingRow
from roller_env.lab.style import FAILURE, STYLE
from roller_env.physics.presets import PRESETS

KNOB_COLOURS: Final = {
    "presets": "#111111",
    "time step": "#2f6db3",
    "RK4": "#d1495b",
    "integrator": "#7a5bb5",
    "cone": "#b58900",
    "contacts": "#1b998b",
    "solver": "#ef8e19",
    "flags": "#7d8597",
    "combinations": "#c77dba",
}
_FRONT: Final = "#ffe08a"
_BEFORE, _AFTER = "#c3c9d1", "#1b998b"
_LIMIT_PERCENT: Final = 1.0
_SHOWN_PERCENT: Final = (0.03, 1.6)
"""Errors beyond these are drawn at them, with their figure."""
_PLACES: Final = {"fast": (-128, -104), "default": (-52, -122), "accurate": (-78, 84)}
"""Of the presets' names, in points from their marks."""
_BELOW: Final = 0.035
"""Share of the height by which a name stands below its mark, on the front."""
_ROOM: Final = (0.11, 0.022)
"""Shares of the chart's width and half its height that a name takes, to the right of its mark."""


def draw_front(rows: Sequence[SettingRow]) -> Figure:
    """Draw every setting's error on the classic course against its cost."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 7.2))
        axes = figure.subplots()
        figure.subplots_adjust(left=0.075, right=0.975, top=0.85, bottom=0.115)
        best = sorted((row for row in rows if row.front), key=lambda row: row.cpu_s_per_s)
        axes.plot(
            [1e3 * row.cpu_s_per_s for row in best],
            [_percent(row) for row in best],
            color=_FRONT,
            linewidth=10.0,
            solid_capstyle="round",
            zorder=1,
        )
        for row in rows:
            _mark(axes, row)
        _frame_front(figure, axes)
        for row in rows:
            if row.setting in PRESETS:
                _name(axes, row)
        _label_others(axes, rows)
        _explain(axes, rows)
    return figure


def _percent(row: SettingRow) -> float:
    return float(np.clip(100.0 * row.course, *_SHOWN_PERCENT))


def _mark(axes: Axes, row: SettingRow) -> None:
    at, colour = ([1e3 * row.cpu_s_per_s], [_percent(row)]), KNOB_COLOURS[row.knob]
    if row.breaks and row.setting not in PRESETS:
        axes.plot(*at, "x", color=FAILURE, markersize=7, markeredgewidth=1.6, zorder=3)
        axes.plot(*at, "o", markerfacecolor="none", markeredgecolor=colour, markersize=11, zorder=3)
    else:
        size = 13 if row.setting in PRESETS else 7.5
        axes.plot(*at, "o", color=colour, markersize=size, markeredgecolor="white", zorder=4)


def _name(axes: Axes, row: SettingRow) -> None:
    text = f"{row.setting}\n{100 * row.course:.2f} %, {1e3 * row.cpu_s_per_s:.2g} ms"
    text += f"\nbut: {row.breaks}" if row.breaks else ""
    axes.annotate(
        text,
        (1e3 * row.cpu_s_per_s, _percent(row)),
        xytext=_PLACES[row.setting],
        textcoords="offset points",
        fontsize=11,
        fontweight="bold",
        bbox={"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": "#111111"},
        arrowprops={"arrowstyle": "-", "color": "#111111", "shrinkB": 6},
        zorder=6,
    )


def _label_others(axes: Axes, rows: Sequence[SettingRow]) -> None:
    """Write names where there is room; the crowd round ``default`` is in the table."""
    marks = {row.setting: axes.transAxes.inverted().transform(_pixels(axes, row)) for row in rows}
    names: list[npt.NDArray[np.float64]] = []
    for row in sorted(rows, key=lambda one: (not one.front, not one.breaks)):
        at = marks[row.setting]
        beyond = 100.0 * row.course > _SHOWN_PERCENT[1]
        in_the_way = [other - at for name, other in marks.items() if name != row.setting]
        if row.setting in PRESETS or (
            any(_covered(way, 0.0) for way in in_the_way) and not (beyond or row.front)
        ):
            continue
        below = beyond or row.front
        place = at - (0.0, _BELOW) if below else at
        if any(_covered(other - place, -_ROOM[0]) for other in names):
            continue
        names.append(place)
        axes.annotate(
            f"{row.setting}: {100.0 * row.course:.0f} %" if beyond else row.setting,
            (1e3 * row.cpu_s_per_s, _percent(row)),
            xytext=(-4, -16) if below else (8, -3),
            textcoords="offset points",
            fontsize=8,
            color=FAILURE if row.breaks else "#333333",
            zorder=5,
        )


def _covered(way: npt.NDArray[np.float64], left: float) -> bool:
    """Say whether something ``way`` from a mark is under its name, or its name under the mark's."""
    return bool(left <= way[0] < _ROOM[0] and abs(way[1]) < _ROOM[1])


def _pixels(axes: Axes, row: SettingRow) -> npt.NDArray[np.float64]:
    return np.asarray(axes.transData.transform((1e3 * row.cpu_s_per_s, _percent(row))))


def _frame_front(figure: Figure, axes: Axes) -> None:
    axes.set(xscale="log", yscale="log")
    axes.set_ylim(_SHOWN_PERCENT[0], _SHOWN_PERCENT[1] * 1.15)
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_yticks([0.03, 0.1, 0.3, 1.0])
    axes.set_xlabel("CPU milliseconds for a simulated second of one game (classic level, 1 thread)")
    axes.set_ylabel(
        "distance from the converged ball over the way, %  (classic level, 3 s of keys)"
    )
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(plain)
    axes.yaxis.set_major_formatter(plain)
    axes.axhline(_LIMIT_PERCENT, color="#777777", linestyle="--", linewidth=1.2, zorder=0)
    axes.annotate(
        "promised: at most 1 %",
        (1.0, _LIMIT_PERCENT),
        xycoords=("axes fraction", "data"),
        xytext=(-4, 4),
        textcoords="offset points",
        ha="right",
        fontsize=8,
        color="#555555",
    )
    top = axes.secondary_xaxis("top", functions=(_times_real_time, _times_real_time))
    top.set_xlabel("times real time, one thread")
    top.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    top.xaxis.set_minor_formatter(NullFormatter())
    top.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    figure.suptitle(
        "Physics presets: what is the cheapest setting that tells the truth?",
        x=0.075,
        y=0.975,
        ha="left",
        fontsize=15,
        fontweight="bold",
    )


def _times_real_time(milliseconds: npt.ArrayLike) -> npt.NDArray[np.float64]:
    with np.errstate(divide="ignore"):
        return np.asarray(1e3 / np.asarray(milliseconds, dtype=float))


def _explain(axes: Axes, rows: Sequence[SettingRow]) -> None:
    for knob, colour in KNOB_COLOURS.items():
        if any(row.knob == knob for row in rows):
            axes.plot([], [], "o", color=colour, label=knob)
    axes.plot([], [], "x", color=FAILURE, label="breaks a promise")
    axes.plot([], [], color=_FRONT, linewidth=8, label="Pareto front")
    axes.legend(
        loc="upper right",
        bbox_to_anchor=(1.0, 0.8),
        ncols=2,
        fontsize=9,
        title="what is varied from default",
    )


# The promises one by one ---------------------------------------------------------------------

_COLOURS: Final = LinearSegmentedColormap.from_list(
    "share of the limit", ["#d9efe9", "#f6f3d8", "#f2b25c", "#b00020"]
)
_DECADES: Final = (-3.0, 1.0)


def draw_promises(rows: Sequence[SettingRow]) -> Figure:
    """Draw each setting's errors as shares of what the game can bear."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(13.5, 1.9 + 0.235 * len(rows)))
        axes = figure.subplots()
        shares = np.array([[_share(row, one) for one in CRITERIA] for row in rows])
        with np.errstate(divide="ignore"):
            axes.imshow(
                np.log10(shares).clip(*_DECADES),
                cmap=_COLOURS,
                vmin=_DECADES[0],
                vmax=_DECADES[1],
                aspect="auto",
            )
        for place, share in np.ndenumerate(shares):
            axes.text(
                place[1],
                place[0],
                _written(share),
                ha="center",
                va="center",
                fontsize=7.5,
                color="white" if share > 1.0 else "#333333",
                fontweight="bold" if share > 1.0 else "normal",
            )
        axes.set_xticks(range(len(CRITERIA)), [_heading(one) for one in CRITERIA], fontsize=7.5)
        axes.xaxis.tick_top()
        axes.set_yticks(range(len(rows)), [row.setting for row in rows], fontsize=8.5)
        for label in axes.get_yticklabels():
            label.set_fontweight("bold" if label.get_text() in PRESETS else "normal")
        axes.grid(visible=False)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        height = figure.get_figheight()
        figure.subplots_adjust(left=0.145, right=0.99, top=1.0 - 1.5 / height, bottom=0.3 / height)
        figure.suptitle(
            "Errors as shares of what the game can bear: more than 1 is a promise broken "
            "(cheapest setting first)",
            x=0.01,
            y=1.0 - 0.12 / height,
            ha="left",
            va="top",
            fontsize=13,
            fontweight="bold",
        )
    return figure


def _share(row: SettingRow, criterion: Criterion) -> float:
    return float(getattr(row, criterion.name)) / criterion.limit


def _heading(criterion: Criterion) -> str:
    unit = f" {criterion.unit}" if criterion.unit else ""
    return "\n".join([*textwrap.wrap(criterion.title, 11), f"≤ {criterion.limit:.3g}{unit}"])


def _written(share: float) -> str:
    if not np.isfinite(share) or share >= 100.0:
        return ">99"
    return "0" if share < 5e-4 else f"{share:.1g}" if share < 0.1 else f"{share:.2g}"


# Modelling less ------------------------------------------------------------------------------


def draw_economies(rows: Sequence[EconomyRow]) -> Figure:
    """Draw what a step costs with more modelled than needed, and on larger levels."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(12.0, 5.6))
        ways, sizes = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        figure.subplots_adjust(left=0.235, right=0.98, top=0.84, bottom=0.13, wspace=0.2)
        _draw_ways(ways, [row for row in rows if not row.boxes])
        _draw_sizes(sizes, [row for row in rows if row.boxes])
        figure.suptitle(
            "Model no more than the scene needs: the cost of a physics step",
            x=0.01,
            y=0.975,
            ha="left",
            fontsize=15,
            fontweight="bold",
        )
    return figure


def _draw_ways(axes: Axes, rows: Sequence[EconomyRow]) -> None:
    rows = sorted(rows, key=lambda row: row.us_per_step)
    cost = [row.us_per_step for row in rows]
    axes.barh(
        [row.what for row in rows],
        cost,
        color=[_AFTER if row.chosen else _BEFORE for row in rows],
        height=0.7,
    )
    chosen = next(row.us_per_step for row in rows if row.chosen)
    for place, row in enumerate(rows):
        change = "" if row.chosen else f" ({100 * (row.us_per_step / chosen - 1):+.0f} %)"
        axes.text(
            row.us_per_step, place, f" {row.us_per_step:.1f}{change}", va="center", fontsize=8
        )
    axes.axvline(chosen, color=_AFTER, linewidth=1.0, linestyle=":")
    axes.set_xlim(0.0, 1.22 * max(cost))
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("CPU microseconds a step, classic level")
    axes.set_title("Classic level, modelled otherwise", loc="left", fontsize=11)


def _draw_sizes(axes: Axes, rows: Sequence[EconomyRow]) -> None:
    styles = {AS_CHOSEN: (_AFTER, 2.6, "o"), "fixed geoms posed every step": ("#8d96a3", 1.6, "s")}
    for what in dict.fromkeys(row.what for row in rows):
        own = [row for row in rows if row.what == what]
        colour, width, marker = styles.get(what, ("#c9b27c", 1.6, "^"))
        x, y = [row.boxes for row in own], [row.us_per_step for row in own]
        said = f"{what}: × {y[-1] / y[0]:.2f} from {x[0]} to {x[-1]}"
        axes.plot(x, y, color=colour, linewidth=width, marker=marker, label=said)
    axes.legend(loc="upper left", fontsize=8)
    axes.set_ylim(0.0, 1.35 * max(row.us_per_step for row in rows))
    axes.set_xlim(0.0, 1.04 * max(row.boxes for row in rows))
    axes.set_xlabel("boxes of the level")
    axes.set_title("The same yard, with more and more boxes", loc="left", fontsize=11)
