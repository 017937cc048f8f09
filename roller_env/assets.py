"""Where the files that come with the package lie: the only place that knows.

A wheel holds them inside the package, in ``roller_env/assets``. A checkout, which an editable
installation is as well, has them where people look for them: in ``assets`` and ``configs``.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Final, Literal

from roller_env.problems import listed

Kind = Literal["levels", "replays", "sounds", "pictures", "page", "generated", "configs"]

LEVELS: Final = (
    "flat",
    "corners",
    "slopes",
    "ice",
    "bridge",
    "wind",
    "springs",
    "pinball",
    "gate",
    "locks",
    "portals",
    "lava",
    "lift",
    "rails",
    "race",
    "ferry",
    "elevators",
    "maze",
    "classic",
    "finale",
)
"""The levels, from the easy ones to the hard ones, as people find them."""

_IN_A_CHECKOUT: Final[dict[Kind, str]] = {
    "levels": "assets/levels",
    "replays": "assets/replays",
    "sounds": "assets/sounds",
    "pictures": "docs/images/levels",
    "page": "assets/page",
    "generated": "assets/generated",
    "configs": "configs",
}


def asset_directory(kind: Kind) -> Path:
    """Return the directory of the files of one kind.

    Raises:
        FileNotFoundError: the installation has lost it.
    """
    package = Path(str(resources.files("roller_env")))
    places = (package / "assets" / kind, package.parent / _IN_A_CHECKOUT[kind])
    for place in places:
        if place.is_dir():
            return place
    raise FileNotFoundError(f"no directory of {kind}; looked for {listed([*map(str, places)])}")
