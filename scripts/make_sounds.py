"""Make the sounds of the game: assets/sounds/*.wav, from sines.

Example::

    python scripts/make_sounds.py
"""

from __future__ import annotations

import wave
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import tyro

from roller_env.play.sound import COIN, SAMPLE_RATE_HZ

COIN_NOTES = ((987.77, 0.0), (1318.51, 0.075))
"""Frequency in Hz and beginning in seconds: B5, and E6 a fourth above it, as coins have chimed
since the arcades."""
COIN_LENGTH_S = 0.45
DECAY_S = 0.11
ATTACK_S = 0.002
OVERTONES = ((1.0, 1.0), (2.0, 0.35), (3.01, 0.15))
"""Multiple of the frequency and strength: slightly out of tune, as a struck disc is."""
LOUDNESS = 0.35


@dataclass(frozen=True, slots=True)
class Arguments:
    """Make the sounds of the game."""

    output: Path = Path("assets/sounds")
    """Directory to write into."""


def main(arguments: Arguments) -> None:
    """Write every sound."""
    arguments.output.mkdir(parents=True, exist_ok=True)
    path = arguments.output / COIN
    write(path, coin())
    print(f"{path}: {path.stat().st_size} bytes")


def coin() -> npt.NDArray[np.float64]:
    """Return the chime of a coin, samples from -1 to 1."""
    time = np.arange(round(COIN_LENGTH_S * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ
    total = np.zeros_like(time)
    for frequency, beginning in COIN_NOTES:
        since = np.maximum(time - beginning, 0.0)
        swell = np.minimum(since / ATTACK_S, 1.0) * np.exp(-since / DECAY_S)
        for multiple, strength in OVERTONES:
            tone = np.sin(2.0 * np.pi * frequency * multiple * since)
            total += strength * swell**multiple * tone
    fade = np.minimum((COIN_LENGTH_S - time) / 0.02, 1.0)
    sound: npt.NDArray[np.float64] = LOUDNESS * fade * total / np.abs(total).max()
    return sound


def write(path: Path, samples: npt.NDArray[np.float64]) -> None:
    """Write one channel of 16 bits a sample."""
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(SAMPLE_RATE_HZ)
        file.writeframes(np.round(samples * 32767.0).astype("<i2").tobytes())


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
