"""Films and contact sheets show the replay's moments, in as many pictures as its time asks for."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

from roller_env.replay.pictures import GIF_FPS, SHEET_COLUMNS, SHEET_ROWS, contact_sheet, film
from tests.replay.recording import straight_on, wandered

pytestmark = pytest.mark.usefixtures("opengl")

SIZE = (96, 64)


def test_a_film_has_a_picture_for_every_part_of_its_time(tmp_path: Path) -> None:
    played = straight_on("flat", 40, physics="fast")
    file = film(played, tmp_path / "game.gif", size=SIZE)
    with Image.open(file) as picture:
        durations = [frame.info["duration"] for frame in ImageSequence.Iterator(picture)]
        assert picture.size == SIZE
    # Two seconds of play, and a second's standstill; equal pictures are joined into one.
    assert sum(durations) == pytest.approx(1000 * (2.0 + 1.0), abs=2000 / GIF_FPS)
    assert len(durations) > 15


def test_a_contact_sheet_shows_different_moments(tmp_path: Path) -> None:
    file = contact_sheet(wandered("flat"), tmp_path / "sheets" / "game.png", size=SIZE)
    with Image.open(file) as sheet:
        pixels = np.asarray(sheet.convert("RGB")).astype(int)
    height, width = SIZE[1], SIZE[0]
    assert pixels.shape[1] > SHEET_COLUMNS * width
    assert pixels.shape[0] > SHEET_ROWS * height
    tiles = [
        pixels[-(row * (height + 12) + 12 + height) :][:height, 12 : 12 + width]
        for row in range(SHEET_ROWS)
    ]
    assert all(tile.std() > 10.0 for tile in tiles)
    assert all(np.abs(one - other).mean() > 2.0 for one, other in itertools.pairwise(tiles))
