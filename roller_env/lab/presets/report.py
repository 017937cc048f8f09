"""Files of a run: tables, charts, and a page that says what was found."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
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
    "µs a step",
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
    "lane %",
    "squeeze mm",
    "breaks",
)


_BEGIN: Final = "<!-- measured: python scripts/presets.py --docs docs -->"
_END: Final = "<!-- end of what was measured -->"
_PUBLISHED: Final[Mapping[str, str]] = {
    "front": "presets.png",
    "promises": "presets-promises.png",
    "economies": "presets-economies.png",
}
"""The pictures by their name in a run and in the documentation."""


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


def publish(out: Path, docs: Path) -> list[Path]:
    """Put what `write` has left in ``out`` into the documentation; return the files changed.

    Raises:
        ValueError: the page has not exactly one place for the tables; nothing is changed then.
    """
    page = docs / "presets.md"
    text = page.read_text(encoding="utf-8")
    before, *rest = text.split(_BEGIN)
    after = rest[0].partition(_END)[2] if len(rest) == 1 and rest[0].count(_END) == 1 else None
    if after is None:
        raise ValueError(f"{page}: must have one line {_BEGIN!r} and, after it, one {_END!r}")
    measured = (out / "presets.md").read_text(encoding="utf-8")
    page.write_text(f"{before}{_BEGIN}\n\n{measured}\n{_END}{after}", encoding="utf-8")
    pictures = [docs / "images" / published for published in _PUBLISHED.values()]
    for name, picture in zip(_PUBLISHED, pictures, strict=True):
        shutil.copyfile(out / f"{name}.png", picture)
    return [page, *pictures]


def tables(rows: Sequence[SettingRow], economies: Sequence[EconomyRow]) -> str:
    """Return the tables in Markdown, presets first and all settings folded away."""
    presets = [row for row in rows if row.setting in PRESETS]
    parts = [
        markdown(_TITLES, [_cells(row) for row in presets]),
        f"<details><summary>All {len(rows)} settings, the cheapest first</summary>\n",
        markdown(_TITLES, [_cells(row) for row in rows]),
        "</details>\n",
        markdown(
            ("classic level", "geoms", "µs a step", "same to the bit"),
            [
                (row.what, row.geoms, row.us_per_step, "yes" if row.same_bits else "no")
                for row in economies
                if not row.boxes
            ],
        ),
        markdown(
            ("boxes", "modelled", "µs a step", "same to the bit"),
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
        100.0 * row.lane_share,
        row.squeeze_mm,
        row.breaks or "-",
    )
