"""The sound of a coin."""

from __future__ import annotations

import subprocess
import sys
import wave
from pathlib import Path

import numpy as np
import pytest

from roller_env.assets import asset_directory
from roller_env.play.sound import COIN, SAMPLE_RATE_HZ, CoinSound
from scripts import make_sounds
from tests.patience import STALLED_S


def samples(path: Path) -> np.ndarray:
    with wave.open(str(path)) as file:
        assert (file.getnchannels(), file.getsampwidth()) == (1, 2)
        assert file.getframerate() == SAMPLE_RATE_HZ
        return np.frombuffer(file.readframes(file.getnframes()), "<i2") / 32768.0


def test_the_shipped_sound_is_what_the_script_makes(tmp_path: Path) -> None:
    make_sounds.main(make_sounds.Arguments(output=tmp_path))
    made, shipped = samples(tmp_path / COIN), samples(asset_directory("sounds") / COIN)
    # Sines differ in the last bit from one C library to another.
    assert made == pytest.approx(shipped, abs=2 / 32768)


def test_the_sound_is_short_clean_and_rings_on_its_two_notes() -> None:
    sound = samples(asset_directory("sounds") / COIN)
    assert 0.2 < len(sound) / SAMPLE_RATE_HZ < 0.6
    assert 0.2 < np.abs(sound).max() < 0.9
    assert abs(sound[0]) < 0.01
    assert abs(sound[-1]) < 0.01
    first = sound[: round(0.075 * SAMPLE_RATE_HZ)]
    for part, note_hz in ((first, 987.77), (sound[len(first) :], 1318.51)):
        spectrum = np.abs(np.fft.rfft(part * np.hanning(len(part)), 2**17))
        loudest = spectrum.argmax() * SAMPLE_RATE_HZ / 2**17
        assert loudest == pytest.approx(note_hz, rel=0.01)


def test_a_muted_game_says_that_it_is() -> None:
    sound = CoinSound(muted=True)
    sound.play()
    assert sound.silent_because == "muted"


PLAY = """
import sys
from roller_env.play.sound import CoinSound
if "without" in sys.argv:
    sys.modules["pygame"] = None
sound = CoinSound()
sound.play()
print(sound.silent_because)
import pygame.mixer
while pygame.mixer.get_busy():
    pass
"""


def in_a_process(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    import os

    return subprocess.run(
        [sys.executable, "-c", PLAY, *arguments],
        capture_output=True,
        text=True,
        timeout=STALLED_S,
        env={**os.environ, **environment},
        check=False,
    )


def test_without_pygame_the_game_is_silent_and_says_how_to_change_that() -> None:
    assert "roller-env[sound]" in in_a_process("without").stdout


def test_without_a_sound_card_the_game_is_silent_and_says_so() -> None:
    pytest.importorskip("pygame", reason="pygame (the extra 'sound') is not installed")
    result = in_a_process(SDL_AUDIODRIVER="no such driver")
    assert "no sound card" in result.stdout


def test_with_a_sound_card_the_sound_goes_to_it(tmp_path: Path) -> None:
    pytest.importorskip("pygame", reason="pygame (the extra 'sound') is not installed")
    played = tmp_path / "played.raw"
    # SDL's driver that writes into a file what a sound card would get.
    result = in_a_process(SDL_AUDIODRIVER="disk", SDL_DISKAUDIOFILE=str(played))
    assert result.stdout.strip() == "None", result.stderr
    heard = np.frombuffer(played.read_bytes(), "<i2") / 32768.0
    assert np.abs(heard).max() == pytest.approx(
        np.abs(samples(asset_directory("sounds") / COIN)).max(), rel=0.05
    )
