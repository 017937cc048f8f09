"""What flashes when something happens: drawn, never simulated, and gone after its time.

The finish's particles are scenery and need no event: `roller_env.drawing.stage` lets them fly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from roller_env.arrays import Bool, Float64
from roller_env.units import quants

Colour = tuple[float, float, float]

FLARE_GROWTH_PER_S: Final = 48.0
FLARE_FADING_PER_S: Final = 32.0
FLARE_LIFE_S: Final = 100.0 / FLARE_FADING_PER_S
"""`EXPLOFLARE2`: its scale grows by 48 a second, its alpha falls from 100 by 32 a second."""

FLARE_RADIUS_M: Final = quants(0.5)
"""Radius at scale 1, so that the scale is the flare's width in quants; the original leaves it to
a bitmap that is lost."""

FLARE_ALPHA: Final = 0.35
"""Opacity where the original's alpha is 100: the ball is to be seen through a flare."""

WHITE: Final[Colour] = (1.0, 1.0, 1.0)
CORE_SHARE: Final = 0.45
"""Radius of the white light within a flare, of the flare's."""

MAX_FLARES: Final = 64
"""Flares alive at once; more coins than that in three seconds put out the oldest."""


class Light(NamedTuple):
    """A shining sphere.

    Attributes:
        position: metres, world frame.
        radius_m: its radius.
        colour: red, green, blue, 0 to 1.
        alpha: opacity, 0 to 1.
    """

    position: tuple[float, float, float]
    radius_m: float
    colour: Colour
    alpha: float


@dataclass(frozen=True, slots=True)
class Flare:
    """The flare of one collected coin."""

    position: tuple[float, float, float]
    colour: Colour
    born_s: float

    def lights(self, clock_s: float) -> tuple[Light, ...]:
        """Return what is seen of it at a time: nothing after `FLARE_LIFE_S`."""
        age = clock_s - self.born_s
        if not 0.0 <= age < FLARE_LIFE_S:
            return ()
        radius = FLARE_RADIUS_M * FLARE_GROWTH_PER_S * age
        alpha = FLARE_ALPHA * (1.0 - age / FLARE_LIFE_S)
        core = Light(self.position, CORE_SHARE * radius, WHITE, alpha)
        return (core, Light(self.position, radius, self.colour, alpha))


class Flares:
    """The flares of one game: one where each coin was, from when it is collected."""

    def __init__(self, coins: Float64, generator: np.random.Generator | None = None):
        """Watch ``coins``, (K, 3) metres.

        Args:
            coins: where they lie.
            generator: of the colours; never one that the game uses.
        """
        self._coins = coins
        self._taken: Bool = np.zeros(len(coins), dtype=bool)
        self._generator = generator or np.random.default_rng()
        self._burning: list[Flare] = []

    def watch(self, taken: Bool, clock_s: float) -> int:
        """Light a flare for every coin newly in ``taken``, (K,); return how many.

        A coin that is back, because the game has begun again, puts out all flares.
        """
        if (self._taken & ~taken).any():
            self._burning.clear()
        fresh = np.flatnonzero(taken & ~self._taken)
        for coin in fresh:
            x, y, z = self._coins[coin].tolist()
            # Not black: a light has at least one strong colour.
            colour = self._generator.uniform(0.2, 1.0, 3)
            red, green, blue = (colour / colour.max()).tolist()
            self._burning.append(Flare((x, y, z), (red, green, blue), clock_s))
        del self._burning[:-MAX_FLARES]
        self._taken = taken.copy()
        return len(fresh)

    def lights(self, clock_s: float) -> list[Light]:
        """Return what is seen of all flares at a time; those that are over are forgotten."""
        self._burning = [f for f in self._burning if clock_s - f.born_s < FLARE_LIFE_S]
        return [light for flare in self._burning for light in flare.lights(clock_s)]
