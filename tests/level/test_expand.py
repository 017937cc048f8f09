"""Expansion: what the shorthands of a level stand for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from roller_env.level.expand import expand
from roller_env.pieces.floor import COIN_HEIGHT_M
from roller_env.pieces.lift_pad import pad_groups
from roller_env.pieces.piece import Solid
from roller_env.yaml_tree import read_tree
from tests.level.samples import small_level


def expanded(**pieces: Any) -> tuple[Solid, ...]:
    """Return the solids of a level that has nothing but these pieces."""
    return expand(small_level(**({"boxes": []} | pieces))).ground


def inside(blocks: tuple[Solid, ...], *points: tuple[float, float, float]) -> list[bool]:
    """Return for each point whether any of the solids holds it."""
    return [any(block.contains(np.array([point])).all() for block in blocks) for point in points]


def test_up_the_page_is_forward_and_left_is_left() -> None:
    plan = {"corner": (10.0, 20.0, 3.0), "cell": 2.0, "thickness": 1.0, "plan": "#..\n..o\n"}
    blocks = expanded(floors=[plan])
    assert sorted(block.centre for block in blocks) == [(11.0, 21.0, 2.5), (13.0, 25.0, 2.5)]
    level = expand(small_level(boxes=[], floors=[plan]))
    positions, sources = level.coins, level.coin_sources
    assert positions.tolist() == [[11.0, 21.0, 3.0 + COIN_HEIGHT_M]]
    assert sources == ("floors[0]",)


def test_a_blank_row_of_a_floor_is_an_empty_row_and_shifts_nothing() -> None:
    blank = {"corner": (0.0, 0.0, 0.0), "cell": 2.0, "plan": "\n#o\n\n  \n##\n"}
    drawn = blank | {"plan": "..\n#o\n..\n..\n##"}
    blocks = expanded(floors=[blank])
    assert blocks == expanded(floors=[drawn])
    assert sorted({block.centre[0] for block in blocks}) == [1.0, 7.0]


@pytest.mark.parametrize(("ending", "lowest"), [("|", 1.0), ("|-", 1.0), ("|+", 3.0)])
def test_a_blank_line_under_a_plan_belongs_to_it_if_yaml_says_so(
    ending: str, lowest: float
) -> None:
    text = f"a:\n  corner: [0, 0, 0]\n  cell: 2\n  plan: {ending}\n    #\n    #\n\nb: 1\n"
    plan = read_tree(text, "f").find(("a",)).plain()  # type: ignore[union-attr]
    assert min(block.centre[0] for block in expanded(floors=[plan])) == lowest


def groups(*pads: tuple[float, float, float]) -> list[int]:
    """Return the groups of pads of one metre in length and width, 0.2 m high, by their centres."""
    level = small_level(lift_pads=[{"at": at, "size": (1.0, 1.0, 0.2)} for at in pads])
    return pad_groups(level.lift_pads)


def test_pads_that_overlap_or_touch_are_one_group_also_by_way_of_others() -> None:
    assert groups((0, 0, 0), (1, 0, 0), (5, 0, 0)) == [0, 0, 2]
    assert groups((0, 0, 0), (2, 0, 0), (1, 0.5, 0.1)) == [0, 0, 0]
    assert groups((4, 0, 0), (0, 0, 0), (3, 0, 0), (1, 0, 0), (2, 0, 0)) == [0] * 5
    assert groups((0, 0, 0), (1, 1, 0)) == [0, 0], "at a corner"
    assert groups((0, 0, 0), (1.002, 0, 0)) == groups((0, 0, 0), (0, 0, 0.21)) == [0, 1]
    assert groups() == []


def test_a_block_of_a_floor_stands_on_its_cell_and_carries_its_coin() -> None:
    legend = {"W": {"wall": 1.5, "material": "glass", "coin": True}}
    plan = {"corner": (0.0, 0.0, 0.0), "cell": 2.0, "plan": "W", "legend": legend}
    slab, block = expanded(floors=[plan])
    assert (slab.material, block.material) == ("glass", "glass")
    assert (block.centre, block.half_size) == ((1.0, 1.0, 0.75), (1.0, 1.0, 0.75))
    positions = expand(small_level(boxes=[], floors=[plan])).coins
    assert positions[0, 2] == 1.5 + COIN_HEIGHT_M


def test_positive_pitch_tips_the_far_end_down_and_positive_yaw_turns_left() -> None:
    def box(**turned: float) -> tuple[Solid, ...]:
        return expanded(boxes=[{"at": (0, 0, 0), "size": (10.0, 0.2, 0.2)} | turned])

    down = (4 * math.cos(math.radians(30)), 0.0, -4 * math.sin(math.radians(30)))
    left = (0.0, 4.0, 0.0)
    assert inside(box(pitch_deg=30.0), down, left) == [True, False]
    assert inside(box(yaw_deg=90.0), down, left) == [False, True]
    assert inside(box(yaw_deg=90.0, pitch_deg=30.0), (0.0, down[0], down[2])) == [True]


@pytest.mark.parametrize("end", [(4.0, 0.0, 3.0), (-4.0, 2.0, -3.0), (0.0, -4.0, 0.0)])
def test_a_ramps_upper_face_runs_from_start_to_end(end: tuple[float, float, float]) -> None:
    (ramp,) = expanded(ramps=[{"start": (0, 0, 0), "end": end, "width": 2.0, "thickness": 0.5}])
    for share in (0.01, 0.5, 0.99):
        x, y, z = (share * value for value in end)
        assert inside((ramp,), (x, y, z - 0.01), (x, y, z + 0.01)) == [True, False]


@pytest.mark.parametrize("end", [(4.0, 0.0), (0.0, 4.0), (-3.0, 2.0)])
def test_a_wall_stands_over_its_line(end: tuple[float, float]) -> None:
    wall = {"start": (0, 0), "end": end, "bottom": 1.0, "height": 2.0, "thickness": 0.2}
    blocks = expanded(walls=[wall])
    x, y = end[0] / 2, end[1] / 2
    heights = [(x, y, z) for z in (0.9, 1.1, 2.9, 3.1)]
    assert inside(blocks, *heights) == [False, True, True, False]
    length = math.hypot(*end)
    beside = (x - y / length * 0.3, y + x / length * 0.3, 2.0)
    assert inside(blocks, beside) == [False]


@pytest.mark.parametrize("end", [(0.0, 0.0, 5.0), (5.0, 0.0, 0.0), (3.0, 1.0, 2.0)])
def test_a_tube_is_free_within_and_closed_all_around(end: tuple[float, float, float]) -> None:
    tube = {"start": (0, 0, 0), "end": end, "inner_radius": 1.0, "thickness": 0.1, "sides": 12}
    blocks = expanded(tubes=[tube])
    axis = np.array(end) / np.linalg.norm(end)
    across = np.cross(axis, [0.3, 0.5, -0.8])
    across /= np.linalg.norm(across)
    quarter = np.cross(axis, across)
    middle = np.array(end) / 2
    for angle in np.linspace(0.0, 2 * math.pi, 41):
        out = across * math.cos(angle) + quarter * math.sin(angle)
        profile = middle + np.outer(np.linspace(0.0, 1.3, 131), out)
        hit = np.logical_or.reduce([block.contains(profile) for block in blocks])
        assert not np.any(hit[:100])
        assert np.any(hit[100:115])


def test_an_upright_tubes_opening_faces_its_compass_angle() -> None:
    opening = {"toward_deg": 90.0, "width_deg": 60.0}
    tube = {"start": (0, 0, 0), "end": (0, 0, 5), "inner_radius": 1.0, "opening": opening}
    blocks = expanded(tubes=[tube])
    left, right, forward = (0.0, 1.05, 2.0), (0.0, -1.05, 2.0), (1.05, 0.0, 2.0)
    assert inside(blocks, left, right, forward) == [False, True, True]


def test_a_lying_tubes_opening_counts_from_straight_up() -> None:
    opening = {"toward_deg": 0.0, "width_deg": 60.0}
    tube = {"start": (0, 0, 0), "end": (5, 0, 0), "inner_radius": 1.0, "opening": opening}
    blocks = expanded(tubes=[tube])
    assert inside(blocks, (2.0, 0.0, 1.05), (2.0, 0.0, -1.05)) == [False, True]


def test_coins_come_in_lines_arcs_and_grids() -> None:
    shapes = [
        {"at": (1, 2, 3)},
        {"line": {"start": (0, 0, 0), "end": (4, 0, 2), "count": 3}},
        {"arc": {"centre": (0, 0, 1), "radius": 2, "from_deg": 0, "to_deg": 90, "count": 2}},
        {"grid": {"centre": (10, 0, 1), "spacing": (2, 3), "count": (1, 2)}},
    ]
    level = expand(small_level(coins=shapes))
    positions, sources = level.coins, level.coin_sources
    assert positions == pytest.approx(
        np.array(
            [
                *([1, 2, 3], [0, 0, 0], [2, 0, 1], [4, 0, 2]),
                *([2, 0, 1], [0, 2, 1], [10, -1.5, 1], [10, 1.5, 1]),
            ]
        )
    )
    assert sources == tuple(f"coins[{index}]" for index in (0, 1, 1, 1, 2, 2, 3, 3))


def test_a_level_without_coins_has_none() -> None:
    level = expand(small_level())
    positions, sources = level.coins, level.coin_sources
    assert positions.shape == (0, 3)
    assert sources == ()
