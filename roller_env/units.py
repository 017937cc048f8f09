"""The two length units of the game, and the one number that ties them.

The original engine (3D GameStudio) measures in quants of one inch; its own rule of thumb
9.81 m/s^2 = 386 quant/s^2 confirms the factor. Inside the package every length is in metres.
"""

from __future__ import annotations

from typing import Final

METRES_PER_QUANT: Final = 0.0254


def quants(value: float) -> float:
    """Return a length of ``value`` quants in metres (or a speed, quant/s, in m/s)."""
    return value * METRES_PER_QUANT
