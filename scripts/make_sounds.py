"""Make the sounds of the game: assets/sounds/*.wav, from sines and noise.

Example::

    python scripts/make_sounds.py
"""

from __future__ import annotations

import wave
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
import tyro

Samples = npt.NDArray[np.float64]

SAMPLE_RATE_HZ: Final = 22_050
"""Nothing in these sounds is higher than 8 kHz."""

LOUDNESS: Final = 0.35
"""Of the loudest sample of a sound, of what a file can hold."""

FADE_S: Final = 0.02
"""A sound ends this softly, so that it does not click."""

ATTACK_S: Final = 0.002
OVERTONES: Final = ((1.0, 1.0), (2.0, 0.35), (3.01, 0.15))
"""Multiple of the frequency and strength: slightly out of tune, as a struck disc is."""

COIN_NOTES: Final = ((987.77, 0.0), (1318.51, 0.075))
"""Frequency in Hz and beginning in seconds: B5, and E6 a fourth above it, as coins have chimed
since the arcades."""

FINISH_NOTES: Final = ((523.25, 0.0), (659.26, 0.1), (783.99, 0.2), (1046.5, 0.3))
"""Likewise: C5, E5, G5, C6, a chord from below."""


@dataclass(frozen=True, slots=True)
class Arguments:
    """Make the sounds of the game."""

    output: Path = Path("assets/sounds")
    """Directory to write into."""


def main(arguments: Arguments) -> None:
    """Write every sound."""
    arguments.output.mkdir(parents=True, exist_ok=True)
    for name, sound in SOUNDS.items():
        path = arguments.output / f"{name}.wav"
        write(path, sound())
        print(f"{path}: {path.stat().st_size} bytes")


def coin() -> Samples:
    """Return the chime of a coin."""
    return chimes(COIN_NOTES, length_s=0.45, decay_s=0.11)


def finish() -> Samples:
    """Return the chord of the finish."""
    return chimes(FINISH_NOTES, length_s=0.8, decay_s=0.2)


def plate() -> Samples:
    """Return the click of a plate that goes down: wood on metal."""
    time = moments(0.18)
    body = np.sin(2.0 * np.pi * 190.0 * time) + 0.6 * np.sin(2.0 * np.pi * 430.0 * time)
    click = noise(time, 1500.0, 6000.0) * np.exp(-time / 0.006)
    return finished(time, body * np.exp(-time / 0.035) + click)


def gate() -> Samples:
    """Return the rumble of a gate that slides into the ground."""
    time = moments(0.5)
    rattle = 0.65 + 0.35 * np.sin(2.0 * np.pi * 19.0 * time)
    swell = np.minimum(time / 0.05, 1.0) * np.minimum((0.5 - time) / 0.25, 1.0)
    hum = 0.5 * np.sin(2.0 * np.pi * 72.0 * time)
    return finished(time, (noise(time, 120.0, 900.0) * rattle + hum) * swell)


def pad() -> Samples:
    """Return the whoosh of a pad that throws the ball up."""
    time = moments(0.4)
    swell = np.minimum(time / 0.03, 1.0) * np.exp(-time / 0.18)
    tone = glide(time, 170.0, 880.0)
    return finished(time, (tone + 0.5 * noise(time, 600.0, 3000.0)) * swell)


def landing() -> Samples:
    """Return the thump of a ball that hits something."""
    time = moments(0.18)
    thump = glide(time, 150.0, 55.0) * np.exp(-time / 0.05)
    slap = 0.5 * noise(time, 300.0, 2000.0) * np.exp(-time / 0.012)
    return finished(time, thump + slap)


def fall() -> Samples:
    """Return the whistle of a ball that falls into the void."""
    time = moments(0.55)
    tremor = 1.0 + 0.12 * np.sin(2.0 * np.pi * 13.0 * time)
    swell = np.minimum(time / 0.02, 1.0) * np.exp(-time / 0.3)
    return finished(time, glide(time, 760.0, 110.0) * tremor * swell)


SOUNDS: Final[dict[str, Callable[[], Samples]]] = {
    "coin": coin,
    "plate": plate,
    "gate": gate,
    "pad": pad,
    "landing": landing,
    "fall": fall,
    "finish": finish,
}


def moments(length_s: float) -> Samples:
    """Return the times of a sound's samples, seconds."""
    return np.arange(round(length_s * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ


def chimes(notes: tuple[tuple[float, float], ...], length_s: float, decay_s: float) -> Samples:
    """Return struck discs.

    Args:
        notes: of each, its frequency in Hz and its beginning in seconds.
        length_s: of the sound.
        decay_s: in which a note's keynote falls to 1/e.
    """
    time = moments(length_s)
    total = np.zeros_like(time)
    for frequency, beginning in notes:
        since = np.maximum(time - beginning, 0.0)
        swell = np.minimum(since / ATTACK_S, 1.0) * np.exp(-since / decay_s)
        for multiple, strength in OVERTONES:
            tone = np.sin(2.0 * np.pi * frequency * multiple * since)
            total += strength * swell**multiple * tone
    return finished(time, total)


def glide(time: Samples, first_hz: float, last_hz: float) -> Samples:
    """Return a sine whose frequency goes from one to the other, evenly in octaves."""
    octaves = np.log2(last_hz / first_hz)
    frequency = first_hz * 2.0 ** (octaves * time / time[-1])
    phase = np.cumsum(frequency) / SAMPLE_RATE_HZ
    tone: Samples = np.sin(2.0 * np.pi * (phase - phase[0]))
    return tone


def noise(time: Samples, low_hz: float, high_hz: float) -> Samples:
    """Return noise between two frequencies, always the same, at most 1."""
    spectrum = np.fft.rfft(np.random.default_rng(0).standard_normal(len(time)))
    frequency = np.fft.rfftfreq(len(time), 1.0 / SAMPLE_RATE_HZ)
    spectrum[(frequency < low_hz) | (frequency > high_hz)] = 0.0
    samples = np.fft.irfft(spectrum, len(time))
    loudest: Samples = samples / np.abs(samples).max()
    return loudest


def finished(time: Samples, samples: Samples) -> Samples:
    """Return samples that begin and end in silence, and are as loud as all sounds."""
    begin = np.minimum(time / ATTACK_S, 1.0)
    end = np.minimum((time[-1] - time) / FADE_S, 1.0)
    faded = begin * end * samples
    sound: Samples = LOUDNESS * faded / np.abs(faded).max()
    return sound


def write(path: Path, samples: Samples) -> None:
    """Write one channel of 16 bits a sample."""
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(SAMPLE_RATE_HZ)
        file.writeframes(np.round(samples * 32767.0).astype("<i2").tobytes())


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
