"""Where the game's six cameras are, what they look at, and when one takes over from another."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.compiled import compiled
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


class TriggerKind(IntEnum):
    """What a camera trigger does; see `roller_env.level.schema.CameraTrigger`."""

    OVERHEAD = 0
    RETREAT = 1
    FIRST_PERSON = 2


_OVERHEAD: Final = int(TriggerKind.OVERHEAD)
_RETREAT: Final = int(TriggerKind.RETREAT)
_FIRST_PERSON: Final = int(TriggerKind.FIRST_PERSON)

OVERHEAD_DELAY_S: Final = 100.0 / 60.0
"""`flipcam` waits 100 frames, at the nominal 60 frames a second."""

OVERHEAD_WAITS: Final = 8
"""Entries of one game that can wait at once. `flipcam` runs once for every impact: each entry sets
mode 2 at the end of a wait of its own, and other events may set other modes in between. A ball that
enters more often in `OVERHEAD_DELAY_S` turns round every fifth of a second; the newest entry then
takes the place of the one before."""

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


def retreat(mode: Int64, ball: Float64, camera_x: Float64, duration_s: float) -> None:
    """Move the cameras in mode 1 back for a time; at 100 quants behind the ball mode 0 begins.

    Changes ``mode`` and ``camera_x``, both (N,), in place.
    """
    _retreat(RETREAT_SPEED_M_S * duration_s, OFFSETS_M[MODE_BEHIND, 0], ball, mode, camera_x)


@compiled
def _retreat(way_m: float, behind_m: float, ball: Float64, mode: Int64, camera_x: Float64) -> None:
    for row in range(len(mode)):
        if mode[row] == MODE_RETREAT:
            camera_x[row] -= way_m
            if camera_x[row] <= ball[row, 0] + behind_m:
                mode[row] = MODE_BEHIND


def move(
    duration_s: float,
    ball: Float64,
    kind: Int64,
    fired: Bool,
    inside: Bool,
    entry: Float64,
    thrust_s: Float64,
    spent: Bool,
    delay_s: Float64,
    mode: Int64,
    camera_x: Float64,
) -> None:
    """Change the cameras as triggers, lift pads and timers say, after a step.

    A camera that retreats heeds nothing: the original's loop looks at nothing but where the ball is
    and ends in mode 0, whatever was set meanwhile, by a lift pad too.

    Changes ``spent``, ``delay_s``, ``mode`` and ``camera_x`` in place; they are those of
    `roller_env.game.state.GameState`.

    Args:
        duration_s: of the step.
        ball: (N, 3) where it ended, metres.
        kind: (N, T) `TriggerKind`.
        fired: (N, T) the triggers that the ball entered.
        inside: (N, T) those that it is in.
        entry: (N, T) when it entered, substeps.
        thrust_s: (N, A) how much longer the lift pads push.
        spent: (N, T) one-time triggers that are dead.
        delay_s: (N, W) times until mode 2 is set, in order; ``inf`` where no entry waits.
        mode: (N,) camera modes.
        camera_x: (N,) world x of cameras in mode 1, metres.
    """
    retreats = mode == MODE_RETREAT
    retreat(mode, ball, camera_x, duration_s)
    _move(
        duration_s,
        OFFSETS_M[:, 0],
        retreats,
        ball,
        kind,
        fired,
        inside,
        entry,
        thrust_s,
        spent,
        delay_s,
        mode,
        camera_x,
    )


@compiled
def _move(
    duration_s: float,
    offset_x: Float64,
    retreats: Bool,
    ball: Float64,
    kind: Int64,
    fired: Bool,
    inside: Bool,
    entry: Float64,
    thrust_s: Float64,
    spent: Bool,
    delay_s: Float64,
    mode: Int64,
    camera_x: Float64,
) -> None:
    for row in range(len(mode)):
        is_due = _overhead_is_due(row, duration_s, delay_s)
        setting = _fire_triggers(row, kind, fired, inside, entry, spent, delay_s)
        if retreats[row]:
            continue
        if is_due:
            mode[row] = MODE_OVERHEAD
        if setting >= 0 and kind[row, setting] == _RETREAT:
            camera_x[row] = ball[row, 0] + offset_x[mode[row]]
            mode[row] = MODE_RETREAT
        elif setting >= 0:
            mode[row] = MODE_FIRST_PERSON
        # The original sets mode 0 in every frame of the push.
        for pad in range(thrust_s.shape[1]):
            if thrust_s[row, pad] > 0.0:
                mode[row] = MODE_BEHIND


@compiled
def _overhead_is_due(row: int, duration_s: float, delay_s: Float64) -> bool:
    """Let the times run that entries of `TriggerKind.OVERHEAD` wait; say whether one has ended."""
    waiting, is_due = 0, False
    for place in range(delay_s.shape[1]):
        left = delay_s[row, place] - duration_s
        delay_s[row, place] = np.inf
        # Sums of control steps miss the end by rounding.
        if left > 1e-9:
            delay_s[row, waiting] = left
            waiting += 1
        else:
            is_due = True
    return is_due


@compiled
def _wait_for_overhead(row: int, delay_s: Float64) -> None:
    """Let one more entry wait, behind the others; two of one step are one."""
    place = 0
    while place < delay_s.shape[1] - 1 and delay_s[row, place] < OVERHEAD_DELAY_S:
        place += 1
    delay_s[row, place] = OVERHEAD_DELAY_S


@compiled
def _fire_triggers(
    row: int, kind: Int64, fired: Bool, inside: Bool, entry: Float64, spent: Bool, delay_s: Float64
) -> int:
    """Let a row's triggers act; return which of them sets the mode, or -1.

    Where several do in one step, the latest counts. A first-person trigger acts all the time that
    the ball is in it.
    """
    setting, latest = -1, -np.inf
    for trigger in range(kind.shape[1]):
        time = entry[row, trigger] if fired[row, trigger] else 0.0
        acts = fired[row, trigger]
        if kind[row, trigger] == _FIRST_PERSON:
            acts = acts or inside[row, trigger]
        elif acts and kind[row, trigger] == _OVERHEAD:
            _wait_for_overhead(row, delay_s)
            acts = False
        elif acts:
            spent[row, trigger] = True
        if acts and time >= latest:
            setting, latest = trigger, time
    return setting
