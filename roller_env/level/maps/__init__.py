"""Levels as `.map` files of TrenchBroom and other editors for Quake: read and written."""

from __future__ import annotations

from roller_env.level.maps.read import ImportedMap, parse_map, read_map
from roller_env.level.maps.write import ExportedMap, export_map

__all__ = ["ExportedMap", "ImportedMap", "export_map", "parse_map", "read_map"]
