"""What the parallel cube shows: differences over time, errors against the time step, tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from roller_env.lab import style
from roller_env.lab.parallel.differences import AGREEMENT, Pair, Remedy, Sample, Verdict
from roller_env.lab.parallel.experiments import Settings
from roller_env.lab.parallel.motions import REFERENCE_ERROR
from roller_env.lab.parallel.velocity_form import REMEDIES
from roller_env.lab.tables import markdown

PANELS: Final[Mapping[str, str]] = {
    "position_m": "position, m",
    "attitude_rad": "attitude, rad",
    "momentum_kg_m_s": "momentum, kg m/s",
    "angular_momentum_kg_m2_s": "angular momentum, kg m²/s",
    "energy_j": "energy, J",
}
"""The differences by their name in `Difference`, with what people read."""

_BETWEEN: Final = "#222222"
"""Colour of the difference between the two sides."""

_HOW_TO_READ: Final = (
    "Thick: how far each side is from the reference. Thin: how far they are from one another; "
    "where a line is missing, it is 0 (under 1e-17)."
)

_FLOOR: Final = 1e-17
"""Differences below this, nearly always exactly 0, leave the picture."""

_EXPERIMENTS: Final = {
    "velocity_rk4_world_axes": "#b58900",
    "velocity_rk4_body_axes": "#2f6db3",
}
"""Colours of the methods that exist nowhere else."""


def draw_flights(settings: Settings, body_name: str, samples: Sequence[Sample]) -> Figure:
    """Draw the differences over time: a row for each scene, a panel for each quantity."""
    scenes = settings.scenes
    heights = [1.15, *[2.2] * (len(scenes) - 1), 2.55, 0.3]
    title = (
        f"The {body_name} in parallel: {settings.mujoco.name} and our {settings.ours.name}, "
        f"dt {1e3 * settings.dt_s:g} ms"
    )
    with matplotlib.rc_context(style.STYLE):
        figure = Figure(figsize=(15.0, sum(heights)), layout="constrained")
        head, *strips, _ = _strips(figure, heights)
        head.suptitle(title, x=0.012, y=0.97, ha="left", fontsize=15)
        head.text(0.012, 0.5, _HOW_TO_READ, fontsize=9, color="#555555")
        limits = {name: _limits([getattr(one, name) for one in samples]) for name in PANELS}
        for scene, strip in zip(scenes, strips, strict=True):
            strip.suptitle(scene.title, x=0.012, ha="left", fontsize=11, fontweight="bold")
            mine = [sample for sample in samples if sample.scene == scene.name]
            for axes, name in zip(strip.subplots(1, len(PANELS)), PANELS, strict=True):
                _draw_panel(axes, settings, name, mine)
                axes.set(xlim=(0.0, settings.duration_s), ylim=limits[name])
                axes.tick_params(labelbottom=strip is strips[-1])
        handles, labels = strips[0].axes[1].get_legend_handles_labels()
        head.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.006, 0.0), ncols=5)
        strips[-1].supxlabel("time, s", fontsize=9)
    return figure


def _strips(figure: Figure, heights: Sequence[float]) -> list[SubFigure]:
    """Return parts of the figure from top to bottom, of these heights."""
    return list(figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0])


def _limits(values: Sequence[float]) -> tuple[float, float]:
    """Return limits of a logarithmic axis: whole decades around all that can be drawn."""
    drawn = [value for value in values if math.isfinite(value) and value > _FLOOR]
    low, high = min(drawn, default=_FLOOR), max([*drawn, 10.0 * AGREEMENT])
    return 10.0 ** math.floor(math.log10(low)), 10.0 ** math.ceil(math.log10(high))


def _draw_panel(axes: Axes, settings: Settings, name: str, samples: Sequence[Sample]) -> None:
    """Draw one quantity of one scene."""
    ours, mujoco = style.colour(f"ours {settings.ours.name}"), style.colour(settings.mujoco.name)
    lines: tuple[tuple[Pair, str, str, float], ...] = (
        ("ours - reference", "our own error", ours, 3.6),
        ("MuJoCo - reference", "MuJoCo's own error", mujoco, 3.6),
        ("ours - MuJoCo", "difference between the two", _BETWEEN, 1.1),
    )
    if name in REFERENCE_ERROR:
        axes.axhspan(
            0.0, REFERENCE_ERROR[name], color="#efefef", lw=0, label="the reference's own error"
        )
        axes.axhline(AGREEMENT, color="#555555", lw=1.0, ls="--", label="must agree to 1e-9")
    for pair, label, colour, width in lines:
        rows = [sample for sample in samples if sample.pair == pair]
        values = np.array([getattr(row, name) for row in rows])
        shown = np.where(values > _FLOOR, values, np.nan)
        times = [row.time_s for row in rows]
        axes.plot(
            times, shown, color=colour, lw=width, alpha=0.7 if width > 2.0 else 1.0, label=label
        )
        if pair == "ours - MuJoCo" and not values.any():
            axes.set_title("no difference", fontsize=8, loc="right")
    axes.set_yscale("log")
    axes.minorticks_off()
    axes.set_title(PANELS[name], fontsize=9, color="#555555", loc="left")
    axes.tick_params(labelsize=8)


def draw_remedies(settings: Settings, body_name: str, rows: Sequence[Remedy]) -> Figure:
    """Draw the attitude error against the time step: a panel for each scene, a line a method."""
    columns = min(3, len(settings.scenes))
    lines = math.ceil(len(settings.scenes) / columns)
    heights = [1.2, 3.2 * lines, 0.3]
    with matplotlib.rc_context(style.STYLE):
        figure = Figure(figsize=(max(10.0, 4.6 * columns), sum(heights)), layout="constrained")
        head, middle, _ = _strips(figure, heights)
        title = f"The {body_name}: which part of the report's method makes its error"
        head.suptitle(title, x=0.012, y=0.97, ha="left", fontsize=14)
        panels = middle.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, scene in zip(panels, settings.scenes, strict=False):
            _draw_remedy_panel(axes, settings, [row for row in rows if row.scene == scene.name])
            axes.set_title(scene.title, fontsize=10, loc="left")
        for axes in panels[len(settings.scenes) :]:
            axes.set_visible(False)
        middle.supxlabel("time step, ms", fontsize=10)
        middle.supylabel(f"largest attitude error in {settings.duration_s:g} s, rad", fontsize=10)
        handles, labels = panels[0].get_legend_handles_labels()
        head.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.006, 0.0), ncols=3)
    return figure


def _draw_remedy_panel(axes: Axes, settings: Settings, rows: Sequence[Remedy]) -> None:
    theirs = {1e3 * row.dt_s: row.mujoco_error_rad for row in rows}
    name = settings.mujoco.name
    axes.plot(
        *zip(*theirs.items(), strict=True), color=style.colour(name), lw=5, alpha=0.5, label=name
    )
    for method in dict.fromkeys(row.method for row in rows):
        mine = {1e3 * row.dt_s: row.error_rad for row in rows if row.method == method}
        axes.plot(
            *zip(*mine.items(), strict=True),
            color=_EXPERIMENTS.get(method) or style.colour(f"ours {method}"),
            marker="o",
            markersize=4,
            label=f"{method}: {REMEDIES[method][1]}" if method in REMEDIES else method,
        )
    axes.axhline(AGREEMENT, color="#555555", lw=1.0, ls="--", label="must agree to 1e-9")
    axes.set(xscale="log", yscale="log")
    axes.set_xticks(list(theirs), [f"{dt_ms:g}" for dt_ms in theirs])
    axes.minorticks_off()


def verdict_table(verdicts: Sequence[Verdict]) -> str:
    """Return the largest differences and who is wrong, for people, as Markdown."""
    cells = [[v.body, v.scene, *(getattr(v, name) for name in PANELS), v.words] for v in verdicts]
    return markdown(["body", "scene", *PANELS.values(), "verdict"], cells)


def remedy_table(rows: Sequence[Remedy]) -> str:
    """Return the largest attitude differences from MuJoCo, rad, by method and step, as Markdown."""
    scenes = list(dict.fromkeys(row.scene for row in rows))
    apart = {(row.method, row.dt_s, row.scene): row.against_mujoco_rad for row in rows}
    methods = list(dict.fromkeys(row.method for row in rows))
    lines = sorted(
        {(row.method, row.dt_s) for row in rows},
        key=lambda line: (methods.index(line[0]), -line[1]),
    )
    cells = [
        [method, 1e3 * dt_s, *(apart[method, dt_s, scene] for scene in scenes)]
        for method, dt_s in lines
    ]
    return markdown(["ours", "dt, ms", *(f"{scene}, rad" for scene in scenes)], cells)
