"""Write the JSON Schema of level files, from which editors complete and check them.

Run it after changing `roller_env.level.schema`; a test fails while the written file is out of date.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from roller_env.level import level_json_schema, levels_directory


def main() -> None:
    parser = argparse.ArgumentParser(description="Write the JSON Schema of level files.")
    parser.add_argument(
        "--output",
        type=Path,
        default=levels_directory() / "level.schema.json",
        help="file to write (default: %(default)s)",
    )
    output: Path = parser.parse_args().output
    output.write_text(json.dumps(level_json_schema(), indent=2) + "\n", encoding="utf-8")
    print(f"wrote {output}")


if __name__ == "__main__":
    main()
