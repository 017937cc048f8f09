"""Stage: the scenery's model, put into the state of one game.

Everything is a function of the game's state and its time, so that the same state always gives the
same picture, however it was reached.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, NamedTuple

import mujoco
import numpy as np

from roller_env.arrays import Bool, Float64, Int64
from roller_env.compile.scenery import build_scenery
from roller_env.game.cameras import MODE_BELOW, MODE_FIRST_PERSON
from roller_env.game.state import GameState
from roller_env.level.expand import expand, shapes
from roller_env.level.schema import Level
from roller_env.physics.presets import PhysicsPreset
from roller_env.pieces.coin import COIN, coin_shapes
from roller_env.pieces.look import Fly, Run, Shape, Spin, part
from roller_env.pieces.piece import Mover, Piece, number_of

SUN_DISTANCE_M: Final = 30.0

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
        model = self.model
        self._rgba = model.geom_rgba.copy()
        self._ball = model.geom("ball").id
        self._sun = model.light("sun/").id
        self._ground = np.array(
            [n for n in range(model.ngeom) if model.geom(n).name.startswith(part("ground"))]
        )
        seen = list(shapes(level))
        self._machines = [
            machine
            for source, piece in level.pieces()
            if (machine := _Machine.of(model, piece, source, expand(level).movers)) is not None
        ]
        coins = coin_shapes(expand(level).coins)
        self._coins = np.array([model.geom(c.name).id for c in coins], dtype=np.int64)
        self._spinning, self._spins = self._moving(seen, Spin)
        self._running, self._runs = self._moving(seen, Run)
        self._flying, self._flights = self._moving(seen, Fly)
        self._directions = np.random.default_rng(1).uniform(-1.0, 1.0, (_DIRECTIONS, 3))

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
        for machine in self._machines:
            self._show_phase(machine, state, row)
        self._hide(self._coins, state.of(COIN).taken[row, : len(self._coins)])
        self._spin(time_s)
        self._run(time_s)
        self._fly(time_s)

    def light_from(self, centre: Float64) -> None:
        """Let the sun cast shadows round ``centre``, (3,) metres."""
        self.data.light_xpos[self._sun] = centre - SUN_DISTANCE_M * self.data.light_xdir[self._sun]

    def clear_view(self, mode: int) -> None:
        """Take out of the picture what would cover it in camera mode ``mode``."""
        if mode == MODE_FIRST_PERSON:
            self._hide(self._ball, True)
        if mode == MODE_BELOW:
            self.model.geom_rgba[self._ground] = [1.0, 1.0, 1.0, SEEN_FROM_BELOW_ALPHA]

    def _moving(
        self, seen: Iterable[Shape], kind: type[Spin | Run | Fly]
    ) -> tuple[Int64, list[Float64]]:
        """Return the geoms that have a kind of motion, and each number of it as an array of all."""
        moving = [shape for shape in seen if isinstance(shape.motion, kind)]
        ids = np.array([self.model.geom(shape.name).id for shape in moving], dtype=np.int64)
        motions = [shape.motion for shape in moving if shape.motion is not None]
        return ids, [np.array([m[k] for m in motions]) for k in range(len(kind._fields))]

    def _hide(self, geoms: int | Int64, hidden: bool | Bool) -> None:
        """Make geoms invisible where ``hidden``; MuJoCo leaves out what is fully transparent."""
        alpha = self._rgba[geoms, 3] * np.logical_not(hidden)
        self.model.geom_rgba[geoms, 3] = alpha

    def _show_phase(self, machine: _Machine, state: GameState, row: int) -> None:
        """Paint a piece by what it is doing, and hide what is not seen then."""
        slab = machine.slab
        arrived = slab is not None and bool(self.data.geom_xpos[slab, 2] <= machine.stop)
        phase = machine.piece.phase(state, row, machine.number, arrived)
        for geom, materials, seen_in in machine.parts:
            self.model.geom_matid[geom] = materials[min(phase, len(materials) - 1)]
            self._hide(geom, phase not in seen_in)

    def _spin(self, time_s: float) -> None:
        """Let what spins do so."""
        turns, bob, bobs, phase = self._spins
        angle = 2.0 * math.pi * turns * time_s + phase
        up = bob * np.sin(2.0 * math.pi * bobs * time_s + phase)
        self.data.geom_xpos[self._spinning, 2] += up
        turn = np.zeros((len(angle), 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
        turn[:, 1, 0] = np.sin(angle)
        turn[:, 0, 1] = -turn[:, 1, 0]
        turn[:, 2, 2] = 1.0
        still = self.data.geom_xmat[self._spinning].reshape(-1, 3, 3)
        self.data.geom_xmat[self._spinning] = (turn @ still).reshape(-1, 9)

    def _run(self, time_s: float) -> None:
        """Let what runs along a line do so."""
        if not len(self._running):
            return
        way, speed, ahead = self._runs
        length = np.linalg.norm(way, axis=1)
        fraction = (ahead + speed * time_s) % length / length
        self.data.geom_xpos[self._running] += fraction[:, None] * way

    def _fly(self, time_s: float) -> None:
        """Let particles fly, shrinking and fading."""
        number, every_s, speed, width, life_s = self._flights
        born = np.floor(time_s / every_s) - number
        age = time_s - born * every_s
        left = np.clip(1.0 - age / life_s, 0.0, 1.0)
        velocity = speed[:, None] * self._directions[born.astype(np.int64) % _DIRECTIONS]
        self.data.geom_xpos[self._flying] += velocity * age[:, None]
        self.model.geom_size[self._flying, 0] = 0.5 * width * np.maximum(left, 0.01)
        # A geom that is to fade has its own colour in place of its material's.
        material = self.model.geom_matid[self._flying]
        self.model.geom_rgba[self._flying, :3] = self.model.mat_rgba[material, :3]
        self.model.geom_rgba[self._flying, 3] = left


class _Machine(NamedTuple):
    """A piece whose look changes with what it is doing.

    Attributes:
        piece: the piece.
        number: its own among those of its kind.
        slab: its solid's geom, if it moves.
        stop: height at which that has arrived, metres.
        parts: of each shape that changes the geom, the materials by phase, and where it is seen.
    """

    piece: Piece
    number: int
    slab: int | None
    stop: float
    parts: list[tuple[int, list[int], tuple[int, ...]]]

    @staticmethod
    def of(
        model: mujoco.MjModel, piece: Piece, source: str, movers: Iterable[Mover]
    ) -> _Machine | None:
        """Return a piece with its geoms, or None if it always looks the same."""
        number = number_of(source)
        parts = [
            (
                model.geom(shape.name).id,
                [model.material(name).id for name in shape.materials],
                shape.seen_in,
            )
            for shape in piece.looks(number)
            if shape.has_phases
        ]
        if not parts:
            return None
        for mover in movers:
            if mover.solid.source == source:
                return _Machine(
                    piece, number, model.geom(mover.name).id, mover.end.centre[2], parts
                )
        return _Machine(piece, number, None, 0.0, parts)


_DIRECTIONS: Final = 256
"""After so many particles the same directions come again: unseen, as 38 are alive at once."""
