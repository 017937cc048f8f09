"""Results as tables: pandas frames, which become CSV and JSON with provenance, and Markdown."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pandas import DataFrame as Frame

from roller_env.lab.runner import header

__all__ = ["Frame", "frame", "markdown", "write"]


def frame(rows: Sequence[Any]) -> Frame:
    """Return rows, mappings or objects of one dataclass, as a frame.

    Raises:
        ValueError: no rows, or rows of different classes.
    """
    kinds = {type(row) for row in rows}
    if len(kinds) != 1:
        names = sorted(kind.__name__ for kind in kinds)
        raise ValueError(f"a table needs rows of one kind, found {names or 'none'}")
    return Frame(
        [asdict(row) if is_dataclass(row) and not isinstance(row, type) else row for row in rows]
    )


def write(table: Frame | Sequence[Any], facts: Mapping[str, str], stem: Path) -> tuple[Path, Path]:
    """Write a frame, or rows of one, as ``stem.csv`` and ``stem.json``; return both paths.

    The CSV begins with one comment line of provenance. What is not finite is an empty cell and
    ``null``: strict JSON has neither infinity nor NaN.
    """
    table = table if isinstance(table, Frame) else frame(table)
    finite = table.replace([np.inf, -np.inf], np.nan).astype(object)
    finite = finite.where(finite.notna(), None)
    stem.parent.mkdir(parents=True, exist_ok=True)
    csv_file, json_file = (stem.with_name(f"{stem.name}.{kind}") for kind in ("csv", "json"))
    text = f"# {header(facts)}\n" + finite.to_csv(index=False, lineterminator="\n")
    csv_file.write_text(text, encoding="utf-8")
    document = {"provenance": dict(facts), "rows": finite.to_dict("records")}
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


def _cell(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
