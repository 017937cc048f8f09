"""Every picture of the laboratory: one look, one way to save, and the shapes that recur.

A colour means the same method everywhere. `grid` makes a page of panels, `against_limits` rows of
what was measured beside what was allowed, and `label` writes names where there is room for them.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import matplotlib
import numpy as np
import numpy.typing as npt
from adjustText import adjust_text
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator
from pandas import concat

from roller_env.lab import table
from roller_env.lab.runner import header
from roller_env.lab.scene import ROUNDING, ErrorKind, failures, pareto, sound
from roller_env.lab.table import Frame

STYLE: Final[dict[Any, Any]] = {
    "axes.edgecolor": "#888888",
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.dpi": 110,
    "font.size": 10,
    "grid.color": "#e6e6e6",
    "legend.frameon": False,
    "svg.hashsalt": "roller",
}
"""Of every picture. The salt makes the same chart the same SVG."""

styled: Final = matplotlib.rc_context(STYLE)
"""Decorates what draws."""

COLOURS: Final[dict[str, str]] = {
    "MuJoCo Euler": "#2f6db3",
    "MuJoCo implicit": "#7a5bb5",
    "MuJoCo implicitfast": "#1b998b",
    "MuJoCo discrete": "#7d8597",
    "MuJoCo RK4": "#d1495b",
    "ours explicit_euler": "#8d6e63",
    "ours semi_implicit_euler": "#b58900",
    "ours rk4": "#ef8e19",
    "ours rk4_body": "#173a61",
    "ours lie_rk4": "#3a8f5c",
    "ours buss2": "#9ccc65",
    "ours buss3": "#5f9ea0",
    "ours splitting2": "#c77dba",
    "ours splitting4": "#8e4585",
}
"""By the method's name. MuJoCo's with the pyramidal cone share the elliptic's colour, dashed."""

FAILURE: Final = "#b00020"
GOOD: Final = "#3a8f5c"
SERIES: Final = ("#2f6db3", "#1b998b", "#ef8e19", "#7a5bb5")
"""Colours of what is no method."""
PREDICTION: Final = "#555555"
PARETO: Final = "#ffe08a"
QUIET: Final = "#666666"


def colour(method_name: str) -> str:
    """Return the method's colour, whatever its cone."""
    return COLOURS[method_name.partition(",")[0]]


@styled
def save(figure: Figure, facts: Mapping[str, str], stem: Path) -> tuple[Path, Path]:
    """Write ``stem.png`` and ``stem.svg`` with provenance along the foot; return both paths."""
    foot: dict[str, Any] = {"fontsize": 6, "color": "#777777", "ha": "left", "va": "bottom"}
    figure.text(0.005, 0.004, header(facts), wrap=True, **foot)
    stem.parent.mkdir(parents=True, exist_ok=True)
    # Not with_suffix: a scene's name may have a point in it.
    png, svg = (stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg"))
    figure.savefig(png, dpi=150, facecolor="white")
    figure.savefig(svg, facecolor="white", metadata={"Date": None})
    return png, svg


def write(
    out: Path,
    facts: Mapping[str, str],
    tables: Mapping[str, Frame],
    figures: Mapping[str, Figure],
    page: tuple[str, str] = ("", ""),
) -> list[Path]:
    """Write an experiment's tables, figures and Markdown page, by their names; return the files."""
    files: list[Path] = []
    for name, rows in tables.items():
        files += table.write(rows, facts, out / name) if len(rows) else ()
    for name, figure in figures.items():
        files += save(figure, facts, out / name)
    name, text = page
    if text:
        files.append(out / f"{name}.md")
        files[-1].write_text(text, encoding="utf-8")
    return files


@styled
def grid(
    shape: tuple[int, int],
    title: str,
    note: str,
    *,
    panel: tuple[float, float] = (4.6, 3.4),
    margins: tuple[float, float, float, float] = (0.9, 0.5, 1.0, 0.7),
    **subplots: Any,
) -> tuple[Figure, npt.NDArray[Any]]:
    """Return a page of panels, (rows, columns), under a headline and a note.

    ``panel`` is a panel's width and height, ``margins`` are the page's left, right, top and bottom,
    inches; the other arguments are of ``Figure.subplots``.
    """
    rows, columns = shape
    left, right, top, bottom = margins
    width, height = left + right + panel[0] * columns, top + bottom + panel[1] * rows
    figure = Figure(figsize=(width, height))
    panels = figure.subplots(rows, columns, squeeze=False, **subplots)
    x, y = (left / width, 1.0 - right / width), (bottom / height, 1.0 - top / height)
    figure.subplots_adjust(x[0], y[0], x[1], y[1], wspace=0.28, hspace=0.45)
    said = textwrap.fill(note, round(14.5 * width))
    figure.text(0.012, 1.0 - 0.3 / height, title, fontsize=14, weight="bold", va="center")
    figure.text(0.012, 1.0 - 0.5 / height, said, fontsize=9, color=QUIET, va="top")
    return figure, panels


def legend_of(figure: Figure, axes: Axes, columns: int = 4) -> None:
    """Write one legend for a page whose panels all show what ``axes`` shows."""
    unique = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    where: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (0.995, 0.012)}
    figure.legend(unique.values(), unique.keys(), ncols=columns, fontsize=8, **where)


def plain(axis: Any) -> None:
    """Write an axis' numbers as people do, and only its major ones."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
    axis.set_minor_formatter(NullFormatter())


@dataclass(frozen=True, slots=True)
class Row:
    """One row of `against_limits`."""

    label: str
    value: float  # NaN where it was not measured
    span: tuple[float, float] = (math.nan, math.nan)  # smallest and largest, or what is allowed
    good: bool = True  # whether it is on the right side
    series: str = ""  # of several, by whose colour it is drawn; empty for good or not
    said: str = ""  # right of it


@styled
def against_limits(
    rows: Sequence[Row],
    title: str,
    note: str,
    xlabel: str,
    limits: tuple[float, float],
    *,
    limit: float = 1.0,
    label_in: float = 3.6,
) -> Figure:
    """Draw values on a logarithmic axis, a line a label, against one limit for all."""
    labels = list(dict.fromkeys(row.label for row in rows))
    series = list(dict.fromkeys(row.series for row in rows))
    panel, margins = (6.2, 0.24 * len(labels) + 0.3), (label_in, 1.5, 1.1, 0.8)
    figure, ((axes,),) = grid((1, 1), title, note, panel=panel, margins=margins)
    axes.axvline(limit, color=PREDICTION, linewidth=1.0)
    beside: dict[str, Any] = {"transform": axes.get_yaxis_transform(), "fontsize": 8}
    for row in rows:
        number = series.index(row.series)
        at = labels.index(row.label) + 0.22 * (number - (len(series) - 1) / 2.0)
        mine = SERIES[number] if row.series else (GOOD if row.good else FAILURE)
        axes.plot(row.span, (at, at), color="#bbbbbb", linewidth=4.0, solid_capstyle="butt")
        axes.plot(np.clip(row.value, *limits), at, "o", color=mine, markersize=5)
        axes.text(1.02, at, row.said, va="center", color=mine, **beside)
    axes.set(xscale="log", xlim=limits, ylim=(len(labels) - 0.4, -0.6))
    axes.set_xlabel(xlabel, fontsize=9)
    axes.set_yticks(range(len(labels)), labels, fontsize=7.5)
    plain(axes.xaxis)
    axes.grid(axis="y", visible=False)
    if len(series) > 1:
        marks = [Line2D([], [], marker="o", ls="", color=SERIES[i]) for i in range(len(series))]
        axes.legend(marks, series, loc="lower right", fontsize=8)
    return figure


def label(axes: Axes, names: Iterable[tuple[str, float, float, str]]) -> None:
    """Write names, (text, x, y, colour), beside points of a panel with final limits, and apart."""
    points = list(names)
    if points:
        texts = [axes.text(x, y, text, color=c, fontsize=7) for text, x, y, c in points]
        axes.figure.canvas.draw()
        _, x, y, _ = zip(*points, strict=True)
        arrow = {"arrowstyle": "-", "color": "#999999", "linewidth": 0.5}
        adjust_text(texts, x, y, ax=axes, arrowprops=arrow, iter_lim=120)


# --- error against cost ----------------------------------------------------------------------

COSTS: Final[Mapping[str, str]] = {
    "cpu_s_per_s": "CPU seconds for a simulated second",
    "evaluations_per_s": "evaluations of the forces for a simulated second",
}
"""The columns of `roller_env.lab.scene.measure` that are costs, with an axis' label."""

_KINDS: Final[Mapping[ErrorKind, str]] = {
    "discretisation": "Discretisation error: against the same model with a vanishing time step.",
    "model": "Model error: against the rigid closed form, which a soft contact does not approach "
    "however small the step.",
}
_SHOWN: Final = (1e-16, 1e12)
"""Errors beyond these are drawn at them."""


@dataclass(frozen=True, slots=True)
class Plot:
    """One scene's error to be drawn."""

    title: str  # of the scene
    label: str  # of the error's axis
    points: Frame  # of the error, rows of `roller_env.lab.scene.measure`
    limits_s: Mapping[str, float]  # time step above which a method is predicted to blow up

    def curves(self) -> dict[str, Frame]:
        """Return every method's sound points, smallest step first."""
        curves = dict(iter(sound(self.points).groupby("method")))
        return {name: curves[name] for name in self.points.method.unique() if name in curves}


@styled
def draw_scene(plot: Plot) -> Figure:
    """Draw one scene's error against both costs."""
    note = f"{_note([plot])} Labels are time steps. {_alike(plot)}"
    figure, panels = grid(
        (1, 2), plot.title, note, panel=(5.2, 5.0), margins=(0.9, 2.6, 1.7, 0.8), sharey=True
    )
    for axes, (cost, title) in zip(panels[0], COSTS.items(), strict=True):
        _draw_panel(axes, plot, cost)
        _draw_guides(axes)
        axes.set_xlabel(title)
        ends = [curve.iloc[[0, -1]] for curve in plot.curves().values()]
        named = concat([pareto(plot.points, cost), *ends])
        clipped, colours = named.error.clip(*_SHOWN), named.method.map(colour)
        names = zip(named.dt_s.map(duration), named[cost], clipped, colours, strict=True)
        label(axes, dict.fromkeys(names))
    panels[0, 0].set_ylabel(plot.label)
    figure.legend(handles=_legend([plot]), loc="center right", fontsize=8)
    return figure


@styled
def draw_overview(plots: Sequence[Plot]) -> Figure:
    """Draw the errors of several scenes against CPU time, a panel each."""
    columns = min(3, len(plots))
    shape, margins = (math.ceil(len(plots) / columns), columns), (0.9, 2.7, 1.2, 0.8)
    figure, panels = grid(shape, "Error against cost", _note(plots), margins=margins)
    for axes in panels.ravel()[len(plots) :]:
        axes.set_axis_off()
    for axes, plot in zip(panels.ravel(), plots, strict=False):
        _draw_panel(axes, plot, "cpu_s_per_s")
        # Above the marks of what is predicted to blow up, which stand on the frame.
        said: dict[str, Any] = {"fontsize": 10, "weight": "bold", "pad": 12 if plot.limits_s else 6}
        axes.set_title(textwrap.fill(plot.title, 46), loc="left", **said)
        axes.set_ylabel(plot.label, fontsize=8)
        axes.set_xlabel(COSTS["cpu_s_per_s"], fontsize=8)
    figure.legend(handles=_legend(plots), loc="center right", fontsize=9)
    return figure


def _note(plots: Sequence[Plot]) -> str:
    return f"{_KINDS[plots[0].points.kind.iloc[0]]} Lower left is better."


def _draw_panel(axes: Axes, plot: Plot, cost: str) -> None:
    """Draw the front and every method's curve; above them its cross and its predicted limit."""
    front, curves, failed = pareto(plot.points, cost), plot.curves(), failures(plot.points)
    wide: dict[str, Any] = {"lw": 9, "solid_capstyle": "round", "zorder": 1.5}
    axes.plot(front[cost], front.error.clip(*_SHOWN), color=PARETO, **wide)
    for method, curve in curves.items():
        axes.plot(curve[cost], curve.error.clip(*_SHOWN), **_line(method))
    axes.set(xscale="log", yscale="log")
    axes.margins(x=0.08)
    bottom, top = axes.get_ylim()
    axes.yaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
    if bottom < ROUNDING:
        axes.axhspan(bottom, ROUNDING, color="#f3f3f3", zorder=0)
        said: dict[str, Any] = {"fontsize": 7, "color": "#8a8a8a", "va": "bottom"}
        inside = axes.get_yaxis_transform()
        axes.text(0.01, bottom, "rounding: exact", transform=inside, **said)
    axes.set_ylim(bottom, top * (top / bottom) ** (0.16 if len(failed) else 0.0))
    over: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "mew": 2}
    # Crosses of about one cost are put one below the other.
    place = (4.0 * np.log10(failed[cost])).round()
    heights = 0.965 - 0.033 * failed.groupby(place).cumcount()
    for method, x, height in zip(failed.method, failed[cost], heights, strict=True):
        axes.plot(x, height, "x", ms=8, color=colour(method), **over)
    for method in [method for method in curves if method in plot.limits_s]:
        first = curves[method].iloc[0]
        x = first[cost] * first.dt_s / plot.limits_s[method]
        axes.plot(x, 1.0, "|", ms=13, color=colour(method), clip_on=False, **over)


def _line(method: str) -> dict[str, Any]:
    """Return how a method's curve is drawn: MuJoCo with discs, ours with open squares."""
    ours, own = method.startswith("ours"), colour(method)
    return {
        "color": own,
        "lw": 1.3,
        "ls": "--" if "pyramidal" in method else "-",
        "marker": "s" if ours else "o",
        "ms": 4.5,
        "mfc": "white" if ours else own,
        "zorder": 3.0,
    }


def _draw_guides(axes: Axes) -> None:
    """Draw slopes of the orders 1, 2 and 4 in the lower left, which no method reaches."""
    (left, right), (bottom, top) = np.log10(axes.get_xlim()), np.log10(axes.get_ylim())
    x0, y0 = left + 0.03 * (right - left), bottom + 0.42 * (top - bottom)
    for order in (1, 2, 4):
        reach = min(0.11 * (right - left), 0.30 * (top - bottom) / order)
        end = 10.0 ** (x0 + reach), 10.0 ** (y0 - order * reach)
        axes.plot((10.0**x0, end[0]), (10.0**y0, end[1]), color="#8a8a8a", linewidth=1.0)
        axes.text(*end, f" order {order}", fontsize=7, color="#8a8a8a", va="top")
    axes.set(xlim=(10.0**left, 10.0**right), ylim=(10.0**bottom, 10.0**top))


def duration(seconds: float) -> str:
    """Return a time step for people, three digits in s, ms or µs: ``2 ms``."""
    for unit, scale in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= 0.999 * scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e6:.3g} µs"


def _alike(plot: Plot) -> str:
    """Return a sentence on the methods whose curves cover one another, or nothing."""
    curves = {method: curve.set_index("dt_s").error for method, curve in plot.curves().items()}
    # The rounding of 10^5 steps adds up to more than that of one.
    exact = [method for method, errors in curves.items() if errors.max() < 100.0 * ROUNDING]
    exact = [method for method in exact if method not in set(failures(plot.points).method)]
    groups: dict[str, list[str]] = {}
    for method in [method for method in curves if method not in exact]:
        like = [first for first in groups if _same(curves[first], curves[method])]
        groups.setdefault((like or [method])[0], []).append(method)
    sentences = [f"One curve: {', '.join(group)}." for group in groups.values() if len(group) > 1]
    if exact:
        sentences.append(f"Exact at every time step: {', '.join(exact)}.")
    return " ".join(sentences)


def _same(one: Any, other: Any) -> bool:
    """Say whether two series by time step are one to the eye: within 1 % wherever both are."""
    one, other = one.align(other, join="inner")
    return len(one) > 0 and bool(((one - other).abs() <= 0.01 * one + ROUNDING).all())


def _legend(plots: Sequence[Plot]) -> list[Line2D]:
    """Return the legend's entries: the methods by family, the front, the cross and the limit."""
    methods = dict.fromkeys(method for plot in plots for method in plot.curves())
    entries: list[Line2D] = []
    for family, title in (("MuJoCo ", "MuJoCo, in C"), ("ours ", "ours, compiled by Numba")):
        own = [method for method in methods if method.startswith(family)]
        entries += [Line2D([], [], ls="", label=title)] if own else []
        entries += [Line2D([], [], label=m.removeprefix(family), **_line(m)) for m in own]
    entries.append(Line2D([], [], color=PARETO, lw=9, label="Pareto front: none is better"))
    dark: dict[str, Any] = {"color": PREDICTION, "ls": "", "mew": 2}
    if any(len(failures(plot.points)) for plot in plots):
        entries.append(Line2D([], [], marker="x", ms=8, label="first to fail", **dark))
    if any(plot.limits_s for plot in plots):
        entries.append(Line2D([], [], marker="|", ms=13, label="predicted to blow up", **dark))
    return entries
