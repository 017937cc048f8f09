"""Textures, painted with NumPy: floors, the ball, the sky, the chequered finish."""

from __future__ import annotations

from functools import cache
from typing import Final, Literal

import mujoco
import numpy as np

from roller_env.arrays import Float64

Colour = tuple[float, float, float]

TILE_PIXELS: Final = 256
CUBE_PIXELS: Final = 256
CHECKS_PER_TILE: Final = 2

_RIM_SHARE: Final = 2.5 / 64.0
"""Height of the bright rim round a slab, in tiles: two and a half quants."""

_CUBE_AXES: Final = np.array(
    [
        # Towards the face, along its columns, down its rows: OpenGL's faces +x -x +y -y +z -z.
        [[1, 0, 0], [0, 0, -1], [0, -1, 0]],
        [[-1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[0, 1, 0], [1, 0, 0], [0, 0, 1]],
        [[0, -1, 0], [1, 0, 0], [0, 0, -1]],
        [[0, 0, 1], [1, 0, 0], [0, -1, 0]],
        [[0, 0, -1], [-1, 0, 0], [0, -1, 0]],
    ],
    dtype=np.float64,
)


def parse_colour(colour: str) -> tuple[Colour, float]:
    """Return red, green and blue of ``#rrggbb`` or ``#rrggbbaa``, and alpha, all 0 to 1."""
    numbers = [int(colour[i : i + 2], 16) / 255.0 for i in range(1, len(colour), 2)]
    return (numbers[0], numbers[1], numbers[2]), numbers[3] if len(numbers) == 4 else 1.0


def add_texture(
    spec: mujoco.MjSpec, name: str, kind: Literal["2d", "cube", "skybox"], pixels: Float64
) -> None:
    """Add ``pixels``, (height, width, 3) from 0 to 1, as a texture; cubes stack their faces."""
    texture = spec.add_texture(
        name=name,
        type=getattr(mujoco.mjtTexture, f"mjTEXTURE_{kind.upper()}"),
        width=pixels.shape[1],
        height=pixels.shape[0],
        nchannel=3,
    )
    texture.data = np.round(np.clip(pixels, 0.0, 1.0) * 255.0).astype(np.uint8).tobytes()


def floor_pixels(colour: Colour, pattern: str) -> Float64:
    """Return one tile of a floor: plain, or two by two checks or squares of a grid."""
    base = np.array(colour)
    pixels = np.broadcast_to(base, (TILE_PIXELS, TILE_PIXELS, 3)).copy()
    if pattern == "plain":
        return pixels
    place = np.arange(TILE_PIXELS) * CHECKS_PER_TILE / TILE_PIXELS
    check, within = place.astype(int), place % 1.0
    if pattern == "checker":
        light = (check[:, None] + check[None, :]) % 2 == 0
        pixels = np.where(light[..., None], _towards_white(base, 0.16), base * 0.86)
    # Distance to the nearest edge of the square, in squares.
    edge = np.minimum(within, 1.0 - within)
    edge = np.minimum(edge[:, None], edge[None, :])
    line = np.clip(1.5 - edge * TILE_PIXELS / CHECKS_PER_TILE / 2.0, 0.0, 1.0)[..., None]
    tint = _towards_white(base, 0.45) if pattern == "grid" else base * 0.62
    strength = 0.75 if pattern == "grid" else 0.5
    # A light that falls off towards the joints makes the squares look like tiles.
    shade = 1.0 - 0.10 * np.exp(-edge / 0.06)[..., None]
    return pixels * shade * (1.0 - strength * line) + tint * strength * line


def edge_pixels(colour: Colour) -> Float64:
    """Return the edge of a slab: a bright rim, and below it a darkening body."""
    base = np.array(colour)
    depth = (np.arange(TILE_PIXELS) + 0.5)[:, None] / TILE_PIXELS
    body = base * np.interp(depth, [0.0, 0.25, 1.0], [0.72, 0.50, 0.34])
    rim = np.clip((_RIM_SHARE - depth) * TILE_PIXELS, 0.0, 1.0)
    column = rim * _towards_white(base, 0.6) + (1.0 - rim) * body
    return np.broadcast_to(column[:, None, :], (TILE_PIXELS, TILE_PIXELS, 3)).copy()


def chequered_pixels(squares: int) -> Float64:
    """Return a black and white board of ``squares`` by ``squares``."""
    check = np.arange(TILE_PIXELS) * squares // TILE_PIXELS
    white = (check[:, None] + check[None, :]) % 2 == 0
    return np.where(white[..., None], 0.96, 0.06) * np.ones(3)


def ball_pixels(colours: tuple[Colour, Colour, Colour], wedges: int) -> Float64:
    """Return a beach ball's cube: wedges of two colours between caps of a third."""
    first, second, cap = (np.array(colour) for colour in colours)
    direction = cube_directions()
    longitude = np.arctan2(direction[..., 1], direction[..., 0]) / (2.0 * np.pi) * wedges
    pixels = np.where((np.floor(longitude) % 2 == 0)[..., None], first, second)
    height = np.abs(direction[..., 2])[..., None]
    seam = np.abs(longitude - np.round(longitude))[..., None] * np.sqrt(1.0 - height**2)
    pixels = np.where(seam < 0.035, 0.15, pixels)
    pixels = np.where(height > 0.86, cap, pixels)
    return np.where(np.abs(height - 0.86) < 0.025, 0.15, pixels).reshape(-1, CUBE_PIXELS, 3)


@cache
def sky_pixels() -> Float64:
    """Return the sky's cube: deep blue overhead, haze at the horizon, a sea of cloud below."""
    # MuJoCo hangs the sky's cube with OpenGL's y upwards.
    direction = cube_directions()[..., [0, 2, 1]] * [1.0, -1.0, 1.0]
    up = direction[..., 2]
    stops = np.array([-1.0, -0.45, -0.08, 0.0, 0.12, 0.45, 1.0])
    colours = np.array(
        [
            [0.17, 0.32, 0.52],
            [0.36, 0.55, 0.74],
            [0.72, 0.83, 0.92],
            [0.93, 0.93, 0.90],
            [0.70, 0.84, 0.95],
            [0.33, 0.60, 0.88],
            [0.13, 0.34, 0.68],
        ]
    )
    sky = np.stack([np.interp(up, stops, colours[:, i]) for i in range(3)], axis=-1)
    cover = _clouds(direction) * np.interp(np.abs(up), [0.03, 0.15, 0.6, 1.0], [0.0, 1.0, 0.8, 0.5])
    sky = sky + (1.0 - sky) * (0.65 * cover)[..., None]
    return sky.reshape(-1, CUBE_PIXELS, 3)


def _clouds(direction: Float64) -> Float64:
    """Return how much cloud there is in each direction, 0 to 1: waves of four sizes, summed."""
    generator = np.random.default_rng(7)
    # Looking along a layer of cloud squeezes it: the layer is a plane over and under the viewer.
    flat = direction[..., :2] / (np.abs(direction[..., 2:]) + 0.25)
    total = np.zeros(direction.shape[:-1])
    for octave in range(4):
        for _ in range(5):
            angle, phase = generator.uniform(0.0, 2.0 * np.pi, 2)
            wave = np.array([np.cos(angle), np.sin(angle)]) * 2.2 * 1.9**octave
            bend = 0.6 * np.sin(flat[..., ::-1] @ wave * 0.7 + phase)
            total += 0.58**octave * np.sin(flat @ wave + phase + bend)
    return np.clip(0.5 + total / 5.0 - 0.35, 0.0, 1.0)


def cube_directions() -> Float64:
    """Return the unit vectors, (6, n, n, 3), from a cube's middle to its faces' pixels."""
    place = (np.arange(CUBE_PIXELS) + 0.5) / CUBE_PIXELS * 2.0 - 1.0
    rows, columns = np.meshgrid(place, place, indexing="ij")
    out, right, down = (_CUBE_AXES[:, i, None, None, :] for i in range(3))
    direction: Float64 = out + columns[..., None] * right + rows[..., None] * down
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    return direction


def _towards_white(colour: Float64, share: float) -> Float64:
    return colour + (1.0 - colour) * share
