"""Where the game's six cameras are, what they look at, and when one takes over from another."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from roller_env.arrays import Float64, Int64
from roller_env.compiled import compiled, device_function
from roller_env.pieces.camera_trigger import TriggerKind
from roller_env.pieces.rules import CameraAsked
from roller_env.units import METRES_PER_QUANT, quants

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
        [-100.0, 0.0, 80.0],  # where the retreat ends; its x is the state's
        [-10.0, 0.0, 80.0],
        [-1.0, 0.0, -80.0],
        [10.0, 0.0, 0.0],
        [80.0, 0.0, 80.0],
    ]
)
"""Camera minus ball in each mode, metres, world frame (`camera1` of the original)."""

_OFFSET_X: Final = np.ascontiguousarray(OFFSETS_M[:, 0])

RETREAT_SPEED_M_S: Final = quants(16.0)
"""Speed of the camera in mode 1: one quant in a tick of 1/16 s."""

_RETREAT: Final = int(TriggerKind.RETREAT)

FIRST_PERSON_LOOKS: Final = (1.0, 0.0, 0.0)
"""Unit vector, world frame. `camera1` never turns the camera in mode 4, and W pushes along +x: so W
is forward for whoever looks, wherever the ball rolls."""


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


def camera_target(mode: Int64, ball: Float64) -> Float64:
    """Return the points, (N, 3) metres, that the cameras look at.

    It is the ball, but in first person a point a metre ahead along `FIRST_PERSON_LOOKS`.

    Args:
        mode: (N,) 0 to 5.
        ball: (N, 3) ball centres, metres.
    """
    ahead = ball + OFFSETS_M[MODE_FIRST_PERSON] + FIRST_PERSON_LOOKS
    return np.where((mode == MODE_FIRST_PERSON)[:, None], ahead, ball)


class CameraState(NamedTuple):
    """What the cameras of N envs own.

    Attributes:
        mode: (N,) 0 to 5.
        x: (N,) world x of the camera while it retreats (mode 1), metres.
    """

    mode: Int64
    x: Float64

    @staticmethod
    def initial(num_envs: int) -> CameraState:
        """Return the state at the start of an episode."""
        return CameraState(np.zeros(num_envs, dtype=np.int64), np.zeros(num_envs))


@compiled
def retreat(env: int, duration_s: float, ball_x: float, camera: CameraState) -> None:
    """Move an env's camera in mode 1 back for a time; 100 quants behind the ball begins mode 0."""
    camera.x[env] -= RETREAT_SPEED_M_S * duration_s
    if camera.x[env] <= ball_x + _OFFSET_X[MODE_BEHIND]:
        camera.mode[env] = MODE_BEHIND


@device_function
def settle(
    env: int, duration_s: float, ball_x: float, asked: CameraAsked, camera: CameraState
) -> None:
    """Change an env's camera as the step's pieces have asked, or let it retreat.

    A camera that retreats heeds nothing: the original's loop looks at nothing but where the ball is
    and ends in mode 0, whatever was set meanwhile, by a lift pad too.
    """
    if camera.mode[env] == MODE_RETREAT:
        retreat(env, duration_s, ball_x, camera)
        return
    if asked.overhead[env]:
        camera.mode[env] = MODE_OVERHEAD
    if asked.trigger[env] == _RETREAT:
        camera.x[env] = ball_x + _OFFSET_X[camera.mode[env]]
        camera.mode[env] = MODE_RETREAT
    elif asked.trigger[env] >= 0:
        camera.mode[env] = MODE_FIRST_PERSON
    if asked.behind[env]:
        camera.mode[env] = MODE_BEHIND
