"""The version of the rules, which whoever keeps a game writes beside it."""

from __future__ import annotations

from typing import Final

RULES_VERSION: Final = 1
"""Raised by every change after which the same actions on the same path of the ball could give
another game: which events there are, when and in what order; what they do to plates, gates, pads,
the keys and the end of an episode; what is rewarded; where a level's text puts its pieces. Not by
cameras and drawing, nor by what an observation shows. `docs/replays.md` says what follows."""
