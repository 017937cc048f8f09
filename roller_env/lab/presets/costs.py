"""What a physics step costs: under each setting, and with more or less modelled than needed.

A cost is the CPU time of `mujoco.batch.Batch` on one thread; all take turns. As in the game's own
steps MuJoCo's profiler is off, a seventh of what the default costs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, Literal

import mujoco
import numpy as np
from mujoco.batch import Batch

from roller_env.arrays import Float64
from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab import runner
from roller_env.lab.benchmark.scale import level_of_boxes
from roller_env.lab.presets.settings import Setting
from roller_env.lab.runner import Name
from roller_env.lab.table import Frame
from roller_env.level import Level, load_level
from roller_env.level.expand import expand
from roller_env.physics.profiler import profiler_off
from roller_env.physics.stepper import keeps_poses

ROUND_S: Final = 0.25
"""Game time of one turn."""
WARM_UP_ROUNDS: Final = 8


class Games:
    """Games of one model under random keys; equal seeds make equal keys at equal times."""

    def __init__(self, model: mujoco.MjModel, level: Level, games: int) -> None:
        """Put every game's ball, the model's first joint, at the level's start."""
        self._steps = max(1, round(ROUND_S / float(model.opt.timestep)))
        self._batch = Batch(model, games, 1, persistent=keeps_poses(model))
        self._ball: Float64 = self._batch.bind("qpos")[:, :7]
        self._ball[:, :3] = level.start.at
        self._ctrl = self._batch.bind("ctrl")
        self._random = np.random.default_rng(0)
        for _ in range(WARM_UP_ROUNDS):
            self.turn()

    @property
    def ball(self) -> Float64:
        """(games, 7) copy of where the balls are, metres, and how they lie."""
        return self._ball.copy()

    def turn(self) -> float:
        """Play one round and return the CPU seconds of a physics step."""
        push = self._random.choice([-KEY_FORCE_N, 0.0, KEY_FORCE_N], (len(self._ctrl), 2))
        self._ctrl[:, :2] = push
        with profiler_off():
            seconds = runner.timed(lambda: self._batch.step(nstep=self._steps), time.process_time)
        return seconds / (self._steps * len(self._ctrl))


def costs(games: Mapping[Name, Games], rounds: int) -> dict[Name, dict[str, float]]:
    """Let all take turns; return ``us_per_step`` (CPU, median) and ``spread`` of each."""
    turns = {name: one.turn for name, one in games.items()}
    taken = runner.interleaved(turns, rounds, shuffled=True)
    return {
        name: {"us_per_step": 1e6 * float(np.median(own)), "spread": runner.spread(own)}
        for name, own in taken.items()
    }


Change = Callable[[mujoco.MjSpec, Level], None]
Way = tuple[Setting, Change | None]
"""How a level is modelled: a setting, and what is then changed of the model."""


def _flags(**flags: bool) -> Setting:
    return Setting("", "flags", flags=flags)


def _unmerged(spec: mujoco.MjSpec, level: Level) -> None:
    """Have every box of the level and every cell of its floors be a geom."""
    merged = [geom for geom in spec.geoms if geom.name.startswith("solid_")]
    materials = {geom.name.split("_", 2)[2]: geom for geom in merged}
    same = ("contype", "conaffinity", "priority", "condim", "friction", "solref", "solimp")
    for number, solid in enumerate(expand(level).ground):
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, np.array(solid.rotation).reshape(9))
        contact = {name: getattr(materials[solid.material], name) for name in same}
        cell = spec.worldbody.add_geom(name=f"cell_{number}", type=mujoco.mjtGeom.mjGEOM_BOX)
        cell.size, cell.pos, cell.quat = solid.half_size, solid.centre, quaternion
        for name, value in contact.items():
            setattr(cell, name, value)
    for geom in merged:
        spec.delete(geom)


def _no_contact_bits(spec: mujoco.MjSpec, _level: Level) -> None:
    """Let everything touch everything, as MuJoCo does unless told otherwise."""
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 1


def _without_movers(part: Literal["joint", "body"]) -> Change:
    def change(spec: mujoco.MjSpec, level: Level) -> None:
        for name in (*(one.name for one in level.plates), *(one.name for one in level.gates)):
            spec.delete(spec.actuator(name))
            spec.delete(getattr(spec, part)(name))

    return change


def _coin_geoms(spec: mujoco.MjSpec, level: Level) -> None:
    radius, kind = level.ball.radius / 2, mujoco.mjtGeom.mjGEOM_CYLINDER
    for place in expand(level).coins:
        geom = spec.worldbody.add_geom(type=kind, size=[radius, radius / 4, 0.0], pos=place)
        geom.contype = geom.conaffinity = 0


def _coin_sites(spec: mujoco.MjSpec, level: Level) -> None:
    for place in expand(level).coins:
        spec.worldbody.add_site(size=[level.ball.radius / 2] * 3, pos=place)


AS_CHOSEN: Final = "as compiled"
_CHOSEN: Final = _flags()
_POSED: Final = _flags(sleep=False)
CLASSIC: Final[Mapping[str, Way]] = {
    AS_CHOSEN: (_CHOSEN, None),
    # With what the compiler does for levels of so many geoms.
    "every floor cell a geom": (_flags(midphase=True), _unmerged),
    "no contact bits: all may touch all": (_CHOSEN, _no_contact_bits),
    "explicit pairs instead of contact bits": (Setting("", "contacts", pairs=True), None),
    "coins as geoms": (_CHOSEN, _coin_geoms),
    "coins as sites": (_CHOSEN, _coin_sites),
    "constraint islands on": (_flags(island=True), None),
    "midphase on": (_flags(midphase=True), None),
    "fixed geoms posed in every step": (_POSED, None),
    "plate and gate without joints": (_CHOSEN, _without_movers("joint")),
    "no plate, no gate": (_CHOSEN, _without_movers("body")),
}
"""Ways to model the classic level."""

_SIZES: Final[Mapping[str, Way]] = {
    AS_CHOSEN: (_CHOSEN, None),
    "fixed geoms posed in every step": (_POSED, None),
    "neither midphase nor posed once": (_flags(sleep=False, midphase=False), None),
}
"""Ways to model levels of many boxes."""


def ablations(rounds: int, boxes: Sequence[int], games: int) -> Frame:
    """Measure every way to model the classic level, and levels of more and more boxes.

    Returns:
        ``what`` is modelled otherwise, ``chosen`` (as the compiler does it), ``boxes`` (0 for the
        classic level), ``geoms``, ``us_per_step`` (CPU, median of the rounds) with its ``spread``,
        and ``same_bits``: whether the ball's way is the chosen model's, to the bit.
    """
    levels = {count: level_of_boxes(count) for count in boxes}
    return Frame(
        [
            *_compared({0: load_level("classic")}, CLASSIC, rounds, games),
            *_compared(levels, _SIZES, rounds, games),
        ]
    )


def _compared(
    levels: Mapping[int, Level], ways: Mapping[str, Way], rounds: int, games: int
) -> Iterator[dict[str, Any]]:
    """Let every way to model each level, by the number of its boxes, take turns."""
    models = {(boxes, what): _model(levels[boxes], ways[what]) for boxes in levels for what in ways}
    played = {key: Games(model, levels[key[0]], games) for key, model in models.items()}
    taken = costs(played, rounds)
    for (boxes, what), model in models.items():
        row = {"what": what, "chosen": what == AS_CHOSEN, "boxes": boxes, "geoms": model.ngeom}
        same = np.array_equal(played[boxes, what].ball, played[boxes, AS_CHOSEN].ball)
        yield row | taken[boxes, what] | {"same_bits": same}


def _model(level: Level, way: Way) -> mujoco.MjModel:
    setting, change = way
    spec = setting.spec(level)
    if change is not None:
        change(spec, level)
    return spec.compile()
