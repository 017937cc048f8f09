"""Maps of TrenchBroom: read as levels, written from levels, and refused in words."""

from __future__ import annotations

import itertools
import math
import random
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.arrays import Float64
from roller_env.cli.level import main
from roller_env.level import (
    Level,
    LevelError,
    level_json_schema,
    load_level,
    parse_level,
    shipped_levels,
)
from roller_env.level.expand import expand
from roller_env.level.maps import export_map, parse_map, read_map
from roller_env.level.maps.brushes import MAX_CORNERS, Block, Hull, body_of, corners_of
from roller_env.level.maps.entities import (
    BALL,
    FINISH,
    FINISH_KEYS,
    KINDS,
    MATERIALS,
    QUAKE_NAMES,
    ROUTE_KEYS,
    SOLIDS,
    SPOTS,
    START,
    START_KEYS,
    TRIGGER,
    WAYPOINT,
    WORLD,
)
from roller_env.level.maps.parse import MAX_BRUSHES, MAX_BYTES, MAX_ENTITIES, Brush, parse_entities
from roller_env.level.text import fields_text
from roller_env.physics.presets import physics_preset
from roller_env.pieces.box import Box
from roller_env.pieces.camera_trigger import CameraTrigger
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.fields import Part
from roller_env.pieces.gate import Gate
from roller_env.pieces.piece import Vector, rotation_matrix
from roller_env.pieces.platform import Platform
from roller_env.replay import load_replay
from roller_env.replay.file import shipped_replays
from roller_env.replay.playback import Playback
from roller_env.units import METRES_PER_QUANT, quants
from tests.level.samples import COMPLETE
from tests.strategies import levels

EDITOR = Path(__file__).parents[2] / "assets" / "trenchbroom"
GATE = (EDITOR / "gate.map").read_text(encoding="utf-8")
PAGE = (EDITOR.parents[1] / "docs" / "maps.md").read_text(encoding="utf-8")
pytestmark = pytest.mark.filterwarnings("ignore::roller_env.level.LevelWarning")


def block(low: Vector, high: Vector, texture: str = "wall") -> str:
    """Return an upright box as a brush of the format Standard."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    planes = [
        ((x0, 0, 0), (x0, 1, 0), (x0, 0, 1)),
        ((x1, 0, 0), (x1, 0, 1), (x1, 1, 0)),
        ((0, y0, 0), (0, y0, 1), (1, y0, 0)),
        ((0, y1, 0), (1, y1, 0), (0, y1, 1)),
        ((0, 0, z0), (1, 0, z0), (0, 1, z0)),
        ((0, 0, z1), (0, 1, z1), (1, 0, z1)),
    ]
    return brush(planes, texture)


def brush(planes: Any, texture: str = "wall") -> str:
    """Return a brush of three points a face."""
    faces = (" ".join(f"( {x} {y} {z} )" for x, y, z in plane) for plane in planes)
    return "{\n" + "".join(f"{face} {texture} 0 0 0 1 1\n" for face in faces) + "}\n"


def hull_of(normals: Any, distance: float) -> Brush:
    """Return the brush whose planes are as far from the origin as that."""
    planes = []
    units = np.array(normals, dtype=float)
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    for normal in units:
        along = np.cross(normal, (1.0, 0.0, 0.0) if abs(normal[0]) < 0.9 else (0.0, 1.0, 0.0))
        along /= np.linalg.norm(along)
        at, across = distance * normal, np.cross(normal, along)
        planes.append((tuple(at + 64 * along), tuple(at), tuple(at + 64 * across)))
    return only_brush("{\n" + brush(planes) + "}\n")


def only_brush(text: str) -> Brush:
    """Return the brush of a map that has one."""
    ((found,),) = (entity.brushes for entity in parse_entities(text, "f"))
    return found


def entity(classname: str, body: str = "", **keys: str) -> str:
    """Return an entity, with the text of its brushes."""
    said = "".join(f'"{key}" "{value}"\n' for key, value in keys.items())
    return f'{{\n"classname" "{classname}"\n{said}{body}}}\n'


FLOOR = block((-100, -100, -16), (500, 100, 0))
ENDS = entity(START, origin="0 0 16") + entity(FINISH, block((440, -32, 0), (480, 32, 64)))


def small(*entities: str, world: str = "", **keys: str) -> str:
    """Return a small map with more entities in it."""
    return entity("worldspawn", FLOOR + world, **keys) + ENDS + "".join(entities)


def problems_of(text: str) -> list[str]:
    """Return what is wrong with a map."""
    with pytest.raises(LevelError) as caught:
        parse_map(text, "f.map").level()
    return [str(problem) for problem in caught.value.problems]


def notes_of(text: str) -> list[str]:
    """Return what is noted of a map that is a level."""
    found = parse_map(text, "f.map")
    found.level()
    return [str(note) for note in found.notes]


def same_corners(one: Float64, other: Float64, tolerance: float) -> bool:
    """Say whether two sets of points are the same, whatever their order."""
    distances = np.linalg.norm(one[:, None] - other[None], axis=2)
    near = (distances <= tolerance).sum(axis=0)
    return len(one) == len(other) and bool((near == 1).all())


# Play ---------------------------------------------------------------------------------------------


def test_the_demonstration_of_gate_plays_to_the_same_end_on_the_map_of_gate() -> None:
    found = read_map(EDITOR / "gate.map")
    level, doubts = found.level()
    assert found.notes == doubts == ()
    replay = load_replay(shipped_replays()["gate"])
    assert replay.options.physics == physics_preset("default")
    here, there = Playback(replay, level=level), Playback(replay)
    for _ in range(len(replay)):
        here.advance()
        there.advance()
        assert np.array_equal(here.simulation.ball_position, there.simulation.ball_position)
    assert here.simulation.result() == replay.result
    assert replay.result.success
    assert replay.result.coins == 8


def test_the_map_of_gate_is_gate() -> None:
    level = read_map(EDITOR / "gate.map").level()[0]
    gate = load_level("gate")
    floor = Box(
        at=(quants(256), 0.0, quants(72)),
        size=(quants(768), quants(384), quants(16)),
        material="hall",
    )
    equal_but_for_solids(level, gate.model_copy(update={"floors": (), "boxes": (floor,)}))


# Round trips --------------------------------------------------------------------------------------


def equal_but_for_solids(level: Level, wanted: Level, tolerance: float = 1e-6) -> None:
    """Hold a level against another, whose floors, walls and so on are boxes in it, in metres."""
    solids = sorted(expand(wanted).ground, key=lambda solid: isinstance(solid, ConvexSolid))
    for one, other in zip(expand(level).ground, solids, strict=True):
        assert same_corners(one.corners(), other.corners(), tolerance)
        assert level.material(one.material) == wanted.material(other.material)
    assert np.allclose(expand(level).coins, expand(wanted).coins, rtol=0.0, atol=tolerance)
    for here, there in zip(expand(level).movers, expand(wanted).movers, strict=True):
        for one, other in ((here.solid, there.solid), (here.end, there.end)):
            assert same_corners(one.corners(), other.corners(), tolerance)
    assert expand(level).regions.keys() == expand(wanted).regions.keys() - {CameraTrigger}
    for kind, regions in expand(level).regions.items():
        for region, other_region in zip(regions, expand(wanted).regions[kind], strict=True):
            numbers, others = (np.hstack(found) for found in (region, other_region))
            assert np.allclose(numbers, others, rtol=0.0, atol=tolerance)
    fields = {kind.field for kind in KINDS.values()} - {"coins"}
    for field in fields:
        for piece, other_piece in zip(getattr(level, field), getattr(wanted, field), strict=True):
            equal_parts(piece, other_piece, tolerance)
    for field in ("start", "finish", "ball", "route"):
        equal_parts(getattr(level, field), getattr(wanted, field), tolerance)
    equal_worlds(level, wanted, tolerance)


def equal_worlds(level: Level, wanted: Level, tolerance: float) -> None:
    """Hold what a level says of the whole against another's."""
    for key in WORLD.values():
        values = getattr(level, key.field), getattr(wanted, key.field)
        if isinstance(values[1], float):
            assert values[0] == pytest.approx(values[1], abs=tolerance)
        else:
            assert values[0] == values[1]


def equal_parts(part: Part | None, wanted: Part | None, tolerance: float) -> None:
    """Hold all fields of a part against another's; of a box that a yaw turns those of no shape."""
    if part is None or wanted is None:
        assert part is wanted
        return
    shape = {"at", "size", "yaw_deg"} if isinstance(part, Gate | Platform) else set()
    here, there = part.model_dump(exclude=shape), wanted.model_dump(exclude=shape)
    assert here.keys() == there.keys()
    for name, value in here.items():
        numbers = np.array(value if value is not None else math.nan)
        if numbers.dtype == np.float64:
            other = np.array(there[name] if there[name] is not None else math.nan)
            assert np.allclose(numbers, other, rtol=0.0, atol=tolerance, equal_nan=True), name
        else:
            assert value == there[name]


def there_and_back(level: Level) -> Level:
    """Return a level as it comes back from a map, and from the level file that is made of that."""
    found = parse_map(export_map(level).text, f"{level.name}.map")
    assert found.notes == ()
    back = found.level()[0]
    assert parse_level(fields_text(found.fields)) == back
    return back


@pytest.mark.parametrize("name", shipped_levels())
def test_a_shipped_level_comes_back_from_a_map(name: str) -> None:
    level = load_level(name)
    back = there_and_back(level)
    assert back.name == level.name
    equal_but_for_solids(back, level)


def test_every_kind_of_piece_comes_back_from_a_map() -> None:
    level = parse_level(COMPLETE)
    equal_but_for_solids(there_and_back(level), level)
    said = {kind.field for kind in KINDS.values()}
    assert all(getattr(level, field) for field in said)
    (note,) = export_map(level).notes
    assert str(note) == "camera_triggers: maps have none of these; they are left out"


@settings(deadline=None, max_examples=40)
@given(levels())
def test_any_level_comes_back_from_a_map(level: Level) -> None:
    equal_but_for_solids(there_and_back(level), level)


ANGLES = st.one_of(st.sampled_from([0.0, 45.0, 90.0, -90.0, 180.0]), st.floats(-180, 180))
LENGTHS = st.floats(0.01, 50.0)


@settings(deadline=None)
@given(
    st.tuples(*[st.floats(-500, 500)] * 3),
    st.tuples(LENGTHS, LENGTHS, LENGTHS),
    st.tuples(ANGLES, ANGLES, ANGLES),
)
def test_a_box_comes_back_however_it_lies(at: Vector, size: Vector, angles: Vector) -> None:
    yaw, pitch, roll = angles
    box = Box(at=at, size=size, yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
    level = parse_map(small()).level()[0].model_copy(update={"boxes": (box,)})
    found = body_of(parse_entities(export_map(level).text, "f")[0].brushes[0])
    assert isinstance(found, Block)
    wanted = corners_of(at, size, rotation_matrix(*angles))
    assert same_corners(found.corners * METRES_PER_QUANT, wanted, 1e-6)


# Bodies -------------------------------------------------------------------------------------------


def test_a_box_of_whole_numbers_stays_one() -> None:
    assert parse_map(small()).fields["boxes"] == [
        {"at": [200, 0, -8], "size": [600, 200, 16], "material": "wall"}
    ]


def test_a_box_is_one_also_with_faces_that_cut_nothing_off() -> None:
    planes = [face.points for face in only_brush("{\n" + block((0, 0, 0), (8, 9, 10)) + "}").faces]
    beyond = ((20, 1, 0), (20, 0, 0), (20, 0, 1))
    body = body_of(only_brush("{\n" + brush([*planes, planes[0], beyond]) + "}"))
    assert isinstance(body, Block)
    assert body == Block((4.0, 4.5, 5.0), (8.0, 9.0, 10.0), (0.0, 0.0, 0.0))


def test_what_is_nearly_a_box_is_a_hull() -> None:
    tilted = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (1e-4, 0, -1)]
    body = body_of(hull_of(tilted, 16.0))
    assert isinstance(body, Hull)
    assert len(body.corners) == 8


@pytest.mark.parametrize("count", [4, 6, 8, 20])
def test_a_body_of_other_shape_has_the_corners_of_its_planes(count: int) -> None:
    signs = [np.array(signs) for signs in itertools.product((-1.0, 1.0), repeat=3)]
    golden = (1 + math.sqrt(5)) / 2
    normals = {
        4: [(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)],
        6: [(1, 1, 0), (1, -1, 0), (-1, 1, 0), (-1, -1, 0), (0, 0.2, 1), (0, 0.2, -1)],
        8: signs,
        20: [
            *signs,
            *(
                np.roll((0.0, one / golden, other * golden), turn)
                for one, other in itertools.product((-1, 1), repeat=2)
                for turn in range(3)
            ),
        ],
    }[count]
    body = body_of(hull_of(normals, 50.0))
    assert isinstance(body, Hull)
    assert len(body.corners) == {4: 4, 6: 8, 8: 6, 20: 12}[count]
    planes = np.array(normals, dtype=float)
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    reach = body.corners @ planes.T
    assert reach.max() <= 50.0 + 1e-6
    assert ((np.abs(reach - 50.0) < 1e-6).sum(axis=1) >= 3).all()


def test_a_brush_that_is_no_box_becomes_a_hull_of_its_material() -> None:
    wedge = brush(
        [
            ((0, 0, 1), (0, 0, 0), (0, 1, 0)),
            ((1, 0, 0), (0, 0, 0), (0, 0, 1)),
            ((0, 64, 1), (0, 64, 0), (1, 64, 0)),
            ((0, 1, 0), (0, 0, 0), (1, 0, 0)),
            ((64, 1, 0), (64, 0, 0), (0, 0, 32)),
        ],
        "ice",
    )
    found = parse_map(small(world=wedge).replace("0 0 16", "-60 0 16"))
    fields = found.fields
    (hull,) = fields["hulls"]
    corners = {tuple(point) for point in hull["points"]}
    ends = ((0, 0), (64, 0), (0, 32))
    assert corners == {(x, y, z) for x, z in ends for y in (0, 64)}
    assert hull["material"] == "ice"
    assert fields["materials"]["ice"]["friction"] == 0.1
    level = found.level()[0]
    equal_but_for_solids(there_and_back(level), level)


def test_a_hull_of_a_map_has_no_more_corners_than_one_of_a_level() -> None:
    hull = level_json_schema()["$defs"]["Hull"]["properties"]["points"]
    assert (hull["minItems"], hull["maxItems"]) == (4, MAX_CORNERS)


@pytest.mark.parametrize(
    ("planes", "said"),
    [
        ([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], "do not close it"),
        ([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)], "do not close it"),
        ([(math.cos(k), math.sin(k), k / 20 - 1) for k in range(41)], "more than 64 corners"),
    ],
)
def test_a_brush_that_is_no_body_is_refused_at_its_line(planes: Any, said: str) -> None:
    faces = [face.points for face in hull_of(planes, 16.0).faces]
    (problem,) = problems_of(small(world=brush(faces)))
    assert problem.startswith("f.map:11: ")
    assert said in problem


def test_faces_that_look_inwards_enclose_nothing() -> None:
    faces = [face.points[::-1] for face in only_brush("{" + FLOOR + "}").faces]
    (problem,) = problems_of(small(world=brush(faces)))
    assert "wanted their outsides outwards" in problem


def test_points_on_one_line_are_no_plane() -> None:
    broken = FLOOR.replace("( -100 1 0 )", "( -100 0 -3 )")
    (problem,) = problems_of(small(world=broken))
    assert problem == "f.map:11: the three points of the face in line 12 lie on one line"


# Entities -----------------------------------------------------------------------------------------


def test_textures_are_materials_and_unknown_ones_are_told() -> None:
    again = block((0, 0, 0), (8, 8, 8), "base/metal1")
    world = block((0, 0, 40), (8, 8, 48), "roller/ICE") + again + again
    found = parse_map(small(world=world), "f.map")
    assert [box.get("material") for box in found.fields["boxes"]] == ["wall", "ice", None, None]
    (note,) = found.notes
    wanted = "f.map:19: unknown texture 'base/metal1' is of the material default (2 times)"
    assert str(note) == wanted


def test_a_brush_is_of_the_material_that_the_ball_rolls_on() -> None:
    lines = block((0, 0, 40), (8, 8, 48), "brick").splitlines(keepends=True)
    lines[6] = lines[6].replace("brick", "sand")
    found = parse_map(small(world="".join(lines)))
    assert found.fields["boxes"][1]["material"] == "sand"
    assert "several textures" in str(found.notes)


def test_a_map_can_define_materials() -> None:
    world = {"material_mud": "3 0.5 #554433 plain"}
    level = parse_map(small(world=block((0, 0, 60), (8, 8, 70), "mud"), **world)).level()[0]
    assert level.boxes[1].material == "mud"
    assert level.materials["mud"].friction == 3.0
    (problem,) = problems_of(small(material_mud="3 #554433"))
    assert problem.startswith(
        "f.map:3: worldspawn.material_mud: found '3 #554433'; wanted friction"
    )


def test_what_is_not_understood_is_listed() -> None:
    text = small(
        entity("monster_ogre", origin="0 0 0", angle="90"),
        entity("func_door", block((0, 0, 40), (8, 8, 48))),
        entity("light", origin="0 0 0", light="300"),
        entity("light_torch", origin="0 0 0"),
        entity("func_group", block((0, 0, 40), (8, 8, 48)), _tb_type="_tb_layer", spawnflags="1"),
        wad="a.wad",
        sounds="4",
    )
    notes = [note.partition(": ")[2] for note in notes_of(text)]
    assert notes == [
        "unknown key 'sounds' of 'worldspawn' is left out",
        "unknown classname 'monster_ogre' is left out",
        "unknown classname 'func_door' is left out, with its brushes",
        "lights are left out: the light of a level is its own (2 times)",
        "unknown key 'spawnflags' of 'func_group' is left out",
    ]


def test_quakes_own_things_are_pieces() -> None:
    low, high = (0, 0, 0), (16, 16, 8)
    level = parse_map(
        small(
            entity("trigger_hurt", block((100, 60, 0), (116, 76, 8))),
            entity("trigger_push", block(low, high), speed="100", angle="90", targetname="p"),
            entity("trigger_push", block(low, high), speed="100", angle="-1"),
            entity("trigger_teleport", block((60, 0, 0), (70, 9, 9)), target="exit"),
            entity("info_teleport_destination", targetname="exit", origin="200 0 16"),
            entity("func_wall", block((0, 80, 0), (8, 88, 8))),
            entity("func_detail", block((0, 80, 8), (8, 88, 16))),
        )
    ).level()[0]
    assert len(level.hazards) == 1
    assert len(level.boxes) == 3
    assert level.springs[0].velocity == pytest.approx((0, quants(100), 0))
    assert level.springs[1].velocity == pytest.approx((0, 0, quants(100)))
    assert level.springs[0].name == "p"
    assert level.teleporters[0].to == pytest.approx((quants(200), 0, quants(16)))


PLATE = block((60, 0, -6), (120, 60, 16))
SLAB = block((200, -60, -48), (216, 60, 96))


def test_one_targetname_may_be_that_of_many() -> None:
    text = small(
        entity("roller_gate", SLAB, targetname="door"),
        entity("roller_gate", SLAB.replace("200", "240").replace("216", "256"), targetname="door"),
        entity("roller_fan", SLAB, targetname="2nd fan", force_n="0 0 1"),
        entity("roller_plate", PLATE, target="door", target2="2nd fan"),
    )
    found = parse_map(text, "f.map")
    level = found.level()[0]
    assert [gate.name for gate in level.gates] == ["door", "door_2"]
    assert level.plates[0].opens == ("door", "door_2", "m2nd_fan")
    assert level.plates[0].name == "plate_1"
    assert [note.message for note in found.notes] == [
        "the targetname 'door' is now door_2",
        "the targetname '2nd fan' is now m2nd_fan",
    ]


def test_a_name_that_is_given_goes_before_one_that_is_made() -> None:
    fan = entity("roller_fan", SLAB, targetname="fan", force_n="0 0 1")
    plates = [
        entity("roller_plate", PLATE, target="fan", **keys)
        for keys in ({}, {"targetname": "plate_1"}, {})
    ]
    level = parse_map(small(fan, *plates)).level()[0]
    assert [plate.name for plate in level.plates] == ["plate_2", "plate_1", "plate_3"]


def test_two_platforms_may_go_to_one_place() -> None:
    corner = entity("path_corner", targetname="there", origin="300 0 60")
    text = small(corner, *[entity("roller_platform", SLAB, target="there")] * 2)
    found = parse_map(text)
    assert [platform["to"] for platform in found.fields["platforms"]] == [[300, 0, 60]] * 2
    assert "&" not in fields_text(found.fields)


def test_more_problems_than_anyone_reads_are_not_looked_for() -> None:
    *problems, last = problems_of(small(entity("roller_hazard") * 200))
    assert len(problems) == 100
    assert last == "f.map: more may be wrong; these are the first 100 problems"


def test_a_target_that_is_not_there_is_told_with_what_is() -> None:
    door = entity("roller_gate", SLAB, targetname="door")
    (problem,) = problems_of(small(door, entity("roller_plate", PLATE, target="dor")))
    assert problem.endswith(
        "roller_plate.target: no gate, platform or fan has the targetname 'dor'; "
        "there are 'door' (did you mean 'door'?)"
    )
    (problem,) = problems_of(small(door, entity("roller_plate", PLATE)))
    assert "roller_plate.target: missing; wanted" in problem
    (problem,) = problems_of(small(entity("roller_platform", SLAB, target="end")))
    assert "roller_platform.target: found 0 path_corner of the targetname; wanted one" in problem


def test_a_body_that_is_no_upright_box_is_the_box_round_it() -> None:
    two = block((300, 0, 0), (310, 10, 10)) + block((330, 20, 0), (340, 40, 30))
    found = parse_map(small(entity("roller_hazard", two)), "f.map")
    assert found.fields["hazards"] == [{"at": [320, 20, 15], "size": [40, 40, 30]}]
    assert "the body of 'roller_hazard' is no upright box: it is the box round it" in str(
        found.notes
    )


def test_what_is_wrong_with_the_level_is_placed_in_the_map() -> None:
    door = entity("roller_gate", SLAB, targetname="door", needs="some")
    text = small(door, entity("roller_plate", PLATE, target="door"))
    line = text[: text.index('"needs"')].count("\n") + 1
    assert problems_of(text) == [
        f"f.map:{line}: gates[0].needs: found the text 'some'; allowed: 'any', 'all'"
    ]
    line = text[: text.index('"roller_gate"')].count("\n")
    problems = problems_of(small(door.replace("some", "any")))
    assert problems == [
        f"f.map:{line}: gates[0].name: nothing opens the gate 'door'; name it in a plate's 'opens' "
        "or a switch's 'sets'"
    ]


def test_start_and_finish_are_needed_once() -> None:
    world = entity("worldspawn", FLOOR)
    assert [problem.partition(": ")[2] for problem in problems_of(world)] == [
        "the map has no info_player_start, where the ball starts; wanted one",
        "the map has no roller_finish, the finish; wanted one",
    ]
    assert any("a second info_player_start" in problem for problem in problems_of(small(ENDS)))


# Broken maps --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("broken", "place", "said"),
    [
        ("(", "1:1", "found '('; wanted '{', which begins an entity"),
        ("{", "1:2", "found the end of the file; wanted a key in quotes"),
        ('{\n"a" "b\n"}', "2:5", "wanted the value of 'a', in quotes on one line"),
        ('{"a" "1"\n "a" "2"}', "2:2", "found the key 'a' of this entity a second time"),
        ("{\n{\nbrushDef {", "3:1", "only the formats Standard and Valve 220 are read"),
        ("{{}}", "1:2", "found a brush of 0 faces; wanted at least 4"),
        ("{{(0 0 x)(0 0 1)(0 1 0) a 0 0 0 1 1}}", "1:3", "found 'x'; wanted a number"),
        ("{{(0 0 1e9)(0 0 1)(0 1 0) a 0 0 0 1 1}}", "1:3", "out of this world"),
        ("{{(0 0 nan)(0 0 1)(0 1 0) a 0 0 0 1 1}}", "1:3", "found 'nan'; wanted a number"),
        ("{{(0 0 1)(0 0 1)(0 1 0) a 0 0 0 1}}", "1:3", "found 4 numbers after the texture 'a'"),
        ("{{(0 0 1)(0 0 1)(0 1 0)", "1:24", "wanted the name of the face's texture"),
        ("{}" * (MAX_ENTITIES + 1), "1:40001", f"more than {MAX_ENTITIES} entities"),
        ("x" * (MAX_BYTES + 1), "", "the map is too large"),
    ],
)
def test_what_is_no_map_is_refused_with_its_place(broken: str, place: str, said: str) -> None:
    (problem,) = problems_of(broken)
    assert problem.startswith(f"f.map:{place}{':' if place else ''} ")
    assert said in problem


def test_too_many_brushes_and_faces_are_refused() -> None:
    face = "(0 0 0)(0 1 0)(0 0 1)a 0 0 0 1 1\n"
    (problem,) = problems_of("{{" + face * 129 + "}}")
    assert "more than 128 faces" in problem
    (problem,) = problems_of("{" + ("{" + face * 4 + "}") * (MAX_BRUSHES + 1) + "}")
    assert f"more than {MAX_BRUSHES} brushes" in problem


def test_a_file_that_cannot_be_read_is_a_level_error(tmp_path: Path) -> None:
    (tmp_path / "latin.map").write_bytes(b'{\n"message" "Caf\xe9"\n}')
    (tmp_path / "large.map").write_bytes(b" " * (MAX_BYTES + 1))
    for name, said in {
        "none": "there is no such file",
        "latin": "latin.map:2:15: found the byte 0xe9",
        "large": "too large",
        "": "found a directory",
    }.items():
        with pytest.raises(LevelError, match=said):
            read_map(tmp_path / f"{name}.map" if name else tmp_path)


def imports_or_complains(text: str) -> bool:
    """Say whether a text is a level; if not, what is wrong must be said of the file."""
    said = "f.map"
    level: Level | None = None
    try:
        found = parse_map(text, "f.map")
        assert all(note.line for note in found.notes)
        level = found.level()[0]
    except LevelError as error:
        said = str(error)
    assert said.startswith("f.map")
    assert level is None or parse_level(fields_text(found.fields)) == level
    return level is not None


PIECES = st.sampled_from(
    [
        "{",
        "}",
        "(",
        ")",
        "[",
        "]",
        '"',
        "\n",
        "//",
        " ",
        "-",
        "1e9",
        "0",
        "nan",
        "1",
        "\\",
        "trigger_hurt",
    ]
    + [word for word in re.split(r"\s+", GATE) if word]
)


@settings(deadline=None, max_examples=150)
@given(st.lists(st.tuples(st.integers(0, len(GATE)), st.integers(0, 40), PIECES), max_size=4))
def test_any_change_of_a_map_gives_a_level_or_a_level_error(
    changes: list[tuple[int, int, str]],
) -> None:
    text = GATE
    for at, length, word in changes:
        text = text[:at] + word + text[at + length :]
    imports_or_complains(text)


@settings(deadline=None)
@given(st.text() | st.lists(PIECES).map(" ".join))
def test_any_text_gives_a_level_or_a_level_error(text: str) -> None:
    imports_or_complains(text)


def test_thousands_of_changed_numbers_give_levels_or_level_errors() -> None:
    rng = random.Random(0)
    values = ["0", "1", "-1", "64", "1e-3", "0.333333", "199999", "-64.5", "72.000001", "1e5"]
    text = small(
        entity("roller_gate", SLAB, targetname="door", speed="32"),
        entity("roller_plate", PLATE, target="door", sinks_to="-13"),
        entity("roller_coin", origin="50 0 16"),
    )
    words = re.split(r"([\s\"]+)", text)
    places = [at for at, word in enumerate(words) if re.fullmatch(r"-?[0-9.]+", word)]
    levels = 0
    for _ in range(1_000):
        changed = list(words)
        for at in rng.sample(places, rng.choice([1, 1, 2, 5])):
            changed[at] = rng.choice(values)
        levels += imports_or_complains("".join(changed))
    assert 300 < levels < 2_700


@pytest.mark.parametrize(
    "text",
    [
        small(**{f"material_m{number}": "1 1 #000000 grid" for number in range(90_000)}),
        small(entity("roller_plate", PLATE, **{f"target{n}": "" for n in range(200_000)})),
        "//\n" * 1_300_000,
        "{{(" + " " * 4_000_000,
        '{"' + "\\" * 4_000_000,
        "{{(" + "1" * 4_000_000,
        small(entity("roller_gate", targetname="g") * 19_000),
        small(entity("roller_gate", SLAB, targetname="g") * 2_000)
        + entity("roller_plate", PLATE, target="g") * 2_000,
        small('{"classname" "path_corner" "targetname" "g" "origin" "0 0 0"}' * 9_000)
        + '{"classname" "roller_platform" "target" "g"}' * 9_000,
    ],
    ids=[
        "materials",
        "targets",
        "comments",
        "blanks",
        "escapes",
        "digits",
        "names",
        "links",
        "corners",
    ],
)
def test_a_hostile_map_takes_no_long_time(text: str) -> None:
    begin = time.process_time()
    imports_or_complains(text)
    assert time.process_time() - begin < 10.0


# The command line and the editor ------------------------------------------------------------------


def test_a_map_is_imported_and_exported_on_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", "gate"]) == 0
    assert main(["import", "gate.map"]) == 0
    assert capsys.readouterr().out == "wrote gate.map\nwrote gate.yaml\n"
    fields = yaml.safe_load(Path("gate.yaml").read_text())
    assert fields["units"] == "quant"
    assert fields["start"] == {"at": [0, 0, 96], "jitter": [24, 24]}
    equal_but_for_solids(load_level("gate.yaml"), load_level("gate"))


def test_the_command_line_lists_what_it_did_not_understand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a b.map").write_text(small(entity("item_health", origin="0 0 0")))
    assert main(["import", "a b.map", "-o", "out.yaml"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "wrote out.yaml",
        "a b.map:27: note: unknown classname 'item_health' is left out",
    ]
    assert load_level("out.yaml").name == "a_b"
    Path("bad.map").write_text(small(entity("roller_gate", SLAB)))
    assert main(["import", "bad.map"]) == 1
    assert "bad.map:27: error: gates[0].name: nothing opens" in capsys.readouterr().out
    assert main(["import", "out.yaml"]) == 1
    assert capsys.readouterr().err.startswith("out.yaml:1:1: found 'name:'; wanted '{'")


def test_the_editor_knows_the_entities_and_keys_that_are_read() -> None:
    text = (EDITOR / "Roller.fgd").read_text(encoding="utf-8")
    text = re.sub(r"=\s*\[[^][]*\]", "", re.sub(r"//.*", "", text))
    classes = re.findall(r"@(\w+)Class([^=\n]*) = (\w+)[^[]*\[([^]]*)\]", text)
    own = {name: set(re.findall(r"(\w+)\(\w+\)", body)) for _, _, name, body in classes}
    keys = {}
    for kind, options, name, _ in classes:
        bases = re.findall(r"base\(([^)]*)\)", options)
        parents = [parent.strip() for base in bases for parent in base.split(",")]
        if kind != "Base":
            keys[name] = own[name].union(*(own[parent] for parent in parents))
    wanted: dict[str, set[str]] = {name: set() for name in SOLIDS}
    wanted |= {
        WAYPOINT: set(),
        "roller_coin": set(),
    }
    wanted |= {spot: {"targetname"} for spot in SPOTS}
    wanted |= {"worldspawn": {*WORLD, *BALL, *ROUTE_KEYS}}
    wanted |= {START: {*START_KEYS}, FINISH: {*FINISH_KEYS}}
    for name, kind in KINDS.items():
        if kind.shape != "point":
            targets = {"target"} if kind.targets or kind.spot else set()
            wanted[name] = {"targetname", *targets, *kind.keys}
    wanted |= {quake: wanted[name] for quake, name in QUAKE_NAMES.items()}
    wanted["trigger_push"] = {"targetname", "speed", "angle"}
    assert keys == wanted


def test_the_editor_has_a_texture_of_every_material() -> None:
    textures = (EDITOR / "textures" / "roller").glob("*.png")
    assert {texture.stem for texture in textures} == {*MATERIALS, TRIGGER}


def test_the_page_has_every_entity_and_key() -> None:
    rows = re.findall(r"^\| (`.*)$", PAGE, re.MULTILINE)
    told: dict[str, set[str]] = {}
    for names, *cells in (row.split(" | ") for row in rows):
        keys = set(re.findall(r"`(\w+)`", cells[-1]))
        told |= dict.fromkeys(re.findall(r"`(\w+)`", names), keys)
    assert {*KINDS, *QUAKE_NAMES, *SOLIDS, *SPOTS, START, FINISH, WAYPOINT, "light"} == told.keys()
    assert {*WORLD, *BALL, *ROUTE_KEYS} <= told["worldspawn"]
    assert {*START_KEYS} <= told[START]
    assert {*FINISH_KEYS} <= told[FINISH]
    for name, kind in KINDS.items():
        assert {*kind.keys} <= told[name]
    assert all(f"`{name}`" in PAGE for name in MATERIALS)


def test_the_python_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.map").write_text(GATE, encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    exec(code, {})  # noqa: S102 - the project's own page


def test_a_map_can_say_all_of_a_level_but_what_the_page_says() -> None:
    pieces = {kind.field for kind in KINDS.values()} | {"boxes", "hulls"}
    whole = {key.field for key in WORLD.values()} | {"name", "units", "materials"}
    parts = {"ball", "start", "finish", "route"}
    solids = {"floors", "ramps", "walls", "tubes", "wedges", "half_pipes", "bowls", "spirals"}
    assert pieces | whole | parts | solids | {"camera_triggers"} == set(Level.model_fields)
