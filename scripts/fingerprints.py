"""See whether Gymnasium's ids still stand for what they stood for, and keep what new ones do.

Examples::

    python scripts/fingerprints.py
    python scripts/fingerprints.py --unreleased
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from roller_env.lab import fingerprints

BUMP = (
    "bump the version: what is above is another game, and results of before are not comparable. "
    "Register the id with the next version, and write what changed into the version history of its "
    "class (docs/baselines.md, Versions). Before the first release: --unreleased"
)


@dataclass(frozen=True, slots=True)
class Arguments:
    """Add the fingerprints of new ids; refuse where one that is known has changed."""

    unreleased: bool = False
    """Keep what is there now, also of known ids that nobody can have results of yet."""

    file: Path = fingerprints.FILE
    """Where they are kept."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    found = fingerprints.fingerprints()
    known: dict[str, Any] = {}
    if arguments.file.exists() and not arguments.unreleased:
        known = json.loads(arguments.file.read_text(encoding="utf-8"))
        new = [name for name in found["ids"] if name not in known["ids"]]
        old = {name: value for name, value in found["ids"].items() if name not in new}
        if changed := fingerprints.differences(known, found | {"ids": old}):
            sys.exit("\n".join([*changed, "", BUMP]))
    arguments.file.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(f"{len(found['ids'])} ids in {arguments.file}")


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
