"""Write docs/gallery.md: every level that comes with Roller, its picture and what is in it.

The pictures are drawn anew, which needs OpenGL; with ``--words`` only the page is written.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import tyro
from PIL import Image

from roller_env import ENV_IDS
from roller_env.drawing.opengl import DrawingUnavailable
from roller_env.drawing.overview import View, render_overview
from roller_env.level import Level, load_level, shipped_levels
from roller_env.level.expand import expand
from roller_env.level.schema import PIECE_FIELDS
from roller_env.replay import load_replay, shipped_replays

DOCS: Final = Path(__file__).resolve().parents[1] / "docs"
PICTURES: Final = Path("images/levels")
SIZE: Final = (960, 600)

VIEWS: Final = {
    # From beyond the upper deck, over which one looks down at the start.
    "classic": View(azimuth_deg=130.0, elevation_deg=-38.0, field_of_view_deg=62.0),
    # Into both rooms.
    "gate": View(azimuth_deg=32.0, elevation_deg=-42.0, field_of_view_deg=40.0),
    "lift": View(azimuth_deg=140.0, elevation_deg=-42.0, field_of_view_deg=66.0),
    # Into its alleys.
    "maze": View(azimuth_deg=32.0, elevation_deg=-58.0, field_of_view_deg=40.0),
}
"""Where to look at a level from, if not as at any other."""

_PLAIN: Final = ("coins", "floors", "boxes", "ramps", "walls", "camera_triggers")
"""Fields that are not worth a word."""

_HEAD: Final = """# Gallery

The levels that come with Roller, from easy to hard. `roller play NAME` plays one; a
replay of each comes with the package, which collects every coin and verifies bit for bit
(`roller replay NAME`). Gold is the finish with every coin within the par time, silver with one of
both, bronze the finish; the par time is at least a fifth more than the solver took.

<!-- Written by scripts/gallery.py. -->
"""


@dataclass(frozen=True, slots=True)
class Arguments:
    """Write the page, and draw the pictures."""

    levels: tuple[str, ...] = shipped_levels()
    """Whose pictures are drawn."""

    words: bool = False
    """Draw nothing."""

    docs: Path = DOCS
    """Directory of the page."""


def page() -> str:
    """Return docs/gallery.md."""
    return _HEAD + "".join(map(_section, shipped_levels()))


def _section(name: str) -> str:
    level = load_level(name)
    (env_id,) = (i for i, options in ENV_IDS.items() if options.get("level") == name)
    result = load_replay(shipped_replays()[name]).result
    pieces = [field.replace("_", " ") for field in PIECE_FIELDS if getattr(level, field)]
    special = [field for field in pieces if field.replace(" ", "_") not in _PLAIN]
    facts = [
        f"`{env_id}`",
        f"{len(expand(level).coins)} coins",
        *([f"par {level.par_time_s:g} s"] if level.par_time_s else []),
        f"replay {result.time_s:.1f} s",
        *([", ".join(special)] if special else []),
    ]
    said = f"{level.description}\n\n" if level.description else ""
    picture = PICTURES / f"{name}.jpg"
    title = level.title or name
    return f"\n## {title}\n\n{said}{' · '.join(facts)}\n\n![{title}]({picture.as_posix()})\n"


def draw(level: Level, directory: Path) -> Path:
    """Draw a level's picture and return the file."""
    picture = render_overview(level, *SIZE, VIEWS.get(level.name))
    file = directory / f"{level.name}.jpg"
    directory.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(file, quality=88)
    return file


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    for name in () if arguments.words else arguments.levels:
        print(draw(load_level(name), arguments.docs / PICTURES))
    file = arguments.docs / "gallery.md"
    file.write_text(page(), encoding="utf-8")
    print(file)


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (DrawingUnavailable, OSError) as error:
        sys.exit(f"gallery.py: {error}")
