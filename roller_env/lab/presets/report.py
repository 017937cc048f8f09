"""The experiment of ``scripts/presets.py``: errors beside costs, as tables, charts and a page."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from roller_env.lab import chart, pages
from roller_env.lab.methods import without_warnings
from roller_env.lab.presets.costs import AS_CHOSEN, Games, costs
from roller_env.lab.presets.errors import REFERENCE_HZ, REQUIREMENTS, errors_of, violations
from roller_env.lab.presets.settings import FEW, SETTINGS
from roller_env.lab.runner import header
from roller_env.lab.table import Frame, markdown
from roller_env.level import load_level
from roller_env.physics.presets import MUJOCO_PRESETS


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is measured."""

    settings: tuple[str, ...]  # names in the catalogue
    reference_hz: int  # steps a second of the converged model
    rounds: int  # turns over which costs are medians
    boxes: tuple[int, ...]  # of the levels of boxes
    games: int  # that are stepped together where costs are measured


FULL: Final = Effort(tuple(SETTINGS), REFERENCE_HZ, 15, (60, 100, 200, 300, 600), 64)
QUICK: Final = Effort(FEW, reference_hz=1920, rounds=2, boxes=(60, 200), games=4)


def measure(effort: Effort, watched: Callable[[Sequence[str]], Iterable[str]]) -> Frame:
    """Measure all settings; ``watched`` goes over names while showing progress.

    Returns:
        A row a setting, the cheapest first: the errors of `roller_env.lab.presets.errors`;
        ``setting``, ``knob``, ``dt_s``; ``us_per_step`` (CPU, on the classic level) and
        ``cpu_s_per_s`` (of a simulated second of one game) with their ``spread``; ``violations``;
        ``front``: whether it has none, and nothing without is both cheaper and truer on the course.
    """
    settings, level = {name: SETTINGS[name] for name in effort.settings}, load_level("classic")
    with without_warnings():
        errors = {
            name: errors_of(settings[name], effort.reference_hz) for name in watched(list(settings))
        }
        games = {
            name: Games(setting.compile(level).model, level, effort.games)
            for name, setting in settings.items()
        }
        taken = costs(games, effort.rounds)
    rows = Frame([errors[name] | taken[name] for name in settings])
    rows["setting"] = list(settings)
    rows["knob"] = [setting.knob for setting in settings.values()]
    rows["dt_s"] = [setting.preset.dt_s for setting in settings.values()]
    rows["cpu_s_per_s"] = 1e-6 * rows.us_per_step / rows.dt_s
    found = [violations(errors[name]) for name in settings]
    rows["violations"] = ["; ".join(one.title for one in own) for own in found]
    sound = rows[rows.violations == ""]
    best = front({row.setting: (row.cpu_s_per_s, row.course) for row in sound.itertuples()})
    rows["front"] = rows.setting.isin(best)
    return rows.sort_values("cpu_s_per_s", ignore_index=True)


def front(points: Mapping[str, tuple[float, float]]) -> set[str]:
    """Return the names of the points that no other is below in one and not above in the other."""
    return {
        name
        for name, (x, y) in points.items()
        if not any(a <= x and b <= y and (a, b) != (x, y) for a, b in points.values())
    }


_COLUMNS: Final[Mapping[str, tuple[str, float]]] = {
    "µs a step": ("us_per_step", 1.0),
    "CPU ms per s": ("cpu_s_per_s", 1e3),
    "course %": ("course", 100.0),
    "path %": ("path", 100.0),
    "landing": ("landing_share", 1.0),
    "elasticity": ("elasticity", 1.0),
    "friction": ("friction", 1.0),
    "seam mm": ("seam_mm", 1.0),
    "hop mm": ("hop_mm", 1.0),
    "rest mm": ("rest_mm", 1.0),
    "lane mm": ("lane_mm", 1.0),
    "lane %": ("lane_share", 100.0),
    "squeeze mm": ("squeeze_mm", 1.0),
}
"""Of the table: a title, the column, and by what it is multiplied."""

_PUBLISHED: Final[Mapping[str, str]] = {
    "front": "presets.png",
    "requirements": "presets-requirements.png",
    "ablations": "presets-ablations.png",
}
"""The pictures by their name in a run and in the documentation."""


def write(settings: Frame, ablations: Frame, facts: dict[str, str], out: Path) -> list[Path]:
    """Write everything; return the files."""
    figures = {
        "front": draw_front(settings),
        "requirements": draw_requirements(settings),
        "ablations": draw_ablations(ablations),
    }
    page = f"{header(facts)}\n\n{tables(settings, ablations)}"
    rows = {"settings": settings, "ablations": ablations}
    return chart.write(out, facts, rows, figures, ("presets", page))


def publish(out: Path, docs: Path) -> list[Path]:
    """Put what `write` has left in ``out`` into the documentation; return the files changed.

    Raises:
        ValueError: the page has not exactly one place for the tables; nothing is changed then.
    """
    pictures = {
        out / f"{name}.png": docs / "images" / published for name, published in _PUBLISHED.items()
    }
    command = "python scripts/presets.py --docs docs"
    return pages.publish(docs / "presets.md", command, out / "presets.md", pictures)


def tables(settings: Frame, ablations: Frame) -> str:
    """Return the tables in Markdown, presets first and all settings folded away."""
    modelled = Frame(
        {
            "boxes": ablations.boxes,
            "modelled": ablations.what,
            "geoms": ablations.geoms,
            "µs a step": ablations.us_per_step,
            "same to the bit": ablations.same_bits.map({True: "yes", False: "no"}),
        }
    )
    classic = modelled[modelled.boxes == 0].drop(columns="boxes")
    sizes = modelled[modelled.boxes > 0].drop(columns="geoms")
    limits = [
        [f"{one.title}, {one.unit}".removesuffix(", "), one.limit, one.reason]
        for one in REQUIREMENTS
    ]
    parts = [
        _settings_table(settings[settings.setting.isin(list(MUJOCO_PRESETS))]),
        f"<details><summary>All {len(settings)} settings, the cheapest first</summary>\n",
        _settings_table(settings),
        "</details>\n",
        markdown(classic.rename(columns={"modelled": "classic level"})),
        markdown(sizes),
        markdown(("requirement", "at most", "why"), limits),
    ]
    return "\n".join(parts)


def _settings_table(settings: Frame) -> str:
    names = settings.setting.mask(settings.front, "**" + settings.setting + "**")
    shown = {title: settings[column] * scale for title, (column, scale) in _COLUMNS.items()}
    violated = settings.violations.replace("", "-")
    return markdown(Frame({"setting": names, **shown, "violations": violated}))


def summary(settings: Frame, ablations: Frame) -> list[str]:
    """Return what a run found, a line each."""
    lines = []
    for row in settings[settings.setting.isin(list(MUJOCO_PRESETS))].itertuples():
        state = f"violates {row.violations}" if row.violations else "meets every requirement"
        place = "on the front" if row.front else "not on the front"
        lines.append(
            f"{row.setting}: {100 * row.course:.2f} % of the way on the course, "
            f"{1e3 * row.cpu_s_per_s:.2f} CPU ms a second, {state}, {place}"
        )
    lines.append("front: " + ", ".join(settings[settings.front].setting))
    grown = ablations[(ablations.boxes > 0) & ablations.chosen]
    few, many = grown.iloc[0], grown.iloc[-1]
    ratio = many.us_per_step / few.us_per_step
    lines.append(f"a step on {many.boxes} boxes costs {ratio:.2f} of one on {few.boxes}")
    return lines


_KNOBS: Final = {
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
_SHOWN_PERCENT: Final = (0.03, 1.6)
"""Errors beyond these are drawn at them, with their figure."""


@chart.styled
def draw_front(settings: Frame) -> Figure:
    """Draw every setting's error on the classic course against its cost."""
    note = (
        "Error: eight games of 3 s on the classic level, under recorded keys. A cross violates "
        "another of the game's requirements; the front is of those that meet all. Of settings that "
        "change nothing but the cost only those on the front have a name."
    )
    title = "Physics presets: what is the cheapest setting that tells the truth?"
    figure, ((axes,),) = chart.grid((1, 1), title, note, panel=(10.6, 5.6))
    rows = settings.assign(
        ms=1e3 * settings.cpu_s_per_s,
        percent=(100.0 * settings.course).clip(*_SHOWN_PERCENT),
        preset=settings.setting.isin(list(MUJOCO_PRESETS)),
    )
    front = rows[rows.front].sort_values("ms")
    axes.plot(front.ms, front.percent, lw=9, color=chart.PARETO, zorder=1, label="Pareto front")
    for row in rows.itertuples():
        mark: dict[str, Any] = {"marker": "o", "ms": 13 if row.preset else 7.5}
        if row.violations and not row.preset:
            mark = {"marker": "x", "ms": 7, "mew": 1.6}
        axes.plot(row.ms, row.percent, color=_KNOBS[row.knob], ls="", label=row.knob, **mark)
    axes.set(xscale="log", yscale="log", ylim=(_SHOWN_PERCENT[0], 1.25 * _SHOWN_PERCENT[1]))
    axes.axhline(1.0, color="#777777", ls="--", zorder=0, label="required: at most 1 %")
    axes.set_xlabel("CPU milliseconds for a simulated second of one game (classic, 1 thread)")
    axes.set_ylabel("distance from the converged ball over the way, %")
    chart.plain(axes.xaxis)
    chart.plain(axes.yaxis)
    # Settings that change nothing but the cost crowd round ``default``.
    like = np.isclose(rows.course, rows[rows.setting == "default"].course.max(), rtol=0.01)
    named = rows[~like | rows.front | rows.preset | (rows.violations != "")].itertuples()
    chart.label(axes, [(_name(row), row.ms, row.percent, _colour(row)) for row in named])
    chart.legend_of(figure, axes, columns=11)
    return figure


def _name(row: Any) -> str:
    percent = 100.0 * row.course
    if row.preset:
        return f"{row.setting}: {percent:.2f} %, {row.ms:.2g} ms"
    return f"{row.setting}: {percent:.0f} %" if percent > _SHOWN_PERCENT[1] else str(row.setting)


def _colour(row: Any) -> str:
    return "#111111" if row.preset else chart.FAILURE if row.violations else chart.QUIET


_COLOURS: Final = LinearSegmentedColormap.from_list(
    "share of the limit", ["#d9efe9", "#f6f3d8", "#f2b25c", "#b00020"]
)


@chart.styled
def draw_requirements(settings: Frame) -> Figure:
    """Draw each setting's errors as shares of what the game can bear."""
    first = settings.setting.isin(list(MUJOCO_PRESETS))
    order = settings.loc[[*settings.index[first], *settings.index[~first]]]
    shares = np.stack([order[one.name] / one.limit for one in REQUIREMENTS], axis=1)
    figure, ((axes,),) = chart.grid(
        (1, 1),
        "Errors as shares of what the game can bear",
        "More than 1 is a violation. Presets, then all others, the cheapest first.",
        panel=(11.4, 0.235 * len(order)),
        margins=(1.9, 0.2, 1.9, 0.3),
    )
    with np.errstate(divide="ignore"):
        shown = np.log10(shares).clip(-3.0, 1.0)
    axes.imshow(shown, cmap=_COLOURS, vmin=-3.0, vmax=1.0, aspect="auto")
    for (y, x), share in np.ndenumerate(shares):
        ink = "white" if share > 1.0 else "#333333"
        axes.text(x, y, _written(share), ha="center", va="center", fontsize=7.5, color=ink)
    heads = [
        "\n".join([*textwrap.wrap(one.title, 11), f"≤ {one.limit:.3g} {one.unit}".rstrip()])
        for one in REQUIREMENTS
    ]
    axes.set_xticks(range(len(heads)), heads, fontsize=7.5)
    axes.xaxis.tick_top()
    axes.set_yticks(range(len(order)), order.setting, fontsize=8.5)
    axes.axhline(first.sum() - 0.5, color="white", linewidth=5.0)
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    return figure


def _written(share: float) -> str:
    if not np.isfinite(share) or share >= 100.0:
        return ">99"
    if math.isclose(share, 1.0, abs_tol=0.05):
        return f"{share:.2f}" if f"{share:.2f}" != "1.00" else f"{share:.4g}"
    return "0" if share < 5e-4 else f"{share:.1g}" if share < 0.1 else f"{share:.2g}"


@chart.styled
def draw_ablations(ablations: Frame) -> Figure:
    """Draw what a step costs with more modelled than needed, and on larger levels."""
    figure, ((ways, sizes),) = chart.grid(
        (1, 2),
        "Model no more than the scene needs: the cost of a physics step",
        "Left: the classic level, modelled otherwise. Right: the same yard, with more boxes.",
        panel=(4.4, 4.0),
        margins=(2.9, 0.3, 0.9, 0.8),
    )
    rows = ablations[ablations.boxes == 0].sort_values("us_per_step")
    chosen = float(rows[rows.chosen].us_per_step.iloc[0])
    colours = rows.chosen.map({True: chart.SERIES[1], False: "#c3c9d1"})
    bars = ways.barh(rows.what, rows.us_per_step, color=colours, height=0.7)
    changes = 100.0 * (rows.us_per_step[~rows.chosen] / chosen - 1.0)
    said = rows.us_per_step.map(" {:.1f}".format).str.cat(
        changes.map(" ({:+.0f} %)".format), na_rep=""
    )
    ways.bar_label(bars, said, fontsize=8)
    ways.axvline(chosen, color=chart.SERIES[1], linewidth=1.0, linestyle=":")
    ways.set_xlim(0.0, 1.3 * rows.us_per_step.max())
    ways.grid(visible=False, axis="y")
    ways.set_xlabel("CPU microseconds a step, classic level")
    grown = ablations[ablations.boxes > 0]
    for what, own in grown.groupby("what", sort=False):
        x, y = own.boxes.tolist(), own.us_per_step.tolist()
        said = f"{what}: × {y[-1] / y[0]:.2f} from {x[0]} to {x[-1]}"
        sizes.plot(x, y, "o-", lw=2.6 if what == AS_CHOSEN else 1.4, label=said)
    sizes.legend(loc="upper left", fontsize=8)
    sizes.set_ylim(0.0, 1.35 * grown.us_per_step.max())
    sizes.set_xlabel("boxes of the level")
    return figure
