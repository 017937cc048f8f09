"""What an agent is shown, entry by entry.

`STATE_ENTRIES` is the one list from which the layout, the Gymnasium spaces and the table of
docs/environments.md are made.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, Literal

import numpy as np

from roller_env.arrays import Float32, Float64
from roller_env.compiled import device_function
from roller_env.game.kinds import RULES
from roller_env.pieces.piece import ExpandedLevel
from roller_env.pieces.rules import Entry, fraction_entry

ObservationMode = Literal["state", "rays", "dict", "pixels"]
Kinds = Literal["level", "all"]
"""Whose entries are shown besides those of the basic kinds: what the levels have, or everything."""

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


_FREE: Final = (-np.inf, np.inf)

BALL_ENTRIES: Final = (
    Entry("position", 3, "m", "world", *_FREE, "ball's centre: x forward, y left, z up"),
    Entry("velocity", 3, "m/s", "world", *_FREE, "velocity of the ball's centre"),
    Entry("angular_velocity", 3, "rad/s", "world", *_FREE, "the ball's spin"),
)

STATE_ENTRIES: Final = (
    *BALL_ENTRIES,
    *(entry for rules in RULES if rules.is_basic for entry in rules.entries),
    fraction_entry("time_left", "share of the time limit that is left"),
)
"""The ball's, those of the basic kinds of pieces in their order, and the time: of every level."""

MORE_ENTRIES: Final = tuple(
    entry for rules in RULES if not rules.is_basic for entry in rules.entries
)
"""Those of the other kinds, which come next, each where there are such pieces."""

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


def state_entries(levels: Iterable[ExpandedLevel]) -> tuple[Entry, ...]:
    """Return the entries of the state of games on some levels, in order."""
    there = {kind.rules for level in levels for kind in level.pieces}
    more = [e for rules in RULES if rules in there and not rules.is_basic for e in rules.entries]
    return (*STATE_ENTRIES, *more)


def entries(
    mode: ObservationMode, kinds: Kinds = "level", levels: Iterable[ExpandedLevel] = ()
) -> tuple[Entry, ...]:
    """Return the entries of an observation in order; none of ``pixels``.

    Args:
        mode: how it is observed.
        kinds: whose entries are shown besides those of the basic kinds.
        levels: that are played.
    """
    if mode == "pixels":
        return ()
    state = STATE_ENTRIES + MORE_ENTRIES if kinds == "all" else state_entries(levels)
    return state + RAY_ENTRIES if mode == "rays" else state


def layout(parts: Iterable[Entry]) -> dict[str, slice]:
    """Return where each entry lies in the observation vector."""
    result, begin = {}, 0
    for entry in parts:
        result[entry.name] = slice(begin, begin + entry.size)
        begin += entry.size
    return result


STATE_SIZE: Final = sum(entry.size for entry in STATE_ENTRIES)
"""Of the entries of every level."""


@device_function
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


def markdown_table(parts: Iterable[Entry], begin: int = 0) -> str:
    """Return the entries as a table of docs/environments.md, in which the first has an index."""
    lines = ["| index | name | meaning | unit | frame | range |", "|---|---|---|---|---|---|"]
    parts = tuple(parts)
    for entry, where in zip(parts, layout(parts).values(), strict=True):
        first, last = begin + where.start, begin + where.stop - 1
        index = f"{first}" if first == last else f"{first} to {last}"
        low, high = f"{entry.low:g}", f"{entry.high:g}"
        lines.append(
            f"| {index} | `{entry.name}` | {entry.meaning} | {entry.unit} | {entry.frame} "
            f"| {low} to {high} |"
        )
    return "\n".join(lines)
