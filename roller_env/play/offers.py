"""The levels that a page offers."""

from __future__ import annotations

from pathlib import Path

from roller_env.assets import LEVELS, asset_directory
from roller_env.config import LevelSource
from roller_env.level import load_level
from roller_env.play.room import Offer


def offers_of(level: LevelSource) -> list[Offer]:
    """Return the shipped levels in order of difficulty, and ``level`` first if it is none of them.

    Raises:
        LevelError: ``level`` is not valid.
    """
    offers = [shipped_offer(name) for name in LEVELS]
    if level not in LEVELS:
        offers.insert(0, Offer(str(level), load_level(level)))
    return offers


def shipped_offer(name: str) -> Offer:
    """Return a shipped level as pages offer it."""
    picture = Path(asset_directory("pictures")) / f"{name}.jpg"
    address = f"/pictures/{name}.jpg" if picture.exists() else None
    return Offer(name, load_level(name), LEVELS.index(name) + 1, address)
