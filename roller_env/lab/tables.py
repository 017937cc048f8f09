"""Results as files: rows of one dataclass, as CSV and JSON with provenance, and as Markdown."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roller_env.lab.provenance import header

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def write_rows(
    rows: Sequence[DataclassInstance], facts: dict[str, str], stem: Path
) -> tuple[Path, Path]:
    """Write ``rows`` as ``stem.csv`` and ``stem.json``; return both paths.

    The CSV begins with one comment line of provenance. What is not finite is an empty cell and
    ``null``: strict JSON has neither infinity nor NaN.

    Raises:
        ValueError: no rows, or rows of different classes.
    """
    kinds = {type(row) for row in rows}
    if len(kinds) != 1:
        names = sorted(kind.__name__ for kind in kinds)
        raise ValueError(f"a table needs rows of one kind, found {names or 'none'}")
    records = [{name: _finite(value) for name, value in asdict(row).items()} for row in rows]
    text = io.StringIO()
    text.write(f"# {header(facts)}\n")
    writer = csv.DictWriter(text, [field.name for field in fields(rows[0])], lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    stem.parent.mkdir(parents=True, exist_ok=True)
    csv_file, json_file = (stem.with_name(f"{stem.name}.{kind}") for kind in ("csv", "json"))
    csv_file.write_text(text.getvalue(), encoding="utf-8")
    document = {"provenance": facts, "rows": records}
    json_file.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return csv_file, json_file


def markdown(titles: Sequence[str], cells: Sequence[Sequence[object]]) -> str:
    """Return a Markdown table; numbers are aligned right and given three significant digits."""
    numeric = [
        bool(cells) and all(isinstance(row[column], int | float) for row in cells)
        for column in range(len(titles))
    ]
    lines = [
        "| " + " | ".join(titles) + " |",
        "|" + "|".join("---:" if is_numeric else "---" for is_numeric in numeric) + "|",
    ]
    lines += ["| " + " | ".join(_cell(value) for value in row) + " |" for row in cells]
    return "\n".join(lines) + "\n"


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _cell(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
