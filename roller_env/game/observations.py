"""What an agent is shown, entry by entry.

`STATE_ENTRIES` is the one list from which the layout, the Gymnasium spaces and the table of
docs/environments.md are made.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from roller_env.compiled import compiled
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


@dataclass(slots=True, eq=False)
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
    out = np.zeros((len(ball.position), STATE_SIZE), dtype=np.float32)
    pads, finish = table.centres(Kind.LIFT_PAD), table.centres(Kind.FINISH)
    _show_ball(
        ball.position,
        ball.velocity,
        ball.orientation,
        ball.spin,
        finish,
        state.thrust_s,
        state.steps,
        max_steps,
        out,
    )
    _show_coins(
        ball.position,
        table.coin_at,
        table.coin_order,
        table.coin_x,
        table.coin_count,
        state.coin_taken,
        state.points,
        out,
    )
    _show_plates(
        ball.position,
        table.centres(Kind.PLATE),
        table.exists(Kind.PLATE),
        state.plate_struck,
        state.plate_down,
        out,
    )
    _show_gates(ball.position, ball.gate, table.gate_centre, table.gate_stop, out)
    _show_pads(ball.position, pads, table.exists(Kind.LIFT_PAD), out)
    return out


_ANGULAR_VELOCITY: Final = _LAYOUT["angular_velocity"].start
_COINS_LEFT: Final = _LAYOUT["coins_left"].start
_COINS: Final = _LAYOUT["coins"].start
_COINS_PRESENT: Final = _LAYOUT["coins_present"].start
_PLATE: Final = _LAYOUT["plate"].start
_PLATE_PRESENT: Final = _LAYOUT["plate_present"].start
_PLATE_SINKING: Final = _LAYOUT["plate_sinking"].start
_GATE: Final = _LAYOUT["gate"].start
_GATE_PRESENT: Final = _LAYOUT["gate_present"].start
_GATE_LOWERED: Final = _LAYOUT["gate_lowered"].start
_PAD: Final = _LAYOUT["pad"].start
_PAD_PRESENT: Final = _LAYOUT["pad_present"].start
_THRUST_LEFT: Final = _LAYOUT["thrust_left"].start
_FINISH: Final = _LAYOUT["finish"].start
_TIME_LEFT: Final = _LAYOUT["time_left"].start
_POSITION: Final = _LAYOUT["position"].start
_VELOCITY: Final = _LAYOUT["velocity"].start


@compiled
def _show_ball(
    position: Float64,
    velocity: Float64,
    orientation: Float64,
    spin: Float64,
    finish: Float64,
    thrust_s: Float64,
    steps: Int64,
    max_steps: Int64,
    out: Float32,
) -> None:
    """Write what is shown of the ball itself, its way to the finish and its time."""
    for row in range(len(out)):
        for axis in range(3):
            out[row, _POSITION + axis] = position[row, axis]
            out[row, _VELOCITY + axis] = velocity[row, axis]
            out[row, _FINISH + axis] = finish[row, 0, axis] - position[row, axis]
        turned = rotated(orientation[row], spin[row])
        out[row, _ANGULAR_VELOCITY] = turned[0]
        out[row, _ANGULAR_VELOCITY + 1] = turned[1]
        out[row, _ANGULAR_VELOCITY + 2] = turned[2]
        for pad in range(thrust_s.shape[1]):
            out[row, _THRUST_LEFT] = max(out[row, _THRUST_LEFT], np.float32(thrust_s[row, pad]))
        out[row, _TIME_LEFT] = max(1.0 - steps[row] / max_steps[row], 0.0)


@compiled
def _show_coins(
    ball: Float64,
    coin_at: Float64,
    coin_order: Int64,
    coin_x: Float64,
    coin_count: Int64,
    taken: Bool,
    points: Int64,
    out: Float32,
) -> None:
    """Write the nearest coins left, nearest first; equal distances go by number.

    The coins lie in the order of their x. The search goes outwards from the ball and ends where x
    alone is further than the last of the nearest.
    """
    nearest = np.empty(NEAREST_COINS, dtype=np.int64)
    distance2 = np.empty(NEAREST_COINS)
    for row in range(len(out)):
        count = coin_count[row]
        if count == 0:
            continue
        out[row, _COINS_LEFT] = (count - points[row]) / count
        if np.isnan(ball[row, 0]):
            continue  # No coin is near to nowhere, and the search would not end.
        distance2[:] = np.inf
        nearest[:] = count
        right = np.searchsorted(coin_x[row, :count], ball[row, 0])
        left = right - 1
        while left >= 0 or right < count:
            back = ball[row, 0] - coin_x[row, left] if left >= 0 else np.inf
            ahead = coin_x[row, right] - ball[row, 0] if right < count else np.inf
            if min(back, ahead) ** 2 > distance2[-1]:
                break
            place = left if back <= ahead else right
            left -= back <= ahead
            right += back > ahead
            coin = coin_order[row, place]
            if not taken[row, coin]:
                _keep_nearest(coin, _distance2(coin_at[row, coin], ball[row]), nearest, distance2)
        for place in range(NEAREST_COINS):
            if nearest[place] < count:
                out[row, _COINS_PRESENT + place] = 1.0
                _show_vector(out[row], _COINS + 3 * place, coin_at[row, nearest[place]], ball[row])


@compiled
def _keep_nearest(coin: int, new2: float, nearest: Int64, distance2: Float64) -> None:
    """Put a coin into its place among the nearest, if it is one of them."""
    place = NEAREST_COINS
    while place > 0 and (
        new2 < distance2[place - 1] or (new2 == distance2[place - 1] and coin < nearest[place - 1])
    ):
        place -= 1
        if place < NEAREST_COINS - 1:
            distance2[place + 1], nearest[place + 1] = distance2[place], nearest[place]
    if place < NEAREST_COINS:
        distance2[place], nearest[place] = new2, coin


@compiled
def _show_plates(
    ball: Float64, centre: Float64, real: Bool, struck: Bool, down: Bool, out: Float32
) -> None:
    """Write the nearest plate not yet struck, and whether any is sinking."""
    for row in range(len(out)):
        best, best2 = -1, np.inf
        for plate in range(struck.shape[1]):
            if struck[row, plate] and not down[row, plate]:
                out[row, _PLATE_SINKING] = 1.0
            new2 = _distance2(centre[row, plate], ball[row])
            if real[row, plate] and not struck[row, plate] and new2 < best2:
                best, best2 = plate, new2
        if best >= 0:
            out[row, _PLATE_PRESENT] = 1.0
            _show_vector(out[row], _PLATE, centre[row, best], ball[row])


@compiled
def _show_gates(
    ball: Float64, displacement: Float64, centre: Float64, stop: Float64, out: Float32
) -> None:
    """Write the nearest gate not yet open, where it is now, and how far it has gone."""
    at = np.empty(3)
    for row in range(len(out)):
        best2 = np.inf
        for gate in range(displacement.shape[1]):
            moved = displacement[row, gate]
            at[:] = centre[row, gate]
            at[2] += moved
            new2 = _distance2(at, ball[row])
            # Padding has no way to go: its stop is 0.
            if stop[row, gate] < 0.0 and moved > stop[row, gate] and new2 < best2:
                best2 = new2
                out[row, _GATE_PRESENT] = 1.0
                out[row, _GATE_LOWERED] = min(max(moved / stop[row, gate], 0.0), 1.0)
                _show_vector(out[row], _GATE, at, ball[row])


@compiled
def _show_pads(ball: Float64, centre: Float64, real: Bool, out: Float32) -> None:
    """Write the nearest lift pad."""
    for row in range(len(out)):
        best2 = np.inf
        for pad in range(real.shape[1]):
            new2 = _distance2(centre[row, pad], ball[row])
            if real[row, pad] and new2 < best2:
                best2 = new2
                out[row, _PAD_PRESENT] = 1.0
                _show_vector(out[row], _PAD, centre[row, pad], ball[row])


@compiled
def _distance2(point: Float64, ball: Float64) -> float:
    x, y, z = point[0] - ball[0], point[1] - ball[1], point[2] - ball[2]
    squared: float = x * x + y * y + z * z
    return squared


@compiled
def _show_vector(out: Float32, begin: int, point: Float64, ball: Float64) -> None:
    for axis in range(3):
        out[begin + axis] = point[axis] - ball[axis]


@compiled
def rotated(quaternion: Float64, vector: Float64) -> tuple[float, float, float]:
    """Return a vector, (3,), rotated by a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    a, b, c = vector[0], vector[1], vector[2]
    # Twice the cross product of the quaternion's axis and the vector.
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * p + (y * r - z * q), b + w * q + (z * p - x * r), c + w * r + (x * q - y * p)


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
    """Return the entries as the table that docs/environments.md shows."""
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
