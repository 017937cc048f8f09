"""Hypothesis strategies for levels.

The random levels have a straight lane along +x, on which the ball starts, and slots of 6 m beside
and on it, one piece a slot, so that every drawn level is valid without a drawn one thrown away.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import yaml
from hypothesis import strategies as st

from roller_env.level.schema import Ball, Level, Material, Route, Start
from roller_env.pieces.box import Box
from roller_env.pieces.camera_trigger import CameraTrigger
from roller_env.pieces.checkpoint import Checkpoint
from roller_env.pieces.coin import CoinArc, CoinGrid, CoinLine, Coins
from roller_env.pieces.curve import Bowl, HalfPipe, Spiral
from roller_env.pieces.fields import METRES_PER_UNIT
from roller_env.pieces.finish import Finish
from roller_env.pieces.floor import FloorCell, FloorPlan
from roller_env.pieces.gate import Gate
from roller_env.pieces.hull import Hull, Wedge
from roller_env.pieces.lift_pad import LiftPad
from roller_env.pieces.plate import Plate
from roller_env.pieces.ramp import Ramp
from roller_env.pieces.tube import Opening, Tube
from roller_env.pieces.wall import Wall

SLOT_M = 6.0
Scenery = Box | Ramp | Wall | Hull | Wedge | HalfPipe | Bowl | Spiral | Tube
OVERHEAD_M = 20.0
"""Over all that is solid."""
LANE_HALF_WIDTH_M = 3.0
CELL_M = 2.0

Draw = Callable[[st.SearchStrategy[Any]], Any]
Origin = tuple[float, float, float]


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of three decimals: what a person writes."""
    return st.integers(round(low * 1000), round(high * 1000)).map(lambda value: value / 1000)


def materials() -> st.SearchStrategy[Material]:
    """Any surface a ball can roll on."""
    return st.builds(
        Material,
        friction=numbers(0.0, 3.0),
        elasticity=numbers(0.0, 1.0),
        colour=st.sampled_from(["#336699", "#33669980", "#ABCDEF"]),
        pattern=st.sampled_from(["plain", "checker", "grid"]),
    )


def balls() -> st.SearchStrategy[Ball]:
    """Balls from light and slippery to heavy and bouncing."""
    return st.builds(
        Ball,
        radius=numbers(0.3, 0.5),
        mass_kg=numbers(0.5, 5.0),
        friction=numbers(0.0, 1.5),
        elasticity=numbers(0.0, 0.9),
    )


def _checkpoints(origin: Origin, length: float) -> st.SearchStrategy[Checkpoint]:
    """Boxes across the lane, whose middles are over everything that is solid."""
    return st.builds(
        lambda x, width: Checkpoint(
            at=_moved(origin, (x, 0.0, OVERHEAD_M)), size=(0.5, width, 2.0 * OVERHEAD_M)
        ),
        numbers(0.0, length),
        numbers(0.5, 4.0),
    )


@st.composite
def levels(draw: Draw) -> Level:
    """Valid levels with any number of every kind of piece."""
    ball: Ball = draw(balls())
    gravity = draw(numbers(3.0, 20.0))
    origin: Origin = (draw(numbers(-20, 20)), draw(numbers(-20, 20)), draw(numbers(-20, 20)))
    named = draw(st.dictionaries(st.sampled_from(["ice", "rubber", "glass"]), materials()))
    surface = st.sampled_from(["default", "glass", *named])
    slots = draw(st.integers(2, 6))
    scenery = [draw(_scenery(slot, origin, surface)) for slot in range(1, slots)]
    plates, gates, pads = _machines(draw, slots, origin, ball, gravity)
    return Level(
        name="random",
        title=draw(st.text(st.characters(codec="utf-8", categories=["L", "N", "Zs"]), max_size=20)),
        gravity=gravity,
        kill_height=origin[2] - draw(numbers(5.0, 30.0)),
        time_limit_s=draw(numbers(1.0, 100.0)),
        ball=ball,
        start=Start(
            at=_moved(origin, (0.0, 0.0, ball.radius)),
            jitter=(draw(numbers(0.0, 1.0)), draw(numbers(0.0, 1.0))),
        ),
        finish=Finish(at=_moved(origin, ((slots + 1) * SLOT_M, 0.0, 0.5)), size=(1.0, 2.0, 1.0)),
        materials=named,
        coins=tuple(draw(_coins(slot, origin)) for slot in range(draw(st.integers(0, slots)))),
        plates=plates,
        gates=gates,
        lift_pads=pads,
        falls=draw(st.sampled_from(["end", "checkpoint"])),
        checkpoints=tuple(draw(st.lists(_checkpoints(origin, slots * SLOT_M), max_size=2))),
        camera_triggers=tuple(draw(st.lists(_triggers(origin, slots * SLOT_M), max_size=3))),
        route=draw(st.none() | _routes(origin, slots)),
        **draw(_lane(slots, origin, surface, scenery)),
    )


@st.composite
def _lane(
    draw: Draw,
    slots: int,
    origin: Origin,
    surface: st.SearchStrategy[str],
    scenery: list[Scenery],
) -> dict[str, Any]:
    """The pieces by kind: the scenery, and the lane as one box or as a floor plan."""
    kinds = {
        "boxes": Box,
        "ramps": Ramp,
        "walls": Wall,
        "hulls": Hull,
        "wedges": Wedge,
        "half_pipes": HalfPipe,
        "bowls": Bowl,
        "spirals": Spiral,
        "tubes": Tube,
    }
    pieces: dict[str, Any] = {
        field: tuple(piece for piece in scenery if isinstance(piece, kind))
        for field, kind in kinds.items()
    }
    length, thickness = (slots + 2) * SLOT_M, draw(numbers(0.1, 2.0))
    if draw(st.booleans()):
        centre = (length / 2 - SLOT_M / 2, 0.0, -thickness / 2)
        size = (length, 2 * LANE_HALF_WIDTH_M, thickness)
        floor = Box(at=_moved(origin, centre), size=size, material=draw(surface))
        return pieces | {"boxes": (floor, *pieces["boxes"])}
    rows = round(length / CELL_M)
    roadside = draw(st.lists(st.sampled_from("#o.W"), min_size=rows, max_size=rows))
    plan = FloorPlan(
        corner=_moved(origin, (-SLOT_M / 2, -LANE_HALF_WIDTH_M - CELL_M, 0.0)),
        cell=CELL_M,
        thickness=thickness,
        plan="\n".join(f"###{character}" for character in roadside),
        legend={"W": FloorCell(material=draw(surface), wall=draw(numbers(0.1, 1.0)))},
    )
    return pieces | {"floors": (plan,)}


@st.composite
def _scenery(draw: Draw, slot: int, origin: Origin, surface: st.SearchStrategy[str]) -> Scenery:
    """One static piece beside the lane, near enough for a ball that falls off to meet it."""
    x, y, z = _moved(origin, (slot * SLOT_M, draw(st.sampled_from([-6.5, 6.5])), 0.0))
    size = draw(numbers(0.1, 2.0))
    material = draw(surface)
    kinds = [Box, Ramp, Wall, Hull, Wedge, HalfPipe, Bowl, Spiral, Tube]
    kind = draw(st.sampled_from(kinds))
    if kind is Box:
        yaw, pitch = draw(numbers(-360.0, 360.0)), draw(numbers(-60.0, 60.0))
        edges = (size, draw(numbers(0.1, 3.0)), draw(numbers(0.1, 1.0)))
        return Box(at=(x, y, z), size=edges, yaw_deg=yaw, pitch_deg=pitch, material=material)
    if kind is Ramp:
        end = (x + draw(numbers(0.2, 2.0)), y + draw(numbers(-1.0, 1.0)), z + draw(numbers(-1, 1)))
        return Ramp(start=(x, y, z), end=end, width=size, thickness=0.3, material=material)
    if kind is Wall:
        corner = (x + draw(numbers(-1.5, 1.5)), y + draw(numbers(0.2, 1.5)))
        height = draw(numbers(0.1, 3.0))
        return Wall(start=(x, y), end=corner, bottom=z, height=height, material=material)
    if kind is Wedge:
        edges = (size, draw(numbers(0.1, 3.0)), draw(numbers(0.1, 1.0)))
        return Wedge(at=(x, y, z), size=edges, yaw_deg=draw(numbers(-360, 360)), material=material)
    if kind is Hull:
        # Four that span a volume, and any others.
        own = [(-size, -0.5, 0.0), (size, -0.5, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5)]
        own += draw(st.lists(st.tuples(*[numbers(-1.5, 1.5)] * 3), max_size=12))
        points = tuple(_moved((x, y, z), point) for point in own)
        return Hull(points=points, material=material)
    if kind is HalfPipe:
        end = (x + draw(numbers(0.2, 2.0)), y, z + draw(numbers(-1.0, 1.0)))
        arc, faces = draw(numbers(20.0, 250.0)), draw(st.integers(2, 9))
        return HalfPipe(
            start=(x, y, z), end=end, radius=size, arc_deg=arc, segments=faces, material=material
        )
    if kind is Bowl:
        rings = draw(st.integers(1, 3))
        return Bowl(at=(x, y, z), radius=size, rings=rings, material=material)
    if kind is Spiral:
        return Spiral(
            centre=(x, y, z),
            radius=1.0,
            width=draw(numbers(0.1, 1.0)),
            rise=draw(numbers(-1.0, 1.0)),
            turn_deg=draw(st.sampled_from([-200.0, 180.0, 500.0])),
            bank_deg=draw(numbers(0.0, 45.0)),
            segments=draw(st.integers(6, 12)),
            material=material,
        )
    opening = st.builds(Opening, toward_deg=numbers(-180, 180), width_deg=numbers(10.0, 90.0))
    return Tube(
        start=(x, y, z),
        end=(x + draw(numbers(-1.0, 1.0)), y, z + draw(numbers(0.5, 4.0))),
        inner_radius=draw(numbers(0.5, 0.8)),
        sides=draw(st.integers(5, 24)),
        opening=draw(st.none() | opening),
        material=material,
    )


def _machines(
    draw: Draw, slots: int, origin: Origin, ball: Ball, gravity: float
) -> tuple[tuple[Plate, ...], tuple[Gate, ...], tuple[LiftPad, ...]]:
    """Plates and lift pads in slots of the lane; each plate opens one or more of the gates."""
    gates = tuple(_gate(draw, f"gate{number}", origin) for number in range(draw(st.integers(0, 2))))
    names = [gate.name for gate in gates]
    plates: list[Plate] = []
    pads: list[LiftPad] = []
    for slot in range(1, slots + 1):
        x = slot * SLOT_M
        kind = draw(st.sampled_from(["nothing", "pad", "plate"]))
        if kind == "pad":
            force = ball.mass_kg * gravity * draw(numbers(1.1, 3.0))
            size, seconds = (2.0, 2.0, draw(numbers(0.05, 0.3))), draw(numbers(0.1, 5.0))
            at = _moved(origin, (x, 0.0, size[2] / 2))
            pads.append(LiftPad(at=at, size=size, force_n=force, duration_s=seconds))
        elif kind == "plate" and gates:
            opens = tuple(draw(st.lists(st.sampled_from(names), min_size=1, unique=True)))
            plates.append(_plate(draw, f"plate{slot}", (x, opens), origin, ball))
    if gates:
        plates.append(_plate(draw, "plate0", (SLOT_M / 2, tuple(names)), origin, ball))
    return tuple(plates), gates, tuple(pads)


def _gate(draw: Draw, name: str, origin: Origin) -> Gate:
    """A gate across the lane between two slots, straight or turned."""
    height = draw(numbers(0.5, 3.0))
    x = draw(st.sampled_from([1.5 * SLOT_M, 2.5 * SLOT_M]))
    at = _moved(origin, (x, 0.0, height / 2))
    yaw = draw(st.sampled_from([0.0, 30.0, 90.0]))
    return Gate(
        name=name,
        at=at,
        size=(0.3, draw(numbers(1.0, 5.0)), height),
        yaw_deg=yaw,
        lowers_to=draw(st.none() | numbers(0.1, 4.0).map(lambda depth: at[2] - depth)),
        speed=draw(numbers(0.05, 2.0)),
    )


def _plate(
    draw: Draw, name: str, place: tuple[float, tuple[str, ...]], origin: Origin, ball: Ball
) -> Plate:
    x, opens = place
    size = (1.5, 2.0, 2 * (0.65 - ball.radius) + draw(numbers(0.0, 0.5)))
    at = _moved(origin, (x, 0.0, draw(numbers(0.0, 0.2))))
    sinks_to = draw(st.none() | numbers(0.0, 0.3).map(lambda depth: at[2] - depth))
    speed = draw(numbers(0.01, 0.5))
    return Plate(name=name, at=at, size=size, opens=opens, sinks_to=sinks_to, speed=speed)


@st.composite
def _coins(draw: Draw, slot: int, origin: Origin) -> Coins:
    """One coin beside the start, or several over the lane, higher than any gate."""
    kind = draw(st.sampled_from(["at", "line", "arc", "grid"]))
    if kind == "at":
        return Coins(at=_moved(origin, (draw(numbers(0.6, 2.0)), draw(numbers(-2.0, 2.0)), 0.5)))
    x, y, z = _moved(origin, (slot * SLOT_M, draw(numbers(-2.0, 2.0)), draw(numbers(3.2, 6.0))))
    count = draw(st.integers(2, 6))
    if kind == "line":
        return Coins(line=CoinLine(start=(x, y, z), end=(x + 2.0, y, z + 1.0), count=count))
    if kind == "arc":
        angles = {"from_deg": draw(numbers(-360, 360)), "to_deg": draw(numbers(-360, 360))}
        return Coins(arc=CoinArc(centre=(x, y, z), radius=1.5, count=count, **angles))
    spacing = (draw(numbers(0.2, 1.0)), draw(numbers(0.2, 1.0)))
    return Coins(grid=CoinGrid(centre=(x, y, z), spacing=spacing, count=(count, 2)))


@st.composite
def _triggers(draw: Draw, origin: Origin, length: float) -> CameraTrigger:
    at = _moved(origin, (draw(numbers(0.0, length)), draw(numbers(-2.0, 2.0)), 0.5))
    kind = draw(st.sampled_from(["overhead", "retreat", "first_person"]))
    if kind == "first_person":
        return CameraTrigger(kind=kind, at=at, reach=draw(numbers(0.1, 2.0)))
    return CameraTrigger(kind=kind, at=at, size=(draw(numbers(0.1, 2.0)), 4.0, 2.0))


@st.composite
def _routes(draw: Draw, origin: Origin, slots: int) -> Route:
    sides = draw(st.lists(numbers(-2.0, 2.0), min_size=2, max_size=slots + 2))
    points = tuple(_moved(origin, (i * SLOT_M, side, 0.4)) for i, side in enumerate(sides))
    return Route(points=points, radius=draw(numbers(0.5, 3.0)))


def _moved(origin: Origin, point: tuple[float, float, float]) -> tuple[float, float, float]:
    return (origin[0] + point[0], origin[1] + point[1], origin[2] + point[2])


def as_yaml(level: Level, unit: str = "metre") -> str:
    """Write a level as the text of a level file in the given unit."""
    data = _in_unit(level.model_dump(mode="json", exclude_defaults=True), METRES_PER_UNIT[unit])
    return yaml.dump({"units": unit, **data}, Dumper=_QuotingDumper, sort_keys=False)


class _QuotingDumper(yaml.SafeDumper):
    """PyYAML writes YAML 1.1, in which text such as 08 needs no quotes; levels are YAML 1.2."""


def _quoted(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style='"')


_QuotingDumper.add_representer(str, _quoted)


def _in_unit(data: Any, scale: float) -> Any:
    """Divide every length by ``scale``: every float whose field names no other unit."""
    if isinstance(data, float):
        return data / scale
    if isinstance(data, list):
        return [_in_unit(item, scale) for item in data]
    if isinstance(data, dict):
        other = ("_deg", "_n", "_s", "_kg", "friction", "elasticity")
        return {k: v if k.endswith(other) else _in_unit(v, scale) for k, v in data.items()}
    return data
