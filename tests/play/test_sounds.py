"""The sounds that the page plays."""

from __future__ import annotations

import re
import wave
from pathlib import Path

import numpy as np
import pytest

from roller_env.assets import asset_directory
from scripts import make_sounds

PAGE = Path(__file__).parents[2] / "page" / "src" / "sound.ts"


def samples(path: Path) -> np.ndarray:
    with wave.open(str(path)) as file:
        assert (file.getnchannels(), file.getsampwidth()) == (1, 2)
        assert file.getframerate() == make_sounds.SAMPLE_RATE_HZ
        return np.frombuffer(file.readframes(file.getnframes()), "<i2") / 32768.0


def shipped() -> dict[str, Path]:
    return {path.stem: path for path in asset_directory("sounds").glob("*.wav")}


def test_the_shipped_sounds_are_what_the_script_makes(tmp_path: Path) -> None:
    make_sounds.main(make_sounds.Arguments(output=tmp_path))
    assert {path.stem for path in tmp_path.iterdir()} == set(shipped())
    for name, path in shipped().items():
        # Sines differ in the last bit from one C library to another.
        assert samples(tmp_path / f"{name}.wav") == pytest.approx(samples(path), abs=2 / 32768)


def test_the_page_plays_every_sound_and_no_other() -> None:
    union = re.search(r"type SoundName = ([^;]+);", PAGE.read_text())
    assert union is not None
    assert set(re.findall(r'"(\w+)"', union[1])) == set(shipped())


def test_the_sounds_are_short_clean_and_small() -> None:
    for path in shipped().values():
        sound = samples(path)
        assert 0.1 < len(sound) / make_sounds.SAMPLE_RATE_HZ < 1.0
        assert 0.2 < np.abs(sound).max() < 0.9
        assert abs(sound[0]) < 0.01
        assert abs(sound[-1]) < 0.01
    assert sum(path.stat().st_size for path in shipped().values()) < 150_000


@pytest.mark.parametrize(
    ("name", "notes"), [("coin", make_sounds.COIN_NOTES), ("finish", make_sounds.FINISH_NOTES)]
)
def test_a_chime_rings_on_its_notes(name: str, notes: tuple[tuple[float, float], ...]) -> None:
    sound, rate = samples(shipped()[name]), make_sounds.SAMPLE_RATE_HZ
    ends = [begin for _, begin in notes[1:]] + [notes[-1][1] + 0.15]
    for (note_hz, begin), end in zip(notes, ends, strict=True):
        part = sound[round(begin * rate) : round(end * rate)]
        spectrum = np.abs(np.fft.rfft(part * np.hanning(len(part)), 2**17))
        assert spectrum.argmax() * rate / 2**17 == pytest.approx(note_hz, rel=0.02)
