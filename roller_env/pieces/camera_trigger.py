"""What changes the view."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import IntEnum
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from roller_env.arrays import Bool, Float64, Int64
from roller_env.compiled import device_function
from roller_env.pieces.fields import Point, PositiveLength, Size
from roller_env.pieces.look import ACTIVE, DONE, IDLE, Paint, Run, Shape, part
from roller_env.pieces.piece import ExpandedLevel, Piece, Region, half_of
from roller_env.pieces.rules import After, Noticed, Own, Rules, padded
from roller_env.units import SCRIPT_RATE_HZ, frames, quants

PANE_COLOUR: Final = "#0101c8"
PANE_ALPHA: Final = 0.70
"""`camch2`: red, green and blue, and the opacity, of a retreat trigger's pane."""

BAND_SPACING_M: Final = quants(32.0)
"""Distance between the bands that run up a retreat trigger's pane."""

BAND_SPEED_M_S: Final = quants(5.0 * SCRIPT_RATE_HZ)
"""`camch2` scrolls its texture by 5 units a frame: read, as the tube's, as quants."""

_PANE: Final = (Paint("trigger/", PANE_COLOUR, emission=0.4, opacity=PANE_ALPHA),)
_BAND: Final = (Paint("band/", "#6f8bffa0", emission=0.6),)


class CameraTrigger(Piece):
    """A box without substance that changes the camera when the ball touches it.

    ``overhead`` (the original's ``camch``): on every entry, 1.667 s later, mode 2.
    ``retreat`` (``camch2``): on the first entry only, at once, mode 1.
    ``first_person`` (``cam_switcher``): mode 4 when the ball's centre is within ``reach`` of
    ``at``, and from then on until something else changes it; it has no box.
    """

    kind: Literal["overhead", "retreat", "first_person"] = Field(
        description="When it fires, and what the camera does then."
    )
    at: Point = Field(description="Its centre.")
    size: Size | None = Field(
        None, description="Full edge lengths, for `overhead` and `retreat`, which need it."
    )
    reach: PositiveLength = Field(
        quants(10.0), description="For `first_person`, which is a ball and has no size."
    )

    @model_validator(mode="after")
    def _shape_fits_kind(self) -> CameraTrigger:
        if self.kind == "first_person" and self.size is not None:
            raise PydanticCustomError(
                "trigger_shape", "a first_person trigger has a reach, not a size"
            )
        if self.kind != "first_person" and self.size is None:
            raise PydanticCustomError(
                "trigger_shape", "a trigger of kind {kind} needs a size", {"kind": self.kind}
            )
        return self

    def region(self, touch: float) -> Region:
        """Return where the ball touches its box, or where its centre is within reach."""
        if self.size is None:
            return Region(self.at, (0.0, 0.0, 0.0), self.reach)
        return Region(self.at, half_of(self.size), touch)

    def looks(self, number: int) -> Iterator[Shape]:
        """Yield the blue pane of a retreat, as `camch2` shows it; the others are unseen.

        Bands of a lighter blue show that the pane's texture scrolls.
        """
        if self.kind != "retreat" or self.size is None:
            return
        x, y, z = half_of(self.size)
        alive = (IDLE, ACTIVE)
        yield Shape(part("trigger", number), "box", _PANE, (x, y, z), self.at, seen_in=alive)
        proud, bands = quants(0.2), max(1, int(self.size[2] / BAND_SPACING_M))
        half = (x + proud, y + proud, min(quants(3.0), 0.5 * z))
        height = 2.0 * (z - half[2])
        at = (self.at[0], self.at[1], self.at[2] - height / 2.0)
        for band in range(bands):
            run = Run((0.0, 0.0, height), BAND_SPEED_M_S, band / bands * height)
            name = part("band", number, band)
            yield Shape(name, "box", _BAND, half, at, seen_in=alive, motion=run)

    def phase(self, state: Any, row: int, number: int, arrived: bool) -> int:
        """Return whether it can fire no more."""
        return DONE if state.of(CAMERA_TRIGGER).spent[row, number] else IDLE


# Rules --------------------------------------------------------------------------------------------


class TriggerKind(IntEnum):
    """What a camera trigger does; see `CameraTrigger`."""

    OVERHEAD = 0
    RETREAT = 1
    FIRST_PERSON = 2


_OVERHEAD: Final = int(TriggerKind.OVERHEAD)
_FIRST_PERSON: Final = int(TriggerKind.FIRST_PERSON)

OVERHEAD_DELAY_S: Final = frames(100.0)
"""`flipcam` waits 100 frames."""

OVERHEAD_WAITS: Final = 8
"""Entries of one game that can wait at once. `flipcam` runs once for every impact: each entry sets
mode 2 at the end of a wait of its own, and other events may set other modes in between. A ball that
enters more often in `OVERHEAD_DELAY_S` turns round every fifth of a second; the newest entry then
takes the place of the one before."""


class CameraTriggerTable(NamedTuple):
    """Numbers of T triggers.

    Attributes:
        kind: (L, T) `TriggerKind`.
    """

    kind: Int64


class CameraTriggerState(NamedTuple):
    """What varies of T triggers.

    Attributes:
        spent: (N, T) one-time triggers that are dead.
        delay_s: (N, W) times until mode 2 is set, one for each entry of an overhead trigger that
            waits, in order; ``inf`` where none does.
    """

    spent: Bool
    delay_s: Float64


def _table(levels: Sequence[ExpandedLevel]) -> CameraTriggerTable:
    kinds = [[TriggerKind[t.kind.upper()] for t in level.of(CameraTrigger)] for level in levels]
    return CameraTriggerTable(padded(kinds).astype(np.int64))


def _state(table: CameraTriggerTable, num_envs: int) -> CameraTriggerState:
    triggers = table.kind.shape[1]
    waits = OVERHEAD_WAITS if triggers else 0
    return CameraTriggerState(
        spent=np.zeros((num_envs, triggers), dtype=bool),
        delay_s=np.full((num_envs, waits), np.inf),
    )


def _notice(now: Noticed, table: CameraTriggerTable, state: CameraTriggerState, own: Own) -> None:
    for trigger in range(own.regions):
        now.live[own.region + trigger] &= not state.spent[now.env, trigger]


def _react(now: After, table: CameraTriggerTable, state: CameraTriggerState, own: Own) -> None:
    """Let the entries' waits run and the triggers act.

    Where several set the mode in one step, the latest counts. A first-person trigger acts all the
    time that the ball is in it.
    """
    delay_s = state.delay_s[now.env]
    now.camera.overhead[now.env] = _is_due(now.duration_s, delay_s)
    latest = -np.inf
    for trigger in range(own.regions):
        entry, kind = now.entry[own.region + trigger], table.kind[now.level, trigger]
        acts = entry < np.inf
        time = entry if acts else 0.0
        if kind == _FIRST_PERSON:
            acts = acts or now.inside[own.region + trigger]
        elif acts and kind == _OVERHEAD:
            _wait(delay_s)
            acts = False
        elif acts:
            state.spent[now.env, trigger] = True
        if acts and time >= latest:
            now.camera.trigger[now.env] = kind
            latest = time


@device_function
def _is_due(duration_s: float, delay_s: Float64) -> bool:
    """Let the times run that entries of `TriggerKind.OVERHEAD` wait; say whether one has ended."""
    waiting, is_due = 0, False
    for place in range(len(delay_s)):
        left = delay_s[place] - duration_s
        delay_s[place] = np.inf
        # Sums of control steps miss the end by rounding.
        if left > 1e-9:
            delay_s[waiting] = left
            waiting += 1
        else:
            is_due = True
    return is_due


@device_function
def _wait(delay_s: Float64) -> None:
    """Let one more entry wait, behind the others; two of one step are one."""
    place = 0
    while place < len(delay_s) - 1 and delay_s[place] < OVERHEAD_DELAY_S:
        place += 1
    delay_s[place] = OVERHEAD_DELAY_S


CAMERA_TRIGGER: Final = Rules(
    name="camera_trigger",
    table=_table,
    state=_state,
    deeds=("spent",),
    notice=_notice,
    react=_react,
)
CameraTrigger.rules = CAMERA_TRIGGER
