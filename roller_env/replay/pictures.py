"""Films and contact sheets of replays."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final, Literal

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from roller_env.drawing.canvas import Picture
from roller_env.drawing.renderer import GameRenderer
from roller_env.drawing.video import with_panel, write_video
from roller_env.level.expand import expand
from roller_env.replay.contents import Replay
from roller_env.replay.playback import Playback

Camera = int | Literal["game"]

MP4_FPS: Final = 30.0
GIF_FPS: Final = 10.0
"""At most so many pictures a second; a film shows every control step, or every n-th."""

END_S: Final = 1.0
"""How long a film stands still at its end."""

SHEET_COLUMNS: Final = 4
SHEET_ROWS: Final = 4
_GAP: Final = 12
_TITLE_HEIGHT: Final = 64
_PAPER: Final = (245, 246, 248)
_INK: Final = (24, 32, 48)


def film(
    replay: Replay,
    file: Path,
    camera: Camera = "game",
    size: tuple[int, int] = (480, 320),
) -> Path:
    """Film a replay from its start to its end.

    Args:
        replay: what to film.
        file: where to; the suffix ``.gif`` asks for a GIF, anything else for MP4.
        camera: a camera mode, or "game" for the one that the game sets.
        size: width and height in pixels, both even.

    Returns:
        The path written; see `roller_env.drawing.video.write_video`.

    Raises:
        DrawingUnavailable: there is no OpenGL here.
    """
    playback = Playback(replay)
    fastest = GIF_FPS if file.suffix == ".gif" else MP4_FPS
    step_s = playback.simulation.duration_s
    stride = max(1, int(np.ceil(1.0 / (fastest * step_s) - 1e-9)))
    fps = max(1, round(1.0 / (stride * step_s)))
    renderer = GameRenderer(playback.simulation, *size)
    try:
        return write_video(_pictures(playback, renderer, camera, stride, fps), file, fps)
    finally:
        renderer.close()


def contact_sheet(
    replay: Replay, file: Path, camera: Camera = "game", size: tuple[int, int] = (480, 320)
) -> Path:
    """Draw moments at equal distances in time, from the first to the last, on one sheet.

    Args:
        replay: what to draw.
        file: where to; its suffix says what kind of picture it becomes.
        camera: a camera mode, or "game" for the one that the game sets.
        size: of each moment, width and height in pixels.

    Returns:
        The path written.

    Raises:
        DrawingUnavailable: there is no OpenGL here.
        ValueError: no kind of picture has this suffix.
    """
    width, height = size
    sheet = Image.new(
        "RGB",
        (
            SHEET_COLUMNS * (width + _GAP) + _GAP,
            SHEET_ROWS * (height + _GAP) + _GAP + _TITLE_HEIGHT,
        ),
        _PAPER,
    )
    draw = ImageDraw.Draw(sheet)
    title, facts = _captions(replay)
    draw.text((_GAP, _GAP), title, font=ImageFont.load_default(size=24), fill=_INK)
    draw.text((_GAP, _GAP + 32), facts, font=ImageFont.load_default(size=16), fill=_INK)
    playback = Playback(replay)
    renderer = GameRenderer(playback.simulation, *size)
    moments = np.linspace(0, len(playback), SHEET_COLUMNS * SHEET_ROWS).round().astype(int)
    try:
        for number, moment in enumerate(moments.tolist()):
            playback.seek(moment)
            picture = with_panel(renderer.render(0, camera), playback.simulation)
            row, column = divmod(number, SHEET_COLUMNS)
            place = (_GAP + column * (width + _GAP), _GAP + _TITLE_HEIGHT + row * (height + _GAP))
            sheet.paste(Image.fromarray(picture), place)
    finally:
        renderer.close()
    file.parent.mkdir(parents=True, exist_ok=True)
    sheet.save(file)
    return file


def _pictures(
    playback: Playback, renderer: GameRenderer, camera: Camera, stride: int, fps: int
) -> Iterator[Picture]:
    picture = with_panel(renderer.render(0, camera), playback.simulation)
    yield picture
    while playback.step < len(playback):
        playback.seek(playback.step + stride)
        picture = with_panel(renderer.render(0, camera), playback.simulation)
        yield picture
    for _ in range(round(END_S * fps)):
        yield picture


def _captions(replay: Replay) -> tuple[str, str]:
    level, result = replay.level, replay.result
    played = f"{replay.player or 'unknown player'}, {result.time_s:.1f} s to: {result.outcome}"
    in_level = len(expand(level).coins)
    coins = f"{result.coins} of {in_level} coins ({result.score_percent:.0f} %)"
    preset = replay.options.preset.name
    return level.title or level.name, f"{played}, {coins}, level {level.name}, physics {preset}"
