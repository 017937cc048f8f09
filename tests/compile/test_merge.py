"""Merging boxes changes their number and nothing else."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from roller_env.compile.merge import cover, merge_solids
from roller_env.level.expand import expand
from roller_env.pieces.floor import FloorPlan
from roller_env.pieces.piece import Solid, rotation_matrix
from tests.builders import make_level

IDENTITY = rotation_matrix()

grids = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9))


@given(grids)
def test_a_cover_partitions_exactly_the_filled_cells(filled: np.ndarray) -> None:
    count = np.zeros(filled.shape, dtype=int)
    rectangles = cover(filled)
    for x0, x1, y0, y1 in rectangles:
        assert x0 < x1
        assert y0 < y1
        count[x0:x1, y0:y1] += 1
    np.testing.assert_array_equal(count, filled.astype(int))


@given(grids)
def test_a_cover_never_needs_more_rectangles_than_runs_of_cells(filled: np.ndarray) -> None:
    def runs(rows: np.ndarray) -> int:
        padded = np.pad(rows.astype(int), ((0, 0), (1, 0)))
        return int((np.diff(padded, axis=1) == 1).sum())

    assert len(cover(filled)) <= min(runs(filled), runs(filled.T))


@given(st.integers(1, 12), st.integers(1, 12))
def test_a_full_rectangle_is_one_box(rows: int, columns: int) -> None:
    assert cover(np.ones((rows, columns), dtype=bool)) == [(0, rows, 0, columns)]


@st.composite
def boxes(draw: st.DrawFn) -> Solid:
    """Boxes on a coarse grid, so that many touch, overlap and share their faces."""
    x, y = draw(st.integers(-4, 4)), draw(st.integers(-4, 4))
    width, depth = draw(st.integers(1, 5)), draw(st.integers(1, 5))
    thickness = draw(st.sampled_from([0.1, 0.3]))
    top = draw(st.sampled_from([0.0, 0.7]))
    turned = draw(st.sampled_from([False, False, False, True]))
    return Solid(
        centre=((x + width / 2) * 0.7, (y + depth / 2) * 0.7, top - thickness / 2),
        half_size=(width * 0.35, depth * 0.35, thickness / 2),
        rotation=rotation_matrix(30.0, 10.0) if turned else IDENTITY,
        material=draw(st.sampled_from(["a", "b"])),
        source="box",
    )


def space(pieces: list[Solid], points: np.ndarray, material: str) -> np.ndarray:
    inside = np.zeros(len(points), dtype=bool)
    for piece in pieces:
        if piece.material == material:
            inside |= piece.contains(points)
    return inside


@settings(max_examples=80, deadline=None)
@given(st.lists(boxes(), max_size=10), st.integers(0, 2**32 - 1))
def test_merged_boxes_fill_exactly_the_same_space_with_the_same_material(
    pieces: list[Solid], seed: int
) -> None:
    merged = merge_solids(pieces)
    points = np.random.default_rng(seed).uniform([-4, -4, -0.4], [7, 7, 0.8], (1500, 3))
    for material in ("a", "b"):
        expected, found = space(pieces, points, material), space(merged, points, material)
        np.testing.assert_array_equal(found, expected)


@given(st.lists(boxes(), max_size=10))
def test_there_are_never_more_boxes_than_before(pieces: list[Solid]) -> None:
    assert len(merge_solids(pieces)) <= len(pieces)


def test_two_boxes_that_cross_stay_two() -> None:
    along = Solid((0.0, 0.0, 0.0), (3.0, 0.5, 0.1), IDENTITY, "a", "box")
    across = Solid((0.0, 0.0, 0.0), (0.5, 3.0, 0.1), IDENTITY, "a", "box")
    assert merge_solids([along, across]) == [along, across]


@given(st.lists(boxes(), max_size=8))
def test_merging_again_changes_nothing(pieces: list[Solid]) -> None:
    once = merge_solids(pieces)
    twice = merge_solids(once)
    assert len(twice) == len(once)
    for a, b in zip(once, twice, strict=True):
        np.testing.assert_allclose(a.centre, b.centre, atol=1e-9)
        np.testing.assert_allclose(a.half_size, b.half_size, atol=1e-9)


def plan(text: str, **options: object) -> FloorPlan:
    return FloorPlan.model_validate(
        {"corner": (0.0, 0.0, 0.0), "cell": 1.7, "plan": text} | options
    )


def merged_plan(*plans: FloorPlan) -> list[Solid]:
    level = make_level(floors=plans, materials={"ice": {}}, boxes=[], start={"at": (0.5, 0.5, 3.0)})
    return merge_solids(expand(level).ground)


def test_a_floor_plan_of_one_material_is_one_box() -> None:
    (slab,) = merged_plan(plan("#o#\n###\nooo\n###"))
    np.testing.assert_allclose(slab.centre, [4 * 0.85, 3 * 0.85, -0.2032])
    np.testing.assert_allclose(slab.half_size, [4 * 0.85, 3 * 0.85, 0.2032])


def test_a_ring_is_four_boxes() -> None:
    assert len(merged_plan(plan("####\n#..#\n####"))) == 4


def test_two_plans_that_meet_are_one_box() -> None:
    first, second = plan("##\n##"), plan("##", corner=(3.4, 0.0, 0.0))
    assert len(merged_plan(first, second)) == 1


def test_different_materials_do_not_merge() -> None:
    legend = {"i": {"material": "ice"}}
    assert len(merged_plan(plan("##\nii", legend=legend))) == 2


def test_different_heights_do_not_merge() -> None:
    assert len(merged_plan(plan("##"), plan("##", corner=(1.7, 0.0, 0.1)))) == 2


def test_rounding_of_a_micrometre_does_not_keep_neighbours_apart() -> None:
    def slab(x: float) -> Solid:
        return Solid((x, 0.0, 0.0), (0.5, 0.5, 0.1), IDENTITY, "a", "box")

    assert len(merge_solids([slab(0.0), slab(1.0 + 1e-7)])) == 1


def test_the_order_of_first_appearance_is_kept() -> None:
    def slab(x: float, material: str) -> Solid:
        return Solid((x, 0.0, 0.0), (0.5, 0.5, 0.1), IDENTITY, material, "box")

    merged = merge_solids([slab(0.0, "b"), slab(1.0, "a"), slab(1.0, "b")])
    assert [piece.material for piece in merged] == ["b", "a"]
