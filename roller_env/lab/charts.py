"""The chart of error against cost: a curve a method, a point a time step."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter, NullLocator
from matplotlib.transforms import Bbox

from roller_env.lab.answers import (
    COSTS,
    ROUNDING,
    Cost,
    cost_of,
    curves,
    first_failure,
    pareto,
    sound,
)
from roller_env.lab.experiment import ErrorKind, Measure, Point, Scene
from roller_env.lab.style import PREDICTION, STYLE, colour, save

LEAST_ERROR: Final = 1e-16
LARGEST_ERROR: Final = 1e12
"""Errors beyond these two are drawn at them."""

SAME_ERROR: Final = 0.01
"""Methods whose errors differ by less than this at every time step have one curve to the eye."""

_KINDS: Final[dict[ErrorKind, str]] = {
    "discretisation": "Discretisation error: against the same model with a vanishing time step.",
    "model": "Model error: against the rigid closed form, which a soft contact does not approach "
    "however small the step.",
}
_COST_LABELS: Final[dict[Cost, str]] = {
    "wall time": "wall seconds for a simulated second",
    "force evaluations": "evaluations of the forces for a simulated second",
}
_NOTE_CHARACTERS: Final = 165
_TITLE_CHARACTERS: Final = 46
_CROSSES_SHARE: Final = 0.16
"""Height over the curves for the crosses, as a share of theirs."""
_MARK_PX: Final = 3.0
_LABEL: Final = {True: (5, 4), False: (6, -2)}
"""Where a label stands from its point, typographic points: on a curve, and beside a cross."""
_FRONT_LABEL: Final = (-5, -10)
"""Of the front's points: to the lower left of it there is nothing."""
_GUIDE_ORDERS: Final = (1, 2, 4)
_GUIDE: Final = "#8a8a8a"
_PARETO: Final = "#ffe08a"
_CROSS: Final[dict[str, Any]] = {"marker": "x", "markersize": 8.0, "markeredgewidth": 2.0}
_PREDICTED: Final[dict[str, Any]] = {"marker": "|", "markersize": 13.0, "markeredgewidth": 2.0}
_FRONT: Final[dict[str, Any]] = {
    "color": _PARETO,
    "linewidth": 9.0,
    "solid_capstyle": "round",
    "marker": "o",
    "markersize": 9.0,
}


@dataclass(frozen=True)
class Plot:
    """One scene's error, with all that is drawn of it.

    Attributes:
        scene: the motion.
        measure: the error.
        points: of this scene and this error.
        limits_s: time step from which on theory expects a method to blow up, by its name.
    """

    scene: Scene
    measure: Measure
    points: Sequence[Point]
    limits_s: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, scene: Scene, measure: Measure, points: Iterable[Point]) -> Plot:
        """Return the plot of a scene's error, from the points of any."""
        own = [p for p in points if (p.scene, p.measure) == (scene.name, measure.name)]
        return cls(scene, measure, own, getattr(scene, "limits_s", {}))

    @property
    def curves(self) -> dict[str, list[Point]]:
        """The points of each method, smallest time step first."""
        return {method: curve for (_, _, method), curve in curves(self.points).items()}

    @property
    def failure(self) -> float | None:
        """Error above which a method fails; None where another error of the scene decides."""
        return self.scene.failure if self.measure == self.scene.measures[0] else None

    @property
    def failures(self) -> list[Point]:
        """The first point at which each method that fails does so, as time steps grow."""
        found = (first_failure(curve) for curve in self.curves.values())
        return [point for point in found if point]


def draw_scene(plot: Plot, facts: dict[str, str], stem: Path) -> tuple[Path, Path]:
    """Draw one scene's error against both costs, and return the PNG's and the SVG's path."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(13.0, 7.0))
        panels = figure.subplots(1, 2, sharey=True)
        figure.subplots_adjust(left=0.065, right=0.795, top=0.78, bottom=0.12, wspace=0.06)
        figure.suptitle(plot.scene.title, x=0.065, y=0.975, ha="left", fontsize=15, weight="bold")
        notes = [
            f"{_KINDS[plot.measure.kind]} Lower left is better; labels are time steps.",
            *textwrap.wrap(_alike(plot), _NOTE_CHARACTERS),
        ]
        figure.text(
            0.065, 0.93, "\n".join(notes), fontsize=9, color="#555555", va="top", linespacing=1.4
        )
        panels[0].set_ylabel(plot.measure.label)
        for panel, cost in zip(panels, COSTS, strict=True):
            _draw_panel(panel, plot, cost)
            panel.set_xlabel(_COST_LABELS[cost])
        _times_real_time(panels[0])
        figure.legend(
            handles=_legend([plot]), loc="center left", bbox_to_anchor=(0.803, 0.45), fontsize=9
        )
        # The panels have their final limits now, on which guides and labels depend.
        for panel, cost in zip(panels, COSTS, strict=True):
            _draw_guides(panel)
            _label_time_steps(panel, plot, cost)
    return save(figure, facts, stem)


def draw_overview(
    plots: Sequence[Plot], facts: dict[str, str], stem: Path, *, columns: int = 3
) -> tuple[Path, Path]:
    """Draw the errors of several scenes against wall time, a panel each, and return both paths."""
    columns = min(columns, len(plots))
    lines = math.ceil(len(plots) / columns)
    panel_in, legend_in, head_in = (4.9, 3.7), 2.9, 0.6
    size = (panel_in[0] * columns + legend_in, panel_in[1] * lines + head_in)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size)
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for panel, plot in zip(panels, plots, strict=False):
            _draw_panel(panel, plot, "wall time")
            title = textwrap.fill(plot.scene.title, _TITLE_CHARACTERS)
            panel.set_title(title, fontsize=10, weight="bold", loc="left")
            panel.set_ylabel(plot.measure.label, fontsize=8)
            panel.set_xlabel(_COST_LABELS["wall time"], fontsize=8)
        for panel in panels[len(plots) :]:
            panel.set_axis_off()
        figure.text(
            0.01,
            1.0 - 0.25 / size[1],
            f"{_KINDS[plots[0].measure.kind]} Lower left is better.",
            fontsize=12,
            va="center",
        )
        width = 1.0 - legend_in / size[0]
        figure.tight_layout(rect=(0.0, 0.25 / size[1], width, 1.0 - 0.45 / size[1]))
        figure.legend(
            handles=_legend(plots), loc="center left", bbox_to_anchor=(width, 0.5), fontsize=9
        )
    return save(figure, facts, stem)


# --- one panel -------------------------------------------------------------------------------


def _draw_panel(panel: Axes, plot: Plot, cost: Cost) -> None:
    """Draw the front and every method's curve; above them its cross and its predicted limit."""
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.margins(x=0.08)
    _plot(panel, pareto(plot.points, cost), cost, **_FRONT, zorder=1.5)
    for method, curve in plot.curves.items():
        _plot(panel, sound(curve), cost, **_line(method))
    bottom, top = panel.get_ylim()
    panel.set_yticks([tick for tick in panel.get_yticks() if bottom <= tick <= top])
    panel.yaxis.set_minor_locator(NullLocator())
    if plot.failures:
        top *= (top / bottom) ** _CROSSES_SHARE
    if bottom < ROUNDING:
        panel.axhspan(bottom, ROUNDING, color="#f3f3f3", zorder=0)
        note: dict[str, Any] = {"fontsize": 7, "color": _GUIDE, "va": "bottom"}
        panel.text(0.01, bottom, "rounding: exact", transform=panel.get_yaxis_transform(), **note)
    panel.set_ylim(bottom, top)
    for point, height in _stacked(plot.failures, cost):
        _mark(panel, cost_of(point, cost), height, point.method, _CROSS)
    for method, limit_s in plot.limits_s.items():
        if method in plot.curves:
            at = _cost_of_step(plot.curves[method], cost, limit_s)
            _mark(panel, at, 1.0, method, _PREDICTED)


def _plot(panel: Axes, points: Sequence[Point], cost: Cost, **line: Any) -> None:
    panel.plot([cost_of(p, cost) for p in points], [_shown(p) for p in points], **line)


def _mark(panel: Axes, at: float, height: float, method: str, mark: Mapping[str, Any]) -> None:
    """Draw a mark at a cost and a share of the panel's height."""
    panel.plot(
        [at],
        [height],
        transform=panel.get_xaxis_transform(),
        color=colour(method),
        clip_on=False,
        zorder=4,
        **mark,
    )


def _stacked(points: Sequence[Point], cost: Cost) -> list[tuple[Point, float]]:
    """Return each point with a share of the panel's height, so that none covers another."""
    taken: Counter[int] = Counter()
    placed = []
    for point in points:
        place = round(4.0 * math.log10(cost_of(point, cost)))
        placed.append((point, 0.965 - 0.033 * taken[place]))
        taken[place] += 1
    return placed


def _cost_of_step(curve: Sequence[Point], cost: Cost, dt_s: float) -> float:
    """Return what a simulated second costs at a time step, from the cost of a step on a curve."""
    return float(np.median([cost_of(point, cost) * point.dt_s for point in curve])) / dt_s


def _shown(point: Point) -> float:
    return min(max(point.error, LEAST_ERROR), LARGEST_ERROR)


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


def _draw_guides(panel: Axes) -> None:
    """Draw slopes of the orders 1, 2 and 4 in the lower left, which no method reaches."""
    left, right = np.log10(panel.get_xlim())
    bottom, top = np.log10(panel.get_ylim())
    width, height = right - left, top - bottom
    x0, y0 = left + 0.03 * width, bottom + 0.42 * height
    for order in _GUIDE_ORDERS:
        reach = min(0.11 * width, 0.30 * height / order)
        x1, y1 = x0 + reach, y0 - order * reach
        panel.plot(
            10.0 ** np.array([x0, x1]), 10.0 ** np.array([y0, y1]), color=_GUIDE, linewidth=1.0
        )
        panel.annotate(
            f"order {order}",
            (10.0**x1, 10.0**y1),
            xytext=(3, -3),
            textcoords="offset points",
            fontsize=7,
            color=_GUIDE,
        )
    panel.set_xlim(10.0**left, 10.0**right)
    panel.set_ylim(10.0**bottom, 10.0**top)


def _label_time_steps(panel: Axes, plot: Plot, cost: Cost) -> None:
    """Write the time step beside the front's points and the curves' ends, where there is room.

    The front comes first, then the smallest steps, the crosses and the largest steps. A label that
    would cover an earlier one is left out; but for the front's, so is one that would cover a mark.
    """
    on_curve, over_curves = panel.transData, panel.get_xaxis_transform()
    drawn = [kept for curve in plot.curves.values() if (kept := sound(curve))]
    crosses = [(point, height, over_curves) for point, height in _stacked(plot.failures, cost)]
    front = [(point, _shown(point), on_curve) for point in pareto(plot.points, cost)]
    wanted = [
        *((curve[0], _shown(curve[0]), on_curve) for curve in drawn),
        *crosses,
        *((curve[-1], _shown(curve[-1]), on_curve) for curve in drawn),
    ]
    # A point that is both on the front and an end has its label once.
    ends = [one for one in wanted if one[0] not in {point for point, *_ in front}]
    every = [(point, _shown(point), on_curve) for curve in drawn for point in curve]
    marks = [
        Bbox.from_bounds(x - _MARK_PX, y - _MARK_PX, 2.0 * _MARK_PX, 2.0 * _MARK_PX)
        for x, y in (to.transform((cost_of(p, cost), at)) for p, at, to in [*every, *crosses])
    ]
    taken: list[Bbox] = []
    for rank, (point, height, transform) in enumerate([*front, *ends]):
        label = panel.annotate(
            duration(point.dt_s),
            (cost_of(point, cost), height),
            xycoords=transform,
            xytext=_FRONT_LABEL if rank < len(front) else _LABEL[transform is on_curve],
            textcoords="offset points",
            ha="right" if rank < len(front) else "left",
            fontsize=7,
            color=colour(point.method),
            zorder=5,
        )
        box = label.get_window_extent()
        if any(map(box.overlaps, taken if rank < len(front) else [*taken, *marks])):
            label.remove()
        else:
            taken.append(box)


def duration(seconds: float) -> str:
    """Return a time step for people, three digits in s, ms or µs: ``2 ms``."""
    for unit, scale in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= 0.999 * scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e6:.3g} µs"


def _times_real_time(panel: Axes) -> None:
    """Put the same axis on top as multiples of real time."""

    def inverse(value: Any) -> Any:
        return 1.0 / np.maximum(value, 1e-300)

    panel.secondary_xaxis("top", functions=(inverse, inverse)).set_xlabel("times real time")


# --- words -----------------------------------------------------------------------------------


def _alike(plot: Plot) -> str:
    """Return a sentence on the methods whose curves cover one another, or nothing."""
    groups: list[list[str]] = []
    exact = [name for name, curve in plot.curves.items() if _is_exact(curve)]
    for method in [name for name in plot.curves if name not in exact]:
        own = _errors(plot.curves[method])
        for group in groups:
            if _same(_errors(plot.curves[group[0]]), own):
                group.append(method)
                break
        else:
            groups.append([method])
    sentences = [f"One curve: {', '.join(group)}." for group in groups if len(group) > 1]
    if exact:
        sentences.append(f"Exact at every time step: {', '.join(exact)}.")
    return " ".join(sentences)


def _is_exact(curve: Sequence[Point]) -> bool:
    # The rounding of 10^5 steps adds up to more than that of one.
    return all(not p.failed and p.error < 100.0 * ROUNDING for p in curve)


def _errors(curve: Sequence[Point]) -> dict[float, float]:
    return {point.dt_s: point.error for point in sound(curve)}


def _same(one: Mapping[float, float], other: Mapping[float, float]) -> bool:
    shared = one.keys() & other.keys()
    return bool(shared) and all(
        abs(one[dt] - other[dt]) <= SAME_ERROR * one[dt] + ROUNDING for dt in shared
    )


def _legend(plots: Sequence[Plot]) -> list[Line2D]:
    """Return the legend's entries: the methods by family, the front, the cross and the limit."""
    methods = dict.fromkeys(point.method for plot in plots for point in plot.points)
    entries: list[Line2D] = []
    for family, title in (("MuJoCo ", "MuJoCo, in C"), ("ours ", "ours, NumPy, one body")):
        own = [method for method in methods if method.startswith(family)]
        if own:
            entries.append(Line2D([], [], linestyle="none", label=title))
            entries += [
                Line2D([], [], label=method.removeprefix(family), **_line(method)) for method in own
            ]
    entries.append(Line2D([], [], linestyle="none", label=""))
    entries.append(Line2D([], [], **_FRONT, label="Pareto front: none is better"))
    dark: dict[str, Any] = {"color": PREDICTION, "linestyle": "none"}
    if any(plot.failures for plot in plots):
        limits = {plot.failure for plot in plots}
        over = f", error over {limits.pop():g}" if len(limits) == 1 and None not in limits else ""
        entries.append(Line2D([], [], **dark, **_CROSS, label=f"first to fail{over}"))
    if any(plot.limits_s for plot in plots):
        entries.append(Line2D([], [], **dark, **_PREDICTED, label="predicted to blow up"))
    return entries
