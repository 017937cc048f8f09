"""The original's units of length and time, and the numbers that tie them to SI.

The original engine (3D GameStudio) measures in quants of one inch; its own rule of thumb
9.81 m/s^2 = 386 quant/s^2 confirms the factor. Inside the package every length is in metres.
"""

from __future__ import annotations

from typing import Final

METRES_PER_QUANT: Final = 0.0254

SCRIPT_RATE_HZ: Final = 60.0
"""Nominal rate of the original's script loops: its waits are counted in frames."""


def quants(value: float) -> float:
    """Return a length of ``value`` quants in metres (or a speed, quant/s, in m/s)."""
    return value * METRES_PER_QUANT


def frames(count: float) -> float:
    """Return how long ``count`` frames of the original's script take, seconds."""
    return count / SCRIPT_RATE_HZ
