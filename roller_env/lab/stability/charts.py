"""The stability laboratory's pictures."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roller_env.lab.stability.cases import LimitRow
from roller_env.lab.stability.failure import Failure, FailureRow, Record
from roller_env.lab.stability.hard_cases import HardRow
from roller_env.lab.stability.smooth import (
    RATIOS,
    explicit_damping_limit,
    implicit_damping_limit,
    rk4_servo_limit,
)
from roller_env.lab.stability.tunnelling import WALL_M
from roller_env.lab.style import COLOURS, FAILURE, PREDICTION, STYLE

CURES: Final = ("#2a7f4f", "#2f6db3", "#7a5bb5")
"""Colours of the settings that cure."""

LEAST_OFF: Final = 1e-6
"""Smallest deviation that the chart of limits tells from none."""

LEAST_SHOWN: Final = 1e-3
MOST_SHOWN: Final = 30.0
"""Range of the chart of hard cases."""


def failure_figure(
    failure: Failure, records: Sequence[Record], rows: Sequence[FailureRow]
) -> Figure:
    """Return the failing setting and its cures in one picture, each with what it costs."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 5.8))
        axes = figure.add_axes((0.1, 0.12, 0.86, 0.68 - 0.037 * len(rows)))
        for index, (row, kept) in enumerate(zip(rows, records, strict=True)):
            x, y = failure.curve(kept)
            failing = row.role == "fails"
            axes.plot(
                x,
                y,
                color=FAILURE if failing else CURES[index - 1],
                linewidth=2.2 if failing else 1.8,
                linestyle="-" if failing else ("--", "-.", ":")[index - 1],
                label=_caption(failure, row),
                zorder=2 if failing else 3,
            )
        axes.set(xlabel=failure.x_label, ylabel=failure.y_label)
        if failure.log_y:
            axes.set_yscale("log")
        _decorate(axes, failure.name)
        axes.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), fontsize=9)
        _headline(figure, failure.title, failure.why)
    return figure


def _caption(failure: Failure, row: FailureRow) -> str:
    says = f"{row.setting}: {failure.says.format(row.value)}"
    if row.role == "fails":
        return f"{says}: fails"
    return f"{says}; {row.time_ratio:.2g}× the time, {row.evaluations_ratio:g}× the evaluations"


def _headline(figure: Figure, title: str, why: str) -> None:
    figure.text(0.04, 0.96, title, fontsize=14, fontweight="bold", va="center")
    figure.text(
        0.04,
        0.93,
        textwrap.fill(why, 118),
        fontsize=8.5,
        color="#444444",
        va="top",
        linespacing=1.3,
    )


def _decorate(axes: Axes, name: str) -> None:
    if name == "tunnelling":
        axes.axhspan(-WALL_M, 0.0, color="#9aa0a6", alpha=0.6, zorder=0)
        axes.text(0.5, -WALL_M / 2, "the wall", fontsize=8, va="center")
        axes.set_ylim(-0.42, 0.9)
    elif name == "restitution_gain":
        axes.set_ylim(bottom=1e-3)
    elif name == "crush":
        axes.axhline(0.8128, color=PREDICTION, linewidth=0.9, linestyle=":")
        axes.text(0.02, 0.83, "the ball's height", color=PREDICTION, fontsize=8)
        axes.set_ylim(0.0, 1.25)


def servo_figure(rows: Sequence[LimitRow]) -> Figure:
    """Return the servo's limits, predicted as lines and measured as dots."""
    lines = (
        ("euler_actuator", "MuJoCo Euler", "Euler, actuator damping", explicit_damping_limit),
        ("rk4", "MuJoCo RK4", "RK4", rk4_servo_limit),
        (
            "implicitfast",
            "MuJoCo implicitfast",
            "implicitfast, or Euler with joint damping",
            implicit_damping_limit,
        ),
    )
    measured = {row.name: row.measured for row in rows}
    grid = np.linspace(0.0, 1.25, 120)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 5.2))
        axes = figure.add_axes((0.09, 0.14, 0.86, 0.68))
        for key, method, label, limit in lines:
            colour = COLOURS[method]
            curve = [limit(float(ratio)) for ratio in grid]
            axes.plot(grid, curve, color=colour, linewidth=1.8)
            dots = [measured[f"servo_{key}_{ratio:g}"] for ratio in RATIOS]
            axes.plot(RATIOS, dots, "o", color=colour, markersize=8, label=label)
            axes.fill_between(grid, 0.0, curve, color=colour, alpha=0.05, linewidth=0)
        joint = [measured[f"servo_euler_joint_{ratio:g}"] for ratio in RATIOS]
        axes.plot(RATIOS, joint, "x", color=COLOURS["MuJoCo Euler"], markersize=8)
        axes.set(
            xlabel="damping ratio of the servo",
            ylabel="largest stable step × natural frequency, h w",
            xlim=(-0.03, 1.25),
            ylim=(0.0, 6.0),
        )
        axes.legend(loc="upper left", fontsize=9, title="lines predicted, dots found by bisection")
        _headline(
            figure,
            "How stiff a servo may be for a time step",
            "Below its line a method is stable, above it the servo blows up. More damping helps "
            "where it is taken from after the step, and hurts where it is taken from before. "
            "discrete, not drawn, has no limit (tried up to 20).",
        )
    return figure


def deviation_figure(rows: Sequence[LimitRow]) -> Figure:
    """Return how far measured is from predicted, and how far it may be."""
    shown = [row for row in rows if np.isfinite(row.ratio)]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 1.9 + 0.2 * len(shown)))
        height = figure.get_figheight()
        axes = figure.add_axes((0.33, 0.75 / height, 0.63, 1.0 - 1.75 / height))
        for index, row in enumerate(shown):
            off = row.ratio - 1.0
            allowed = row.band_high - 1.0 if off >= 0.0 else 1.0 - row.band_low
            axes.plot([LEAST_OFF, allowed], [index, index], color="#d5d8dc", linewidth=6)
            colour = CURES[0] if row.verdict == "holds" else FAILURE
            axes.plot(max(abs(off), LEAST_OFF), index, "o", color=colour, markersize=5)
        axes.axvline(0.01, color=PREDICTION, linewidth=0.8)
        axes.set_yticks(range(len(shown)), [row.name for row in shown], fontsize=7)
        axes.set_xscale("log")
        axes.set(
            xlabel="|measured / predicted - 1|; the line is 1 %",
            xlim=(0.7 * LEAST_OFF, 4.0),
            ylim=(len(shown) - 0.4, -0.6),
        )
        axes.grid(axis="y", visible=False)
        _tall_headline(
            figure,
            "How far the limits are from what was predicted",
            "dots: measured; grey: what is allowed, 1 % where the formula is exact",
        )
    return figure


def _tall_headline(figure: Figure, title: str, subtitle: str) -> None:
    height = figure.get_figheight()
    figure.text(0.04, 1.0 - 0.3 / height, title, fontsize=14, fontweight="bold", va="center")
    figure.text(0.04, 1.0 - 0.6 / height, subtitle, fontsize=9, color="#444444", va="center")


def hard_figure(rows: Sequence[HardRow]) -> Figure:
    """Return how near the game's hard cases come to what is acceptable, under every preset."""
    shown = [row for row in rows if row.limit > 0.0]
    lines = list(dict.fromkeys((row.case, row.quantity) for row in shown))
    presets = list(dict.fromkeys(row.preset for row in shown))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 1.9 + 0.25 * len(lines)))
        height = figure.get_figheight()
        axes = figure.add_axes((0.47, 0.75 / height, 0.5, 1.0 - 1.95 / height))
        axes.axvspan(1.0, MOST_SHOWN, color=FAILURE, alpha=0.07, linewidth=0)
        axes.axvline(1.0, color=FAILURE, linewidth=1.0)
        styles = zip(presets, CURES, ("o", "s", "D"), (-0.2, 0.0, 0.2), strict=False)
        for preset, colour, marker, shift in styles:
            own = [row for row in shown if row.preset == preset]
            shares = [max(LEAST_SHOWN, row.value / row.limit) for row in own]
            at = [lines.index((row.case, row.quantity)) + shift for row in own]
            axes.plot(shares, at, marker, color=colour, markersize=5, alpha=0.85, label=preset)
        labels = [f"{case.replace('_', ' ')}: {what}" for case, what in lines]
        axes.set_yticks(range(len(lines)), labels, fontsize=7.5)
        axes.set_xscale("log")
        axes.set(
            xlabel="measured / acceptable (less than a thousandth: at the left)",
            xlim=(0.7 * LEAST_SHOWN, MOST_SHOWN),
            ylim=(len(lines) - 0.4, -0.6),
        )
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(presets), fontsize=9)
        _tall_headline(
            figure,
            "The game's own hard cases, under its three physics presets",
            "right of the line: more than is acceptable, for the reasons in hard_cases.md",
        )
    return figure
