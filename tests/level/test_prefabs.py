"""Prefabs and copies: what is placed is what somebody would have written out by hand."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.arrays import Float64
from roller_env.level import Level, LevelError, load_level, parse_level
from roller_env.level.expand import expand
from roller_env.level.schema import PIECE_FIELDS
from roller_env.pieces.fan import Fan
from roller_env.pieces.fields import Part, Role
from roller_env.pieces.finish import Finish
from roller_env.pieces.piece import ExpandedLevel
from roller_env.pieces.placing import Frame, place_fields
from roller_env.pieces.spring import Spring
from tests.level.samples import COMPLETE, SMALL, small_level

pytestmark = pytest.mark.filterwarnings("ignore::roller_env.level.LevelWarning")

GROUP: dict[str, Any] = {
    kind: pieces for kind, pieces in yaml.safe_load(COMPLETE).items() if kind in PIECE_FIELDS
}
"""One of every kind of piece."""
HEAD = (
    "units: quant\nname: t\nstart: {at: [0, 0, 16]}\nfinish: {at: [0, 900, 16], size: [1, 1, 1]}\n"
)
"""Four lines of file."""
HERE = Frame()
DOOR = """\
prefabs:
  room:
    plates:
      - {name: button, at: [100, 0, 20], size: [32, 32, 24], opens: [door], sinks_to: 0}
    gates:
      - {name: door, at: [200, 0, 20], size: [8, 32, 40], lowers_to: -40}
"""


def complaints(text: str) -> list[str]:
    with pytest.raises(LevelError) as caught:
        parse_level(text, "f")
    return str(caught.value).splitlines()


def placed(pieces: dict[str, Any], frame: Frame, **others: Any) -> Level:
    """Return a level of pieces in a frame, and of others that stay where they are."""
    entry = {"pieces": pieces, "at": list(frame.at), "yaw_deg": frame.yaw_deg, "name": "x"}
    head = yaml.safe_load(HEAD) | {"start": {"at": [0, 0, 9000]}, "place": [entry]}
    finish = {"at": [0, 0, 8000], "size": [1, 1, 1]}
    return load_level(head | others | {"finish": finish, "materials": {"ice": {}}})


def in_frame(points: Float64, frame: Frame) -> Float64:
    """Return places in metres, (..., 3), moved and turned."""
    angle = math.radians(frame.yaw_deg)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    moved = points + 0.0
    moved[..., :2] = points[..., :2] @ turn.T
    return moved + 0.0254 * np.array(frame.at)


def test_copies_are_what_they_would_be_written_out() -> None:
    copies = parse_level(
        SMALL
        + "prefabs:\n"
        + "  post: {parameters: {high: 30}, boxes: [{at: [5, 0, 15], size: [9, 9, $high]}]}\n"
        + "place:\n"
        + "  - {of: post, at: [100, 50, 0], repeat: {count: 3, step: [0, -40, 1]}}\n"
        + "  - {of: post, at: [300, 0, 0], yaw_deg: 90, parameters: {high: 20}}\n"
    )
    assert copies == parse_level(
        SMALL
        + "  - {at: [105, 50, 15], size: [9, 9, 30]}\n"
        + "  - {at: [105, 10, 16], size: [9, 9, 30]}\n"
        + "  - {at: [105, -30, 17], size: [9, 9, 30]}\n"
        + "  - {at: [300, 5, 15], size: [9, 9, 20], yaw_deg: 90}\n"
    )


def test_nothing_is_left_of_copies_in_the_level_that_a_replay_holds() -> None:
    level = parse_level(HEAD + DOOR + "place: [{of: room, at: [0, 50, 0]}]\n")
    assert set(level.model_dump()) <= set(Level.model_fields)
    assert Level.model_validate_json(level.model_dump_json()) == level


@pytest.mark.parametrize("yaw_deg", [0, 90, 180, -90])
def test_every_piece_is_moved_and_turned_as_a_whole(yaw_deg: int) -> None:
    frame = Frame((300, -70, 11), yaw_deg)
    # The faces of a bowl lie as they do, whichever way it is turned.
    group = GROUP if yaw_deg % 180 == 0 else GROUP | {"bowls": []}
    there, here = expand(placed(group, frame)), expand(placed(group, HERE))
    assert len(there.solids) > 20
    assert solids_of(there) == solids_of(here, frame)
    assert rounded(there.coins) == rounded(in_frame(here.coins, frame))
    for new, old in zip(there.movers, here.movers, strict=True):
        assert new.end.centre == pytest.approx(in_frame(np.array(old.end.centre), frame))
    assert len(there.regions) > 5
    for kind in set(there.regions) - {Finish}:
        regions = there.regions[kind]
        for region, before in zip(regions, here.regions[kind], strict=True):
            half = before.half if yaw_deg % 180 == 0 else np.array(before.half)[[1, 0, 2]]
            assert region.half == pytest.approx(tuple(half))
            assert region.centre == pytest.approx(in_frame(np.array(before.centre), frame))
    turn = Frame((0, 0, 0), yaw_deg)
    velocities = [level.of(Spring)[0].velocity for level in (there, here)]
    forces = [level.of(Fan)[0].force_n for level in (there, here)]
    for new_way, way in (velocities, forces):
        assert new_way == pytest.approx(in_frame(np.array(way), turn))


def solids_of(level: ExpandedLevel, frame: Frame = HERE) -> list[list[list[float]]]:
    """Return the corners of all solids in a frame, in an order that does not depend on theirs."""
    return sorted(rounded(in_frame(solid.corners(), frame)) for solid in level.at_the_start)


def rounded(points: Float64) -> list[list[float]]:
    """Return places, to a micrometre, in an order that does not depend on theirs."""
    return sorted((points.round(6) + 0.0).tolist())


@settings(deadline=None, max_examples=20)
@given(st.floats(-360, 360))
def test_what_is_not_bound_to_the_axes_can_be_turned_by_any_angle(yaw_deg: float) -> None:
    frame = Frame((100, -50, 7), yaw_deg)
    kinds = "boxes ramps walls hulls wedges half_pipes spirals gates platforms"
    group = {kind: GROUP[kind] for kind in kinds.split()}
    # An upright one is as it is from everywhere: its panels look along the axes.
    group["tubes"] = [{"start": [0, 50, 9], "end": [90, 80, 40], "inner_radius": 9, "sides": 5}]
    group["coins"] = GROUP["coins"][:3]
    there, here = turned(group, frame), turned(group, HERE)
    for new, old in zip(there.at_the_start, here.at_the_start, strict=True):
        corners = in_frame(old.corners(), frame)
        assert all(np.linalg.norm(corners - c, axis=1).min() < 1e-9 for c in new.corners())
    assert there.coins == pytest.approx(in_frame(here.coins, frame), abs=1e-9)


def turned(group: dict[str, Any], frame: Frame) -> ExpandedLevel:
    """Return pieces in a frame, none of which anything has to open."""
    switch = {"at": [0, 0, 5000], "size": [1, 1, 1], "sets": ["x-door"]}
    return expand(placed(group, frame, switches=[switch]))


def test_no_field_of_any_piece_that_is_a_vector_was_forgotten() -> None:
    def forgotten(kind: Any, path: str) -> list[str]:
        if isinstance(kind, type) and issubclass(kind, Part):
            return [
                name
                for field, info in kind.model_fields.items()
                if not any(isinstance(extra, Role) for extra in info.metadata)
                for name in forgotten(info.annotation, f"{path}.{field}")
            ]
        if any(isinstance(extra, Role) for extra in getattr(kind, "__metadata__", ())):
            return []
        parts = get_args(kind)
        is_list = getattr(kind, "__origin__", None) is tuple
        is_vector = is_list and len(parts) > 1 and ... not in parts
        return [path] if is_vector else [n for part in parts for n in forgotten(part, path)]

    assert [name for field, kind in PIECE_FIELDS.items() for name in forgotten(kind, field)] == []


@given(st.integers(2, 40), st.integers(1, 40), st.floats(-300, 300))
def test_copies_that_are_only_turned_stand_on_a_ring(count: int, of: int, out: float) -> None:
    entry = {"pieces": {"coins": [{"at": [out, 0, 5]}]}, "at": [1, 2, 3]}
    entry["repeat"] = {"count": count, "turn_deg": 360 / of}
    coins = expand(load_level(small_level().model_dump(mode="json") | {"place": [entry]})).coins
    assert np.linalg.norm(coins - (1, 2, 8), axis=1) == pytest.approx(abs(out), abs=1e-9)
    assert coins[0] == pytest.approx(coins[of % count if of < count else 0], abs=1e-9)


def test_each_copy_is_placed_in_the_frame_of_the_one_before() -> None:
    row = "    repeat: {count: 5, step: [100, 0, 1], turn_deg: 90}\n"
    coins = parse_level(HEAD + "place:\n  - pieces: {coins: [{at: [0, 0, 16]}]}\n" + row).coins
    places = [[round(v / 0.0254, 9) for v in coin.at or ()] for coin in coins]
    assert places == [[0, 0, 16], [100, 0, 17], [100, 100, 18], [0, 100, 19], [0, 0, 20]]


def test_names_are_those_of_a_copy() -> None:
    level = parse_level(
        HEAD
        + DOOR
        + "place:\n"
        + "  - {of: room, repeat: {count: 2, step: [0, 99, 0]}}\n"
        + "  - {of: room, at: [0, 300, 0], name: east}\n"
        + "switches: [{at: [0, 0, 2], size: [9, 9, 4], sets: [east-door, room-2-door]}]\n"
    )
    assert [plate.opens for plate in level.plates] == [(gate.name,) for gate in level.gates]
    assert [gate.name for gate in level.gates] == ["room-1-door", "room-2-door", "east-door"]


def test_prefabs_hold_prefabs_whose_names_are_local_again() -> None:
    level = parse_level(
        HEAD
        + DOOR
        + "  wing:\n"
        + "    place: [{of: room, at: [10, 0, 0], yaw_deg: 90}]\n"
        + "    switches: [{at: [0, 0, 2], size: [9, 9, 4], sets: [room-1-door, outer]}]\n"
        + "place: [{of: wing, at: [0, 50, 0], yaw_deg: 90, name: west}]\n"
        + "gates: [{name: outer, at: [0, 600, 9], size: [9, 9, 9], lowers_to: -9}]\n"
    )
    assert level.switches[0].sets == ("west-room-1-door", "outer")
    assert level.plates[0].opens == ("west-room-1-door",)
    assert level.gates[1].at == pytest.approx((-200 * 0.0254, 60 * 0.0254, 20 * 0.0254))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("place: 3", "f:5:8: place: wanted a list, each item after a '- '"),
        ("place: [{}]", "f:5:9: place[0]: give exactly one of of, pieces"),
        (
            "place: [{of: roam}]\nprefabs: {room: {}}",
            "f:5:14: place[0].of: no prefab is called 'roam'; there are 'room' "
            "(did you mean 'room'?)",
        ),
        (
            "place: [{pieces: {boxs: []}}]",
            "f:5:19: place[0].pieces.boxs: unknown field; allowed: "
            f"{', '.join(('place', *PIECE_FIELDS))} (did you mean 'boxes'?)",
        ),
        (
            "prefabs: {a: {boxes: [{at: [0, 0], size: [1, 1, 1]}]}}\n"
            "place: [{of: a, repeat: {count: 9}}]",
            "f:5:28: prefabs.a.boxes[0].at: found a list of 2; allowed: a list of 3 numbers "
            "(in copy 1 of place[0])",
        ),
        (
            "place: [{pieces: {boxes: [{at: [0, 0, $z], size: [1, 1, 1]}]}}]",
            None,
        ),
        (
            "prefabs: {a: {parameters: {z: 1}, boxes: [{at: [0, 0, $y], size: [1, 1, 1]}]}}\n"
            "place: [{of: a}]",
            "f:5:55: prefabs.a.boxes[0].at[2]: no parameter is called 'y'; there are 'z'",
        ),
        (
            "prefabs: {a: {parameters: {z: ~}}}\nplace: [{of: a}]",
            "f:6:9: place[0]: the parameter 'z' is missing, and has no default",
        ),
        (
            "prefabs: {a: {parameters: {z: 1}}}\nplace: [{of: a, parameters: {y: 1}}]",
            "f:6:33: place[0].parameters.y: the prefab has no such parameter; there are 'z'",
        ),
        (
            "place: [{repeat: {count: 0}, pieces: {}}]",
            "f:5:26: place[0].repeat.count: found 0; allowed: a whole number from 1 to 10000",
        ),
        (
            "place: [{yaw_deg: 30, pieces: {hazards: [{at: [0, 0, 900], size: [1, 1, 1]}]}}]",
            "f:5:42: place[0].pieces.hazards[0]: it has edges along x and y, and is turned by 30 "
            "degrees; wanted a multiple of 90 (in place[0])",
        ),
        (
            "prefabs: {a: {place: [{of: b}]}, b: {place: [{of: a}]}}\nplace: [{of: a}]",
            "f:5:51: prefabs.b.place[0].of: the prefab 'a' would be placed in itself",
        ),
        (
            "boxes: [{at: [0, 0, 0], size: [9, 9, 8]}]\n"
            "place: [{pieces: {boxes: [{at: [0, 0, 1], size: [9, 9, 20]}]}}]",
            "f:3:13: start.at: the ball, of radius 16 quants, would start inside boxes[0], "
            "place[0].pieces.boxes[0] in place[0]; wanted free space around it (on a floor: one "
            "radius over its upper face)",
        ),
    ],
)
def test_what_is_wrong_is_said_where_it_is_written(text: str, said: str | None) -> None:
    assert complaints(HEAD + text) == [
        said
        or "f:5:39: place[0].pieces.boxes[0].at[2]: found the text '$z'; allowed: a number "
        "(in place[0])"
    ]


def test_a_fault_in_many_copies_is_told_once() -> None:
    room = DOOR.partition("    gates:")[0]
    text = HEAD + room + "place: [{of: room, repeat: {count: 20, step: [0, 99, 0]}}]\n"
    none = "the level has nothing that it could tell: no gate, no platform, no fan with a name"
    where = "f:8:70: prefabs.room.plates[0].opens[0]"
    assert complaints(text) == [f"{where}: {none} (in copy 1 of place[0])"]


def doubling(levels: int) -> str:
    inner = [f"  p{n}: {{place: [{{of: p{n + 1}}}, {{of: p{n + 1}}}]}}" for n in range(levels)]
    lines = "\n".join(inner)
    return f"prefabs:\n{lines}\n  p{levels}: {{coins: [{{at: [0, 0, 16]}}]}}\nplace: [{{of: p0}}]\n"


BOMBS = {
    "doubling": doubling(30),
    "repeating": "prefabs:\n  a: {place: [{of: b, repeat: {count: 10000}}]}\n"
    "  b: {place: [{of: c, repeat: {count: 10000}}]}\n  c: {coins: [{at: [0, 0, 16]}]}\n"
    "place: [{of: a, repeat: {count: 10000}}]\n",
    "nothing, often": "place:\n" + "  - {pieces: {}, repeat: {count: 10000}}\n" * 9000,
    "parameters": "prefabs:\n"
    + "".join(
        f"  p{n}: {{parameters: {{x: 1}}, "
        f"place: [{{of: p{n + 1}, parameters: {{x: [$x, $x]}}}}]}}\n"
        for n in range(29)
    )
    + "  p29: {parameters: {x: 1}, coins: [{at: $x}]}\nplace: [{of: p0}]\n",
    "a chain": "prefabs:\n"
    + "".join(f"  p{n}: {{place: [{{of: p{n + 1}}}]}}\n" for n in range(3000))
    + "  p3000: {}\nplace: [{of: p0}]\n",
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_small_file_that_would_become_a_huge_level_is_refused_soon(bomb: str) -> None:
    began = time.process_time()
    (said,) = complaints(HEAD + BOMBS[bomb])
    assert time.process_time() - began < 3.0
    assert "more than" in said


def test_a_level_as_large_as_any_may_be_made_of_copies() -> None:
    level = parse_level(
        SMALL + "place:\n  - pieces: {boxes: [{at: [0, 900, 0], size: [1, 1, 1]}]}\n"
        "    repeat: {count: 9999, step: [2, 0, 0]}\n"
    )
    assert len(level.boxes) == 10_000


def test_a_frame_in_a_frame_is_one_after_the_other() -> None:
    outer, inner = Frame((1, 2, 3), 30.0), Frame((4, 5, 6), 45.0)
    fields = {"at": [7, 8, 9], "size": [1, 1, 1]}
    once = place_fields(PIECE_FIELDS["boxes"], fields, outer.inner(inner))
    twice = place_fields(
        PIECE_FIELDS["boxes"], place_fields(PIECE_FIELDS["boxes"], fields, inner), outer
    )
    assert once["at"] == pytest.approx(twice["at"])
    assert once["yaw_deg"] == twice["yaw_deg"] == 75.0
    assert replace(outer, yaw_deg=0).direction(1, 2) == (1, 2)
