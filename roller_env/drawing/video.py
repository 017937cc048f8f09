"""Films of episodes, with points and time written on them."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from roller_env.drawing.canvas import Picture
from roller_env.game.state import COIN_ON_PANELS
from roller_env.simulation import Simulation

_MP4_QUALITY: Final = 8
"""On imageio-ffmpeg's scale from 0 to 10; below 7 the chequered floors smear."""


def write_video(frames: Iterable[Picture], file: Path, fps: int) -> Path:
    """Write pictures as an MP4 film, or as a GIF where there is no ffmpeg.

    Args:
        frames: (H, W, 3) uint8, of equal and even sizes.
        file: where to; a suffix ``.gif`` asks for a GIF.
        fps: pictures a second.

    Returns:
        The path written: ``file``, with the suffix ``.gif`` in place of its own without ffmpeg.

    Raises:
        ValueError: there are no frames.
    """
    iterator = iter(frames)
    first = next(iterator, None)
    if first is None:
        raise ValueError("frames: found none; a film has at least one")
    file.parent.mkdir(parents=True, exist_ok=True)
    if file.suffix == ".gif" or not _has_ffmpeg():
        file = file.with_suffix(".gif")
        _write_gif(first, iterator, file, fps)
    else:
        _write_mp4(first, iterator, file, fps)
    return file


def _has_ffmpeg() -> bool:
    """Say whether imageio-ffmpeg is here and brought, or finds, an ffmpeg for this machine."""
    try:
        importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        return False
    return True


def _write_mp4(first: Picture, others: Iterator[Picture], file: Path, fps: int) -> None:
    height, width, _ = first.shape
    imageio_ffmpeg = importlib.import_module("imageio_ffmpeg")
    writer = imageio_ffmpeg.write_frames(
        str(file), (width, height), fps=fps, quality=_MP4_QUALITY, macro_block_size=2
    )
    writer.send(None)
    try:
        for frame in chain([first], others):
            writer.send(np.ascontiguousarray(frame))
    finally:
        writer.close()


def _write_gif(first: Picture, others: Iterator[Picture], file: Path, fps: int) -> None:
    Image.fromarray(first).save(
        file,
        save_all=True,
        append_images=(Image.fromarray(frame) for frame in others),
        duration=round(1000 / fps),
        loop=0,
    )


def panel_lines(simulation: Simulation, row: int = 0) -> list[str]:
    """Return what the panel says of a game: points, coins and time, and how it ended."""
    result = simulation.result(row)
    lines = [
        f"{COIN_ON_PANELS * result.coins} points   {result.time_s:.1f} s",
        f"{result.coins} of {simulation.coins_in_level[row]} coins",
    ]
    if simulation.state.over[row]:
        lines.append(f"{result.outcome}: {result.score_percent:.0f} %")
    return lines


def with_panel(picture: Picture, simulation: Simulation, row: int = 0) -> Picture:
    """Return a picture with the game's points, time and end written on it."""
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image, "RGBA")
    height = picture.shape[0]
    font = ImageFont.load_default(size=max(height // 18, 10))
    margin = height // 40
    text = "\n".join(panel_lines(simulation, row))
    left, top, right, bottom = draw.textbbox((2 * margin, 2 * margin), text, font=font)
    box = (left - margin, top - margin, right + margin, bottom + margin)
    draw.rounded_rectangle(box, radius=margin, fill=(16, 24, 40, 150))
    draw.text((2 * margin, 2 * margin), text, font=font, fill=(255, 255, 255, 255))
    return np.asarray(image)
