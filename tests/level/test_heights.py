"""Heights at which plates and gates stop, where a level leaves them to the ground."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.level import Level, load_level, parse_level
from roller_env.level.expand import expand
from roller_env.level.schema import MAX_PIECES
from roller_env.pieces.gate import LOWERS_TO_M, Gate
from roller_env.pieces.piece import Piece
from roller_env.pieces.plate import SINKS_TO_M, Plate
from roller_env.units import quants
from tests.builders import ORIGINALS
from tests.level.samples import SMALL, small_level

PLATE = {"name": "plate", "at": (3.0, 0.0, -0.2), "size": (1.0, 1.0, 0.56), "opens": ["gate"]}
GATE = {"name": "gate", "at": (6.0, 0.0, 0.9), "size": (0.2, 3.0, 2.0)}


def stops(level: Level, kind: type[Piece]) -> set[float]:
    field = "lowers_to" if kind is Gate else "sinks_to"
    return {getattr(piece, field) for piece in expand(level).of(kind)}


def stop(level: Level, kind: type[Piece]) -> float:
    (height,) = stops(level, kind)
    return height


def gate_stop(**changes: Any) -> float:
    level = small_level(**{"plates": [PLATE], "gates": [GATE]} | changes)
    return stop(level, Gate)


@pytest.mark.parametrize("name", ORIGINALS)
def test_in_shipped_levels_they_are_the_original_s_to_the_bit(name: str) -> None:
    level = load_level(name)
    assert stops(level, Plate) <= {SINKS_TO_M}
    assert stops(level, Gate) <= {LOWERS_TO_M}


@given(st.integers(-4000, 4000), st.integers(1, 60), st.sampled_from(["quant", "metre"]))
def test_on_a_deck_of_any_height_they_are_as_far_under_it_as_in_the_original(
    deck: int, thickness: int, unit: str
) -> None:
    def at(height: float) -> float:
        return height if unit == "quant" else quants(height)

    size, gate = [at(96), at(96), at(22)], [at(16), at(128), at(224)]
    level = parse_level(
        f"name: a\nunits: {unit}\nkill_height: {at(-9000)}\n"
        f"start: {{at: [0, 0, {at(deck + 16)}]}}\n"
        f"finish: {{at: [{at(500)}, 0, {at(deck)}], size: {size}}}\n"
        f"boxes: [{{at: [{at(200)}, 0, {at(deck - thickness / 2)}],"
        f" size: [{at(800)}, {at(400)}, {at(thickness)}]}}]\n"
        f"plates: [{{name: p, at: [{at(200)}, 0, {at(deck - 8)}], size: {size}, opens: [g]}}]\n"
        f"gates: [{{name: g, at: [{at(400)}, 0, {at(deck - 16)}], size: {gate}}}]\n"
    )
    if unit == "quant":
        assert (stop(level, Plate), stop(level, Gate)) == (quants(deck - 13), quants(deck - 112))
    else:
        expected = (quants(deck - 13), quants(deck - 112))
        assert (stop(level, Plate), stop(level, Gate)) == pytest.approx(expected, abs=1e-7)


def test_what_is_written_is_kept() -> None:
    level = small_level(plates=[PLATE | {"sinks_to": -1.0}], gates=[GATE | {"lowers_to": -7.0}])
    assert (stop(level, Plate), stop(level, Gate)) == (-1.0, -7.0)


def test_a_level_holds_what_was_found_as_if_it_were_written() -> None:
    level = small_level(plates=[PLATE], gates=[GATE])
    assert level.plates[0].sinks_to == pytest.approx(-quants(13.0))
    assert level.gates[0].lowers_to == pytest.approx(-1.0)
    assert Level.model_validate(level.model_dump()) == level
    assert Level.model_validate(level.model_dump(exclude_defaults=True)) == level


@pytest.mark.parametrize("yaw_deg", [0.0, 20.0, 90.0])
def test_a_gate_in_a_gap_stands_on_what_is_beside_it(yaw_deg: float) -> None:
    boxes = [{"at": (x, 0.0, -0.5), "size": (9.5, 6.0, 1.0)} for x in (1.0, 11.0)]
    assert gate_stop(boxes=boxes, gates=[GATE | {"yaw_deg": yaw_deg}]) == pytest.approx(-1.0)


def test_a_gate_between_walls_stands_on_the_floor_in_its_middle() -> None:
    walls = [{"start": (6, y), "end": (6, 2 * y), "bottom": 0, "height": 1.5} for y in (1.6, -1.6)]
    assert gate_stop(walls=walls) == pytest.approx(-1.0)


def test_a_gate_on_a_ramp_stands_on_the_face_of_the_ramp() -> None:
    ramp = {"start": (4.0, 0.0, 0.0), "end": (8.0, 0.0, 1.0), "width": 4.0}
    assert gate_stop(ramps=[ramp]) == pytest.approx(0.5 - 1.0)


def test_a_roof_and_a_deck_far_below_are_no_ground() -> None:
    roof, deep = ({"at": (6.0, 0.0, z), "size": (20.0, 6.0, 0.2)} for z in (3.0, -9.0))
    floor = {"at": (8.0, 0.0, -0.5), "size": (20.0, 6.0, 1.0)}
    assert gate_stop(boxes=[floor, roof, deep]) == pytest.approx(-1.0)
    assert gate_stop(boxes=[deep]) == LOWERS_TO_M, "what hangs free stops where the original's does"


def test_a_lift_pad_is_no_ground() -> None:
    pad = {"at": (6.0, 0.0, 0.25), "size": (1.0, 1.0, 0.5)}
    assert gate_stop(lift_pads=[pad]) == pytest.approx(-1.0)


def test_the_ground_of_a_level_with_too_many_pieces_is_not_made() -> None:
    row = "#" * 200
    plan = "\n".join([row] * (MAX_PIECES // 200 + 1))
    floor = {"corner": (100.0, 0.0, 0.0), "cell": 0.5, "plan": plan}
    assert gate_stop(floors=[floor]) == LOWERS_TO_M


def test_null_is_as_good_as_leaving_it_out() -> None:
    text = SMALL + (
        "plates: [{name: p, at: [100, 0, 0], size: [48, 48, 24], opens: [g], sinks_to: null}]\n"
        "gates: [{name: g, at: [300, 0, 50], size: [16, 400, 100]}]\n"
    )
    assert stop(parse_level(text), Plate) == quants(-13.0)
