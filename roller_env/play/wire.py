"""What goes over the page's one WebSocket: frames of bytes out, messages of JSON in and out.

``page/src/wire.ts`` is the other end; a test holds the two together. All numbers of a frame are
little endian, lengths are metres, of the world's frame.
"""

from __future__ import annotations

import math
import struct
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from roller_env.arrays import Float64
from roller_env.game.actions import KEY_AXES, KEY_CODES
from roller_env.pieces.coin import COIN
from roller_env.play.scene import Scene, coin_bits
from roller_env.play.session import FASTEST, SLOWEST, GameFrame, Phase

FORMAT: Final = 1
MAX_MESSAGE_BYTES: Final = 512
"""Longest message that a page may send."""

_HEAD: Final = struct.Struct("<4B2IfdfHBB3f4f3fff3fHBB")
_KIND: Final = 1
_CROWD_M: Final = 0.01
"""What the places of a crowd are rounded to."""

_PHASES: Final = tuple(Phase)
_OUTCOMES: Final = ("not ended", "finish", "fall", "diverged", "time limit")

_AGENT, _AGENT_PLAYS, _RECORDING, _GHOST, _PRACTICE = (1 << bit for bit in range(5))


def frame_bytes(
    frame: GameFrame,
    scene: Scene,
    ghost: Float64 | None = None,
    crowd: Float64 | None = None,
    recording: bool = False,
) -> bytes:
    """Return a frame as pages read it.

    Args:
        frame: the moment.
        scene: of its level.
        ghost: (3,) centre of the ball that is raced against, metres.
        crowd: (N, 3) centres of balls that play beside it, metres.
        recording: whether replays are written.
    """
    qpos, state, result = frame.qpos(), frame.state, frame.result
    displacements = qpos[7:][scene.slots]
    phases = scene.phases(state, displacements)
    flags = (
        _AGENT * frame.agent
        | _AGENT_PLAYS * frame.agent_plays
        | _RECORDING * recording
        | _GHOST * (ghost is not None)
        | _PRACTICE * frame.practice
    )
    head = _HEAD.pack(
        _KIND,
        _PHASES.index(frame.phase),
        flags,
        int(state.camera.mode[0]),
        frame.episode,
        int(state.steps[0]),
        result.time_s,
        frame.clock_s,
        frame.control_in_s,
        result.coins,
        keys_of(frame.force_n),
        _OUTCOMES.index(result.outcome),
        *qpos[:7],
        *frame.velocity,
        result.total_reward,
        frame.speed,
        *(np.zeros(3) if ghost is None else ghost),
        min(frame.falls, 2**16 - 1),
        len(displacements),
        len(phases),
    )
    coins = coin_bits(state.of(COIN).taken[0, : scene.coins])
    parts = [head, displacements.astype("<f4").tobytes(), bytes(phases), coins]
    if crowd is not None:
        near = np.clip(np.round(crowd / _CROWD_M), -(2**15), 2**15 - 1)
        parts += [struct.pack("<H", len(crowd)), near.astype("<i2").tobytes()]
    return b"".join(parts)


def keys_of(force_n: Float64) -> int:
    """Return the code of the keys that push along a force, (2,): W 1, A 2, S 4, D 8."""
    along: Float64 = KEY_AXES @ force_n
    # A force of an agent may have any direction: the keys nearest to it.
    least = 0.5 * math.hypot(*force_n) / math.sqrt(2.0)
    return int(KEY_CODES[(along > 0.0) & (along > least)].sum())


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Keys(_Message):
    """Which keys are held, letters of "wasd"."""

    type: Literal["keys"]
    held: Annotated[str, Field(pattern="^[wasd]{0,4}$")]


class Plain(_Message):
    """A wish that needs no more words."""

    type: Literal[
        "start",
        "skip",
        "restart",
        "pause",
        "resume",
        "hand_back",
        "next",
        "menu",
        "step",
        "ask_seat",
        "leave_seat",
    ]


class Choose(_Message):
    """Load a level."""

    type: Literal["choose"]
    level: Annotated[str, Field(max_length=200)]


class Seek(_Message):
    """Show another moment."""

    type: Literal["seek"]
    time_s: Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]


class Speed(_Message):
    """Let time run slower or faster."""

    type: Literal["speed"]
    factor: Annotated[float, Field(ge=SLOWEST, le=FASTEST, allow_inf_nan=False)]


GhostKind = Literal["none", "best", "par"]


class GhostChoice(_Message):
    """Race against a run."""

    type: Literal["ghost"]
    kind: GhostKind


ToServer = Annotated[
    Keys | Plain | Choose | Seek | Speed | GhostChoice, Field(discriminator="type")
]
_TO_SERVER: Final[TypeAdapter[ToServer]] = TypeAdapter(ToServer)


def read_message(text: str) -> ToServer:
    """Return what a page sent.

    Raises:
        ValueError: it is too long, or no message.
    """
    if len(text.encode(errors="replace")) > MAX_MESSAGE_BYTES:
        raise ValueError(f"message: found more than {MAX_MESSAGE_BYTES} bytes")
    try:
        return _TO_SERVER.validate_json(text)
    except ValidationError as error:
        raise ValueError(f"message: {error.errors()[0]['msg']}") from None


def message(kind: str, **fields: Any) -> dict[str, Any]:
    """Return a message for pages."""
    return {"type": kind, **fields}
