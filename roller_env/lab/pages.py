"""What was measured, put where the documentation says that it stands."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final

_END: Final = "<!-- end of what was measured -->"


def publish(page: Path, command: str, measured: Path, pictures: Mapping[Path, Path]) -> list[Path]:
    """Put a run's Markdown and pictures into the documentation; return the files changed.

    Args:
        page: has a line ``<!-- measured: COMMAND -->`` and after it one that ends it; what is
            between them is replaced.
        command: as in that line.
        measured: the run's page.
        pictures: where they go, by where the run has left them.

    Raises:
        ValueError: the page has not exactly one place for it; nothing is changed then.
    """
    begin = f"<!-- measured: {command} -->"
    before, *rest = page.read_text(encoding="utf-8").split(begin)
    if len(rest) != 1 or rest[0].count(_END) != 1:
        raise ValueError(f"{page}: must have one line {begin!r} and, after it, one {_END!r}")
    after = rest[0].partition(_END)[2]
    text = measured.read_text(encoding="utf-8")
    page.write_text(f"{before}{begin}\n\n{text}\n{_END}{after}", encoding="utf-8")
    for source, target in pictures.items():
        shutil.copyfile(source, target)
    return [page, *pictures.values()]
