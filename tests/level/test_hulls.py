"""Hulls and wedges as solids: what is in them, what stands on them, what can be wrong with them."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from roller_env.level import Level, LevelError, parse_level
from roller_env.level.expand import expand
from roller_env.level.lint import lint
from roller_env.level.reach import Play, reach
from roller_env.pieces.convex import ConvexSolid
from roller_env.pieces.ground import Ground
from roller_env.pieces.piece import UNTURNED, Solid
from roller_env.pieces.space import held_up
from roller_env.pieces.spans import SLOPE, free_spans
from tests.builders import make_level
from tests.level.samples import SMALL, small_level

Float64 = npt.NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1)
PLAY = Play(dt_s=1 / 240, push_n=2.0**0.5 * 5.08)


def random_box(seed: int) -> Solid:
    random = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=random).as_matrix().tolist()
    centre, half = random.uniform(-1.0, 1.0, 3).tolist(), random.uniform(0.2, 1.0, 3).tolist()
    return Solid(tuple(centre), tuple(half), tuple(map(tuple, rotation)), "default", "boxes[0]")


def hull_of(solid: Solid) -> ConvexSolid:
    """Return a solid as the hull of its corners."""
    return convex(solid.corners())


def convex(points: Float64) -> ConvexSolid:
    return ConvexSolid.of([(x, y, z) for x, y, z in points.tolist()], "default", "hulls[0]")


def random_hull(seed: int) -> ConvexSolid:
    random = np.random.default_rng(seed)
    return convex(random.normal(size=(random.integers(4, 30), 3)))


# Shape --------------------------------------------------------------------------------------------


def test_a_wedge_is_half_a_box_and_rises_along_its_x() -> None:
    level = make_level(wedges=[{"at": (10.0, 20.0, 1.0), "size": (4.0, 6.0, 2.0)}])
    wedge = expand(level).solids[-1]
    assert len(list(wedge.faces())) == 5
    assert {tuple(corner) for corner in wedge.corners().tolist()} == {
        *product((8.0, 12.0), (17.0, 23.0), (0.0,)),
        *product((12.0,), (17.0, 23.0), (2.0,)),
    }
    assert (wedge.centre, wedge.half_size) == ((10.0, 20.0, 1.0), (2.0, 3.0, 1.0))


def test_a_yaw_of_90_makes_a_wedge_rise_towards_y() -> None:
    wedge = {"at": (0.0, 0.0, 1.0), "size": (4.0, 6.0, 2.0), "yaw_deg": 90.0}
    corners = expand(make_level(wedges=[wedge], start={"at": (9.0, 9.0, 1.0)})).solids[-1].corners()
    upper = corners[corners[:, 2] > 1.0]
    np.testing.assert_allclose(sorted(upper.tolist()), [[-3, 2, 2], [3, 2, 2]], atol=1e-12)


def test_points_inside_a_hull_change_nothing() -> None:
    """Nor do those on its faces and edges."""
    cube = list(product((-1.1, 1.1), repeat=3))
    inside = [(0.5, 0.5, 0.0), (1.1, 0.2, 0.3), (1.1, 0.2, 1.1), (1.1, 1.1, 0.0), (0.0, 0.0, 0.0)]
    hulls = [
        expand(small_level(hulls=[{"points": points}], start={"at": (5.0, 0.0, 0.5)})).solids[-1]
        for points in (cube, [*inside, *cube, *inside])
    ]
    assert len(list(hulls[1].faces())) == 6
    corners = [sorted(map(tuple, hull.corners().tolist())) for hull in hulls]
    assert corners[0] == corners[1] == sorted(cube)


@given(seed=seeds)
def test_faces_look_outwards_and_go_round_counterclockwise(seed: int) -> None:
    for solid in (random_hull(seed), random_box(seed)):
        for face in solid.faces():
            out = face.corners - solid.corners().mean(axis=0)
            assert (out @ face.normal > 0.0).all()
            assert np.ptp(face.corners @ face.normal) < 1e-12
            if isinstance(solid, ConvexSolid):
                along = np.roll(face.corners, -1, axis=0) - face.corners
                turns = np.cross(along, np.roll(along, -1, axis=0)) @ face.normal
                assert (turns > 0.0).all()


# What is in it ------------------------------------------------------------------------------------


@given(seed=seeds, margin=st.sampled_from([-0.1, 0.0, 0.05, 0.4]))
def test_a_hull_contains_what_the_box_of_its_corners_contains(seed: int, margin: float) -> None:
    box, points = random_box(seed), np.random.default_rng(seed).uniform(-2.0, 2.0, (300, 3))
    np.testing.assert_array_equal(
        hull_of(box).contains(points, margin), box.contains(points, margin)
    )


@given(seed=seeds)
def test_the_margin_of_a_hull_is_the_distance_to_it(seed: int) -> None:
    hull, random = random_hull(seed), np.random.default_rng(seed)
    corners = hull.corners()
    for point in random.uniform(-4.0, 4.0, (3, 3)):

        def off(weights: Float64, point: Float64 = point) -> float:
            return float(((weights @ corners - point) ** 2).sum())

        count = len(corners)
        nearest = minimize(
            off,
            np.full(count, 1.0 / count),
            bounds=[(0.0, 1.0)] * count,
            constraints={"type": "eq", "fun": lambda weights: weights.sum() - 1.0},
            options={"ftol": 1e-12, "maxiter": 300},
        )
        distance = nearest.fun**0.5
        if distance > 0.01:
            assert hull.contains(point[None], distance + 1e-3).all()
            assert not hull.contains(point[None], distance - 1e-3).any()


@given(seed=seeds)
def test_upright_lines_run_inside_a_hull_where_it_contains_their_points(seed: int) -> None:
    hull, random = random_hull(seed), np.random.default_rng(seed)
    points = random.uniform(-1.5, 1.5, (200, 3))
    bottom, top = hull.upright(points[:, :2])
    within = (bottom <= points[:, 2]) & (points[:, 2] <= top)
    np.testing.assert_array_equal(within, hull.contains(points))


# What stands on it --------------------------------------------------------------------------------


@given(seed=seeds)
def test_the_ground_and_what_holds_a_ball_up_are_those_of_the_box(seed: int) -> None:
    box = random_box(seed)
    x, y = (np.array(box.centre[:2]) + np.random.default_rng(seed).uniform(-0.5, 0.5, 2)).tolist()
    piece = Solid((x, y, 1.0), (0.01, 0.01, 3.0), UNTURNED, "", "")
    on_the_box, on_the_hull = Ground(lambda: [box]), Ground(lambda: [hull_of(box)])
    assert on_the_hull.under(piece) == pytest.approx(on_the_box.under(piece), abs=1e-9)
    places = np.random.default_rng(seed).uniform((-2.0, -2.0, -1.0), (2.0, 2.0, 3.0), (50, 3))
    by_the_hull = held_up([hull_of(box)], places, 0.3, -3.0)
    np.testing.assert_array_equal(by_the_hull, held_up([box], places, 0.3, -3.0))


def test_a_gate_on_a_hull_lowers_into_it() -> None:
    gate = {"name": "door", "size": (0.2, 2.0, 1.0)}
    block = list(product((6.0, 10.0), (-2.0, 2.0), (0.0, 0.7)))
    plate = {
        "name": "button",
        "at": (3.0, 0.0, 1.0),
        "size": (1.0, 1.0, 0.5),
        "sinks_to": 0.5,
        "opens": ["door"],
    }
    level = make_level(
        hulls=[{"points": block}], gates=[gate | {"at": (8.0, 0.0, 1.2)}], plates=[plate]
    )
    assert level.gates[0].lowers_to == pytest.approx(0.7 - 0.5)


@given(seed=seeds)
def test_a_ball_over_a_hull_has_the_free_spans_that_it_has_over_the_box(seed: int) -> None:
    """Where it lies on a face; at the edges hulls are a little smaller, as the search may have it.

    What is compared with is the exact height of a ball that touches the box.
    """
    box, radius = random_box(seed), 0.3
    spans = free_spans([hull_of(box)], radius, np.zeros((1, 2)))
    assert spans is not None
    on = np.flatnonzero(spans.is_support)
    x, y = np.divmod(spans.column[on], spans.shape[1])
    centres = np.stack([x, y, np.zeros_like(x)], axis=1) * spans.cell
    centres[:, :2] += spans.corner
    centres[:, 2] = spans.floor[on]
    assert box.contains(centres, radius + 1e-9).all()
    on_face = spans.kind[on] == SLOPE
    assert on_face.any()
    lifted = centres[on_face] + [0.0, 0.0, 1e-6]
    assert not box.contains(lifted, radius).any()


@pytest.mark.parametrize(
    ("wedges", "reached"),
    [([{"at": (10.0, 0.0, 1.5), "size": (12.0, 6.0, 3.0)}], True), ([], False)],
)
def test_the_search_gets_up_a_wedge(wedges: list[dict[str, Any]], reached: bool) -> None:
    """Onto a deck 3 m high, with the finish on it."""
    level = small_level(
        boxes=[
            {"at": (8.0, 0.0, -0.5), "size": (40.0, 6.0, 1.0)},
            {"at": (20.0, 0.0, 1.5), "size": (8.0, 6.0, 3.0)},
        ],
        finish={"at": (22.0, 0.0, 3.5), "size": (1.0, 1.0, 1.0)},
        wedges=wedges,
    )
    found = reach(level, PLAY)
    assert found is not None
    assert found.finish == reached


@pytest.mark.parametrize(
    ("drop", "thickness", "warned"), [(9.0, 0.02, 0), (900.0, 0.02, 1), (900.0, 1.5, 0)]
)
def test_a_hull_is_too_thin_for_a_fall_where_a_box_is(
    drop: float, thickness: float, warned: int
) -> None:
    """Measured: the ball passes through a slab from the same speed on, whichever it is."""
    start, finish = {"at": (0.0, 0.0, drop + 1.0)}, {"at": (8.0, 0.0, 0.5), "size": (1.0, 1.0, 1.0)}
    perch = {"at": (0.0, 0.0, drop), "size": (2.0, 2.0, 1.0)}
    slab = {"at": (8.0, 0.0, -thickness / 2), "size": (40.0, 40.0, thickness)}
    corners = product((-12.0, 28.0), (-20.0, 20.0), (-thickness, 0.0))
    levels = [
        small_level(start=start, finish=finish, boxes=[perch, *boxes], hulls=hulls)
        for boxes, hulls in (([slab], []), ([], [{"points": list(corners)}]))
    ]
    messages = [[problem.message for problem in lint(level, PLAY)] for level in levels]
    assert len(messages[0]) == warned
    assert messages[0] == messages[1]


# What can be wrong with it ------------------------------------------------------------------------

FLAT = "[[0, 0, 0], [10, 0, 0], [0, 10, 0], [10, 10, 0]]"


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (FLAT, "hulls[0]: the points lie in one plane; wanted at least 4 that span a volume"),
        (
            "[[0, 0, 0], [10, 0, 0], [0, 10, 0], [10, 10, 0.01]]",
            "hulls[0]: the points are nearly in one plane; wanted at least 4",
        ),
        ("[[5, 5, 5], [5, 5, 5], [5, 5, 5], [5, 5, 5], [1, 1, 1]]", "lie in one plane"),
        ("[[0, 0, 0], [10, 0, 0], [0, 10, 0]]", "hulls[0].points"),
    ],
)
def test_a_hull_without_volume_is_refused_with_its_place(points: str, message: str) -> None:
    with pytest.raises(LevelError) as caught:
        parse_level(f"{SMALL}hulls:\n  - points: {points}\n", "oops.yaml")
    assert message in str(caught.value)
    assert "oops.yaml:8:" in str(caught.value)


def test_what_is_inside_a_hull_is_said() -> None:
    rock = (
        "hulls:\n  - points: [[50, -9, 0], [50, 9, 0], [90, 0, 0], [60, 0, 40]]\n    name: rock\n"
    )
    with pytest.warns(match=r"inside hulls\[0\]"):
        parse_level(f"{SMALL}coins:\n  - at: [60, 0, 10]\n{rock}")
    with pytest.raises(LevelError, match=r"would start inside hulls\[0\]"):
        parse_level(SMALL.replace("{at: [0, 0, 16]}", "{at: [62, 0, 16]}") + rock)


def test_a_hull_is_written_in_the_unit_of_the_file() -> None:
    text = f"{SMALL}hulls:\n  - points: [[100, 50, 0], [200, 50, 0], [100, 80, 0], [100, 50, 10]]\n"
    level: Level = parse_level(text)
    assert level.hulls[0].points[1] == pytest.approx((200 * 0.0254, 50 * 0.0254, 0.0))
