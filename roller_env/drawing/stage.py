"""Stage: the scenery's model, put into the state of one game.

Everything is a function of the game's state and its time, so that the same state always gives the
same picture, however it was reached.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from roller_env.compile.scenery import (
    GATE_BARS,
    SPARK_COLOUR,
    SPARKS,
    STATES,
    band_count,
    build_scenery,
    part,
    ring_count,
)
from roller_env.compile.textures import parse_colour
from roller_env.game.cameras import MODE_BELOW, MODE_FIRST_PERSON
from roller_env.game.state import GameState
from roller_env.level.expand import expand
from roller_env.level.schema import Level
from roller_env.physics.presets import PhysicsPreset
from roller_env.pieces.camera_trigger import CAMERA_TRIGGER, TriggerKind
from roller_env.pieces.coin import COIN
from roller_env.pieces.lift_pad import LIFT_PAD
from roller_env.pieces.plate import PLATE
from roller_env.units import quants

Bool = npt.NDArray[np.bool_]
Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]

SUN_DISTANCE_M: Final = 30.0

COIN_TURNS_PER_S: Final = 0.5
COIN_BOB_M: Final = quants(2.0)
COIN_BOBS_PER_S: Final = 0.6

RING_SPEED_M_S: Final = quants(16.0)
"""`btube` scrolls its texture by 16 units a second."""

BAND_SPEED_M_S: Final = quants(5.0 * 60.0)
"""`camch2` scrolls its texture by 5 units a frame: read, as the tube's, as quants."""

FRAME_S: Final = 1.0 / 60.0
SPARK_SPEED_M_S: Final = quants(5.0 * 16.0)
"""`fire1`: up to 5 quants a tick of 1/16 s along each axis."""
SPARK_WIDTH_M: Final = quants(20.0)
"""`fire1`: the size of a particle when it is born."""
SPARK_FADING_PER_S: Final = 160.0
SPARK_LIFE_S: Final = 100.0 / SPARK_FADING_PER_S
"""`smoke_property`: alpha falls from 100 by 160 a second, and the size from 20 quants by 32: both
are nought at the same time."""

SEEN_FROM_BELOW_ALPHA: Final = 0.35


class Stage:
    """The model and data that pictures are taken of.

    Attributes:
        model: the scenery's model; colours in it change with the state.
        data: its kinematics.
    """

    def __init__(self, level: Level, preset: PhysicsPreset):
        """Build the scenery of ``level`` and put it into the state in which the game starts."""
        self.model = build_scenery(level, preset)
        self.data = mujoco.MjData(self.model)
        model, coins = self.model, len(expand(level).coins)
        self._level = level
        self._rgba = model.geom_rgba.copy()
        self._ball = model.geom("ball").id
        self._sun = model.light("sun/").id
        self._ground = self._ids(
            model.geom(number).name
            for number in range(model.ngeom)
            if model.geom(number).name.startswith(part("ground"))
        )
        self._coins = self._ids(part("coin", number) for number in range(coins))
        self._sparks = self._ids(part("spark", number) for number in range(SPARKS))
        self._plates = self._ids(part("plate") + plate.name for plate in level.plates)
        self._gates = self._ids(gate.name for gate in level.gates)
        self._bars = [
            self._ids(part("gate", bar) + gate.name for bar in range(GATE_BARS))
            for gate in level.gates
        ]
        pads = range(len(level.lift_pads))
        self._pads = self._ids(part("pad", number) for number in pads)
        self._glows = self._ids(part("glow", number) for number in pads)
        self._rings = [
            self._ids(part("ring", number, ring) for ring in range(ring_count(tube)))
            for number, tube in enumerate(level.tubes)
        ]
        self._panes = [
            (
                number,
                model.geom(part("trigger", number)).id,
                self._ids(part("band", number, band) for band in range(band_count(trigger))),
            )
            for number, trigger in enumerate(level.camera_triggers)
            if TriggerKind[trigger.kind.upper()] is TriggerKind.RETREAT
        ]
        self._materials = {
            kind: np.array([model.material(f"{kind}/{state}").id for state in states])
            for kind, states in STATES.items()
        }
        generator = np.random.default_rng(1)
        self._spark_velocity = SPARK_SPEED_M_S * generator.uniform(-1.0, 1.0, (_SPARK_CYCLE, 3))

    def show(self, qpos: Float64, state: GameState, row: int, time_s: float) -> None:
        """Put the stage into the state of one game.

        Args:
            qpos: (nq,) MuJoCo's positions of that game.
            state: the games' states.
            row: which of them.
            time_s: the game's time, which everything that moves by itself is a function of.
        """
        self.data.qpos[:] = qpos
        self.model.geom_rgba[:] = self._rgba
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        self._show_coins(state.of(COIN).taken[row, : len(self._coins)], time_s)
        self._show_machines(state, row)
        self._show_rings(time_s)
        self._show_sparks(time_s)
        self._show_panes(state.of(CAMERA_TRIGGER).spent[row], time_s)

    def light_from(self, centre: Float64) -> None:
        """Let the sun cast shadows round ``centre``, (3,) metres."""
        self.data.light_xpos[self._sun] = centre - SUN_DISTANCE_M * self.data.light_xdir[self._sun]

    def clear_view(self, mode: int) -> None:
        """Take out of the picture what would cover it in camera mode ``mode``."""
        if mode == MODE_FIRST_PERSON:
            self._hide(self._ball, True)
        if mode == MODE_BELOW:
            self.model.geom_rgba[self._ground] = [1.0, 1.0, 1.0, SEEN_FROM_BELOW_ALPHA]

    def _ids(self, names: Iterable[str]) -> Int64:
        return np.array([self.model.geom(name).id for name in names], dtype=np.int64)

    def _hide(self, geoms: int | Int64, hidden: bool | Bool) -> None:
        """Make geoms invisible where ``hidden``; MuJoCo leaves out what is fully transparent."""
        alpha = self._rgba[geoms, 3] * np.logical_not(hidden)
        self.model.geom_rgba[geoms, 3] = alpha

    def _show_coins(self, taken: Bool, time_s: float) -> None:
        """Let the coins spin and bob, each a little later than the one before."""
        if len(taken) == 0:
            return
        phase = 0.15 * np.arange(len(taken))
        angle = 2.0 * math.pi * COIN_TURNS_PER_S * time_s + phase
        bob = COIN_BOB_M * np.sin(2.0 * math.pi * COIN_BOBS_PER_S * time_s + phase)
        self.data.geom_xpos[self._coins, 2] += bob
        turn = np.zeros((len(taken), 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
        turn[:, 1, 0] = np.sin(angle)
        turn[:, 0, 1] = -turn[:, 1, 0]
        turn[:, 2, 2] = 1.0
        still = self.data.geom_xmat[self._coins].reshape(-1, 3, 3)
        self.data.geom_xmat[self._coins] = (turn @ still).reshape(-1, 9)
        self._hide(self._coins, taken)

    def _show_machines(self, state: GameState, row: int) -> None:
        """Colour plates, gates and pads by what they are doing."""
        matid = self.model.geom_matid
        plate_state = state.of(PLATE)
        struck, down = plate_state.struck[row], plate_state.down[row]
        plates = len(self._plates)
        phase = np.where(down, 2, np.where(struck, 1, 0))[:plates]
        matid[self._plates] = self._materials["plate"][phase]
        gates = zip(self._level.gates, self._gates, self._bars, strict=True)
        for number, (gate, slab, bars) in enumerate(gates):
            opening = bool(state.signals[row, number])
            height = self.data.geom_xpos[slab, 2]
            phase_of_gate = 2 if opening and height <= gate.lowers_to else int(opening)
            matid[bars] = self._materials["gate"][phase_of_gate]
        pushing = state.of(LIFT_PAD).thrust_s[row, : len(self._pads)] > 0.0
        matid[self._pads] = self._materials["pad"][pushing.astype(np.int64)]
        self._hide(self._glows, ~pushing)

    def _show_rings(self, time_s: float) -> None:
        """Let the bands of light run along the tubes."""
        for tube, rings in zip(self._level.tubes, self._rings, strict=True):
            if len(rings) == 0:
                continue
            start, along = np.array(tube.start), np.subtract(tube.end, tube.start)
            length = float(np.linalg.norm(along))
            spacing = length / len(rings)
            place = (np.arange(len(rings)) * spacing + RING_SPEED_M_S * time_s) % length
            self.data.geom_xpos[rings] = start + place[:, None] * along / length

    def _show_panes(self, spent: Bool, time_s: float) -> None:
        """Let the bands run up the panes of the retreat triggers that are not dead yet."""
        for number, pane, bands in self._panes:
            self._hide(pane, spent[number])
            self._hide(bands, spent[number])
            height = 2.0 * (self.model.geom_size[pane, 2] - self.model.geom_size[bands[0], 2])
            place = (np.arange(len(bands)) / len(bands) * height + BAND_SPEED_M_S * time_s) % height
            self.data.geom_xpos[bands, 2] += place - height / 2.0

    def _show_sparks(self, time_s: float) -> None:
        """Let a particle fly out of the finish every frame, shrinking and fading."""
        newest = math.floor(time_s / FRAME_S)
        born = newest - np.arange(SPARKS)
        age = time_s - born * FRAME_S
        share = np.clip(1.0 - age / SPARK_LIFE_S, 0.0, 1.0)
        flight = self._spark_velocity[born % _SPARK_CYCLE] * age[:, None]
        self.data.geom_xpos[self._sparks] = np.array(self._level.finish.at) + flight
        self.model.geom_size[self._sparks, 0] = 0.5 * SPARK_WIDTH_M * np.maximum(share, 0.01)
        self.model.geom_rgba[self._sparks, :3] = parse_colour(SPARK_COLOUR)[0]
        self.model.geom_rgba[self._sparks, 3] = share


_SPARK_CYCLE: Final = 256
"""After so many particles the same directions come again: unseen, as 38 are alive at once."""
