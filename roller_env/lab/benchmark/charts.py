"""The pictures of the ratios: how they stand to their goals, and where the time goes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import matplotlib
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from roller_env.lab.benchmark.breakdown import PARTS, PartRow
from roller_env.lab.benchmark.goals import GoalRow
from roller_env.lab.style import FAILURE, STYLE, save

_MET: Final = "#3a8f5c"
_ABSENT: Final = "#bdbdbd"
_INK: Final = "#333333"
_QUIET: Final = "#666666"
_MEASURED_AT: Final = 1.03
_GOAL_AT: Final = 1.2
"""Where the columns right of the bars stand, in widths of the panel."""
_LIGHT_SUM: Final = 1.9
"""Of red, green and blue from 0 to 1 each: on lighter colours white cannot be read."""

_COLOURS: Final = dict(
    zip(
        PARTS,
        (
            *("#1f4e8c", "#7fb2e5"),  # physics
            *("#1b998b", "#9bd3a8", "#3a8f5c"),  # observation, reward, rules
            *("#b58900", "#e3c567"),  # Python
            *("#f0a58f", "#d1495b", "#c77dba", "#7a5bb5"),  # training
            "#9a9a9a",
        ),
        strict=True,
    )
)
_LIGHT: Final = frozenset(
    part for part, colour in _COLOURS.items() if sum(to_rgb(colour)) > _LIGHT_SUM
)


def draw_goals(
    rows: Sequence[GoalRow], title: str, facts: dict[str, str], stem: Path
) -> tuple[Path, Path]:
    """Draw what was measured against its goal, better to the right; return PNG and SVG."""
    with matplotlib.rc_context(STYLE):
        height = 2.1 + 0.5 * len(rows)
        figure = Figure(figsize=(12.0, height))
        panel = figure.subplots()
        figure.subplots_adjust(left=0.38, right=0.8, top=1.0 - 1.1 / height, bottom=0.9 / height)
        figure.text(0.02, 1.0 - 0.4 / height, title, fontsize=15, weight="bold")
        for place, row in enumerate(rows):
            _draw_goal(panel, place, row)
        panel.axvline(1.0, color=_INK, linewidth=1.2)
        panel.text(1.0, -0.62, "goal", ha="center", va="bottom", color=_INK)
        for at, heading in ((_MEASURED_AT, "measured"), (_GOAL_AT, "goal")):
            right = panel.get_yaxis_transform()
            panel.text(at, -0.62, heading, transform=right, va="bottom", color=_QUIET)
        panel.set_ylim(len(rows) - 0.45, -0.6)
        panel.set_xscale("log")
        panel.set_xlim(*_limits(rows))
        panel.xaxis.set_major_locator(LogLocator(base=2.0))
        panel.xaxis.set_minor_locator(NullLocator())
        panel.set_yticks(range(len(rows)), [row.comparison for row in rows])
        panel.tick_params(axis="y", length=0)
        panel.grid(visible=False, axis="y")
        panel.set_axisbelow(True)
        panel.spines["left"].set_visible(False)
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panel.set_xlabel(
            "times the goal, better to the right; the thin line is the range of the rounds",
            color=_QUIET,
        )
        return save(figure, facts, stem)


def _draw_goal(panel: Axes, place: int, row: GoalRow) -> None:
    right = panel.get_yaxis_transform()
    wanted = f"{'≥' if row.sense == 'at least' else '≤'} {row.goal:g}"
    if row.verdict == "not measured":
        panel.plot(1.0, place, marker="o", color="white", markeredgecolor=_ABSENT)
        text, colour = "not measured", _QUIET
    else:
        colour = _MET if row.verdict == "met" else FAILURE
        value = _reached(row, row.measured)
        panel.barh(place, value - 1.0, left=1.0, height=0.5, color=colour, alpha=0.85)
        ends = sorted(_reached(row, end) for end in (row.smallest, row.largest))
        panel.plot(ends, [place, place], color=_INK, linewidth=1.2, solid_capstyle="butt")
        text = f"{row.measured:.3g}"
    panel.text(_MEASURED_AT, place, text, transform=right, va="center", color=colour)
    panel.text(_GOAL_AT, place, wanted, transform=right, va="center", color=_QUIET)


def _reached(row: GoalRow, value: float) -> float:
    """Return a value as a share of its goal that is 1 at the goal and grows with merit."""
    return value / row.goal if row.sense == "at least" else row.goal / value


def _limits(rows: Sequence[GoalRow]) -> tuple[float, float]:
    """Return the ends of an axis on which all ranges and both sides of the goal can be seen."""
    ends = [_reached(row, end) for row in rows for end in (row.smallest, row.largest)]
    known = [end for end in ends if not math.isnan(end)]
    return min([*known, 0.5]) / 1.2, max([*known, 2.0]) * 1.2


def draw_parts(
    rows: Sequence[PartRow], title: str, facts: dict[str, str], stem: Path
) -> tuple[Path, Path]:
    """Draw where the time of every profiled step goes, one bar each; return PNG and SVG."""
    whats = list(dict.fromkeys(row.what for row in rows))
    present = {row.part for row in rows}
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 2.6 + 0.7 * len(whats)))
        panel = figure.subplots()
        height = figure.get_figheight()
        figure.subplots_adjust(left=0.2, right=0.97, top=1.0 - 0.7 / height, bottom=1.6 / height)
        figure.text(0.02, 1.0 - 0.4 / height, title, fontsize=15, weight="bold")
        for place, what in enumerate(whats):
            _draw_bar(panel, place, [row for row in rows if row.what == what])
        for part in PARTS:
            if part in present:
                panel.barh(0, 0.0, color=_COLOURS[part], label=part)
        figure.legend(loc="lower center", bbox_to_anchor=(0.5, 0.25 / height), ncols=4, fontsize=9)
        panel.set_ylim(len(whats) - 0.4, -0.6)
        panel.set_yticks(range(len(whats)), [_named(what, rows) for what in whats])
        panel.tick_params(axis="y", length=0)
        panel.grid(visible=False, axis="y")
        panel.set_axisbelow(True)
        panel.spines["left"].set_visible(False)
        panel.set_xlim(0.0, 1.0)
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.0f} %"))
        return save(figure, facts, stem)


def _draw_bar(panel: Axes, place: int, rows: Sequence[PartRow]) -> None:
    left = 0.0
    for row in sorted(rows, key=lambda row: PARTS.index(row.part)):
        panel.barh(place, row.share, left=left, height=0.55, color=_COLOURS[row.part])
        if row.share > 0.035:
            middle = left + 0.5 * row.share
            label = f"{100 * row.share:.0f} %"
            ink = _INK if row.part in _LIGHT else "white"
            panel.text(middle, place, label, ha="center", va="center", color=ink, fontsize=9)
        left += row.share


def _named(what: str, rows: Sequence[PartRow]) -> str:
    whole = sum(row.us_per_env_step for row in rows if row.what == what)
    return f"{what}\n{whole:,.0f} µs an env. step"
