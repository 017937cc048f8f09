"""Ablations of the model: what each thing that the compiler leaves out, or puts in, costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final, Literal

import mujoco
import numpy as np

from roller_env.lab.benchmark.scale import level_of_boxes
from roller_env.lab.presets.results import Games, costs
from roller_env.lab.presets.setting import Setting
from roller_env.lab.table import Frame
from roller_env.level import Level, load_level
from roller_env.level.expand import coin_positions, solids

Change = Callable[[mujoco.MjSpec, Level], None]
Way = tuple[Setting, Change | None]
"""How a level is modelled: a setting, and what is then changed of the model."""


def _flags(**flags: bool) -> Setting:
    return Setting("", "flags", flags=tuple(flags.items()))


def _unmerged(spec: mujoco.MjSpec, level: Level) -> None:
    """Have every box of the level and every cell of its floors be a geom."""
    merged = [geom for geom in spec.geoms if geom.name.startswith("solid_")]
    materials = {geom.name.split("_", 2)[2]: geom for geom in merged}
    same = ("contype", "conaffinity", "priority", "condim", "friction", "solref", "solimp")
    for number, solid in enumerate(solids(level)):
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, np.array(solid.rotation).reshape(9))
        spec.worldbody.add_geom(
            name=f"cell_{number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=solid.half_size,
            pos=solid.centre,
            quat=quaternion,
            **{name: getattr(materials[solid.material], name) for name in same},
        )
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


def _coins(level: Level) -> Iterator[tuple[str, np.ndarray, float]]:
    """Yield each coin's name, place and radius, m."""
    for number, place in enumerate(coin_positions(level)[0]):
        yield f"coin_{number}", place, level.ball.radius / 2


def _coin_geoms(spec: mujoco.MjSpec, level: Level) -> None:
    shape = mujoco.mjtGeom.mjGEOM_CYLINDER
    for name, place, r in _coins(level):
        geom = spec.worldbody.add_geom(name=name, type=shape, size=[r, r / 4, 0.0], pos=place)
        geom.contype = geom.conaffinity = 0


def _coin_sites(spec: mujoco.MjSpec, level: Level) -> None:
    for name, place, r in _coins(level):
        spec.worldbody.add_site(name=name, size=[r] * 3, pos=place)


AS_CHOSEN: Final = "as compiled"
_CHOSEN: Final = _flags()
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
    "fixed geoms posed in every step": (_flags(sleep=False), None),
    "plate and gate without joints": (_CHOSEN, _without_movers("joint")),
    "no plate, no gate": (_CHOSEN, _without_movers("body")),
}
"""Ways to model the classic level."""

_SIZES: Final[Mapping[str, Way]] = {
    AS_CHOSEN: (_CHOSEN, None),
    "fixed geoms posed in every step": (_flags(sleep=False), None),
    "neither midphase nor posed once": (_flags(sleep=False, midphase=False), None),
}
"""Ways to model levels of many boxes."""


def measure(rounds: int, boxes: Sequence[int], games: int) -> Frame:
    """Measure every way to model the classic level, and levels of more and more boxes.

    Args:
        rounds: turns over which costs are medians.
        boxes: sizes of the levels.
        games: that are stepped together.

    Returns:
        ``what`` is modelled otherwise, ``chosen`` (as the compiler does it), ``boxes`` (0 for the
        classic level), ``geoms``, ``us_per_step`` (CPU, median) with its ``spread``, and
        ``same_bits``: whether the ball's way is the chosen model's, to the bit.
    """
    rows = []
    for of_boxes in ({0: load_level("classic")}, {n: level_of_boxes(n) for n in boxes}):
        played = {
            (count, what): Games(_model(level, way), level.start.at, games)
            for count, level in of_boxes.items()
            for what, way in (_SIZES if count else CLASSIC).items()
        }
        taken = costs({f"{count} {what}": one for (count, what), one in played.items()}, rounds)
        for (count, what), one in played.items():
            row = {"what": what, "chosen": what == AS_CHOSEN, "boxes": count}
            same = np.array_equal(one.ball, played[count, AS_CHOSEN].ball)
            rows.append(row | {"geoms": one.geoms} | taken[f"{count} {what}"] | {"same_bits": same})
    return Frame(rows)


def _model(level: Level, way: Way) -> mujoco.MjModel:
    setting, change = way
    spec = setting.spec(level)
    if change is not None:
        change(spec, level)
    return spec.compile()
