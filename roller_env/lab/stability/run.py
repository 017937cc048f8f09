"""What ``scripts/stability.py`` runs, and the files that it leaves."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from roller_env.lab.provenance import header
from roller_env.lab.stability import charts, failures, hard_cases
from roller_env.lab.stability.cases import QUICK, Effort, LimitRow, judged
from roller_env.lab.stability.failure import FailureRow, record, rows
from roller_env.lab.stability.limits import CASES, GROUPS
from roller_env.lab.style import save
from roller_env.lab.tables import markdown, write_rows

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
    """What came out."""

    limits: list[LimitRow] = field(default_factory=list)
    failures: list[FailureRow] = field(default_factory=list)
    hard_cases: list[hard_cases.HardRow] = field(default_factory=list)
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
    known = [*SECTIONS, *GROUPS, *CASES, *failures.FAILURES, *hard_cases.HARD_CASES]
    for name in only:
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise ValueError(
                f"only: found {name!r}; allowed are {', '.join(SECTIONS)}, the groups "
                f"{', '.join(GROUPS)}, or one case{hint}"
            )
    wanted = set(only) or set(SECTIONS)
    return Selection(
        limits=tuple(
            name
            for name, case in CASES.items()
            if name in wanted
            or (wanted & {"limits", case.group} and (case.quick or effort != QUICK))
        ),
        failures=tuple(n for n in failures.FAILURES if wanted & {n, "failures"}),
        hard_cases=tuple(n for n in hard_cases.HARD_CASES if wanted & {n, "hard_cases"}),
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
            _run_failure(name, effort, results)
        else:
            case = hard_cases.HARD_CASES[name]
            results.hard_cases += hard_cases.run_case(case, hard_cases.ALL_PRESETS, effort)
    results.figures |= _overviews(results)
    return results


def _run_failure(name: str, effort: Effort, results: Results) -> None:
    failure = failures.FAILURES[name]()
    records = [record(setting, failure.seconds) for setting in failure.settings]
    found = rows(failure, records, repeats=effort.repeats)
    results.failures += found
    results.figures[name] = charts.failure_figure(failure, records, found)


def _overviews(results: Results) -> dict[str, Figure]:
    figures = {}
    names = {row.name for row in results.limits}
    if names >= {name for name, case in CASES.items() if case.group == "servo"}:
        figures["servo"] = charts.servo_figure(results.limits)
    if any(math.isfinite(row.ratio) for row in results.limits):
        figures["limits"] = charts.deviation_figure(results.limits)
    if results.hard_cases:
        figures["hard_cases"] = charts.hard_figure(results.hard_cases)
    return figures


def write(results: Results, facts: dict[str, str], directory: Path) -> list[Path]:
    """Write CSV, JSON, Markdown and pictures; return what was written."""
    written: list[Path] = []
    for name, found, table in (
        ("limits", results.limits, limits_table),
        ("failures", results.failures, failures_table),
        ("hard_cases", results.hard_cases, hard_cases_table),
    ):
        if found:
            written += write_rows(found, facts, directory / name)
            text = directory / f"{name}.md"
            text.write_text(f"{table(results)}\n{header(facts)}\n", encoding="utf-8")
            written.append(text)
    for name, figure in results.figures.items():
        written += save(figure, facts, directory / "pictures" / name)
    return written


# Tables --------------------------------------------------------------------------------------


def limits_table(results: Results) -> str:
    """Return the predicted and measured limits as Markdown, with the notes below."""
    cells = [
        (
            row.name,
            row.quantity,
            row.method,
            row.formula,
            _limit(row.predicted, row.searched_to),
            _limit(row.measured, row.searched_to),
            f"{row.ratio:.4f}" if math.isfinite(row.ratio) else "",
            f"{row.band_low:g} to {row.band_high:g}" if math.isfinite(row.ratio) else "",
            row.verdict,
        )
        for row in results.limits
    ]
    titles = ("name", "what", "method", "formula", "predicted", "measured", "ratio", "band", "")
    return markdown(titles, cells) + _notes((row.name, row.note) for row in results.limits)


def failures_table(results: Results) -> str:
    """Return what fails, what cures it and what the cure costs, as Markdown."""
    cells = [
        (
            row.failure,
            row.setting,
            row.role,
            row.quantity,
            f"{row.value:.3g}",
            f"{row.acceptable:.3g}",
            row.verdict if row.as_expected else f"{row.verdict}, unexpectedly",
            f"{row.time_ratio:.2f}",
            f"{row.evaluations_ratio:g}",
        )
        for row in results.failures
    ]
    titles = (
        "failure",
        "setting",
        "role",
        "what",
        "measured",
        "acceptable",
        "",
        "time",
        "evaluations",
    )
    return markdown(titles, cells) + _notes((row.failure, row.why) for row in results.failures)


def hard_cases_table(results: Results) -> str:
    """Return the game's hard cases as Markdown, a column a preset; in bold what is too much."""
    presets = tuple(dict.fromkeys(row.preset for row in results.hard_cases))
    lines: dict[tuple[str, str], dict[str, hard_cases.HardRow]] = {}
    for row in results.hard_cases:
        lines.setdefault((row.case, row.quantity), {})[row.preset] = row
    cells = []
    for (case, quantity), own in lines.items():
        any_row = own[presets[0]]
        values = [_bold_if_too_much(own[preset]) for preset in presets]
        cells.append((case, quantity, *values, f"{any_row.limit:.3g}", any_row.reason))
    table = markdown(("case", "what", *presets, "acceptable", "since"), cells)
    return table + _notes((row.case, row.note) for row in results.hard_cases)


def _bold_if_too_much(row: hard_cases.HardRow) -> str:
    value = f"{row.value:.3g}"
    return f"**{value}**" if row.verdict == "fails" else value


def summary(results: Results) -> Iterator[str]:
    """Yield one line a section: how many held, and the names of those that did not."""
    differing = [row.name for row in results.limits if row.verdict == "differs"]
    if results.limits:
        yield _counted("predictions hold", len(results.limits), differing)
    odd = [f"{row.failure}: {row.setting}" for row in results.failures if not row.as_expected]
    if results.failures:
        yield _counted("failures and cures are as expected", len(results.failures), odd)
    failing = [
        f"{row.case} ({row.preset}, {row.quantity})"
        for row in results.hard_cases
        if row.verdict == "fails"
    ]
    if results.hard_cases:
        yield _counted("readings of hard cases are acceptable", len(results.hard_cases), failing)


def _counted(what: str, count: int, exceptions: Sequence[str]) -> str:
    line = f"{count - len(exceptions)} of {count} {what}"
    return line + (f"; not: {', '.join(exceptions)}" if exceptions else "")


def _limit(value: float, searched_to: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else f"none to {searched_to:g}"


def _notes(named: Iterable[tuple[str, str]]) -> str:
    notes = {name: text for name, text in named if text}
    return "".join(f"\n- `{name}`: {text}" for name, text in notes.items()) + "\n"
