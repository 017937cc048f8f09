"""Convex hulls: what they are made of, and that a ball meets them as it meets boxes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from roller_env.physics.rigid.closest import CORNER, EDGE, FACE, closest
from roller_env.physics.rigid.hull import hull_of
from roller_env.physics.rigid.kernels import entry
from roller_env.physics.rigid.rays import cast_rays
from roller_env.physics.rigid.scene import RigidLevel, SolidBox, SolidHull, Solids, pack
from roller_env.physics.rigid.states import make_states
from tests.physics.rigid.world import FRICTION, GRAVITY, RADIUS_M, RESTING_M, World, floor

Float64 = npt.NDArray[np.float64]


@entry
def _measure(solids: Solids, points: Float64, found: Float64) -> None:
    """Write of each point and solid: the distance, the normal and the kind of the feature."""
    for i in range(len(points)):
        for k in range(len(solids.one)):
            solid = solids.one[k]
            c = solid.centre
            at = points[i, 0] - c[0], points[i, 1] - c[1], points[i, 2] - c[2]
            distance, normal, kind, _ = closest(solids, solid, at)
            found[i, k, 0], found[i, k, 4] = distance, kind
            found[i, k, 1], found[i, k, 2], found[i, k, 3] = normal


def measured(solids: Sequence[SolidBox | SolidHull], points: Float64) -> Float64:
    """Return (n, solids, 5): distance, normal, kind of the nearest feature."""
    scenes = pack([RigidLevel(solids, RADIUS_M, GRAVITY)])
    found = np.empty((len(points), len(solids), 5))
    _measure(scenes.solids, points, found)
    return found


def corners(box: SolidBox) -> list[tuple[float, float, float]]:
    """Return the corners of a box."""
    half, turn = np.array(box.half_size), np.array(box.rotation)
    return [tuple(box.centre + turn @ (half * signs)) for signs in product((-1, 1), repeat=3)]


def as_hull(box: SolidBox) -> SolidHull:
    """Return a box as the hull of its corners."""
    return SolidHull(corners(box), box.friction, box.elasticity, box.slab)


def random_box(random: np.random.Generator) -> SolidBox:
    return SolidBox(
        tuple(random.uniform(-1.0, 1.0, 3)),
        tuple(random.uniform(0.2, 1.0, 3)),
        Rotation.random(random_state=random).as_matrix().tolist(),
        FRICTION,
    )


def test_a_hull_has_the_faces_edges_and_corners_of_what_it_is() -> None:
    cube = hull_of(list(product((0, 1), repeat=3)))
    assert (len(cube.faces), len(cube.edges), len(cube.corners)) == (6, 12, 8)
    wedge = hull_of([(0, 0, 0), (2, 0, 0), (2, 0, 1), (0, 3, 0), (2, 3, 0), (2, 3, 1), (1, 1, 0.2)])
    assert (len(wedge.faces), len(wedge.edges), len(wedge.corners)) == (5, 9, 6)
    assert sorted(edge.length for edge in wedge.edges)[-1] == 3.0


@pytest.mark.parametrize(
    "points", [[(0, 0, 0)] * 5, [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(0, 0, 0)], []]
)
def test_points_that_span_no_volume_are_refused(points: list[tuple[float, float, float]]) -> None:
    with pytest.raises(ValueError, match=r"points: found .* span no volume"):
        hull_of(points)


@given(seed=st.integers(0, 2**32 - 1))
def test_a_box_and_the_hull_of_its_corners_are_as_far_from_everything(seed: int) -> None:
    random = np.random.default_rng(seed)
    box = random_box(random)
    found = measured([box, as_hull(box)], random.uniform(-3.0, 3.0, (50, 3)))
    assert found[:, 1] == pytest.approx(found[:, 0], abs=1e-9)


@given(seed=st.integers(0, 2**32 - 1))
def test_the_nearest_point_of_a_hull_is_the_nearest_of_all_sums_of_its_points(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(random.integers(4, 30), 3))
    places = random.uniform(-4.0, 4.0, (10, 3))
    found = measured([SolidHull(points.tolist())], places)[:, 0]
    assert set(found[:, 4]) <= {FACE, EDGE, CORNER}
    weight = 1e4
    for place, (distance, *normal, _) in zip(places, found, strict=True):
        _, residual = nnls(
            np.vstack([points.T, np.full(len(points), weight)]), np.append(place, weight)
        )
        assert max(distance, 0.0) == pytest.approx(residual, abs=1e-5)
        if distance > 0.0:
            # All of the hull is behind the plane through the nearest point.
            nearest = place - distance * np.array(normal)
            assert ((points - nearest) @ normal).max() < 1e-9


def test_a_ball_rolls_down_a_wedge_as_it_does_down_a_slope() -> None:
    angle = math.radians(20.0)
    c, s = math.cos(angle), math.sin(angle)
    ends = [(-40.0, 0.0), (40.0, 0.0)]
    wedge = SolidHull(
        [(x * c, y, -x * s) for x, _ in ends for y in (-5.0, 5.0)]
        + [(x * c, y, -50.0) for x, _ in ends for y in (-5.0, 5.0)],
        friction=FRICTION,
    )
    normal = np.array([s, 0.0, c])
    world = World([wedge]).put(tuple(normal * RESTING_M)).run(2.0)
    way = np.linalg.norm(world.states.position[0] - normal * RESTING_M)
    assert way == pytest.approx(0.5 * 5.0 / 7.0 * GRAVITY * s * 2.0**2, abs=1e-9)


@given(seed=st.integers(0, 2**32 - 1))
def test_balls_among_hulls_do_what_they_do_among_the_same_boxes(seed: int) -> None:
    random = np.random.default_rng(seed)
    boxes = [random_box(random) for _ in range(4)]
    ground = floor()
    worlds = [World([*boxes, ground], 4), World([*map(as_hull, boxes), ground], 4)]
    places = np.array([0.0, 0.0, 3.0]) + random.uniform(-1.0, 1.0, (4, 3))
    for world in worlds:
        world.states.position[:] = places
    for _ in range(8):
        for world in worlds:
            world.step()
        one, other = (world.states.position for world in worlds)
        # An edge or corner makes micrometres of a nanometre within two bounces.
        assert other == pytest.approx(one, abs=1e-4)
        assert np.median(np.abs(other - one)) < 1e-8


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_balls_among_hulls_neither_sink_in_nor_gain_energy(seed: int) -> None:
    random = np.random.default_rng(seed)
    hulls = [
        SolidHull((random.uniform(-2.0, 2.0, 3) + random.normal(0, 0.5, (9, 3))).tolist(), 0.6)
        for _ in range(12)
    ]
    world = World([*hulls, floor()], 8)
    world.states.position[:] = [0.0, 0.0, 5.0]
    world.states.position[:, :2] += random.uniform(-2.0, 2.0, (8, 2))
    energy, found = world.energy(), np.empty((8, len(hulls) + 1, 5))
    for _ in range(40):
        world.step()
        assert (world.energy() < energy + 1e-6).all()
        energy = world.energy()
        _measure(world.scenes.solids, world.states.position, found)
        assert found[:, :, 0].min() - RADIUS_M > -1e-6
    assert world.counts.forced.sum() == 0


def test_rays_see_a_hull_as_they_see_the_box() -> None:
    random = np.random.default_rng(0)
    boxes = [random_box(random) for _ in range(3)]
    offsets = random.uniform(-2.0, 2.0, (200, 3))
    directions = random.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen = []
    for solids in (boxes, [as_hull(box) for box in boxes]):
        scenes = pack([RigidLevel(solids, RADIUS_M, GRAVITY)])
        states = make_states(scenes, 1)
        out = np.empty((1, 200))
        row = np.zeros(1, dtype=np.int64)
        cast_rays(scenes, row, states.packed, row, offsets, directions, 10.0, out)
        seen.append(out)
    assert np.isfinite(seen[0]).any()
    assert seen[1] == pytest.approx(seen[0], abs=1e-9)
