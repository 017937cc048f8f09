"""How long tests wait for other processes: no clock decides whether the game is right."""

from __future__ import annotations

from typing import Final

STALLED_S: Final = 600.0
"""After which what neither ends nor goes on is taken for dead. A machine that has other things to
do may take minutes to import torch, to compile the rules and to open a page."""
