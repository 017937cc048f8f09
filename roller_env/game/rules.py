"""The rules of Roller, once, over (num_envs, ...).

A control step of the game is: `controls` says what the motors do, the physics moves the ball along
a path, `roller_env.game.sweep.find_events` says what the ball met on it and when, `apply` draws the
consequences. Events at the same moment count in this order: coins; plates, lift pads, camera
triggers, finish, as `roller_env.game.tables.Kind` has them; the fall.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from roller_env.compiled import compiled
from roller_env.game import cameras, slabs
from roller_env.game.state import GameState
from roller_env.game.sweep import Events, Motion
from roller_env.game.tables import Kind, LevelTable

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

SPLASH_S: Final = 1.0
"""`main` freezes the game while it shows the splash screen, a second after loading the level."""

INTRO_S: Final = SPLASH_S + 5.0
"""Time from loading a level to control: the splash screen, then five seconds of the intro panel."""

HANGING_S: Final = SPLASH_S + 10.0 / 60.0
"""Time from loading a level to a physical ball: `roller` waits 10 frames, at the nominal 60 frames
a second, which the splash holds up. Until then nothing moves and nothing happens."""


@dataclass(slots=True, eq=False)
class Controls:
    """What the actuators do during one control step; see `CompiledLevel` for their addresses.

    Attributes:
        force_n: (N, 3) mean force on the ball over the step, world frame.
        plate_velocity: (N, P) m/s at which what pulls the plates moves, down is negative.
        gate_velocity: (N, G) likewise of the gates.
        hanging_s: (N,) time from the step's beginning until the ball is physical, if it is not.
    """

    force_n: Float64
    plate_velocity: Float64
    gate_velocity: Float64
    hanging_s: Float64


def anything_moves(state: GameState) -> bool:
    """Say whether a plate or gate of any game has been set going."""
    return bool(state.plate_struck.any() or state.gate_opening.any())


def controls(
    state: GameState,
    table: LevelTable,
    key_force_n: Float64,
    bodies: slabs.Bodies | None,
    duration_s: float,
) -> Controls:
    """Return what the actuators do in the next step, given the keys' force (N, 2).

    ``bodies`` is needed only where `anything_moves`.

    Timers that end within the step act for their share of it, so that no impulse depends on the
    length of the control step.
    """
    result = Controls(
        force_n=np.empty((len(key_force_n), 3)),
        plate_velocity=np.zeros(state.plate_struck.shape),
        gate_velocity=np.zeros(state.gate_opening.shape),
        hanging_s=np.empty(len(key_force_n)),
    )
    _push(
        duration_s,
        key_force_n,
        state.control_delay_s,
        state.thrust_s,
        table.pad_force_n,
        result.force_n,
        result.hanging_s,
    )
    if bodies is None:
        return result
    slabs.lower(
        duration_s,
        state.plate_struck,
        table.plate_speed,
        table.centres(Kind.PLATE),
        table.halves(Kind.PLATE),
        table.plate_heading,
        bodies.plate,
        bodies.plate_aim,
        bodies.ball,
        bodies.velocity,
        table.ball_radius,
        result.plate_velocity,
    )
    slabs.lower(
        duration_s,
        state.gate_opening,
        table.gate_speed,
        table.gate_centre,
        table.gate_half,
        table.gate_heading,
        bodies.gate,
        bodies.gate_aim,
        bodies.ball,
        bodies.velocity,
        table.ball_radius,
        result.gate_velocity,
    )
    return result


@compiled
def _push(
    duration_s: float,
    key_force_n: Float64,
    control_delay_s: Float64,
    thrust_s: Float64,
    pad_force_n: Float64,
    force_n: Float64,
    hanging_s: Float64,
) -> None:
    """Write the mean forces of keys and pads over a step, (n, 3), and how long balls still hang."""
    for row in range(force_n.shape[0]):
        # Both delays begin when the level is loaded.
        hanging_s[row] = max(control_delay_s[row] - (INTRO_S - HANGING_S), 0.0)
        held = min(max(1.0 - control_delay_s[row] / duration_s, 0.0), 1.0)
        lift = 0.0
        for pad in range(thrust_s.shape[1]):
            lift += min(thrust_s[row, pad] / duration_s, 1.0) * pad_force_n[row, pad]
        force_n[row, 0] = key_force_n[row, 0] * held
        force_n[row, 1] = key_force_n[row, 1] * held
        force_n[row, 2] = lift


def apply(state: GameState, table: LevelTable, motion: Motion, events: Events) -> None:
    """Change ``state`` by a step's events and by the passing of its time."""
    state.steps += 1
    _take_coins(events.points, events.coins, state.points, state.coin_taken)
    state.touching = events.inside
    _move_slabs(
        events.plates,
        motion.plate,
        table.plate_stop,
        table.plate_opens,
        state.plate_struck,
        state.plate_down,
        state.gate_opening,
    )
    pads = table.slices[Kind.LIFT_PAD]
    _run_timers(
        motion.duration_s,
        events.entry[:, pads],
        table.pad_group,
        table.pad_duration_s,
        state.thrust_s,
        state.control_delay_s,
    )
    triggers = table.slices[Kind.TRIGGER]
    cameras.move(
        motion.duration_s,
        motion.ball[:, -1],
        table.trigger_kind,
        events.triggers,
        events.inside[:, triggers],
        events.entry[:, triggers],
        state.thrust_s,
        state.trigger_spent,
        state.camera_delay_s,
        state.camera_mode,
        state.camera_x,
    )
    state.finished |= events.finished
    state.fallen |= events.fallen


@compiled
def _take_coins(found: Int64, collected: Bool, points: Int64, taken: Bool) -> None:
    """Mark the coins collected, in the games that collected any: a level may have thousands."""
    for row in range(len(found)):
        if found[row] > 0:
            points[row] += found[row]
            for coin in range(taken.shape[1]):
                taken[row, coin] |= collected[row, coin]


@compiled
def _move_slabs(
    hit: Bool,
    displacement: Float64,
    stop: Float64,
    opens: Bool,
    struck: Bool,
    down: Bool,
    opening: Bool,
) -> None:
    """Start the plates that were hit, see which have arrived, and open their gates."""
    for row in range(struck.shape[0]):
        for plate in range(struck.shape[1]):
            struck[row, plate] |= hit[row, plate]
            if struck[row, plate] and displacement[row, plate] <= stop[row, plate]:
                down[row, plate] = True
            if down[row, plate]:
                for gate in range(opening.shape[1]):
                    opening[row, gate] |= opens[row, plate, gate]


@compiled
def _run_timers(
    duration_s: float,
    entry: Float64,
    group: Int64,
    push_s: Float64,
    thrust_s: Float64,
    control_delay_s: Float64,
) -> None:
    """Let the timers of the intro and of pushing pads run, and start those of the pads entered.

    A pad that is still pushing does not fire again, so that its push never lasts longer; nor does
    one of its group, so that a pad made of two pushes like one.
    """
    for row in range(thrust_s.shape[0]):
        control_delay_s[row] = max(control_delay_s[row] - duration_s, 0.0)
        for pad in range(thrust_s.shape[1]):
            if entry[row, pad] < np.inf and _fires(pad, entry[row], group[row], thrust_s[row]):
                thrust_s[row, pad] = -1.0  # until those behind it have been asked
        for pad in range(thrust_s.shape[1]):
            left = thrust_s[row, pad]
            if left < 0.0:
                thrust_s[row, pad] = push_s[row, pad]
            else:
                left -= duration_s
                # Sums of control steps miss a timer's end by rounding: that is no time at all.
                thrust_s[row, pad] = left if left >= 1e-9 else 0.0


@compiled
def _fires(pad: int, entry: Float64, group: Int64, thrust_s: Float64) -> bool:
    """Say whether none of an entered pad's group is pushing or was entered before it."""
    for other in range(len(group)):
        first = entry[other] < entry[pad] or (entry[other] == entry[pad] and other < pad)
        if group[other] == group[pad] and (thrust_s[other] > 0.0 or first):
            return False
    return True
