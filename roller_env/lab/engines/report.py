"""The experiment of ``scripts/engines.py``: both engines side by side, as tables and a chart."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure
from pandas import concat

from roller_env.lab import chart, pages
from roller_env.lab.engines import agreement, courses, robustness, speed
from roller_env.lab.engines.cases import CASES, STARTS, readings
from roller_env.lab.engines.curves import catalogue
from roller_env.lab.runner import header
from roller_env.lab.table import Frame, frame, markdown
from roller_env.physics.presets import PRESETS, PhysicsPreset
from roller_env.physics.rigid.law import COULOMB, RELAXED

LEVELS: Final = ("flat", "bridge", "lift", "gate", "classic")

CAPS_S: Final = (1 / 60, 1 / 120, 1 / 240)

EXACT_M: Final = 1e-9
"""What is nearer is so by a closed form; contacts are kept half of it open."""

COMMAND: Final = "python scripts/engines.py --docs docs"

BESIDE: Final = PhysicsPreset(
    "RK4, 1/3840 s", dt_s=1 / 3840, integrator="RK4", iterations=100, tolerance=1e-14
)
"""MuJoCo, where the engines are compared on faces."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is measured."""

    balls: int  # on courses
    steps: int  # random control steps on each level, by each law
    looked_at: int  # of which every so manieth
    scenes: int  # of turned boxes
    rounds: int  # turns over which costs are medians
    costed: int  # balls of a turn
    further: Sequence[PhysicsPreset]  # MuJoCo on the chart, besides the presets
    reference: PhysicsPreset  # MuJoCo's converged ball
    beside: PhysicsPreset


FULL: Final = Effort(96, 20_000_000, 64, 1000, 9, 64, speed.RATES, courses.REFERENCE, BESIDE)
_COARSE: Final = PhysicsPreset("RK4, 1/960 s", dt_s=1 / 960, integrator="RK4", iterations=50)
QUICK: Final = Effort(8, 20_000, 4, 5, 2, 8, speed.RATES[:2], _COARSE, _COARSE)

Watched = Callable[[Sequence[str]], Iterable[str]]
"""Goes over names while it shows progress."""


def measure(effort: Effort, watched: Watched) -> dict[str, Frame]:
    """Measure everything, and return tables by name: what `tables` shows."""
    measures: dict[str, Callable[[], Frame]] = {
        "cases": _cases,
        "curves": _curves,
        "faces": lambda: frame(agreement.rows(LEVELS, effort.beside, effort.balls)),
        "laws": lambda: frame(
            courses.law_rows(LEVELS, effort.balls, references=[effort.reference])
        ),
        "caps": lambda: frame(courses.cap_rows(LEVELS, effort.balls)),
        "robustness": lambda: _robustness(effort),
        "speed": lambda: frame(
            speed.points(
                effort.balls, effort.rounds, effort.costed, effort.reference, effort.further
            )
        ),
    }
    return {name: measures[name]() for name in watched(list(measures))}


def _cases() -> Frame:
    """Return a row a case and preset: ``lowest`` and ``highest`` reading of all starts."""
    rows = []
    for case in CASES:
        for preset in PRESETS.values():
            lowest, highest = readings(case, preset)
            rows.append(
                {
                    "kind": case.kind,
                    "case": case.name,
                    "unit": case.unit,
                    "exact": case.exact,
                    "preset": preset.name,
                    "lowest": lowest,
                    "highest": highest,
                }
            )
    return Frame(rows)


def _curves() -> Frame:
    """Return a row a motion: its error at each cap, and the order between the first two."""
    rows = []
    for curve in catalogue():
        errors = [curve.error(cap_s) for cap_s in CAPS_S]
        row: dict[str, Any] = {"motion": curve.name}
        row |= {f"1/{round(1 / cap_s)}": e for cap_s, e in zip(CAPS_S, errors, strict=True)}
        order = math.log2(errors[0] / errors[1])
        rows.append(row | {"order": "exact" if errors[0] < EXACT_M else f"{order:.1f}"})
    return Frame(rows)


def _robustness(effort: Effort) -> Frame:
    rows = []
    for law, called in ((COULOMB, "rigid"), (RELAXED, "relaxed")):
        own = [
            *robustness.level_rows(LEVELS, effort.steps, law=law, every=effort.looked_at),
            robustness.box_row(effort.scenes, law),
        ]
        rows.append(frame(own).assign(preset=called))
    return concat(rows, ignore_index=True)


def write(measured: dict[str, Frame], facts: dict[str, str], out: Path) -> list[Path]:
    """Write everything; return the files."""
    page = f"{header(facts)}\n\n{tables(measured)}"
    figures = {"engines": draw(measured["speed"])}
    return chart.write(out, facts, measured, figures, ("engines", page))


def publish(out: Path, docs: Path) -> list[Path]:
    """Put what `write` has left in ``out`` into the documentation; return the files changed.

    Raises:
        ValueError: the page has not exactly one place for the tables; nothing is changed then.
    """
    pictures = {out / "engines.png": docs / "images" / "engines.png"}
    return pages.publish(docs / "engines.md", COMMAND, out / "engines.md", pictures)


def tables(measured: dict[str, Frame]) -> str:
    """Return everything in Markdown."""
    return "\n".join(
        [
            "### What each preset makes of it\n",
            f"Lowest to highest of {STARTS} arrivals at different moments of a step; one figure "
            "where they agree to 1 %, or where there is one start.\n",
            *(
                _case_table(measured["cases"], kind)
                for kind in dict.fromkeys(measured["cases"].kind)
            ),
            "### Motions that turn: metres from DOP853, by the cap\n",
            markdown(measured["curves"]),
            "### On faces: `rigid` and MuJoCo until a ball touches an edge or a second solid\n",
            _named(
                measured["faces"],
                {
                    "level": "level",
                    "balls": "balls",
                    "seconds": "seconds, mean",
                    "median_m": "median, m",
                    "worst_m": "worst, m",
                    "worst_rad": "attitude, rad",
                },
            ),
            "### Whole courses: the engine's laws against MuJoCo, over the way after 1 s, mean\n",
            _law_table(measured["laws"]),
            "### The cap: 1/120 s against 1/960 s, over the way after 3 s\n",
            _named(
                measured["caps"],
                {"level": "level", "median": "median", "mean": "mean", "worst": "worst"},
            ),
            "### Random steps\n",
            _named(
                measured["robustness"],
                {
                    "preset": "preset",
                    "scene": "scene",
                    "steps": "steps",
                    "forced": "forced",
                    "unsolved": "unsolved",
                    "depth_m": "depth, m",
                    "gained_j": "energy gained, J",
                },
            ),
            "### Speed against accuracy\n",
            _named(
                measured["speed"],
                {
                    "preset": "preset",
                    "ms_per_s": "CPU ms for a simulated second",
                    "from_rigid": "from the rigid ball",
                    "from_mujoco": "from MuJoCo's limit",
                },
            ),
        ]
    )


def _named(rows: Frame, columns: dict[str, str]) -> str:
    return markdown(rows[list(columns)].rename(columns=columns))


def _law_table(laws: Frame) -> str:
    """Return the mean distance from MuJoCo by level and law."""
    means = laws.pivot_table("mean", ["other", "level"], "one", sort=False).reset_index()
    return markdown(means.rename(columns={"other": "MuJoCo"}))


def _case_table(cases: Frame, kind: str) -> str:
    """Return the cases of a kind, a row each, and a column a preset."""
    own = cases[cases.kind == kind]
    rows = []
    for name, readings_of in own.groupby("case", sort=False):
        first = readings_of.iloc[0]
        said = [f"{name}, {first.unit}".removesuffix(", "), _figure(first.exact)]
        by_preset = readings_of.set_index("preset")
        said += [_span(*by_preset.loc[preset, ["lowest", "highest"]]) for preset in PRESETS]
        rows.append(said)
    return markdown((kind, "rigid answer", *(f"`{name}`" for name in PRESETS)), rows)


def _span(lowest: float, highest: float) -> str:
    if lowest == highest or abs(highest - lowest) <= 0.01 * max(abs(lowest), abs(highest)):
        return _figure(highest)
    return f"{_figure(lowest)} to {_figure(highest)}"


def _figure(value: float) -> str:
    if math.isinf(value):
        return "never"
    return "0" if value == 0.0 else f"{value:.2g}" if abs(value) < 0.1 else f"{value:.3g}"


_OF_ENGINE: Final = {"mujoco": chart.SERIES[0], "rigid": chart.SERIES[2]}
_LEAST: Final = 1e-5
"""Errors below it are drawn at it."""


@chart.styled
def draw(points: Frame) -> Figure:
    """Draw what a simulated second costs against how far it is off, by both references."""
    figure, panels = chart.grid(
        (1, 2),
        "Two engines: what a second costs, and how far off it ends",
        f"Balls under random keys on {speed.LEVEL} for one second; mean distance over the way. "
        "Left from the rigid ball (Newton, Coulomb), right from what MuJoCo's own contacts "
        "approach as its step vanishes: two laws of friction. Lower left is better.",
        panel=(5.4, 4.2),
        margins=(0.9, 0.4, 1.2, 0.8),
        sharey=True,
    )
    titles = {
        "from_rigid": "from the rigid ball, cap 1/960 s",
        "from_mujoco": "from MuJoCo, RK4 at 1/15360 s",
    }
    for axes, (column, title) in zip(panels[0], titles.items(), strict=True):
        mujoco = points[(points.engine == "mujoco") & (points.preset != "accurate")]
        line = mujoco.sort_values("ms_per_s")
        own: dict[str, Any] = {"color": _OF_ENGINE["mujoco"], "lw": 1.2, "zorder": 1}
        axes.plot(line.ms_per_s, line[column], label="MuJoCo, implicitfast, by its step", **own)
        for row in points.itertuples():
            of = {"mujoco": "MuJoCo", "rigid": "the rigid-ball engine"}[row.engine]
            named = row.preset in PRESETS
            mark: dict[str, Any] = {"marker": "o", "ms": 11 if named else 5, "ls": ""}
            error = max(getattr(row, column), _LEAST)
            mark["label"] = f"presets of {of}" if named else None
            axes.plot(row.ms_per_s, error, color=_OF_ENGINE[row.engine], **mark)
        axes.set(xscale="log", yscale="log", ylim=(0.6 * _LEAST, 0.03), xlim=(0.01, 50.0))
        axes.set_xlabel("CPU milliseconds for a simulated second of one ball")
        axes.set_title(title, loc="left", fontsize=10, weight="bold")
        chart.plain(axes.xaxis)
        chart.label(
            axes,
            [
                (_said(row, column), row.ms_per_s, max(getattr(row, column), _LEAST), "#111111")
                for row in points.itertuples()
            ],
        )
    panels[0, 0].set_ylabel("distance over the way")
    chart.legend_of(figure, panels[0, 0], columns=3)
    return figure


def _said(row: Any, column: str) -> str:
    error = getattr(row, column)
    if row.preset not in PRESETS:
        return f"{row.preset} s"
    return f"{row.preset}: {'< 1e-9' if error < 1e-9 else f'{error:.1e}'}"


def summary(measured: dict[str, Frame]) -> list[str]:
    """Return what a run found, a line each."""
    points = measured["speed"].set_index("preset")
    forced = measured["robustness"]
    curves = measured["curves"]
    ratio = points.ms_per_s["default"] / points.ms_per_s["rigid"]
    return [
        f"a second of rigid costs 1/{ratio:.0f} of default's",
        f"relaxed is {points.from_mujoco['relaxed']:.1e} of the way from MuJoCo's limit, default "
        f"{points.from_mujoco['default']:.1e}, accurate {points.from_mujoco['accurate']:.1e}",
        f"on faces rigid and MuJoCo part by at most {measured['faces'].worst_m.max():.1e} m",
        f"from DOP853 at a cap of 1/120 s: at most {curves['1/120'].max():.1e} m",
        f"{forced.steps.sum():,} random steps: {forced.forced.sum()} forced, "
        f"{forced.unsolved.sum()} unsolved, {forced.depth_m.max():.1e} m deep",
    ]
