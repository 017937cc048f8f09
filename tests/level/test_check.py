"""Meaning: what a well-formed level may still not say."""

from __future__ import annotations

import time
from typing import Any

import pytest

from roller_env.level import check_level, level_warnings, parse_level
from roller_env.level.schema import BUILT_IN_MATERIALS, MAX_PIECES
from roller_env.pieces.piece import TOUCHING_M
from roller_env.pieces.plate import PLATE_HIT_HEIGHT_M
from roller_env.problems import FieldPath
from roller_env.units import quants
from tests.level.samples import COMPLETE, small_level

RADIUS = quants(16.0)
PLATE = {"name": "plate", "at": (3.0, 0.0, 0.25), "size": (1.0, 1.0, 0.5), "sinks_to": 0.1}
GATE = {"name": "gate", "at": (6.0, 0.0, 1.0), "size": (0.2, 4.0, 2.0), "lowers_to": -1.1}
LINKED = {"plates": [PLATE | {"opens": ["gate"]}], "gates": [GATE]}


def faults(**changes: Any) -> list[FieldPath]:
    """Return the fields at fault in the small level with these changes."""
    return [problem.path for problem in check_level(small_level(**changes))]


def message(**changes: Any) -> str:
    """Return what is said of the one fault of the small level with these changes."""
    (problem,) = check_level(small_level(**changes))
    return str(problem)


def start_at(x: float, y: float, z: float, *jitter: float) -> dict[str, Any]:
    return {"at": (x, y, z), "jitter": jitter or (0.0, 0.0)}


def test_the_small_level_is_sound() -> None:
    assert faults() == []
    assert faults(**LINKED) == []


def test_a_plate_may_only_open_gates_that_exist() -> None:
    changes = {"plates": [PLATE | {"opens": ["gate", "gat"]}], "gates": [GATE]}
    assert faults(**changes) == [("plates", 0, "opens", 1)]
    assert message(**changes).endswith("there are 'gate' (did you mean 'gate'?)")


def test_a_plate_cannot_open_where_there_are_no_gates() -> None:
    text = message(plates=[PLATE | {"opens": ["gate"]}])
    none = "the level has nothing that it could tell: no gate, no platform, no fan with a name"
    assert text == f"plates[0].opens[0]: {none}"


def test_a_plate_that_opens_nothing_is_a_fault() -> None:
    changes = {"plates": [PLATE | {"opens": ["gate"]}, PLATE | {"name": "b", "opens": []}]}
    assert faults(**changes, gates=[GATE]) == [("plates", 1, "opens")]


def test_a_gate_that_no_plate_opens_is_a_fault() -> None:
    assert faults(gates=[GATE]) == [("gates", 0, "name")]


def test_no_two_pieces_share_a_name() -> None:
    box = {"at": (0.0, 9.0, 0.0), "size": (1.0, 1.0, 1.0), "name": "gate"}
    wall = {"start": (0, 20), "end": (1, 20), "bottom": 0.0, "height": 1.0, "name": "gate"}
    found = faults(**LINKED, boxes=[*_floor(), box], walls=[wall])
    assert found == [("walls", 0, "name"), ("gates", 0, "name")]


def _floor() -> list[dict[str, Any]]:
    return [{"at": (8.0, 0.0, -0.5), "size": (20.0, 6.0, 1.0)}]


@pytest.mark.parametrize("name", [*BUILT_IN_MATERIALS, "ice"])
def test_built_in_and_own_materials_are_known(name: str) -> None:
    assert faults(materials={"ice": {}}, boxes=[*_floor(), _block(material=name)]) == []


def _block(**changes: Any) -> dict[str, Any]:
    return {"at": (0.0, 9.0, 0.0), "size": (1.0, 1.0, 1.0)} | changes


def test_every_kind_of_static_piece_needs_a_known_material() -> None:
    far: dict[str, Any] = {"start": (50.0, 50.0, 0.0), "end": (51.0, 50.0, 1.0), "material": "x"}
    line = {"start": (50.0, 50.0), "end": (51.0, 50.0), "bottom": 0.0, "height": 1.0}
    legend = {"W": {"material": "x"}}
    assert faults(
        floors=[{"corner": (50.0, 0.0, 0.0), "cell": 1.0, "plan": "#", "legend": legend}],
        boxes=[*_floor(), _block(material="x")],
        ramps=[far | {"width": 1.0}],
        walls=[line | {"material": "x"}],
        tubes=[far | {"inner_radius": 1.0}],
    ) == [
        ("floors", 0, "legend", "W", "material"),
        ("boxes", 1, "material"),
        ("ramps", 0, "material"),
        ("walls", 0, "material"),
        ("tubes", 0, "material"),
    ]


def test_a_ball_resting_on_the_floor_is_not_inside_it() -> None:
    assert faults(start=start_at(0, 0, RADIUS)) == []
    assert faults(start=start_at(0, 0, RADIUS - 0.9 * TOUCHING_M)) == []


def test_a_ball_that_starts_in_the_floor_is_a_fault() -> None:
    sunk = start_at(0, 0, RADIUS - 1.1 * TOUCHING_M)
    assert faults(start=sunk) == [("start", "at")]
    assert "would start inside boxes[0];" in message(start=sunk)


def test_the_ball_must_be_free_all_over_its_jitter() -> None:
    post = _block(at=(1.0, 0.0, 1.0), size=(0.01, 0.01, 2.0))
    assert faults(boxes=[*_floor(), post]) == []
    text = message(boxes=[*_floor(), post], start=start_at(0, 0, RADIUS, 2.0, 0.0))
    assert "would start inside boxes[1] somewhere within its jitter;" in text


@pytest.mark.parametrize("x", [-1.0, 1.0])
@pytest.mark.parametrize("y", [-1.0, 1.0])
def test_every_corner_of_the_jitter_counts(x: float, y: float) -> None:
    post = _block(at=(x, y, 1.0), size=(0.01, 0.01, 2.0))
    start = start_at(0.0, 0.0, RADIUS, 1.0 - RADIUS / 2, 1.0 - RADIUS / 2)
    assert faults(boxes=[*_floor(), post], start=start) == [("start", "at")]


def test_a_ball_may_not_start_in_a_closed_gate_a_plate_or_a_pad() -> None:
    plate = PLATE | {"at": (0.0, 0.0, 0.25), "opens": ["gate"]}
    assert faults(plates=[plate], gates=[GATE]) == [("start", "at")]
    gate = GATE | {"at": (0.0, 0.0, 1.0)}
    assert faults(plates=[PLATE | {"opens": ["gate"]}], gates=[gate]) == [("start", "at")]
    assert faults(lift_pads=[{"at": (0, 0, 0.1), "size": (1, 1, 0.2)}]) == [("start", "at")]


def test_a_gate_is_turned_by_its_yaw_before_the_ball_is_held_against_it() -> None:
    along = GATE | {"at": (0.0, 1.0, 1.0), "yaw_deg": 90.0}
    across = GATE | {"at": (0.0, 1.0, 1.0), "yaw_deg": 0.0}
    plates = [PLATE | {"opens": ["gate"]}]
    assert faults(plates=plates, gates=[along]) == []
    assert faults(plates=plates, gates=[across]) == [("start", "at")]


def test_start_finish_and_route_lie_above_the_kill_height() -> None:
    low = -28.0
    assert faults(
        kill_height=low,
        start=start_at(0, 0, low),
        finish={"at": (9, 0, low), "size": (1, 1, 1)},
        route={"points": [(0, 0, 0), (0, 0, low)]},
    ) == [("start", "at"), ("finish", "at"), ("route", "points", 1)]


def test_a_kill_height_above_the_start_is_a_fault() -> None:
    assert faults(kill_height=0.5, finish={"at": (9, 0, 1), "size": (1, 1, 1)}) == [("start", "at")]


def test_a_plate_must_be_thick_enough_to_be_struck_from_above() -> None:
    def plate(height: float) -> dict[str, Any]:
        piece = PLATE | {"at": (3, 0, 0.25), "size": (1, 1, height), "opens": ["gate"]}
        return {"plates": [piece], "gates": [GATE]}

    needed = 2 * (PLATE_HIT_HEIGHT_M - RADIUS)
    assert needed == pytest.approx(quants(18.0))
    assert faults(**plate(needed + 0.01)) == []
    assert faults(**plate(needed)) == [("plates", 0, "size", 2)]
    assert "hits from more than 0.635 metres count; wanted a plate at least 0.46" in message(
        **plate(needed)
    )


def test_a_larger_ball_can_strike_a_thinner_plate() -> None:
    thin = PLATE | {"size": (1.0, 1.0, 0.1), "opens": ["gate"]}
    ball, start = {"radius": 0.6}, start_at(0, 0, 0.6)
    assert faults(plates=[thin], gates=[GATE], ball=ball, start=start) == []


def test_plates_and_gates_only_sink() -> None:
    plate = PLATE | {"sinks_to": 0.3, "opens": ["gate"]}
    gate = GATE | {"lowers_to": 1.1}
    found = faults(plates=[plate], gates=[gate])
    assert found == [("plates", 0, "sinks_to"), ("gates", 0, "lowers_to")]


def test_a_height_that_follows_from_the_ground_and_lies_too_high_is_told_with_the_ground() -> None:
    plate = {key: value for key, value in PLATE.items() if key != "sinks_to"} | {"opens": ["gate"]}
    sunk = plate | {"at": (3.0, 0.0, -0.35), "size": (1.0, 1.0, 0.8)}
    assert message(plates=[sunk], gates=[GATE]) == (
        "plates[0].sinks_to: not given, so on ground at 0 metres it is -0.3302 metres; "
        "wanted at most the height of 'at', -0.35 metres"
    )
    assert message(plates=[plate | {"at": (3.0, 9.0, 0.25)}], gates=[GATE]) == (
        "plates[0].sinks_to: not given, and it stands on nothing that would tell it; "
        "wanted at most the height of 'at', 0.25 metres"
    )


def test_a_lift_pad_must_be_stronger_than_the_weight_of_the_ball() -> None:
    pad = {"at": (3, 0, 0.1), "size": (1, 1, 0.2), "force_n": 20.0}
    assert faults(lift_pads=[pad], gravity=9.0, ball={"mass_kg": 2.0}) == []
    assert faults(lift_pads=[pad], gravity=10.0, ball={"mass_kg": 2.0}) == [
        ("lift_pads", 0, "force_n")
    ]


def test_coins_lie_above_the_kill_height() -> None:
    line = {"line": {"start": (9, 9, 0), "end": (9, 9, -40), "count": 5}}
    text = message(coins=[line])
    assert text.startswith("coins[0]: the coin at [9, 9, -30] (the first of 2) is not above")


def test_a_tube_keeps_at_least_one_panel() -> None:
    tube = {"start": (50, 0, 0), "end": (50, 0, 5), "inner_radius": 1.0, "sides": 3}
    opening = {"toward_deg": 90.0, "width_deg": 359.0}
    assert faults(tubes=[tube]) == []
    assert faults(tubes=[tube | {"opening": opening}]) == [("tubes", 0, "opening")]


def test_coins_are_counted_over_the_whole_level_without_making_them() -> None:
    grid = {"grid": {"centre": (0, 0, 5), "spacing": (1, 1), "count": (100, 100)}}
    assert faults(coins=[grid]) == []
    assert faults(coins=[grid, {"at": (0, 0, 9)}]) == [("coins",)]
    began = time.process_time()
    assert faults(coins=[grid] * 5_000) == [("coins",)]
    assert time.process_time() - began < 5.0


def test_pieces_are_counted_over_the_whole_level() -> None:
    row = "#" * 100
    plan = "\n".join([row] * (MAX_PIECES // 100))
    floor = {"corner": (100.0, 0.0, 0.0), "cell": 0.5, "plan": plan}
    assert faults(boxes=[], floors=[floor]) == []
    assert faults(boxes=_floor(), floors=[floor]) == [()]


def test_messages_speak_in_the_unit_of_the_file() -> None:
    level = small_level(kill_height=0.5, finish={"at": (9, 0, 1), "size": (1, 1, 1)})
    (in_metres,), (in_quants,) = check_level(level), check_level(level, "quant")
    assert in_metres.message.endswith("above the kill height, 0.5 metres")
    assert in_quants.message.endswith("above the kill height, 19.685 quants")


FINISH = {"at": (5.0, 0.0, 1.0), "size": (2.0, 2.0, 2.0)}
"""Its near face is at x = 4, so the ball touches it from x = 4 - RADIUS on."""


def test_a_ball_that_starts_in_the_finish_is_a_fault() -> None:
    for start in (start_at(5, 0, 1.0), start_at(4 - RADIUS / 2, 0, RADIUS)):
        text = message(finish=FINISH, start=start)
        assert text.startswith(
            "start.at: the ball, of radius 0.4064 metres, would start in the fin"
        )
    assert faults(finish=FINISH, start=start_at(4 - RADIUS - 0.01, 0, RADIUS)) == []


def test_a_ball_that_could_start_in_the_finish_by_its_jitter_is_a_fault() -> None:
    assert faults(finish=FINISH, start=start_at(2, 0, RADIUS, 1.5, 0)) == []
    text = message(finish=FINISH, start=start_at(2, 0, RADIUS, 1.7, 0))
    assert "would start in the finish somewhere within its jitter" in text
    beside = start_at(3.8, -1.8, RADIUS)
    assert faults(finish=FINISH, start=beside) == [], "past the corner"


def test_a_finish_that_is_wholly_inside_a_solid_is_a_fault() -> None:
    text = message(finish={"at": (9, 0, -0.5), "size": (1, 1, 0.5)})
    assert text.startswith("finish.at: the finish is wholly inside boxes[0]")
    for free in (0.0, -0.2):
        assert faults(finish={"at": (9, 0, free), "size": (1, 1, 0.5)}) == []


def test_a_finish_flush_with_a_floor_can_be_touched_and_is_none() -> None:
    assert faults(finish={"at": (9, 0, -0.5), "size": (1, 1, 1)}) == []


def test_a_finish_inside_several_solids_together_is_a_fault() -> None:
    plan = {"corner": (40.0, 0.0, 5.0), "cell": 2.0, "plan": "###\n###\n###", "thickness": 4.0}
    finish = {"at": (43.0, 3.0, 3.0), "size": (4.0, 4.0, 1.0)}
    assert faults(floors=[plan], finish=finish) == [("finish", "at")]
    holed = plan | {"plan": "###\n#.#\n###"}
    assert faults(floors=[holed], finish=finish) == []


def test_a_finish_inside_a_turned_box_is_a_fault_and_one_whose_corner_shows_is_none() -> None:
    block = _block(at=(40.0, 0.0, 0.0), size=(4.0, 2.0, 1.0), yaw_deg=30.0, pitch_deg=20.0)
    inner = {"at": (40.0, 0.0, 0.0), "size": (0.5, 0.5, 0.2)}
    assert faults(boxes=[*_floor(), block], finish=inner) == [("finish", "at")]
    longer = inner | {"size": (3.9, 0.5, 0.2)}
    assert faults(boxes=[*_floor(), block], finish=longer) == []


def test_a_finish_inside_a_gate_waits_for_it_to_open() -> None:
    assert faults(**LINKED, finish={"at": GATE["at"], "size": (0.1, 1, 1)}) == []


def test_the_complete_sample_is_sound() -> None:
    assert check_level(parse_level(COMPLETE)) == []
    assert level_warnings(parse_level(COMPLETE)) == []
