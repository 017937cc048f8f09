"""What ``scripts/stability.py`` runs, and the files that it leaves."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import matplotlib
from matplotlib.figure import Figure

from roller_env.lab import chart
from roller_env.lab.runner import header, known
from roller_env.lab.stability import failures, hard_cases
from roller_env.lab.stability.contacts import CONTACTS
from roller_env.lab.stability.limits import QUICK, WORDS, Case, Effort, judged
from roller_env.lab.stability.smooth import SMOOTH
from roller_env.lab.table import Frame, frame, markdown
from roller_env.lab.table import write as write_table

CASES: Final[Mapping[str, Case]] = {name: {**SMOOTH, **CONTACTS}[name] for name in WORDS}
"""Every predicted limit by name, in the order of the table."""


class Results(NamedTuple):
    """What came out: a table by section (limits, failures, hard_cases), and pictures by name."""

    tables: dict[str, Frame]
    figures: dict[str, Figure]


def select(only: Sequence[str], effort: Effort) -> list[tuple[str, str]]:
    """Return the sections and names of the cases that ``only`` names, in the order of the tables.

    It names sections, groups of limits, limits, failures or hard cases; none means everything. A
    quick ``effort`` leaves out the slow limits, unless they are named themselves.

    Raises:
        ValueError: a name that nothing has; the message has the nearest one.
    """
    meanings: dict[tuple[str, str], set[str]] = {}
    for name, words in WORDS.items():
        slow = effort == QUICK and not words["quick"]
        meanings["limits", name] = {name} if slow else {name, words["group"], "limits"}
    for section, table in (("failures", failures.FAILURES), ("hard_cases", hard_cases.HARD_CASES)):
        meanings |= {(section, name): {name, section} for name in table}
    for name in only:
        known("case", name, sorted(set[str]().union(*meanings.values())))
    wanted = set(only) or {"limits", "failures", "hard_cases"}
    return [case for case, meant in meanings.items() if meant & wanted]


def run(
    selection: Sequence[tuple[str, str]],
    effort: Effort,
    wrap: Callable[[Sequence[str]], Iterable[str]],
) -> Results:
    """Measure everything selected; ``wrap`` goes over "section/name"s and shows progress."""
    rows: dict[str, list[dict[str, Any]]] = {}
    figures: dict[str, Figure] = {}
    for full_name in wrap(["/".join(one) for one in selection]):
        section, _, name = full_name.partition("/")
        if section == "limits":
            found = [judged(name, CASES[name], effort)]
        elif section == "failures":
            found, curves = failures.rows(name, effort.repeats)
            figures[name] = draw_failure(frame(found), curves)
        else:
            found = hard_cases.rows(name, effort)
        rows.setdefault(section, []).extend(found)
    tables = {section: frame(found) for section, found in rows.items()}
    for section, draw in (("limits", draw_limits), ("hard_cases", draw_hard_cases)):
        if section in tables:
            figures[section] = draw(tables[section])
    return Results(tables, figures)


def write(results: Results, facts: Mapping[str, str], directory: Path) -> list[Path]:
    """Write CSV, JSON, Markdown and pictures; return what was written."""
    written: list[Path] = []
    for section, table in results.tables.items():
        written += write_table(table, facts, directory / section)
        written.append(directory / f"{section}.md")
        written[-1].write_text(f"{page(section, table)}\n{header(facts)}\n", encoding="utf-8")
    for name, figure in results.figures.items():
        written += chart.save(figure, facts, directory / "pictures" / name)
    return written


def page(section: str, table: Frame) -> str:
    """Return a section's table as Markdown, with the notes below."""
    shown = {"limits": _limits, "failures": _failures, "hard_cases": _hard_cases}[section](table)
    notes = table[table.note != ""].drop_duplicates("case")
    listed = "".join(f"\n- `{row.case}`: {row.note}" for row in notes.itertuples())
    return f"{markdown(list(shown), shown.to_numpy().tolist())}{listed}\n"


def summary(results: Results) -> Iterator[str]:
    """Yield one line a section: how many held, and the names of those that did not."""
    for section, table in results.tables.items():
        said, label = {
            "limits": ("limits are as expected", "{case}"),
            "failures": ("failures and cures are as expected", "{case}: {setting}"),
            "hard_cases": (
                "readings of hard cases are acceptable",
                "{case} ({preset}, {quantity})",
            ),
        }[section]
        odd = [label.format(**row) for row in table[~table.good].to_dict("records")]
        line = f"{len(table) - len(odd)} of {len(table)} {said}"
        if section == "limits":
            holds, departs = ((table.verdict == verdict).sum() for verdict in ("holds", "departs"))
            line += f" ({holds} as predicted, {departs} known to depart; "
            line += f"{table.bisected.sum()} by bisection, the others by one measurement)"
        yield line + (f"; not: {', '.join(odd)}" if odd else "")


def _limits(table: Frame) -> Frame:
    shown = table[["case", "quantity", "method", "formula"]].copy()
    none = table.searched_to.map("none to {:g}".format)
    for column in ("predicted", "measured"):
        finite = table[column].map(math.isfinite)
        shown[column] = table[column].map("{:.4g}".format).where(finite, none)
    limited = table.ratio.notna()
    shown["ratio"] = table.ratio.map("{:.4f}".format).where(limited, "")
    band = table.low.map("{:g} to ".format) + table.high.map("{:g}".format)
    return shown.assign(band=band.where(limited, ""), verdict=table.verdict)


def _failures(table: Frame) -> Frame:
    verdict = table.verdict.where(table.good, table.verdict + ", unexpectedly")
    columns = ["case", "setting", "role", "quantity", "value", "acceptable", "verdict"]
    return table.assign(verdict=verdict)[[*columns, "time_ratio", "evaluations_ratio"]]


def _hard_cases(table: Frame) -> Frame:
    """Return a column a preset; in bold what is too much."""
    said = table.value.map("{:.3g}".format)
    keys = ["case", "quantity", "limit", "reason"]
    wide = table.assign(said=said.where(table.good, "**" + said + "**"))
    wide = wide.set_index([*keys, "preset"]).said.unstack(sort=False).reset_index()
    return wide[[*keys[:2], *table.preset.unique(), *keys[2:]]]


def draw_failure(rows: Frame, curves: Sequence[failures.Curve]) -> Figure:
    """Draw the failing setting and its cures in one picture, each with what it costs."""
    first = rows.iloc[0]
    top = 0.7 + 0.19 * (math.ceil(len(first.note) / 118) + len(rows))
    figure, ((axes,),) = chart.grid(
        (1, 1), first.title, first.note, panel=(6.9, 3.6), margins=(0.9, 0.3, top, 0.7)
    )
    with matplotlib.rc_context(chart.STYLE):
        styles = (("-", chart.FAILURE), *zip(("--", "-.", ":"), chart.SERIES, strict=False))
        for row, curve, (line, colour) in zip(rows.itertuples(), curves, styles, strict=False):
            cost = f"{row.time_ratio:.2g}× the time, {row.evaluations_ratio:g}× the evaluations"
            label = f"{row.setting}: {row.value:.3g}, {'fails' if row.role == 'fails' else cost}"
            axes.plot(*curve, line, color=colour, lw=2.0, label=label)
        axes.axhline(first.acceptable, color=chart.PREDICTION, lw=0.9, ls=":")
        axes.set(xlabel="time, s", ylabel=first.quantity)
        if rows.value.max() > 100.0 * first.acceptable:
            axes.set_yscale("log")
        axes.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), fontsize=9)
    return figure


def draw_limits(table: Frame) -> Figure:
    """Draw how far measured is from predicted, and how far it may be."""
    limited = table[table.ratio.notna()]
    allowed = (limited.high - 1.0).where(limited.ratio >= 1.0, 1.0 - limited.low)
    return chart.against_limits(
        [
            chart.Row(row.case, abs(row.ratio - 1.0), (1e-6, most), row.good)
            for row, most in zip(limited.itertuples(), allowed, strict=True)
        ],
        "How far the limits are from what was predicted",
        "Dots: measured; grey: what is allowed, 1 % where the formula is exact.",
        "|measured / predicted - 1|; the line is 1 %",
        (1e-6, 4.0),
        limit=0.01,
        label_in=2.8,
    )


def draw_hard_cases(table: Frame) -> Figure:
    """Draw how near the game's hard cases come to what is acceptable, under every preset."""
    named = table.case.str.replace("_", " ") + ": " + table.quantity
    shown = zip(named, table.value / table.limit, table.preset, table.limit, strict=True)
    return chart.against_limits(
        [chart.Row(name, ratio, series=preset) for name, ratio, preset, limit in shown if limit],
        "The game's own hard cases, under its three physics presets",
        "Right of the line: more than is acceptable, for the reasons in hard_cases.md.",
        "measured / acceptable (less than a thousandth: at the left)",
        (1e-3, 30.0),
        label_in=4.6,
    )
