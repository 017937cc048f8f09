"""Ablations of the model: what each thing that the compiler leaves out, or puts in, costs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import mujoco
import numpy as np

from roller_env.compile.mjcf import BALL, build_spec
from roller_env.lab.benchmark.scale import level_of_boxes
from roller_env.lab.presets.results import Games, costs
from roller_env.lab.presets.setting import pair_with_ball, set_flag
from roller_env.lab.table import Frame, frame
from roller_env.level import Level, load_level
from roller_env.level.expand import expand
from roller_env.physics.presets import PRESETS

Change = Callable[[mujoco.MjSpec, Level], None]


def _as_chosen(_spec: mujoco.MjSpec, _level: Level) -> None:
    pass


def _flag(name: str, on: bool) -> Change:
    def change(spec: mujoco.MjSpec, _level: Level) -> None:
        set_flag(spec.option, name, on)

    return change


def _unmerged(spec: mujoco.MjSpec, level: Level) -> None:
    """Have every box of the level and every cell of its floors be a geom."""
    merged = [geom for geom in spec.geoms if geom.name.startswith("solid_")]
    materials = {geom.name.split("_", 2)[2]: geom for geom in merged}
    for number, solid in enumerate(expand(level).ground):
        like = materials[solid.material]
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, np.array(solid.rotation).reshape(9))
        spec.worldbody.add_geom(
            name=f"cell_{number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=solid.half_size,
            pos=solid.centre,
            quat=quaternion,
            contype=like.contype,
            conaffinity=like.conaffinity,
            priority=like.priority,
            condim=like.condim,
            friction=like.friction,
            solref=like.solref,
            solimp=like.solimp,
        )
    for geom in merged:
        spec.delete(geom)


def _no_contact_bits(spec: mujoco.MjSpec, _level: Level) -> None:
    """Let everything touch everything, as MuJoCo does unless told otherwise."""
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 1


def _pairs(spec: mujoco.MjSpec, _level: Level) -> None:
    for geom in spec.geoms:
        if geom.name != BALL:
            pair_with_ball(spec, geom)
    spec.geom(BALL).contype = 0


def _fixed_movers(spec: mujoco.MjSpec, level: Level) -> None:
    for name in _movers(level):
        spec.delete(spec.actuator(name))
        spec.delete(spec.joint(name))


def _no_movers(spec: mujoco.MjSpec, level: Level) -> None:
    for name in _movers(level):
        spec.delete(spec.actuator(name))
        spec.delete(spec.body(name))


def _movers(level: Level) -> list[str]:
    return [*(plate.name for plate in level.plates), *(gate.name for gate in level.gates)]


def _coins(as_geoms: bool) -> Change:
    def change(spec: mujoco.MjSpec, level: Level) -> None:
        radius = level.ball.radius / 2
        for number, coin in enumerate(expand(level).coins):
            if as_geoms:
                spec.worldbody.add_geom(
                    name=f"coin_{number}",
                    type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                    size=[radius, radius / 4, 0.0],
                    pos=coin,
                    contype=0,
                    conaffinity=0,
                )
            else:
                spec.worldbody.add_site(name=f"coin_{number}", size=[radius] * 3, pos=coin)

    return change


def _cells(spec: mujoco.MjSpec, level: Level) -> None:
    """Leave floors unmerged, with what the compiler does for levels of so many geoms."""
    _unmerged(spec, level)
    set_flag(spec.option, "midphase", True)


AS_CHOSEN: Final = "as compiled"
CLASSIC: Final[dict[str, Change]] = {
    AS_CHOSEN: _as_chosen,
    "every floor cell a geom": _cells,
    "no contact bits: all may touch all": _no_contact_bits,
    "explicit pairs instead of contact bits": _pairs,
    "coins as geoms": _coins(as_geoms=True),
    "coins as sites": _coins(as_geoms=False),
    "constraint islands on": _flag("island", True),
    "midphase on": _flag("midphase", True),
    "fixed geoms posed in every step": _flag("sleep", False),
    "plate and gate without joints": _fixed_movers,
    "no plate, no gate": _no_movers,
}
"""Ways to model the classic level."""


def _plain(spec: mujoco.MjSpec, _level: Level) -> None:
    set_flag(spec.option, "sleep", False)
    set_flag(spec.option, "midphase", False)


_SIZES: Final[dict[str, Change]] = {
    AS_CHOSEN: _as_chosen,
    "fixed geoms posed in every step": _flag("sleep", False),
    "neither midphase nor posed once": _plain,
}
"""Ways to model levels of many boxes."""


def measure(rounds: int, boxes: Sequence[int], games: int) -> Frame:
    """Measure every way to model the classic level, and levels of more and more boxes.

    Args:
        rounds: turns over which costs are medians.
        boxes: sizes of the levels.
        games: that are stepped together.

    Returns:
        ``boxes`` (0 for the classic level), ``what`` is modelled otherwise, ``chosen`` (as the
        compiler does it), ``geoms``, ``us_per_step`` (CPU, median) with its ``spread``, and
        ``same_bits``: whether the ball's way is the chosen model's, to the bit.
    """
    rows = _compared({0: (load_level("classic"), CLASSIC)}, rounds, games)
    sizes = {count: (level_of_boxes(count), _SIZES) for count in boxes}
    return frame(rows + _compared(sizes, rounds, games))


def _compared(
    levels: Mapping[int, tuple[Level, Mapping[str, Change]]], rounds: int, games: int
) -> list[dict[str, Any]]:
    """Let every way to model each level, by the number of its boxes, take turns."""
    models, played = {}, {}
    for boxes, (level, changes) in levels.items():
        for what, change in changes.items():
            model = _model(level, change)
            models[boxes, what] = model
            played[f"{boxes} {what}"] = Games(model, level.start.at, games)
    taken = costs(played, rounds)
    balls = {boxes: played[f"{boxes} {AS_CHOSEN}"].ball for boxes in levels}
    return [
        {
            "what": what,
            "chosen": what == AS_CHOSEN,
            "boxes": boxes,
            "geoms": model.ngeom,
            "us_per_step": 1e6 * taken[f"{boxes} {what}"].value,
            "spread": taken[f"{boxes} {what}"].spread,
            "same_bits": bool(np.array_equal(played[f"{boxes} {what}"].ball, balls[boxes])),
        }
        for (boxes, what), model in models.items()
    ]


def _model(level: Level, change: Change) -> mujoco.MjModel:
    spec = build_spec(level, PRESETS["default"])
    change(spec, level)
    model = spec.compile()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return model
