"""The sound of a coin.

It is played by the machine that runs the game: Studio's page has no sound, so through a tunnel
nothing is heard. Without pygame (the extra ``sound``) or without a sound card the game is silent.
"""

from __future__ import annotations

import os
from typing import Any, Final

from roller_env.assets import asset_directory

COIN: Final = "coin.wav"
SAMPLE_RATE_HZ: Final = 44_100
BUFFER_SAMPLES: Final = 512
"""A sound is at most this much late: 12 ms."""


class CoinSound:
    """Plays the sound of a coin, or nothing where nothing can be played.

    Attributes:
        silent_because: why nothing is heard; None if something is.
    """

    def __init__(self, muted: bool = False):
        """Open the sound card, unless ``muted``."""
        self._sound: Any = None
        self.silent_because: str | None = "muted" if muted else self._open()

    def play(self) -> None:
        """Play it once; does not wait."""
        if self._sound is not None:
            self._sound.play()

    def _open(self) -> str | None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError:
            return "pygame is not installed; 'pip install roller-env[sound]' brings it"
        try:
            pygame.mixer.init(frequency=SAMPLE_RATE_HZ, channels=1, buffer=BUFFER_SAMPLES)
        except pygame.error as error:
            return f"there is no sound card to play on: {error}"
        self._sound = pygame.mixer.Sound(str(asset_directory("sounds") / COIN))
        return None
