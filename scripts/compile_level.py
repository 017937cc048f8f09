"""Write a level as MJCF text that MuJoCo loads without this package."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from roller_env.compile.compiled import level_mjcf
from roller_env.level import LevelError, load_level, shipped_levels
from roller_env.physics.presets import PRESETS


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("level", help=f"one of {', '.join(shipped_levels())}, or a level file")
    parser.add_argument("-o", "--output", type=Path, help="file to write (default: print it)")
    parser.add_argument("--physics", choices=list(PRESETS), default="default")
    arguments = parser.parse_args()
    try:
        text = level_mjcf(load_level(arguments.level), arguments.physics)
    except LevelError as error:
        print(error, file=sys.stderr)
        return 1
    if arguments.output is None:
        print(text)
    else:
        arguments.output.write_text(text, encoding="utf-8")
        print(f"wrote {arguments.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
