"""What an agent is shown, entry by entry.

`STATE_ENTRIES` is the one list from which the layout, the Gymnasium spaces and the README's table
are made.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from roller_env.game.state import GameState
from roller_env.game.tables import Kind, LevelTable

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]
ObservationMode = Literal["state", "rays", "dict", "pixels"]

NEAREST_COINS: Final = 4
"""Coins shown, nearest first."""

HORIZONTAL_RAYS: Final = 16
RAY_RANGE_M: Final = 20.0
SCAN_SIDE: Final = 7
SCAN_SPACING_M: Final = 0.8
"""Twice the ball's radius, so that the scan sees an edge about half a second before the ball is
over it at the speed one key reaches in a second."""
SCAN_ABOVE_M: Final = 2.0
"""Height over the ball's centre from which the scan looks down."""
SCAN_DEPTH_M: Final = 5.0
"""Depth under the ball's lowest point at which the scan stops looking."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One named part of an observation.

    Attributes:
        name: its key in the ``dict`` observation.
        size: how many numbers.
        unit: SI unit, or a dash.
        frame: ``world``, ``ball`` (world axes, origin at the ball's centre) or a dash.
        low: smallest value.
        high: largest value.
        meaning: one line.
    """

    name: str
    size: int
    unit: str
    frame: str
    low: float
    high: float
    meaning: str


_FREE = (-np.inf, np.inf)

STATE_ENTRIES: Final = (
    Entry("position", 3, "m", "world", *_FREE, "ball's centre: x forward, y left, z up"),
    Entry("velocity", 3, "m/s", "world", *_FREE, "velocity of the ball's centre"),
    Entry("angular_velocity", 3, "rad/s", "world", *_FREE, "the ball's spin"),
    Entry("coins_left", 1, "-", "-", 0.0, 1.0, "share of the level's coins still to collect"),
    Entry(
        "coins",
        3 * NEAREST_COINS,
        "m",
        "ball",
        *_FREE,
        f"x, y, z of the {NEAREST_COINS} nearest coins left, nearest first; else 0",
    ),
    Entry("coins_present", NEAREST_COINS, "-", "-", 0.0, 1.0, "1 where `coins` shows a coin"),
    Entry("plate", 3, "m", "ball", *_FREE, "centre of the nearest plate not yet struck; 0 if none"),
    Entry("plate_present", 1, "-", "-", 0.0, 1.0, "1 where `plate` shows a plate"),
    Entry("plate_sinking", 1, "-", "-", 0.0, 1.0, "1 while a struck plate is still sinking"),
    Entry("gate", 3, "m", "ball", *_FREE, "centre of the nearest gate not yet open; 0 if none"),
    Entry("gate_present", 1, "-", "-", 0.0, 1.0, "1 where `gate` shows a gate"),
    Entry("gate_lowered", 1, "-", "-", 0.0, 1.0, "share of its way down that this gate has gone"),
    Entry("pad", 3, "m", "ball", *_FREE, "centre of the nearest lift pad; 0 if none"),
    Entry("pad_present", 1, "-", "-", 0.0, 1.0, "1 where `pad` shows a pad"),
    Entry("thrust_left", 1, "s", "-", 0.0, np.inf, "how much longer a lift pad pushes the ball"),
    Entry("finish", 3, "m", "ball", *_FREE, "centre of the finish"),
    Entry("time_left", 1, "-", "-", 0.0, 1.0, "share of the time limit that is left"),
)

RAY_ENTRIES: Final = (
    Entry(
        "rays",
        HORIZONTAL_RAYS,
        "m",
        "world",
        0.0,
        RAY_RANGE_M,
        f"free distance from the ball's centre in {HORIZONTAL_RAYS} level directions, from +x "
        "towards +y",
    ),
    Entry(
        "heights",
        SCAN_SIDE**2,
        "m",
        "ball",
        -SCAN_DEPTH_M,
        np.inf,
        f"height of the ground over the ball's lowest point on a {SCAN_SIDE} by {SCAN_SIDE} grid "
        f"{SCAN_SPACING_M} m apart, rows from -x to +x, each from -y to +y; "
        f"-{SCAN_DEPTH_M:g} where there is none",
    ),
)


def entries(mode: ObservationMode) -> tuple[Entry, ...]:
    """Return the entries of an observation mode in order; none for ``pixels``."""
    if mode == "pixels":
        return ()
    return STATE_ENTRIES + RAY_ENTRIES if mode == "rays" else STATE_ENTRIES


def layout(parts: Iterable[Entry]) -> dict[str, slice]:
    """Return where each entry lies in the observation vector."""
    result, begin = {}, 0
    for entry in parts:
        result[entry.name] = slice(begin, begin + entry.size)
        begin += entry.size
    return result


_LAYOUT: Final = layout(STATE_ENTRIES)
STATE_SIZE: Final = sum(entry.size for entry in STATE_ENTRIES)


@dataclass(frozen=True, eq=False)
class BallState:
    """The moving bodies as MuJoCo has them, in arrays of rows.

    Attributes:
        position: (N, 3) metres, world frame.
        velocity: (N, 3) m/s, world frame.
        orientation: (N, 4) unit quaternion (w, x, y, z), ball to world.
        spin: (N, 3) rad/s, ball frame.
        gate: (N, G) gates' displacements, metres, <= 0.
    """

    position: Float64
    velocity: Float64
    orientation: Float64
    spin: Float64
    gate: Float64


def state_observation(
    ball: BallState, state: GameState, table: LevelTable, max_steps: Int64
) -> Float32:
    """Return the state vectors, (N, STATE_SIZE) float32, laid out as `STATE_ENTRIES`.

    Args:
        ball: the moving bodies.
        state: the game's state.
        table: the levels of the rows.
        max_steps: (N,) control steps after which an episode is cut off.
    """
    n = len(ball.position)
    out = np.zeros((n, STATE_SIZE), dtype=np.float32)
    out[:, _LAYOUT["position"]] = ball.position
    out[:, _LAYOUT["velocity"]] = ball.velocity
    out[:, _LAYOUT["angular_velocity"]] = rotate(ball.orientation, ball.spin)
    _show_coins(out, ball.position, state, table)
    unstruck = table.exists(Kind.PLATE) & ~state.plate_struck
    _show_nearest(out, "plate", ball.position, table.centres(Kind.PLATE), unstruck)
    out[:, _LAYOUT["plate_sinking"]] = (state.plate_struck & ~state.plate_down).any(
        axis=1, keepdims=True
    )
    _show_gate(out, ball, table)
    pads = table.exists(Kind.LIFT_PAD)
    _show_nearest(out, "pad", ball.position, table.centres(Kind.LIFT_PAD), pads)
    out[:, _LAYOUT["thrust_left"]] = state.thrust_s.max(axis=1, initial=0.0)[:, None]
    out[:, _LAYOUT["finish"]] = table.centres(Kind.FINISH)[:, 0] - ball.position
    out[:, _LAYOUT["time_left"]] = np.maximum(1.0 - state.steps / max_steps, 0.0)[:, None]
    return out


def _show_coins(out: Float32, ball: Float64, state: GameState, table: LevelTable) -> None:
    left = table.exists(Kind.COIN) & ~state.coin_taken
    width = left.shape[1]
    if width == 0:
        return
    out[:, _LAYOUT["coins_left"]] = (left.sum(axis=1) / np.maximum(table.coin_count, 1))[:, None]
    x, y, z = (coin - at[:, None] for coin, at in zip(table.coin_planes, ball.T, strict=True))
    distance = x * x + y * y + z * z
    distance[~left] = np.inf
    shown = min(NEAREST_COINS, width)
    rows = np.arange(len(ball))[:, None]
    if width > NEAREST_COINS:
        nearest = np.argpartition(distance, shown - 1, axis=1)[:, :shown]
        # argpartition leaves the nearest few in no order; equal distances go by number.
        nearest.sort(axis=1)
        nearest = nearest[rows, np.argsort(distance[rows, nearest], axis=1, kind="stable")]
    else:
        nearest = np.argsort(distance, axis=1, kind="stable")
    present = left[rows, nearest]
    vectors = np.stack([axis[rows, nearest] for axis in (x, y, z)], axis=2) * present[..., None]
    begin = _LAYOUT["coins"].start
    out[:, begin : begin + 3 * shown] = vectors.reshape(len(ball), -1)
    begin = _LAYOUT["coins_present"].start
    out[:, begin : begin + shown] = present


def _show_nearest(
    out: Float32, name: str, ball: Float64, centres: Float64, candidates: Bool
) -> Int64:
    """Write the vector to the nearest candidate and whether there is one; return its index."""
    if candidates.shape[1] == 0:
        return np.zeros(len(ball), dtype=np.int64)
    if candidates.shape[1] == 1:
        # Most levels have one of each, and nothing to choose from.
        nearest = np.zeros(len(ball), dtype=np.int64)
        present, vectors = candidates[:, 0], centres[:, 0] - ball
    else:
        relative = centres - ball[:, None, :]
        distance = np.where(candidates, np.einsum("nki,nki->nk", relative, relative), np.inf)
        nearest, rows = distance.argmin(axis=1), np.arange(len(ball))
        present, vectors = candidates[rows, nearest], relative[rows, nearest]
    out[:, _LAYOUT[name]] = np.where(present[:, None], vectors, 0.0)
    out[:, _LAYOUT[f"{name}_present"]] = present[:, None]
    return nearest


def _show_gate(out: Float32, ball: BallState, table: LevelTable) -> None:
    if ball.gate.shape[1] == 0:
        return
    real = table.gate_stop < 0.0
    lowered = np.clip(ball.gate / np.where(real, table.gate_stop, -1.0), 0.0, 1.0)
    centres = table.gate_centre.copy()
    centres[..., 2] += ball.gate
    shut = real & (ball.gate > table.gate_stop)
    nearest = _show_nearest(out, "gate", ball.position, centres, shut)
    rows = np.arange(len(lowered))
    out[:, _LAYOUT["gate_lowered"]] = (lowered * shut)[rows, nearest][:, None]


def rotate(quaternion: Float64, vector: Float64) -> Float64:
    """Return vectors, (N, 3), rotated by unit quaternions (w, x, y, z), (N, 4)."""
    w, x, y, z = quaternion.T
    a, b, c = vector.T
    # Twice the cross product of the quaternion's axis and the vector; numpy.cross takes 5 times
    # as long on a single vector.
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    rotated = (
        a + w * p + (y * r - z * q),
        b + w * q + (z * p - x * r),
        c + w * r + (x * q - y * p),
    )
    return np.stack(rotated, axis=1)


def ray_directions() -> Float64:
    """Return the level rays' directions, (HORIZONTAL_RAYS, 3) unit vectors, world frame."""
    angles = 2.0 * np.pi * np.arange(HORIZONTAL_RAYS) / HORIZONTAL_RAYS
    return np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)


def scan_offsets() -> Float64:
    """Return the height scan's origins minus the ball's centre, (SCAN_SIDE**2, 3) metres."""
    line = (np.arange(SCAN_SIDE) - (SCAN_SIDE - 1) / 2) * SCAN_SPACING_M
    x, y = np.meshgrid(line, line, indexing="ij")
    return np.stack([x.ravel(), y.ravel(), np.full(SCAN_SIDE**2, SCAN_ABOVE_M)], axis=1)


def ray_observation(level_rays: Float64, scan: Float64, ball_radius: Float64) -> Float32:
    """Return the part of the ``rays`` observation that `RAY_ENTRIES` describes, float32.

    Args:
        level_rays: (N, HORIZONTAL_RAYS) metres to the first surface, ``inf`` for none.
        scan: (N, SCAN_SIDE**2) metres downwards from `scan_offsets`, ``inf`` for none.
        ball_radius: (N,) metres.
    """
    heights = SCAN_ABOVE_M + ball_radius[:, None] - scan
    return np.concatenate(
        [np.minimum(level_rays, RAY_RANGE_M), np.maximum(heights, -SCAN_DEPTH_M)], axis=1
    ).astype(np.float32)


def split(observation: Float32, parts: Sequence[Entry]) -> dict[str, Float32]:
    """Return the observation's entries, (..., size), by name."""
    return {name: observation[..., where] for name, where in layout(parts).items()}


def markdown_table(parts: Iterable[Entry]) -> str:
    """Return the entries as the table that the README shows."""
    lines = ["| index | name | meaning | unit | frame | range |", "|---|---|---|---|---|---|"]
    parts = tuple(parts)
    for entry, where in zip(parts, layout(parts).values(), strict=True):
        first, last = where.start, where.stop - 1
        index = f"{first}" if first == last else f"{first} to {last}"
        low, high = f"{entry.low:g}", f"{entry.high:g}"
        lines.append(
            f"| {index} | `{entry.name}` | {entry.meaning} | {entry.unit} | {entry.frame} "
            f"| {low} to {high} |"
        )
    return "\n".join(lines)
