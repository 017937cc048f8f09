"""Every picture of the laboratory: one look, one way to save, and the shapes that recur.

A colour means the same method everywhere. `grid` makes a page of panels, `against_limits` rows of
what was measured beside what was allowed, `label` writes names where there is room for them, and
`error_against_cost` is the chart of a method a curve, a time step a point.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import matplotlib
import numpy as np
import numpy.typing as npt
from adjustText import adjust_text
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from roller_env.lab.runner import header
from roller_env.lab.scene import ErrorKind

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


def save(figure: Figure, facts: Mapping[str, str], stem: Path) -> tuple[Path, Path]:
    """Write the figure as ``stem.png`` and ``stem.svg`` with its provenance along the foot.

    Returns:
        Both paths.
    """
    foot: dict[str, Any] = {"fontsize": 6, "color": "#777777", "ha": "left", "va": "bottom"}
    figure.text(0.005, 0.004, header(facts), wrap=True, **foot)
    stem.parent.mkdir(parents=True, exist_ok=True)
    # Not with_suffix: a scene's name may have a point in it.
    png, svg = (stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg"))
    with matplotlib.rc_context(STYLE):
        figure.savefig(png, dpi=150, facecolor="white")
        figure.savefig(svg, facecolor="white", metadata={"Date": None})
    return png, svg


def grid(
    shape: tuple[int, int],
    title: str,
    note: str,
    *,
    panel: tuple[float, float] = (4.6, 3.4),
    margins: tuple[float, float, float, float] = (0.9, 0.5, 1.0, 0.7),
    **subplots: Any,
) -> tuple[Figure, npt.NDArray[Any]]:
    """Return a page of panels under a headline.

    Args:
        shape: rows and columns.
        title: the headline.
        note: a line below it, broken where it is too long.
        panel: width and height of a panel, inches.
        margins: left, right, top and bottom of the page, inches.
        **subplots: further arguments of ``Figure.subplots``.

    Returns:
        The figure, and its panels (rows, columns).
    """
    rows, columns = shape
    left, right, top, bottom = margins
    width, height = left + right + panel[0] * columns, top + bottom + panel[1] * rows
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        panels = figure.subplots(rows, columns, squeeze=False, **subplots)
        figure.subplots_adjust(
            left=left / width,
            right=1.0 - right / width,
            top=1.0 - top / height,
            bottom=bottom / height,
            wspace=0.28,
            hspace=0.45,
        )
        said = textwrap.fill(note, round(14.5 * width))
        figure.text(0.012, 1.0 - 0.3 / height, title, fontsize=14, weight="bold", va="center")
        figure.text(0.012, 1.0 - 0.5 / height, said, fontsize=9, color=QUIET, va="top")
    return figure, panels


def legend_of(figure: Figure, axes: Axes, columns: int = 4) -> None:
    """Write one legend for a page whose panels all show what ``axes`` shows."""
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(
        unique.values(),
        unique.keys(),
        loc="lower right",
        ncols=columns,
        fontsize=8,
        bbox_to_anchor=(0.995, 0.012),
    )


def plain(axis: Any) -> None:
    """Write an axis' numbers as people do, and only its major ones."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
    axis.set_minor_formatter(NullFormatter())


@dataclass(frozen=True, slots=True)
class Row:
    """One row of `against_limits`.

    Attributes:
        label: what it is.
        value: on the axis; NaN where it was not measured.
        span: smallest and largest, which are drawn as a line; or what is allowed.
        good: whether it is on the right side.
        series: of several, by whose colour it is drawn; empty for good or not.
        said: what is written right of it.
    """

    label: str
    value: float
    span: tuple[float, float] = (math.nan, math.nan)
    good: bool = True
    series: str = ""
    said: str = ""


def against_limits(
    rows: Sequence[Row],
    title: str,
    note: str,
    xlabel: str,
    limits: tuple[float, float],
    *,
    limit: float | None = 1.0,
    label_in: float = 3.6,
) -> Figure:
    """Draw values on a logarithmic axis, a line a label, against one limit for all."""
    labels = list(dict.fromkeys(row.label for row in rows))
    series = list(dict.fromkeys(row.series for row in rows))
    figure, ((axes,),) = grid(
        (1, 1),
        title,
        note,
        panel=(6.2, 0.24 * len(labels) + 0.3),
        margins=(label_in, 1.5, 1.1, 0.8),
    )
    with matplotlib.rc_context(STYLE):
        if limit is not None:
            axes.axvline(limit, color=PREDICTION, linewidth=1.0)
        for row in rows:
            shift = 0.22 * (series.index(row.series) - (len(series) - 1) / 2.0)
            at = labels.index(row.label) + shift
            mine = (
                SERIES[series.index(row.series)] if row.series else (GOOD if row.good else FAILURE)
            )
            axes.plot(row.span, (at, at), color="#bbbbbb", linewidth=4.0, solid_capstyle="butt")
            axes.plot(np.clip(row.value, *limits), at, "o", color=mine, markersize=5)
            if row.said:
                axes.text(1.02, at, row.said, transform=axes.get_yaxis_transform(), va="center",
                          fontsize=8, color=mine)  # fmt: skip
        axes.set(xscale="log", xlim=limits, ylim=(len(labels) - 0.4, -0.6))
        axes.set_xlabel(xlabel, fontsize=9)
        axes.set_yticks(range(len(labels)), labels, fontsize=7.5)
        plain(axes.xaxis)
        axes.grid(axis="y", visible=False)
        if len(series) > 1:
            marks = [Line2D([], [], marker="o", ls="", color=SERIES[i]) for i in range(len(series))]
            axes.legend(marks, series, loc="lower right", fontsize=8)
    return figure


def label(axes: Axes, names: Iterable[tuple[str, float, float, str]], **style: Any) -> None:
    """Write names beside points of a panel with final limits, and move them apart.

    Args:
        axes: of the chart.
        names: text, x, y and colour of each.
        **style: further arguments of ``Axes.text``.
    """
    points = list(names)
    if not points:
        return
    texts = [axes.text(x, y, text, color=c, **{"fontsize": 7, **style}) for text, x, y, c in points]
    axes.figure.canvas.draw()
    adjust_text(
        texts,
        [x for _, x, _, _ in points],
        [y for _, _, y, _ in points],
        ax=axes,
        arrowprops={"arrowstyle": "-", "color": "#999999", "linewidth": 0.5},
        iter_lim=120,
    )


# --- error against cost ----------------------------------------------------------------------

Cost = Literal["CPU time", "force evaluations"]
COSTS: Final[tuple[Cost, ...]] = ("CPU time", "force evaluations")

ROUNDING: Final = 1e-13
"""Errors below it are rounding of float64: the answer is exact."""

_COST_COLUMN: Final[dict[Cost, str]] = {
    "CPU time": "cpu_s_per_s",
    "force evaluations": "evaluations_per_s",
}
_COST_LABELS: Final[dict[Cost, str]] = {
    "CPU time": "CPU seconds for a simulated second",
    "force evaluations": "evaluations of the forces for a simulated second",
}
_KINDS: Final[dict[ErrorKind, str]] = {
    "discretisation": "Discretisation error: against the same model with a vanishing time step.",
    "model": "Model error: against the rigid closed form, which a soft contact does not approach "
    "however small the step.",
}
_SHOWN: Final = (1e-16, 1e12)
"""Errors beyond these are drawn at them."""


@dataclass(frozen=True)
class Plot:
    """One scene's error, with all that is drawn of it.

    Attributes:
        title: of the scene.
        label: of the error's axis.
        kind: of the error.
        curves: method, and its points before the first that fails: (dt_s, error, {cost: value}),
            smallest time step first.
        fronts: of each cost, the points that no other beats: (method, dt_s, error, value).
        failures: method, its smallest failing step and what that costs.
        limits_s: method and the time step above which it is predicted to blow up.
    """

    title: str
    label: str
    kind: ErrorKind
    curves: Mapping[str, Sequence[tuple[float, float, Mapping[Cost, float]]]]
    fronts: Mapping[Cost, Sequence[tuple[str, float, float, float]]]
    failures: Mapping[str, tuple[float, Mapping[Cost, float]]]
    limits_s: Mapping[str, float] = field(default_factory=dict)


def draw_scene(plot: Plot) -> Figure:
    """Draw one scene's error against both costs."""
    note = f"{_KINDS[plot.kind]} Lower left is better; labels are time steps. {_alike(plot)}"
    figure, panels = grid((1, 2), plot.title, note, panel=(5.2, 5.0), margins=(0.9, 2.6, 1.7, 0.8),
                          sharey=True)  # fmt: skip
    with matplotlib.rc_context(STYLE):
        for axes, cost in zip(panels[0], COSTS, strict=True):
            _draw_panel(axes, plot, cost)
            _draw_guides(axes)
            axes.set_xlabel(_COST_LABELS[cost])
            ends = [(m, c[end]) for m, c in plot.curves.items() for end in {0, len(c) - 1} if c]
            at_ends = [
                (duration(dt), costs[cost], _clipped(error), colour(method))
                for method, (dt, error, costs) in ends
            ]
            front = [(duration(dt), x, _clipped(e), colour(m)) for m, dt, e, x in plot.fronts[cost]]
            label(axes, dict.fromkeys([*front, *at_ends]))
        panels[0, 0].set_ylabel(plot.label)
        figure.legend(handles=_legend([plot]), loc="center right", fontsize=8)
    return figure


def draw_overview(plots: Sequence[Plot], columns: int = 3) -> Figure:
    """Draw the errors of several scenes against CPU time, a panel each."""
    columns = min(columns, len(plots))
    lines = math.ceil(len(plots) / columns)
    figure, panels = grid((lines, columns), "Error against cost", f"{_KINDS[plots[0].kind]} Lower "
                          "left is better.", margins=(0.9, 2.7, 1.2, 0.8))  # fmt: skip
    with matplotlib.rc_context(STYLE):
        for axes, plot in zip(panels.ravel(), plots, strict=False):
            _draw_panel(axes, plot, "CPU time")
            axes.set_title(textwrap.fill(plot.title, 46), fontsize=10, weight="bold", loc="left")
            axes.set_ylabel(plot.label, fontsize=8)
            axes.set_xlabel(_COST_LABELS["CPU time"], fontsize=8)
        for axes in panels.ravel()[len(plots) :]:
            axes.set_axis_off()
        figure.legend(handles=_legend(plots), loc="center right", fontsize=9)
    return figure


def _draw_panel(axes: Axes, plot: Plot, cost: Cost) -> None:
    """Draw the front and every method's curve; above them its cross and its predicted limit."""
    front = plot.fronts[cost]
    axes.plot([x for *_, x in front], [_clipped(e) for _, _, e, _ in front], color=PARETO, lw=9,
              solid_capstyle="round", zorder=1.5)  # fmt: skip
    for method, curve in plot.curves.items():
        axes.plot([c[cost] for *_, c in curve], [_clipped(e) for _, e, _ in curve], **_line(method))
    axes.set(xscale="log", yscale="log")
    axes.margins(x=0.08)
    bottom, top = axes.get_ylim()
    axes.yaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
    if bottom < ROUNDING:
        axes.axhspan(bottom, ROUNDING, color="#f3f3f3", zorder=0)
        axes.text(0.01, bottom, "rounding: exact", transform=axes.get_yaxis_transform(), fontsize=7,
                  color="#8a8a8a", va="bottom")  # fmt: skip
    axes.set_ylim(bottom, top * (top / bottom) ** (0.16 if plot.failures else 0.0))
    over = axes.get_xaxis_transform()
    taken: dict[int, int] = {}
    for method, (_, costs) in plot.failures.items():
        place = round(4.0 * math.log10(costs[cost]))
        height = 0.965 - 0.033 * taken.setdefault(place, 0)
        taken[place] += 1
        axes.plot(costs[cost], height, "x", ms=8, mew=2, color=colour(method), transform=over)
    for method, limit_s in plot.limits_s.items():
        for dt_s, _, costs in plot.curves.get(method, ())[:1]:
            at = costs[cost] * dt_s / limit_s
            axes.plot(at, 1.0, "|", ms=13, mew=2, color=colour(method), transform=over,
                      clip_on=False)  # fmt: skip


def _clipped(error: float) -> float:
    return float(np.clip(error, *_SHOWN))


def _line(method: str) -> dict[str, Any]:
    """Return how a method's curve is drawn: MuJoCo with discs, ours with open squares."""
    ours = method.startswith("ours")
    return {
        "color": colour(method),
        "linestyle": "--" if "pyramidal" in method else "-",
        "linewidth": 1.3,
        "marker": "s" if ours else "o",
        "markersize": 4.5,
        "markerfacecolor": "white" if ours else colour(method),
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
    groups: list[list[str]] = []
    errors = {name: {dt: error for dt, error, _ in curve} for name, curve in plot.curves.items()}
    # The rounding of 10^5 steps adds up to more than that of one.
    exact = [
        name
        for name, own in errors.items()
        if name not in plot.failures and max(own.values(), default=1.0) < 100.0 * ROUNDING
    ]
    for method in [name for name in errors if name not in exact]:
        for group in groups:
            if _same(errors[group[0]], errors[method]):
                group.append(method)
                break
        else:
            groups.append([method])
    sentences = [f"One curve: {', '.join(group)}." for group in groups if len(group) > 1]
    if exact:
        sentences.append(f"Exact at every time step: {', '.join(exact)}.")
    return " ".join(sentences)


def _same(one: Mapping[float, float], other: Mapping[float, float]) -> bool:
    """Say whether two curves are one to the eye: within 1 % at every time step."""
    shared = one.keys() & other.keys()
    return bool(shared) and all(
        abs(one[dt] - other[dt]) <= 0.01 * one[dt] + ROUNDING for dt in shared
    )


def _legend(plots: Sequence[Plot]) -> list[Line2D]:
    """Return the legend's entries: the methods by family, the front, the cross and the limit."""
    methods = dict.fromkeys(method for plot in plots for method in plot.curves)
    entries: list[Line2D] = []
    for family, title in (("MuJoCo ", "MuJoCo, in C"), ("ours ", "ours, compiled by Numba")):
        own = [method for method in methods if method.startswith(family)]
        if own:
            entries.append(Line2D([], [], linestyle="none", label=title))
            entries += [Line2D([], [], label=m.removeprefix(family), **_line(m)) for m in own]
    entries.append(Line2D([], [], color=PARETO, lw=9, label="Pareto front: none is better"))
    dark: dict[str, Any] = {"color": PREDICTION, "linestyle": "none", "markeredgewidth": 2}
    if any(plot.failures for plot in plots):
        entries.append(Line2D([], [], marker="x", ms=8, label="first to fail", **dark))
    if any(plot.limits_s for plot in plots):
        entries.append(Line2D([], [], marker="|", ms=13, label="predicted to blow up", **dark))
    return entries
