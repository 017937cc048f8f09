"""What ``scripts/stability.py`` runs, and the files that it leaves."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import matplotlib
from matplotlib.figure import Figure

from roller_env.lab import chart
from roller_env.lab.runner import header, known
from roller_env.lab.stability import failures, hard_cases
from roller_env.lab.stability.contacts import CONTACTS
from roller_env.lab.stability.failures import FAILURES
from roller_env.lab.stability.hard_cases import HARD_CASES
from roller_env.lab.stability.limits import QUICK, WORDS, Case, Effort, judged
from roller_env.lab.stability.smooth import SMOOTH
from roller_env.lab.table import Frame, frame, markdown
from roller_env.lab.table import write as write_table

CASES: Final[Mapping[str, Case]] = {name: {**SMOOTH, **CONTACTS}[name] for name in WORDS}
"""Every predicted limit by name, in the order of the table."""

Cells = tuple[Sequence[str], Sequence[Sequence[object]]]
"""Titles and rows of a table for people."""


@dataclass(slots=True)
class Results:
    """What came out: a table by section (limits, failures, hard_cases), and pictures."""

    tables: dict[str, Frame] = field(default_factory=dict)
    figures: dict[str, Figure] = field(default_factory=dict)


def select(only: Sequence[str], effort: Effort) -> dict[str, list[str]]:
    """Return what ``only`` names, by section and in the order of the tables.

    Args:
        only: sections, groups of limits, limits, failures or hard cases; none means everything. A
            name that is both a group and a failure ("tunnelling") means both.
        effort: a quick one leaves out the slow limits, unless they are named themselves.

    Raises:
        ValueError: a name that nothing has; the message has the nearest one.
    """
    groups = {words["group"] for words in WORDS.values()}
    for name in only:
        known("case", name, [*_SECTIONS, *groups, *CASES, *FAILURES, *HARD_CASES])
    wanted = set(only) or set(_SECTIONS)
    return {
        "limits": [
            name
            for name, words in WORDS.items()
            if name in wanted
            or (wanted & {"limits", words["group"]} and (words["quick"] or effort != QUICK))
        ],
        "failures": [name for name in FAILURES if wanted & {name, "failures"}],
        "hard_cases": [name for name in HARD_CASES if wanted & {name, "hard_cases"}],
    }


def run(
    selection: Mapping[str, Sequence[str]],
    effort: Effort,
    wrap: Callable[[Sequence[str]], Iterable[str]],
) -> Results:
    """Measure everything selected; ``wrap`` goes over "section/name"s and shows progress."""
    results, rows = Results(), {section: list[dict[str, Any]]() for section in _SECTIONS}
    for full_name in wrap(
        [f"{section}/{name}" for section in selection for name in selection[section]]
    ):
        section, _, name = full_name.partition("/")
        if section == "limits":
            rows[section].append(judged(name, CASES[name], effort))
        elif section == "failures":
            found, curves = failures.rows(name, effort.repeats)
            rows[section] += found
            results.figures[name] = draw_failure(frame(found), curves)
        else:
            rows[section] += hard_cases.rows(name, effort)
    results.tables = {section: frame(found) for section, found in rows.items() if found}
    limited = results.tables.get("limits", Frame({"ratio": []})).dropna(subset="ratio")
    if len(limited):
        results.figures["limits"] = draw_limits(limited)
    if "hard_cases" in results.tables:
        results.figures["hard_cases"] = draw_hard_cases(results.tables["hard_cases"])
    return results


def write(results: Results, facts: Mapping[str, str], directory: Path) -> list[Path]:
    """Write CSV, JSON, Markdown and pictures; return what was written."""
    written: list[Path] = []
    for section, table in results.tables.items():
        written += write_table(table, facts, directory / section)
        text = directory / f"{section}.md"
        text.write_text(f"{page(section, table)}\n{header(facts)}\n", encoding="utf-8")
        written.append(text)
    for name, figure in results.figures.items():
        written += chart.save(figure, facts, directory / "pictures" / name)
    return written


# Tables --------------------------------------------------------------------------------------


def page(section: str, table: Frame) -> str:
    """Return a section's table as Markdown, with the notes below."""
    notes = table[table.note != ""].drop_duplicates("case")
    listed = "".join(f"\n- `{row.case}`: {row.note}" for row in notes.itertuples())
    return f"{markdown(*_SECTIONS[section].cells(table))}{listed}\n"


def summary(results: Results) -> Iterator[str]:
    """Yield one line a section: how many held, and the names of those that did not."""
    for section, table in results.tables.items():
        is_odd, said, label = (
            _SECTIONS[section].odd,
            _SECTIONS[section].said,
            _SECTIONS[section].label,
        )
        odd = [label.format(**row) for row in table.to_dict("records") if is_odd(row)]
        line = f"{len(table) - len(odd)} of {len(table)} {said}"
        yield line + (f"; not: {', '.join(odd)}" if odd else "")


def _limits(table: Frame) -> Cells:
    def limit(value: float, searched_to: float) -> str:
        return f"{value:.4g}" if math.isfinite(value) else f"none to {searched_to:g}"

    titles = ("name", "what", "method", "formula", "predicted", "measured", "ratio", "band", "")
    return titles, [
        (
            *(row.case, row.quantity, row.method, row.formula),
            *(limit(row.predicted, row.searched_to), limit(row.measured, row.searched_to)),
            f"{row.ratio:.4f}" if math.isfinite(row.ratio) else "",
            f"{row.low:g} to {row.high:g}" if math.isfinite(row.ratio) else "",
            row.verdict,
        )
        for row in table.itertuples()
    ]


def _failures(table: Frame) -> Cells:
    verdict = table.verdict.where(table.as_expected, table.verdict + ", unexpectedly")
    columns = {
        "failure": "case", "setting": "setting", "role": "role", "what": "quantity",
        "measured": "value", "acceptable": "acceptable", "": "verdict", "time": "time_ratio",
        "evaluations": "evaluations_ratio",
    }  # fmt: skip
    return list(columns), table.assign(verdict=verdict)[list(columns.values())].values.tolist()


def _hard_cases(table: Frame) -> Cells:
    """Return a column a preset; in bold what is too much."""
    said = table.value.map("{:.3g}".format)
    said = said.where(table.verdict == "holds", "**" + said + "**")
    index = ["case", "quantity", "limit", "reason"]
    wide = table.assign(said=said).pivot_table("said", index, "preset", "first", sort=False)
    presets = list(wide)
    rows = wide.reset_index()[["case", "quantity", *presets, "limit", "reason"]]
    return ["case", "what", *presets, "acceptable", "since"], rows.values.tolist()


@dataclass(frozen=True)
class _Section:
    """How a section is written: its table, what is odd in it, and how that is said."""

    cells: Callable[[Frame], Cells]
    said: str
    odd: Callable[[Mapping[str, Any]], bool]
    label: str


_SECTIONS: Final = {
    "limits": _Section(
        _limits, "predictions hold", lambda row: row["verdict"] == "differs", "{case}"
    ),
    "failures": _Section(
        _failures,
        "failures and cures are as expected",
        lambda row: not row["as_expected"],
        "{case}: {setting}",
    ),
    "hard_cases": _Section(
        _hard_cases,
        "readings of hard cases are acceptable",
        lambda row: row["verdict"] == "fails",
        "{case} ({preset}, {quantity})",
    ),
}


# Pictures ------------------------------------------------------------------------------------


def draw_failure(rows: Frame, curves: Sequence[failures.Curve]) -> Figure:
    """Draw the failing setting and its cures in one picture, each with what it costs."""
    first = rows.iloc[0]
    top = 0.7 + 0.19 * (math.ceil(len(first.note) / 118) + len(rows))
    margins = (0.9, 0.3, top, 0.7)
    figure, ((axes,),) = chart.grid(
        (1, 1), first.title, first.note, panel=(6.9, 3.6), margins=margins
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


def draw_limits(limited: Frame) -> Figure:
    """Draw how far measured is from predicted, and how far it may be."""

    def shown(row: Any) -> chart.Row:
        off = row.ratio - 1.0
        allowed = row.high - 1.0 if off >= 0.0 else 1.0 - row.low
        return chart.Row(row.case, abs(off), (1e-6, allowed), row.verdict == "holds")

    return chart.against_limits(
        [shown(row) for row in limited.itertuples()],
        "How far the limits are from what was predicted",
        "Dots: measured; grey: what is allowed, 1 % where the formula is exact.",
        "|measured / predicted - 1|; the line is 1 %",
        (1e-6, 4.0),
        limit=0.01,
        label_in=2.8,
    )


def draw_hard_cases(table: Frame) -> Figure:
    """Draw how near the game's hard cases come to what is acceptable, under every preset."""
    return chart.against_limits(
        [
            chart.Row(
                f"{row.case.replace('_', ' ')}: {row.quantity}",
                row.value / row.limit,
                series=row.preset,
            )
            for row in table[table.limit > 0.0].itertuples()
        ],
        "The game's own hard cases, under its three physics presets",
        "Right of the line: more than is acceptable, for the reasons in hard_cases.md.",
        "measured / acceptable (less than a thousandth: at the left)",
        (1e-3, 30.0),
        label_in=4.6,
    )
