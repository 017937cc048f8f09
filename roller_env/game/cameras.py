"""Where the game's six cameras are and what they look at."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.units import METRES_PER_QUANT, quants

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

MODE_BEHIND: Final = 0
MODE_RETREAT: Final = 1
MODE_OVERHEAD: Final = 2
MODE_BELOW: Final = 3
MODE_FIRST_PERSON: Final = 4
MODE_FRONT: Final = 5

MODES: Final = ("behind", "retreat", "overhead", "below", "first_person", "front")
"""Names of the camera modes, by number."""

OFFSETS_M: Final = METRES_PER_QUANT * np.array(
    [
        [-100.0, 0.0, 80.0],
        [-100.0, 0.0, 80.0],  # where the retreat ends; its x is the state's camera_x
        [-10.0, 0.0, 80.0],
        [-1.0, 0.0, -80.0],
        [10.0, 0.0, 0.0],
        [80.0, 0.0, 80.0],
    ]
)
"""Camera minus ball in each mode, metres, world frame (`camera1` of the original)."""

RETREAT_SPEED_M_S: Final = quants(16.0)
"""Speed of the camera in mode 1: one quant in a tick of 1/16 s."""

HEADING_SPEED_M_S: Final = 0.1
"""The first-person camera follows the direction of motion above this speed and keeps the last
direction below it, where the direction would be noise."""


def camera_position(mode: Int64, ball: Float64, camera_x: Float64) -> Float64:
    """Return the cameras' positions, (N, 3) metres, world frame.

    Args:
        mode: (N,) 0 to 5.
        ball: (N, 3) ball centres, metres.
        camera_x: (N,) world x of cameras in mode 1, metres.
    """
    position: Float64 = ball + OFFSETS_M[mode]
    position[:, 0] = np.where(mode == MODE_RETREAT, camera_x, position[:, 0])
    return position


def camera_target(mode: Int64, ball: Float64, heading: Float64) -> Float64:
    """Return the points, (N, 3) metres, that the cameras look at.

    It is the ball, but in first person a point ahead along ``heading``, (N, 3) unit vectors.
    """
    ahead = ball + OFFSETS_M[MODE_FIRST_PERSON] + heading
    return np.where((mode == MODE_FIRST_PERSON)[:, None], ahead, ball)


def retreat(mode: Int64, ball: Float64, camera_x: Float64, duration_s: float) -> None:
    """Move the cameras in mode 1 back for a time; at 100 quants behind the ball mode 0 begins.

    Changes ``mode`` and ``camera_x``, both (N,), in place.
    """
    retreating = mode == MODE_RETREAT
    if not retreating.any():
        return
    camera_x[retreating] -= RETREAT_SPEED_M_S * duration_s
    mode[retreating & (camera_x <= ball[:, 0] + OFFSETS_M[MODE_BEHIND, 0])] = MODE_BEHIND


def follow_heading(heading: Float64, velocity: Float64) -> Float64:
    """Return the direction of motion, (N, 3), or the last one where the ball hardly moves."""
    speed = np.sqrt((velocity * velocity).sum(axis=1))[:, None]
    direction: Float64 = np.where(
        speed > HEADING_SPEED_M_S, velocity / np.maximum(speed, HEADING_SPEED_M_S), heading
    )
    return direction
