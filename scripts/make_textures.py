"""Paint the textures of Roller's materials for TrenchBroom: `python scripts/make_textures.py`.

They lie in ``assets/trenchbroom/textures/roller``, by the names of materials; a map names them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from PIL import Image

from roller_env.arrays import UInt8
from roller_env.level.maps.entities import MATERIALS, TRIGGER
from roller_env.level.schema import BUILT_IN_MATERIALS, Material

DIRECTORY: Final = Path(__file__).resolve().parents[1] / "assets/trenchbroom/textures/roller"
SIZE: Final = 64
"""Pixels, and map units: those of a cell of the original's floors."""

DARKER: Final = 0.8


def painted(material: Material) -> UInt8:
    """Return a tile of a material, (`SIZE`, `SIZE`, 3)."""
    colour = [int(material.colour[k : k + 2], 16) for k in (1, 3, 5)]
    y, x = np.mgrid[:SIZE, :SIZE]
    dark = np.zeros((SIZE, SIZE), dtype=bool)
    if material.pattern == "checker":
        dark = (x * 2 // SIZE + y * 2 // SIZE) % 2 == 1
    elif material.pattern == "grid":
        dark = (x % SIZE < 2) | (y % SIZE < 2)
    shade = np.where(dark, DARKER, 1.0)[..., None]
    return (shade * colour).astype(np.uint8)


def main() -> None:
    DIRECTORY.mkdir(parents=True, exist_ok=True)
    materials = {
        **{name: Material.model_validate(fields) for name, fields in MATERIALS.items()},
        **BUILT_IN_MATERIALS,
        TRIGGER: Material(colour="#c060c0", pattern="checker"),
    }
    for name, material in materials.items():
        Image.fromarray(painted(material)).save(DIRECTORY / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
