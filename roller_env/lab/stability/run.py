"""What ``scripts/stability.py`` runs, and the files that it leaves."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roller_env.lab import chart, simulate, table
from roller_env.lab.runner import header, known
from roller_env.lab.stability import hard_cases, smooth
from roller_env.lab.stability.cases import QUICK, Case, Effort, judged
from roller_env.lab.stability.failure import Failure, rows, simulated
from roller_env.lab.stability.failures import FAILURES
from roller_env.lab.stability.friction import friction_cases
from roller_env.lab.stability.hard_cases import HARD_CASES
from roller_env.lab.stability.hop import hop_cases
from roller_env.lab.stability.impact import bounce_cases, impact_cases
from roller_env.lab.stability.resting import mocap_cases, resting_cases, seam_cases
from roller_env.lab.stability.tunnelling import WALL_M, tunnelling_cases
from roller_env.lab.table import markdown

_SOURCES: Final = (
    smooth.smooth_cases,
    impact_cases,
    bounce_cases,
    tunnelling_cases,
    friction_cases,
    mocap_cases,
    resting_cases,
    seam_cases,
    hop_cases,
)

CASES: Final[dict[str, Case]] = {case.name: case for cases in _SOURCES for case in cases()}
"""Every predicted limit by name, in the order of the table."""

GROUPS: Final[tuple[str, ...]] = tuple(dict.fromkeys(case.group for case in CASES.values()))
"""What the cases are about."""

SECTIONS: Final = ("limits", "failures", "hard_cases")

Wrap = Callable[[Sequence[str]], Iterable[str]]
"""Goes over names while showing progress."""


@dataclass(frozen=True, slots=True)
class Selection:
    """Names of what is to run, in the order of the registries."""

    limits: tuple[str, ...]
    failures: tuple[str, ...]
    hard_cases: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All of them, with their sections."""
        sections = zip(SECTIONS, (self.limits, self.failures, self.hard_cases), strict=True)
        return tuple(f"{section}/{name}" for section, names in sections for name in names)


@dataclass(slots=True)
class Results:
    """What came out: rows of `judged`, `rows` and `run_case`, and pictures."""

    limits: list[dict[str, Any]] = field(default_factory=list)
    failures: list[dict[str, Any]] = field(default_factory=list)
    hard_cases: list[dict[str, Any]] = field(default_factory=list)
    figures: dict[str, Figure] = field(default_factory=dict)


def select(only: Sequence[str], effort: Effort) -> Selection:
    """Return what ``only`` names: sections, groups of limits, limits, failures or hard cases.

    Args:
        only: names; none means everything. A name that is both a group and a failure
            ("tunnelling") means both.
        effort: a quick one leaves out the slow limits, unless they are named themselves.

    Raises:
        ValueError: a name that nothing has; the message has the nearest one.
    """
    for name in only:
        known("case", name, [*SECTIONS, *GROUPS, *CASES, *FAILURES, *HARD_CASES])
    wanted = set(only) or set(SECTIONS)
    return Selection(
        limits=tuple(
            name
            for name, case in CASES.items()
            if name in wanted
            or (wanted & {"limits", case.group} and (case.quick or effort != QUICK))
        ),
        failures=tuple(name for name in FAILURES if wanted & {name, "failures"}),
        hard_cases=tuple(name for name in HARD_CASES if wanted & {name, "hard_cases"}),
    )


def run(selection: Selection, effort: Effort, wrap: Wrap) -> Results:
    """Measure everything selected.

    Args:
        selection: what.
        effort: how hard.
        wrap: goes over ``selection.names``; shows progress.
    """
    results = Results()
    for full_name in wrap(selection.names):
        section, _, name = full_name.partition("/")
        if section == "limits":
            results.limits.append(judged(CASES[name], effort))
        elif section == "failures":
            failure = FAILURES[name]()
            paths = [simulated(setting, failure.seconds) for setting in failure.settings]
            found = rows(failure, paths, repeats=effort.repeats)
            results.failures += found
            results.figures[name] = draw_failure(failure, paths, found)
        else:
            found = hard_cases.run_case(HARD_CASES[name], hard_cases.ALL_PRESETS, effort)
            results.hard_cases += found
    names = {row["name"] for row in results.limits}
    if names >= {name for name, case in CASES.items() if case.group == "servo"}:
        results.figures["servo"] = draw_servos(results.limits)
    if any(math.isfinite(row["ratio"]) for row in results.limits):
        results.figures["limits"] = draw_limits(results.limits)
    if results.hard_cases:
        results.figures["hard_cases"] = draw_hard_cases(results.hard_cases)
    return results


def write(results: Results, facts: dict[str, str], directory: Path) -> list[Path]:
    """Write CSV, JSON, Markdown and pictures; return what was written."""
    written: list[Path] = []
    for name, found, said in (
        ("limits", results.limits, limits_table),
        ("failures", results.failures, failures_table),
        ("hard_cases", results.hard_cases, hard_cases_table),
    ):
        if found:
            written += table.write(table.frame(found), facts, directory / name)
            text = directory / f"{name}.md"
            text.write_text(f"{said(results)}\n{header(facts)}\n", encoding="utf-8")
            written.append(text)
    for name, figure in results.figures.items():
        written += chart.save(figure, facts, directory / "pictures" / name)
    return written


# Tables --------------------------------------------------------------------------------------


def limits_table(results: Results) -> str:
    """Return the predicted and measured limits as Markdown, with the notes below."""
    cells = [
        (
            *(row[name] for name in ("name", "quantity", "method", "formula")),
            _limit(row["predicted"], row["searched_to"]),
            _limit(row["measured"], row["searched_to"]),
            f"{row['ratio']:.4f}" if math.isfinite(row["ratio"]) else "",
            f"{row['band_low']:g} to {row['band_high']:g}" if math.isfinite(row["ratio"]) else "",
            row["verdict"],
        )
        for row in results.limits
    ]
    titles = ("name", "what", "method", "formula", "predicted", "measured", "ratio", "band", "")
    return markdown(titles, cells) + _notes(results.limits, "name", "note")


def failures_table(results: Results) -> str:
    """Return what fails, what cures it and what the cure costs, as Markdown."""
    cells = [
        (
            *(row[name] for name in ("failure", "setting", "role", "quantity")),
            f"{row['value']:.3g}",
            f"{row['acceptable']:.3g}",
            row["verdict"] if row["as_expected"] else f"{row['verdict']}, unexpectedly",
            f"{row['time_ratio']:.2f}",
            f"{row['evaluations_ratio']:g}",
        )
        for row in results.failures
    ]
    titles = ("failure", "setting", "role", "what", "measured", "acceptable", "", "time",
              "evaluations")  # fmt: skip
    return markdown(titles, cells) + _notes(results.failures, "failure", "why")


def hard_cases_table(results: Results) -> str:
    """Return the game's hard cases as Markdown, a column a preset; in bold what is too much."""
    presets = tuple(dict.fromkeys(row["preset"] for row in results.hard_cases))
    lines: dict[tuple[str, str], dict[str, dict[str, Any]]] = {}
    for row in results.hard_cases:
        lines.setdefault((row["case"], row["quantity"]), {})[row["preset"]] = row
    cells = []
    for (case, quantity), own in lines.items():
        values = [
            f"**{own[name]['value']:.3g}**"
            if own[name]["verdict"] == "fails"
            else f"{own[name]['value']:.3g}"
            for name in presets
        ]
        first = own[presets[0]]
        cells.append((case, quantity, *values, f"{first['limit']:.3g}", first["reason"]))
    titles = ("case", "what", *presets, "acceptable", "since")
    return markdown(titles, cells) + _notes(results.hard_cases, "case", "note")


def summary(results: Results) -> Iterator[str]:
    """Yield one line a section: how many held, and the names of those that did not."""
    for found, what, odd in (
        (
            results.limits,
            "predictions hold",
            [row["name"] for row in results.limits if row["verdict"] == "differs"],
        ),
        (
            results.failures,
            "failures and cures are as expected",
            [f"{row['failure']}: {row['setting']}" for row in results.failures
             if not row["as_expected"]],
        ),
        (
            results.hard_cases,
            "readings of hard cases are acceptable",
            [f"{row['case']} ({row['preset']}, {row['quantity']})" for row in results.hard_cases
             if row["verdict"] == "fails"],
        ),
    ):  # fmt: skip
        if found:
            line = f"{len(found) - len(odd)} of {len(found)} {what}"
            yield line + (f"; not: {', '.join(odd)}" if odd else "")


def _limit(value: float, searched_to: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else f"none to {searched_to:g}"


def _notes(found: Sequence[Mapping[str, Any]], name: str, note: str) -> str:
    notes = {row[name]: row[note] for row in found if row[note]}
    return "".join(f"\n- `{who}`: {text}" for who, text in notes.items()) + "\n"


# Pictures ------------------------------------------------------------------------------------


def draw_failure(
    failure: Failure, paths: Sequence[simulate.Path], found: Sequence[Mapping[str, Any]]
) -> Figure:
    """Draw the failing setting and its cures in one picture, each with what it costs."""
    lines = math.ceil(len(failure.why) / 118)
    figure, ((axes,),) = chart.grid(
        (1, 1),
        failure.title,
        failure.why,
        panel=(6.9, 3.6),
        margins=(0.9, 0.3, 0.7 + 0.19 * (lines + len(found)), 0.7),
    )
    with matplotlib.rc_context(chart.STYLE):
        for index, (row, path) in enumerate(zip(found, paths, strict=True)):
            says = f"{row['setting']}: {failure.says.format(row['value'])}"
            style: dict[str, Any] = {"color": chart.FAILURE, "lw": 2.2, "label": f"{says}: fails"}
            if index:
                style = {
                    "color": chart.SERIES[index - 1],
                    "ls": ("--", "-.", ":")[index - 1],
                    "lw": 1.8,
                    "label": f"{says}; {row['time_ratio']:.2g}× the time, "
                    f"{row['evaluations_ratio']:g}× the evaluations",
                }
            axes.plot(*failure.curve(path), **style)
        axes.set(xlabel=failure.x_label, ylabel=failure.y_label)
        if failure.log_y:
            axes.set_yscale("log")
        _decorate(axes, failure.name)
        axes.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), fontsize=9)
    return figure


def _decorate(axes: Axes, name: str) -> None:
    if name == "tunnelling":
        axes.axhspan(-WALL_M, 0.0, color="#9aa0a6", alpha=0.6, zorder=0)
        axes.text(0.5, -WALL_M / 2, "the wall", fontsize=8, va="center")
        axes.set_ylim(-0.42, 0.9)
    elif name == "restitution_gain":
        axes.set_ylim(bottom=1e-3)
    elif name == "crush":
        axes.axhline(0.8128, color=chart.PREDICTION, linewidth=0.9, linestyle=":")
        axes.text(0.02, 0.83, "the ball's height", color=chart.PREDICTION, fontsize=8)
        axes.set_ylim(0.0, 1.25)


def draw_servos(found: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw the servo's limits, predicted as lines and measured as dots."""
    lines = (
        ("euler_actuator", "MuJoCo Euler", "Euler, actuator damping",
         smooth.explicit_damping_limit),
        ("rk4", "MuJoCo RK4", "RK4", smooth.rk4_servo_limit),
        ("implicitfast", "MuJoCo implicitfast", "implicitfast, or Euler with joint damping",
         smooth.implicit_damping_limit),
    )  # fmt: skip
    measured = {row["name"]: row["measured"] for row in found}
    ratios = np.linspace(0.0, 1.25, 120)
    figure, ((axes,),) = chart.grid(
        (1, 1),
        "How stiff a servo may be for a time step",
        "Below its line a method is stable, above it the servo blows up. More damping helps where "
        "it is taken from after the step, and hurts where it is taken from before. discrete, not "
        "drawn, has no limit (tried up to 20). Lines predicted, dots found by bisection.",
        panel=(6.9, 3.6),
        margins=(0.9, 0.3, 1.2, 0.7),
    )
    with matplotlib.rc_context(chart.STYLE):
        for key, method, label, limit in lines:
            colour = chart.colour(method)
            curve = [limit(float(ratio)) for ratio in ratios]
            axes.plot(ratios, curve, color=colour, linewidth=1.8)
            dots = [measured[f"servo_{key}_{ratio:g}"] for ratio in smooth.RATIOS]
            axes.plot(smooth.RATIOS, dots, "o", color=colour, markersize=8, label=label)
        joint = [measured[f"servo_euler_joint_{ratio:g}"] for ratio in smooth.RATIOS]
        axes.plot(smooth.RATIOS, joint, "x", color=chart.colour("MuJoCo Euler"), markersize=8)
        axes.set(xlim=(-0.03, 1.25), ylim=(0.0, 6.0), xlabel="damping ratio of the servo")
        axes.set_ylabel("largest stable step × natural frequency, h w")
        axes.legend(loc="upper left", fontsize=9)
    return figure


def draw_limits(found: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw how far measured is from predicted, and how far it may be."""

    def shown(row: Mapping[str, Any]) -> chart.Row:
        off = row["ratio"] - 1.0
        allowed = row["band_high"] - 1.0 if off >= 0.0 else 1.0 - row["band_low"]
        return chart.Row(row["name"], abs(off), (1e-6, allowed), row["verdict"] == "holds")

    return chart.against_limits(
        [shown(row) for row in found if math.isfinite(row["ratio"])],
        "How far the limits are from what was predicted",
        "Dots: measured; grey: what is allowed, 1 % where the formula is exact.",
        "|measured / predicted - 1|; the line is 1 %",
        (1e-6, 4.0),
        limit=0.01,
        label_in=2.8,
    )


def draw_hard_cases(found: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw how near the game's hard cases come to what is acceptable, under every preset."""
    shown = [
        chart.Row(
            textwrap.shorten(f"{row['case'].replace('_', ' ')}: {row['quantity']}", 70),
            row["value"] / row["limit"],
            series=row["preset"],
        )
        for row in found
        if row["limit"] > 0.0
    ]
    return chart.against_limits(
        shown,
        "The game's own hard cases, under its three physics presets",
        "Right of the line: more than is acceptable, for the reasons in hard_cases.md.",
        "measured / acceptable (less than a thousandth: at the left)",
        (1e-3, 30.0),
        label_in=4.6,
    )
