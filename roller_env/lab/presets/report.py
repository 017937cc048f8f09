"""Files of a run: tables, charts, and a page that says what was found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from roller_env.lab.presets import charts
from roller_env.lab.presets.economies import AS_CHOSEN, EconomyRow
from roller_env.lab.presets.errors import CRITERIA
from roller_env.lab.presets.results import SettingRow
from roller_env.lab.provenance import header
from roller_env.lab.style import save
from roller_env.lab.tables import markdown, write_rows
from roller_env.physics.presets import PRESETS

_TITLES: Final = (
    "setting",
    "us a step",
    "CPU ms per s",
    "course %",
    "path %",
    "landing",
    "elasticity",
    "friction",
    "seam mm",
    "hop mm",
    "rest mm",
    "lane mm",
    "squeeze mm",
    "breaks",
)


def write(
    rows: Sequence[SettingRow],
    economies: Sequence[EconomyRow],
    facts: dict[str, str],
    out: Path,
) -> list[Path]:
    """Write everything; return the files."""
    files = [*write_rows(rows, facts, out / "settings")]
    files += write_rows(economies, facts, out / "economies")
    for name, figure in (
        ("front", charts.draw_front(rows)),
        ("promises", charts.draw_promises(rows)),
        ("economies", charts.draw_economies(economies)),
    ):
        files += save(figure, facts, out / name)
    page = out / "presets.md"
    page.write_text(f"{header(facts)}\n\n{tables(rows, economies)}", encoding="utf-8")
    return [*files, page]


def tables(rows: Sequence[SettingRow], economies: Sequence[EconomyRow]) -> str:
    """Return the tables in Markdown, presets first."""
    presets = [row for row in rows if row.setting in PRESETS]
    parts = [
        markdown(_TITLES, [_cells(row) for row in presets]),
        markdown(_TITLES, [_cells(row) for row in rows]),
        markdown(
            ("classic level", "geoms", "us a step", "same to the bit"),
            [
                (row.what, row.geoms, row.us_per_step, "yes" if row.same_bits else "no")
                for row in economies
                if not row.boxes
            ],
        ),
        markdown(
            ("boxes", "modelled", "us a step", "same to the bit"),
            [
                (row.boxes, row.what, row.us_per_step, "yes" if row.same_bits else "no")
                for row in economies
                if row.boxes
            ],
        ),
        markdown(
            ("promise", "at most", "why"), [(one.label, one.limit, one.reason) for one in CRITERIA]
        ),
    ]
    return "\n".join(parts)


def summary(rows: Sequence[SettingRow], economies: Sequence[EconomyRow]) -> list[str]:
    """Return what a run found, a line each."""
    lines = []
    for row in rows:
        if row.setting in PRESETS:
            state = f"breaks {row.breaks}" if row.breaks else "keeps every promise"
            place = "on the front" if row.front else "not on the front"
            lines.append(
                f"{row.setting}: {100 * row.course:.2f} % of the way on the course, "
                f"{1e3 * row.cpu_s_per_s:.2f} CPU ms a second, {state}, {place}"
            )
    lines.append("front: " + ", ".join(row.setting for row in rows if row.front))
    grown = [row for row in economies if row.boxes and row.what == AS_CHOSEN]
    ratio = grown[-1].us_per_step / grown[0].us_per_step
    lines.append(f"a step on {grown[-1].boxes} boxes costs {ratio:.2f} of one on {grown[0].boxes}")
    return lines


def _cells(row: SettingRow) -> tuple[object, ...]:
    return (
        f"**{row.setting}**" if row.front else row.setting,
        row.us_per_step,
        1e3 * row.cpu_s_per_s,
        100.0 * row.course,
        100.0 * row.path,
        row.landing_share,
        row.elasticity,
        row.friction,
        row.seam_mm,
        row.hop_mm,
        row.rest_mm,
        row.lane_mm,
        row.squeeze_mm,
        row.breaks or "-",
    )
