"""The charts: error against cost, the promises one by one, and what modelling less saves."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Final

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from roller_env.lab.presets.economies import AS_CHOSEN, EconomyRow
from roller_env.lab.presets.errors import CRITERIA, Criterion
from roller_env.lab.presets.labels import FAR_RINGS, NEAR_RINGS, Room
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


def draw_front(rows: Sequence[SettingRow]) -> Figure:
    """Draw every setting's error on the classic course against its cost."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(12.0, 7.6))
        axes = figure.subplots()
        figure.subplots_adjust(left=0.07, right=0.98, top=0.815, bottom=0.14)
        _frame_front(figure, axes, rows)
        axes.plot(*np.array(_front(rows)).T, color=_FRONT, linewidth=9.0, zorder=1)
        for row in rows:
            _mark(axes, row)
        _explain(axes, rows)
        _name_all(axes, rows)
    return figure


def _place(row: SettingRow) -> tuple[float, float]:
    return 1e3 * row.cpu_s_per_s, float(np.clip(100.0 * row.course, *_SHOWN_PERCENT))


def _front(rows: Sequence[SettingRow]) -> list[tuple[float, float]]:
    return sorted(_place(row) for row in rows if row.front)


def _mark(axes: Axes, row: SettingRow) -> None:
    colour, (x, y) = KNOB_COLOURS[row.knob], _place(row)
    if row.breaks and row.setting not in PRESETS:
        axes.plot(x, y, "x", color=FAILURE, markersize=6, markeredgewidth=1.4, zorder=3)
        axes.plot(x, y, "o", markerfacecolor="none", markeredgecolor=colour, markersize=10)
    else:
        size = 13 if row.setting in PRESETS else 7.5
        axes.plot(x, y, "o", color=colour, markersize=size, markeredgecolor="white", zorder=4)


def _name_all(axes: Axes, rows: Sequence[SettingRow]) -> None:
    """Write the presets' names, then those for which there is room; the table has the rest."""
    room = Room(axes, [(_place(row), 6.0 if row.breaks else 4.5) for row in rows], _front(rows))
    for row in rows:
        if row.setting in PRESETS:
            but = "\n".join(["", *textwrap.wrap(f"but: {row.breaks}", 17)]) if row.breaks else ""
            room.write(
                f"{row.setting}\n{100 * row.course:.2f} %, {1e3 * row.cpu_s_per_s:.2g} ms{but}",
                _place(row),
                FAR_RINGS,
                fontsize=11,
                fontweight="bold",
                bbox={"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": "#111111"},
                arrowprops={"arrowstyle": "-", "color": "#111111", "shrinkB": 6},
            )
    for row in sorted(rows, key=lambda one: (not one.front, -one.course)):
        if row.setting not in PRESETS and not _like_default(row, rows):
            beyond = 100.0 * row.course > _SHOWN_PERCENT[1]
            room.write(
                f"{row.setting}: {100.0 * row.course:.0f} %" if beyond else row.setting,
                _place(row),
                NEAR_RINGS,
                fontsize=8,
                color=FAILURE if row.breaks else "#333333",
                arrowprops={"arrowstyle": "-", "color": "#999999", "linewidth": 0.6, "shrinkB": 4},
            )


def _like_default(row: SettingRow, rows: Sequence[SettingRow]) -> bool:
    """Say whether a setting changes nothing but the cost: such crowd round ``default``."""
    errors = [one.course for one in rows if one.setting == "default"]
    return not (row.front or row.breaks) and any(
        math.isclose(row.course, one, rel_tol=0.01) for one in errors
    )


def _frame_front(figure: Figure, axes: Axes, rows: Sequence[SettingRow]) -> None:
    axes.set(xscale="log", yscale="log")
    cost = [_place(row)[0] for row in rows]
    axes.set_xlim(min(cost) / 1.25, max(cost) * 1.25)
    axes.set_ylim(_SHOWN_PERCENT[0], _SHOWN_PERCENT[1] * 1.25)
    axes.set_xlabel("CPU milliseconds for a simulated second of one game (classic level, 1 thread)")
    axes.set_ylabel("distance from the converged ball over the way, %")
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    axes.set_yticks([0.03, 0.1, 0.3, 1.0])
    axes.yaxis.set_major_formatter(plain)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(plain)
    axes.minorticks_off()
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
    top.minorticks_off()
    top.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    figure.suptitle(
        "Physics presets: what is the cheapest setting that tells the truth?",
        x=0.01,
        y=0.98,
        ha="left",
        fontsize=15,
        fontweight="bold",
    )
    figure.text(0.01, 0.925, _FRONT_TELLS, fontsize=9, color="#555555", va="top")


_FRONT_TELLS: Final = (
    "Error: eight games of 3 s on the classic level, under recorded keys. A cross breaks another "
    "of the game's promises; the front is\nof those that keep all. The nameless dots in a row with "
    "default have its errors: flags and solver settings that change only the cost."
)


def _times_real_time(milliseconds: npt.ArrayLike) -> npt.NDArray[np.float64]:
    with np.errstate(divide="ignore"):
        return np.asarray(1e3 / np.asarray(milliseconds, dtype=float))


_TIGHT: Final = {"columnspacing": 1.1, "handletextpad": 0.5, "handlelength": 1.2}


def _explain(axes: Axes, rows: Sequence[SettingRow]) -> None:
    for knob, colour in KNOB_COLOURS.items():
        if any(row.knob == knob for row in rows):
            axes.plot([], [], "o", color=colour, label=knob)
    axes.plot([], [], "x", color=FAILURE, label="breaks a promise")
    axes.plot([], [], color=_FRONT, linewidth=6, label="Pareto front")
    axes.legend(loc="upper left", bbox_to_anchor=(-0.01, -0.08), ncols=11, fontsize=9, **_TIGHT)


# The promises one by one ---------------------------------------------------------------------

_COLOURS: Final = LinearSegmentedColormap.from_list(
    "share of the limit", ["#d9efe9", "#f6f3d8", "#f2b25c", "#b00020"]
)
_DECADES: Final = (-3.0, 1.0)


def draw_promises(rows: Sequence[SettingRow]) -> Figure:
    """Draw each setting's errors as shares of what the game can bear."""
    with matplotlib.rc_context(STYLE):
        presets = [row for row in rows if row.setting in PRESETS]
        rows = [*presets, *(row for row in rows if row.setting not in PRESETS)]
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
        axes.axhline(len(presets) - 0.5, color="white", linewidth=5.0)
        axes.grid(visible=False)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        height = figure.get_figheight()
        figure.subplots_adjust(left=0.145, right=0.99, top=1.0 - 1.5 / height, bottom=0.3 / height)
        figure.suptitle(
            "Errors as shares of what the game can bear: more than 1 is a promise broken "
            "(presets, then all others, cheapest first)",
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
    if math.isclose(share, 1.0, abs_tol=0.05):
        return f"{share:.2f}" if f"{share:.2f}" != "1.00" else f"{share:.4g}"
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
    styles = {
        AS_CHOSEN: (_AFTER, 2.6, "o"),
        "fixed geoms posed in every step": ("#8d96a3", 1.6, "s"),
    }
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
