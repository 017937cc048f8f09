"""Checksums of a game: by them a replay knows whether it is the game that was recorded.

They are of named quantities, each of which says what it is, where and in which unit; not of how
MuJoCo or the rules happen to keep them, which may change while the game does not.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from roller_env.arrays import Int64, UInt32
from roller_env.pieces.coin import COIN
from roller_env.pieces.lift_pad import LIFT_PAD
from roller_env.pieces.plate import PLATE
from roller_env.simulation import Simulation

QUANTITIES: Final[dict[str, Callable[[Simulation], npt.NDArray[Any]]]] = {
    "ball_position": lambda game: game.ball_position,
    "ball_velocity": lambda game: game.ball_velocity,
    "ball_orientation": lambda game: game.ball_orientation,
    "ball_angular_velocity": lambda game: game.ball_angular_velocity,
    "plate_displacement": lambda game: game.plate_displacement,
    "gate_displacement": lambda game: game.gate_displacement,
    "control_delay": lambda game: game.state.control_delay_s,
    "coins_collected": lambda game: game.state.of(COIN).taken,
    "plates_pressed": lambda game: game.state.of(PLATE).struck,
    "plates_down": lambda game: game.state.of(PLATE).down,
    "gates_opening": lambda game: game.state.signals,
    "lift_time_left": lambda game: game.state.of(LIFT_PAD).thrust_s,
    "finished": lambda game: game.state.finished,
    "fallen": lambda game: game.state.fallen,
    "diverged": lambda game: game.state.diverged,
    "time_up": lambda game: game.state.truncated,
}
"""By name, in the order in which they are written; `docs/replays.md` says what each is.

A quantity is added by a line here: replays of before name those that they have, and are still
compared in them. Cameras are left out, which show the game and do not change it."""

INTERVAL_S: Final = 0.5
"""Game time from one row of checksums to the next, if nothing else is asked for. Four of them
change in every step and do not compress: at 16 bytes a row this is 2 kB a minute."""

MAX_ROWS: Final = 2**17
"""Of a replay: 18 hours at that interval."""


def checksums(simulation: Simulation, rows: Int64, names: Sequence[str]) -> UInt32:
    """Return a CRC-32 of each of the named quantities in each of the rows, (n, Q).

    It is of the quantity's numbers as little-endian float64, a flag being 0 or 1, one after the
    other. CRC-32 is meant for accidents, which is what is looked for here.
    """
    table = np.empty((len(rows), len(names)), dtype=np.uint32)
    for column, name in enumerate(names):
        values = np.ascontiguousarray(QUANTITIES[name](simulation)[rows], dtype="<f8")
        table[:, column] = [zlib.crc32(row.data) for row in values.reshape(len(rows), -1)]
    return table


def interval_of(step_s: float) -> int:
    """Return how many control steps of ``step_s`` seconds lie between two rows of checksums."""
    return max(1, round(INTERVAL_S / step_s))


def row_count(steps: int, every: int) -> int:
    """Return how many rows of checksums ``steps`` control steps have; see `Checksums`."""
    return 1 + -(-steps // every)


@dataclass(frozen=True, eq=False)
class Checksums:
    """The checksums of one episode: of its beginning, of every ``every``-th step, and of its end.

    Attributes:
        every: control steps from one row to the next; to the last there may be fewer.
        quantities: names of the columns, of `QUANTITIES`.
        table: (C, Q) uint32.
    """

    every: int
    quantities: tuple[str, ...]
    table: UInt32

    def row_of(self, step: int, steps: int) -> int | None:
        """Return the row of the moment after ``step`` of ``steps``, if there is one."""
        return row_count(step, self.every) - 1 if step % self.every == 0 or step == steps else None

    def mismatches(self, row: int, now: UInt32) -> tuple[str, ...]:
        """Return the names of the quantities in which a row is not as it is ``now``, (Q,)."""
        return tuple(self.quantities[column] for column in np.flatnonzero(self.table[row] != now))
