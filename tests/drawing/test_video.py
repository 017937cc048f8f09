"""Films."""

from __future__ import annotations

from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from roller_env.drawing.canvas import Picture
from roller_env.drawing.overview import render_overview
from roller_env.drawing.video import panel_lines, with_panel, write_video
from tests.builders import Game
from tests.drawing.course import COIN, START, course


def frames(count: int) -> list[Picture]:
    """Return pictures that brighten."""
    return [np.full((48, 64, 3), 10 * index, dtype=np.uint8) for index in range(count)]


def test_a_film_has_all_its_frames(tmp_path: Path) -> None:
    file = write_video(iter(frames(12)), tmp_path / "new" / "film.mp4", fps=20)
    assert file == tmp_path / "new" / "film.mp4"
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(file))
    assert count == 12
    assert seconds == pytest.approx(0.6, abs=0.06)


def test_a_gif_has_all_its_frames_and_goes_on_for_ever(tmp_path: Path) -> None:
    file = write_video(iter(frames(12)), tmp_path / "film.gif", fps=20)
    with Image.open(file) as film:
        assert getattr(film, "n_frames", 1) == 12
        assert film.info["loop"] == 0
        assert film.info["duration"] == 50


def test_a_film_without_frames_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least one"):
        write_video([], tmp_path / "film.mp4", fps=20)


def test_a_coin_counts_ten_points_on_a_films_panel() -> None:
    game = Game(course(coins=[{"at": START}, {"at": COIN}], time_limit_s=0.1))
    game.play(0.05)
    assert panel_lines(game.simulation) == ["10 points   0.1 s", "1 of 2 coins"]
    game.play(0.05)
    assert panel_lines(game.simulation)[2] == "time limit: 50 %"


def test_the_panel_says_how_the_game_stands() -> None:
    game = Game(course(time_limit_s=0.1))
    black = np.zeros((240, 320, 3), dtype=np.uint8)
    running = with_panel(black, game.simulation)
    game.play(0.1)
    over = with_panel(black, game.simulation)
    assert running.shape == black.shape
    assert 0 < (running > 200).sum() < (over > 200).sum()


@pytest.mark.usefixtures("opengl")
def test_an_overview_is_a_picture_of_the_size_asked_for() -> None:
    picture = render_overview(course(), 160, 100)
    assert picture.shape == (100, 160, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500
