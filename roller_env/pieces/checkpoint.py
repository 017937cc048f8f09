"""Where the ball comes back to after a fall."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from pydantic import Field

from roller_env.arrays import Float64, Int64
from roller_env.pieces.fields import OptionalName, Point, Size
from roller_env.pieces.look import ACTIVE, IDLE, Shape, part, states
from roller_env.pieces.piece import TOUCHING_M, ExpandedLevel, Piece, Region, Vector, half_of
from roller_env.pieces.rules import After, Own, Rules, padded
from roller_env.pieces.space import inside
from roller_env.problems import FieldPath, Problem
from roller_env.units import quants

if TYPE_CHECKING:
    from roller_env.pieces.surroundings import Surroundings

_PAINT: Final = states("checkpoint", ("#8fb6ff80", 0.3), ("#4fe39a", 0.8))


class Checkpoint(Piece):
    """A box without substance: after a fall the ball comes back to the last one that it touched.

    It does so where the level says ``falls: checkpoint``, and at rest; coins, plates and gates stay
    as they are. Before any is touched the ball comes back to the start.
    """

    at: Point = Field(description="Its centre, and where the **ball's centre** comes back.")
    size: Size = Field(description="Full edge lengths of the box that the ball has to touch.")
    name: OptionalName = Field(None, description="So that you find it; no two pieces share one.")

    def region(self, touch: float) -> Region:
        """Return where the ball touches its box."""
        return Region(self.at, half_of(self.size), touch)

    def problems(self, path: FieldPath, around: Surroundings) -> Iterator[Problem]:
        """Yield that the ball cannot come back there."""
        yield from around.too_low((*path, "at"), "the ball comes back", self.at[2])
        margin = max(around.ball_radius - TOUCHING_M, 0.0)
        hit = inside(around.solids, np.array([self.at]), margin)
        sources = dict.fromkeys(solid.source for solid, _ in hit)
        if sources:
            where = ", ".join(sources)
            message = f"the ball would come back inside {where}; wanted free space around it"
            yield Problem((*path, "at"), message)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield a post at either end of the longer side, lit where the ball would come back."""
        x, y, z = half_of(self.size)
        post = quants(3.0)
        for side, sign in enumerate((-1.0, 1.0)):
            along = (0.0, sign * (y + post)) if y >= x else (sign * (x + post), 0.0)
            at = (self.at[0] + along[0], self.at[1] + along[1], self.at[2])
            yield Shape(part("checkpoint", number, side), "cylinder", _PAINT, (post, z, 0.0), at)

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether the ball would come back to it."""
        return ACTIVE if state.of(CHECKPOINT).last[row] == number else IDLE

    def label(self) -> tuple[str, Vector]:
        """Return what it is."""
        return self.name or "checkpoint", self.at


# Rules --------------------------------------------------------------------------------------------


class CheckpointTable(NamedTuple):
    """Numbers of C checkpoints.

    Attributes:
        at: (L, C, 3) where the ball's centre comes back, metres, world frame.
    """

    at: Float64


class CheckpointState(NamedTuple):
    """Which checkpoint counts.

    Attributes:
        last: (N,) number of the last one that the ball entered; -1 for none.
    """

    last: Int64


def _table(levels: Sequence[ExpandedLevel]) -> CheckpointTable:
    return CheckpointTable(padded([[c.at for c in level.of(Checkpoint)] for level in levels], (3,)))


def _state(table: CheckpointTable, num_envs: int) -> CheckpointState:
    return CheckpointState(np.full(num_envs, -1))


def _react(now: After, table: CheckpointTable, state: CheckpointState, own: Own) -> None:
    """Remember the checkpoint entered last, and say where a ball that has fallen comes back."""
    latest = -np.inf
    for checkpoint in range(own.regions):
        entry = now.entry[own.region + checkpoint]
        if entry < np.inf and entry >= latest:
            state.last[now.env], latest = checkpoint, entry
    if state.last[now.env] >= 0:
        for axis in range(3):
            now.back_at[axis] = table.at[now.level, state.last[now.env], axis]


CHECKPOINT: Final = Rules(name="checkpoint", table=_table, state=_state, react=_react)
Checkpoint.rules = CHECKPOINT
