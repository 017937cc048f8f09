"""The rules of Roller, once, over (num_envs, ...).

A control step of the game is: `controls` says what the motors do, the physics moves the ball along
a path, `find_events` says what the ball met on it and when, `apply` draws the consequences. The
order in which events at the same moment count is that of `roller_env.game.tables.Kind`: coins,
plates, lift pads, camera triggers, finish; then the fall.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.game import cameras
from roller_env.game.state import GameState
from roller_env.game.sweep import find_entries
from roller_env.game.tables import Kind, LevelTable, TriggerKind

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

INTRO_S: Final = 6.0
"""Time from loading a level to control: one second of splash screen, five of the intro panel."""

OVERHEAD_DELAY_S: Final = 100.0 / 60.0
"""`flipcam` waits 100 frames, at the nominal 60 frames a second."""


@dataclass(frozen=True, eq=False)
class Controls:
    """What the actuators do during one control step; see `CompiledLevel` for their addresses.

    Attributes:
        force_n: (N, 3) mean force on the ball over the step, world frame.
        plate_velocity: (N, P) m/s, down is negative.
        gate_velocity: (N, G) m/s.
    """

    force_n: Float64
    plate_velocity: Float64
    gate_velocity: Float64


@dataclass(frozen=True, eq=False)
class Motion:
    """Where the physics took the ball and the slabs in one control step of S substeps.

    Attributes:
        ball: (N, S + 1, 3) ball centres before the first substep and after each, world frame.
        plate: (N, P) plates' displacements from where they began, at the end, <= 0.
        velocity: (N, 3) the ball's velocity at the end, world frame.
        duration_s: length of the control step.
    """

    ball: Float64
    plate: Float64
    velocity: Float64
    duration_s: float


@dataclass(frozen=True, eq=False)
class Events:
    """What happened in one control step.

    Attributes:
        entry: (N, M) time in substeps at which the ball entered each region and it counted;
            ``inf`` where it did not.
        inside: (N, M) which regions the ball is in at the end.
        coins: (N, K) coins collected.
        plates: (N, P) plates struck.
        pads: (N, A) lift pads fired.
        triggers: (N, T) camera triggers fired.
        finished: (N,) the finish was reached.
        fallen: (N,) the ball fell below the kill height.
        end: (N,) substep time of the finish or fall, ``inf`` if neither.
    """

    entry: Float64
    inside: Bool
    coins: Bool
    plates: Bool
    pads: Bool
    triggers: Bool
    finished: Bool
    fallen: Bool
    end: Float64


def controls(
    state: GameState, table: LevelTable, key_force_n: Float64, duration_s: float
) -> Controls:
    """Return what the actuators do in the next step, given the keys' force (N, 2).

    Timers that end within the step act for their share of it, so that no impulse depends on the
    length of the control step.
    """
    force = np.zeros((len(key_force_n), 3))
    force[:, :2] = key_force_n
    if state.control_delay_s.any():
        held = np.clip(1.0 - state.control_delay_s / duration_s, 0.0, 1.0)
        force[:, :2] *= held[:, None]
    if state.thrust_s.any():
        thrust = np.minimum(state.thrust_s / duration_s, 1.0) * table.pad_force_n
        force[:, 2] = thrust.sum(axis=1)
    return Controls(
        force_n=force,
        plate_velocity=np.where(state.plate_struck, -table.plate_speed, 0.0),
        gate_velocity=np.where(state.gate_opening, -table.gate_speed, 0.0),
    )


def find_events(state: GameState, table: LevelTable, motion: Motion) -> Events:
    """Return what the ball met on its path, as the game stood when the step began."""
    entry, inside = find_entries(motion.ball, table, state.touching, _live(state, table))
    finish = entry[:, table.slices[Kind.FINISH]].min(axis=1)
    fall = _time_of_fall(motion.ball, table.kill_height)
    end = np.minimum(finish, fall)
    met = entry < np.inf
    ends = end < np.inf
    if ends.any():
        # What lies behind the end of the game did not happen.
        met &= entry <= end[:, None]
        entry[~met] = np.inf
    return Events(
        entry=entry,
        inside=inside,
        coins=met[:, table.slices[Kind.COIN]],
        plates=met[:, table.slices[Kind.PLATE]],
        pads=met[:, table.slices[Kind.LIFT_PAD]],
        triggers=met[:, table.slices[Kind.TRIGGER]],
        finished=ends & (finish <= fall),
        fallen=fall < finish,
        end=end,
    )


def _live(state: GameState, table: LevelTable) -> Bool:
    """Say which regions, (N, M), can do something if the ball enters them."""
    live = np.ones(state.touching.shape, dtype=bool)
    live[:, table.slices[Kind.COIN]] = ~state.coin_taken
    live[:, table.slices[Kind.PLATE]] = ~state.plate_struck
    live[:, table.slices[Kind.TRIGGER]] = ~state.trigger_spent
    return live


def _time_of_fall(ball: Float64, kill_height: Float64) -> Float64:
    """Return the substep time, (N,), at which the ball first is at or below the kill height."""
    below = ball[:, :, 2] <= kill_height[:, None]
    time = np.full(len(ball), np.inf)
    if not below.any():
        return time
    rows = np.flatnonzero(below.any(axis=1))
    after = below[rows].argmax(axis=1)
    before = np.maximum(after - 1, 0)
    high, low = ball[rows, before, 2], ball[rows, after, 2]
    drop = np.where(after > 0, high - low, 1.0)
    share = np.where(after > 0, (high - kill_height[rows]) / drop, 0.0)
    time[rows] = before + share
    return time


def apply(state: GameState, table: LevelTable, motion: Motion, events: Events) -> None:
    """Change ``state`` by a step's events and by the passing of its time."""
    state.steps += 1
    if state.control_delay_s.any():
        state.control_delay_s = np.maximum(state.control_delay_s - motion.duration_s, 0.0)
    state.coin_taken |= events.coins
    state.touching = events.inside
    _move_slabs(state, table, motion, events)
    _fire_pads(state, table, motion, events)
    _move_camera(state, table, motion, events)
    state.finished |= events.finished
    state.fallen |= events.fallen


def _move_slabs(state: GameState, table: LevelTable, motion: Motion, events: Events) -> None:
    """Start struck plates, see which have arrived, and open their gates."""
    state.plate_struck |= events.plates
    state.plate_down |= state.plate_struck & (motion.plate <= table.plate_stop)
    state.gate_opening |= (state.plate_down[:, :, None] & table.plate_opens).any(axis=1)


def _fire_pads(state: GameState, table: LevelTable, motion: Motion, events: Events) -> None:
    """Let the timers of pushing pads run, and start those of the pads entered.

    A pad that is still pushing does not fire again, so that its push never lasts longer.
    """
    if not (events.pads.any() or state.thrust_s.any()):
        return
    fires = events.pads & (state.thrust_s <= 0.0)
    remaining = np.maximum(state.thrust_s - motion.duration_s, 0.0)
    # Sums of control steps miss a timer's end by rounding: what is left then is no time at all.
    remaining[remaining < 1e-9] = 0.0
    state.thrust_s = np.where(fires, table.pad_duration_s, remaining)


def _move_camera(state: GameState, table: LevelTable, motion: Motion, events: Events) -> None:
    """Change the cameras' modes as triggers, pads and timers say."""
    ball = motion.ball[:, -1]
    state.camera_heading = cameras.follow_heading(state.camera_heading, motion.velocity)
    cameras.retreat(state.camera_mode, ball, state.camera_x, motion.duration_s)
    if np.isfinite(state.camera_delay_s).any():
        state.camera_delay_s -= motion.duration_s
        due = state.camera_delay_s <= 1e-9
        state.camera_mode[due.any(axis=1)] = cameras.MODE_OVERHEAD
        state.camera_delay_s[due] = np.inf
    first_person = events.inside[:, table.slices[Kind.TRIGGER]] & (
        table.trigger_kind == TriggerKind.FIRST_PERSON
    )
    if events.triggers.any() or first_person.any():
        _fire_triggers(state, table, ball, events, first_person)
    # The original sets mode 0 in every frame of the push.
    if state.thrust_s.any():
        state.camera_mode[(state.thrust_s > 0.0).any(axis=1)] = cameras.MODE_BEHIND


def _fire_triggers(
    state: GameState, table: LevelTable, ball: Float64, events: Events, first_person: Bool
) -> None:
    """Let the triggers entered act; where several set a mode in one step, the latest counts.

    A first-person trigger acts all the time that the ball is in it (``first_person``, (N, T)).
    """
    fired = events.triggers
    overhead = fired & (table.trigger_kind == TriggerKind.OVERHEAD)
    state.camera_delay_s[overhead] = np.minimum(state.camera_delay_s[overhead], OVERHEAD_DELAY_S)
    retreat = fired & (table.trigger_kind == TriggerKind.RETREAT)
    state.trigger_spent |= retreat
    sets_mode = first_person | (fired & ~overhead)
    time = np.where(sets_mode, events.entry[:, table.slices[Kind.TRIGGER]], -np.inf)
    time[first_person & ~fired] = 0.0
    rows = np.flatnonzero(sets_mode.any(axis=1))
    latest = time.shape[1] - 1 - time[rows, ::-1].argmax(axis=1)
    goes_back = retreat[rows, latest]
    back = rows[goes_back]
    now = cameras.camera_position(state.camera_mode[back], ball[back], state.camera_x[back])
    state.camera_x[back] = now[:, 0]
    state.camera_mode[rows] = np.where(goes_back, cameras.MODE_RETREAT, cameras.MODE_FIRST_PERSON)
