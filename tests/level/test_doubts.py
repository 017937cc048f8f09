"""Doubts: what a level may mean, is shown when it is loaded, and stops nothing."""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roller_env.level import (
    LevelWarning,
    level_warnings,
    load_level,
    parse_level,
    shipped_levels,
)
from roller_env.pieces.coin import MAX_COINS
from roller_env.pieces.piece import TOUCHING_M
from roller_env.problems import FieldPath
from tests.level.samples import SMALL, small_level
from tests.level.test_check import GATE, LINKED, PLATE, RADIUS, _block, _floor, start_at

VOID = SMALL.replace("[0, 0, 16]", "[0, 900, 16]")


def doubts(**changes: Any) -> list[FieldPath]:
    """Return the fields in doubt in the small level with these changes."""
    return [problem.path for problem in level_warnings(small_level(**changes))]


def test_shipped_levels_load_without_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in shipped_levels():
            load_level(name)
            load_level(load_level(name))


def test_a_doubt_is_shown_with_its_place_where_the_level_is_loaded(tmp_path: Path) -> None:
    text = VOID + "coins:\n  - at: [9, 0, -4]\n"
    wanted = (
        "f:3:13: start.at: nothing is under the middle of the ball down to the kill height, "
        "-1129 quants\n"
        "f:8:5: coins[0]: the coin at [9, 0, -4] is inside boxes[0]; wanted in free space"
    )
    with pytest.warns(LevelWarning) as caught:
        level = parse_level(text, "f")
    (warning,) = caught
    assert str(warning.message) == wanted
    assert warning.filename == __file__
    (tmp_path / "f.yaml").write_text(text, encoding="utf-8")
    for source in (level, tmp_path / "f.yaml"):
        with pytest.warns(LevelWarning, match="nothing is under the middle") as caught:
            assert load_level(source) == level
        assert caught[0].filename == __file__


def test_a_start_over_the_void_is_in_doubt_and_one_high_over_ground_is_not() -> None:
    assert doubts(start=start_at(0, 9, RADIUS)) == [("start", "at")]
    assert doubts(start=start_at(0, 0, 300.0)) == []
    assert doubts(start=start_at(0, 0, 300.0), kill_height=10.0) == [("start", "at")]
    assert doubts(start=start_at(0, 0, -5.0)) == [("start", "at")], "the floor is over it"


def test_a_start_with_its_middle_past_an_edge_is_in_doubt() -> None:
    assert doubts(start=start_at(0, 2.99, RADIUS)) == []
    assert doubts(start=start_at(0, 3.01, RADIUS)) == [("start", "at")]


def test_jitter_past_an_edge_is_in_doubt() -> None:
    assert doubts(start=start_at(0, 1.0, RADIUS, 0.0, 1.9)) == []
    assert doubts(start=start_at(0, 1.0, RADIUS, 0.0, 2.1)) == [("start", "jitter")]
    assert doubts(start=start_at(-1.5, -2.5, RADIUS, 0.4, 0.6)) == [("start", "jitter")]


def test_rails_hold_a_ball_whose_middle_is_over_the_gap() -> None:
    rails = [_block(at=(0.0, side, -0.5), size=(20.0, 0.2, 1.0)) for side in (-0.35, 0.35)]
    assert doubts(boxes=rails, start=start_at(0, 0, RADIUS + 0.1, 3.0, 0.0)) == []
    assert doubts(boxes=rails[:1], start=start_at(0, 0, RADIUS + 0.1)) == [("start", "at")]


@pytest.mark.parametrize("turn", [{}, {"yaw_deg": 40.0}, {"pitch_deg": 15.0}, {"yaw_deg": 90.0}])
def test_ground_that_is_turned_or_tilted_is_ground(turn: dict[str, float]) -> None:
    slab = _block(at=(0.0, 0.0, -3.0), size=(6.0, 2.0, 0.2)) | turn
    corner = np.array([2.9, 0.9])
    yaw = np.radians(turn.get("yaw_deg", 0.0))
    shrink = np.array([np.cos(np.radians(turn.get("pitch_deg", 0.0))), 1.0])
    x, y = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]) @ (corner * shrink)
    assert doubts(boxes=[slab], start=start_at(x, y, 2.0)) == []
    assert doubts(boxes=[slab], start=start_at(1.2 * x, 1.2 * y, 2.0)) == [("start", "at")]


@pytest.mark.parametrize("kind", ["plate", "gate", "pad", "tube"])
def test_whatever_is_solid_is_ground(kind: str) -> None:
    tube = {"start": (-9, 0, -2), "end": (9, 0, -2), "inner_radius": 1.0}
    at = {"at": (0.0, 0.0, -1.0), "size": (2.0, 2.0, 1.0)}
    kinds: dict[str, dict[str, Any]] = {
        "plate": {"plates": [PLATE | at | {"opens": ["gate"], "sinks_to": -2}], "gates": [GATE]},
        "gate": {"gates": [GATE | at | {"lowers_to": -9}], "plates": LINKED["plates"]},
        "pad": {"lift_pads": [at]},
        "tube": {"tubes": [tube]},
    }
    assert doubts(boxes=[], start=start_at(0, 0, RADIUS, 0.3, 0.3), **kinds[kind]) == []


def test_a_plate_that_is_wholly_inside_a_solid_is_in_doubt() -> None:
    sunk = PLATE | {"opens": ["gate"], "at": (3, 0, -0.5), "size": (1, 1, 0.5), "sinks_to": -0.6}
    assert doubts(plates=[sunk], gates=[GATE]) == [("plates", 0, "at")]
    assert doubts(plates=[sunk | {"at": (3, 0, -0.25)}], gates=[GATE]) == [], "flush with it"


def test_a_coin_on_a_surface_is_not_inside_it() -> None:
    assert doubts(coins=[{"at": (1, 0, 0)}]) == []
    assert doubts(coins=[{"at": (1, 0, -2 * TOUCHING_M)}]) == [("coins", 0)]


@pytest.mark.parametrize("kind", ["plate", "gate", "pad"])
def test_a_coin_may_not_lie_in_what_moves_or_lifts(kind: str) -> None:
    at = {"plate": PLATE["at"], "gate": GATE["at"], "pad": (9.0, 0.0, 0.2)}[kind]
    pad = {"at": (9.0, 0.0, 0.2), "size": (1, 1, 0.4)}
    assert doubts(**LINKED, lift_pads=[pad], coins=[{"at": at}]) == [("coins", 0)]


def test_a_floors_own_coin_under_another_piece_is_the_floors_fault() -> None:
    floor = {"corner": (30.0, 0.0, 0.0), "cell": 2.0, "plan": "oo"}
    box = _block(at=(31.0, 1.0, 0.5), size=(1.0, 1.0, 1.0))
    assert doubts(boxes=[*_floor(), box], floors=[floor]) == [("floors", 0)]


def test_a_coin_in_a_turned_box_is_found_and_one_beside_it_is_not() -> None:
    slab = _block(at=(40.0, 0.0, 0.0), size=(4.0, 0.2, 1.0), yaw_deg=45.0)
    coins = [{"at": (41.0, 1.0, 0.0)}, {"at": (41.0, -1.0, 0.0)}]
    assert doubts(boxes=[*_floor(), slab], coins=coins) == [("coins", 0)]


def test_ten_thousand_coins_and_a_thousand_turned_boxes_take_about_a_second() -> None:
    generator = np.random.default_rng(7)
    places = generator.uniform([-100.0, -100.0, 50.0], [100.0, 100.0, 250.0], (1_000, 3))
    boxes = [_block(at=tuple(place), yaw_deg=30.0, pitch_deg=20.0) for place in places.tolist()]
    coins = [{"at": tuple(place)} for place in (places[::100] + 0.1).tolist()]
    grid = {"centre": (0, 0, 300.0), "spacing": (1, 1), "count": (99, 99)}
    level = small_level(boxes=[*_floor(), *boxes], coins=[*coins, {"grid": grid}])
    assert 9_000 < 99 * 99 + len(coins) <= MAX_COINS
    began = time.process_time()
    found = [problem.path for problem in level_warnings(level)]
    assert time.process_time() - began < 5.0
    assert found == [("coins", index) for index in range(10)]


def test_a_search_by_brute_force_finds_the_same_buried_coins() -> None:
    generator = np.random.default_rng(11)
    low, high = [-4.0, 26.0, 6.0], [4.0, 34.0, 14.0]
    places = generator.uniform(low, high, (60, 3))
    turns = generator.uniform(-180.0, 180.0, (60, 2))
    boxes = [
        _block(at=tuple(place), size=(2.0, 0.5, 1.0), yaw_deg=yaw, pitch_deg=pitch)
        for place, (yaw, pitch) in zip(places.tolist(), turns.tolist(), strict=True)
    ]
    coins = generator.uniform(low, high, (300, 3))
    found = doubts(boxes=[*_floor(), *boxes], coins=[{"at": tuple(c)} for c in coins.tolist()])
    buried = {index for index, coin in enumerate(coins) if _in_any(coin, places, turns)}
    assert 20 < len(buried) < 280
    assert {path[1] for path in found} == buried


def _in_any(coin: Any, places: Any, turns: Any) -> bool:
    """Undo yaw and pitch of each box by hand, from the definition in the schema."""
    for place, (yaw_deg, pitch_deg) in zip(places, turns, strict=True):
        yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
        dx, dy, dz = coin - place
        along, left = dx * np.cos(yaw) + dy * np.sin(yaw), dy * np.cos(yaw) - dx * np.sin(yaw)
        x, z = (
            along * np.cos(pitch) - dz * np.sin(pitch),
            dz * np.cos(pitch) + along * np.sin(pitch),
        )
        deep = np.array([1.0, 0.25, 0.5]) - TOUCHING_M
        if np.all(np.abs([x, left, z]) <= deep):
            return True
    return False
