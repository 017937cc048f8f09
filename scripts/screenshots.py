"""Draw a picture of every shipped level into docs/images: `python scripts/screenshots.py`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Final

from PIL import Image

from roller_env.drawing.opengl import DrawingUnavailable
from roller_env.drawing.overview import View, render_overview
from roller_env.level import load_level, shipped_levels

DIRECTORY: Final = Path(__file__).resolve().parents[1] / "docs" / "images"

VIEWS: Final = {
    # From beyond the upper deck, over which one looks down at the start.
    "classic": View(azimuth_deg=130.0, elevation_deg=-38.0, field_of_view_deg=62.0),
    # Into both rooms.
    "gate": View(azimuth_deg=32.0, elevation_deg=-42.0, field_of_view_deg=40.0),
    "lift": View(azimuth_deg=140.0, elevation_deg=-42.0, field_of_view_deg=66.0),
}
"""Where to look at a level from, if not as at any other."""


def main() -> int:
    """Draw the levels named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("levels", nargs="*", default=shipped_levels(), metavar="level")
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--height", type=int, default=800)
    parser.add_argument("--directory", type=Path, default=DIRECTORY)
    arguments = parser.parse_args()
    arguments.directory.mkdir(parents=True, exist_ok=True)
    for name in arguments.levels:
        level = load_level(name)
        try:
            picture = render_overview(
                level, arguments.width, arguments.height, VIEWS.get(level.name)
            )
        except DrawingUnavailable as error:
            print(error, file=sys.stderr)
            return 1
        file = arguments.directory / f"{level.name}.png"
        Image.fromarray(picture).save(file)
        print(file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
