"""Results as tables: pandas frames, which become CSV and JSON with provenance, and Markdown."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pandas import DataFrame as Frame

from roller_env.lab.runner import header

__all__ = ["Frame", "frame", "markdown", "write"]


def frame(rows: Sequence[Any]) -> Frame:
    """Return rows, mappings or objects of one dataclass, as a frame."""
    return Frame(list(rows))


def write(table: Frame, facts: Mapping[str, str], stem: Path) -> tuple[Path, Path]:
    """Write a frame as ``stem.csv`` and ``stem.json``; return both paths.

    The CSV begins with one comment line of provenance. What is not finite is an empty cell and
    ``null``: strict JSON has neither infinity nor NaN.
    """
    finite = table.replace([np.inf, -np.inf], np.nan).astype(object)
    finite = finite.where(finite.notna(), None)
    stem.parent.mkdir(parents=True, exist_ok=True)
    csv_file, json_file = (stem.with_name(f"{stem.name}.{kind}") for kind in ("csv", "json"))
    text = f"# {header(facts)}\n" + finite.to_csv(index=False, lineterminator="\n")
    csv_file.write_text(text, encoding="utf-8")
    document = {"provenance": dict(facts), "rows": finite.to_dict("records")}
    json_file.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return csv_file, json_file


def markdown(table: Frame | Sequence[str], cells: Sequence[Sequence[object]] | None = None) -> str:
    """Return a frame, or titles and cells, as Markdown; numbers to the right, with three digits."""
    titles = list(table)
    rows = table.astype(object).to_numpy().tolist() if isinstance(table, Frame) else cells or []
    rules = [
        "---:" if rows and all(isinstance(row[at], int | float) for row in rows) else "---"
        for at in range(len(titles))
    ]
    shown = [[f"{v:.3g}" if isinstance(v, float) else str(v) for v in row] for row in rows]
    head = f"| {' | '.join(titles)} |\n|{'|'.join(rules)}|\n"
    return head + "".join(f"| {' | '.join(row)} |\n" for row in shown)
