"""The state: primary, secondary and constant values, and what is refused."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.rigid_body import Body, State, quaternion
from roller_env.rigid_body.arrays import Float64
from tests.rigid_body.bodies import EXAMPLES, boxes, cubes, states, vectors

CUBE = Body.cube(size=2.0, mass=3.0)


@EXAMPLES
@given(st.floats(0.01, 100.0), st.floats(0.01, 100.0))
def test_a_cube_has_the_reports_inertia_about_every_axis(size: float, mass: float) -> None:
    cube = Body.cube(size, mass)
    np.testing.assert_allclose(cube.inertia, size**2 * mass / 6.0, rtol=1e-15)
    np.testing.assert_allclose(cube.inertia, Body.box([size] * 3, mass).inertia, rtol=1e-15)
    assert cube.isotropic


@EXAMPLES
@given(boxes(3))
def test_a_boxs_inertia_is_that_of_its_matter(body: Body) -> None:
    # Eight points at edge / (2 sqrt 3) have a uniform box's second moments exactly (Gauss).
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    points = corners * body.size[:, None, :] / (2.0 * math.sqrt(3.0))
    about_axis = np.sum(points**2, axis=2, keepdims=True) - points**2
    moments = np.mean(about_axis, axis=1) * body.mass[:, None]
    np.testing.assert_allclose(body.inertia, moments, rtol=1e-13)


def test_the_benchmarks_box_has_the_published_moments() -> None:
    moments = Body.box((0.1, 0.4, 0.9), 10.0).inertia
    np.testing.assert_allclose(moments, [[0.8083, 0.6833, 0.1417]], atol=5e-5)


@EXAMPLES
@given(boxes(2))
def test_a_body_made_from_moments_is_the_box_that_has_them(body: Body) -> None:
    again = Body.from_inertia(body.inertia, body.mass)
    squares = np.sum(body.size**2, axis=1, keepdims=True)
    np.testing.assert_allclose(again.size**2 / squares, body.size**2 / squares, atol=1e-14)


@EXAMPLES
@given(states(boxes(3)))
def test_every_secondary_value_follows_from_the_primary_ones(state: State) -> None:
    matrix = quaternion.to_matrix(state.orientation)
    tensor = np.einsum("nij,nj,nkj->nik", matrix, state.body.inertia, matrix)
    omega = np.linalg.solve(tensor, state.angular_momentum[:, :, None])[:, :, 0]
    np.testing.assert_allclose(state.velocity, state.momentum / state.body.mass[:, None])
    np.testing.assert_allclose(state.angular_velocity, omega, rtol=1e-10, atol=1e-10)
    np.testing.assert_array_equal(
        state.spin, quaternion.spin(state.angular_velocity, state.orientation)
    )
    np.testing.assert_array_equal(state.body_to_world[:, :3, :3], matrix)
    np.testing.assert_array_equal(state.body_to_world[:, :3, 3], state.position)


@EXAMPLES
@given(states(boxes(2)), vectors(2))
def test_recalculating_keeps_the_secondary_values_in_step(state: State, momentum: Float64) -> None:
    after = state.recalculate(momentum=momentum, angular_momentum=2.0 * state.angular_momentum)
    np.testing.assert_allclose(after.velocity, momentum / state.body.mass[:, None])
    np.testing.assert_allclose(
        after.angular_velocity, 2.0 * state.angular_velocity, rtol=1e-13, atol=1e-13
    )
    np.testing.assert_array_equal(after.position, state.position)


@EXAMPLES
@given(states(boxes(2)))
def test_recalculating_renormalises_the_orientation_unless_told_not_to(state: State) -> None:
    stretched = state.recalculate(orientation=1.5 * state.orientation)
    np.testing.assert_allclose(quaternion.norm(stretched.orientation), 1.0, atol=4e-16)
    kept = state.recalculate(orientation=1.5 * state.orientation, renormalise=False)
    np.testing.assert_allclose(quaternion.norm(kept.orientation), 1.5, rtol=4e-16)
    np.testing.assert_allclose(kept.body_to_world, state.body_to_world, atol=4e-15)
    np.testing.assert_allclose(kept.angular_velocity, state.angular_velocity, atol=1e-13)


@EXAMPLES
@given(states(cubes(2)))
def test_a_state_made_from_velocities_gives_them_back(state: State) -> None:
    again = State.create(
        state.body,
        velocity=state.velocity,
        angular_velocity=state.angular_velocity,
        orientation=state.orientation,
    )
    np.testing.assert_allclose(again.momentum, state.momentum, rtol=1e-14)
    np.testing.assert_allclose(again.angular_momentum, state.angular_momentum, rtol=1e-14)


@EXAMPLES
@given(states(boxes(3)))
def test_world_to_body_is_the_inverse_of_body_to_world(state: State) -> None:
    product = state.world_to_body @ state.body_to_world
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(4), (3, 4, 4)), atol=4e-15)


@EXAMPLES
@given(states(boxes(3)), vectors(3))
def test_points_go_to_the_world_and_back(state: State, points: Float64) -> None:
    world = state.points_to_world(points)
    by_matrix = np.einsum("nij,nj->ni", state.body_to_world, np.c_[points, np.ones(3)])[:, :3]
    np.testing.assert_allclose(world, by_matrix, atol=2e-14)
    np.testing.assert_allclose(state.points_to_body(world), points, atol=4e-14)
    many = np.stack([points, 2.0 * points], axis=1)
    np.testing.assert_array_equal(state.points_to_world(many)[:, 0], world)


@EXAMPLES
@given(states(boxes(3)), vectors(3))
def test_directions_turn_but_do_not_move(state: State, vector: Float64) -> None:
    world = state.vectors_to_world(vector)
    np.testing.assert_allclose(
        world, state.points_to_world(vector) - state.position, rtol=0, atol=2e-14
    )
    np.testing.assert_allclose(state.vectors_to_body(world), vector, atol=2e-14)


def test_a_matrix_first_rotates_and_then_translates() -> None:
    quarter = quaternion.from_axis_angle((0, 0, 1), math.pi / 2)
    state = State.create(CUBE, position=(10.0, 0.0, 0.0), orientation=quarter)
    np.testing.assert_allclose(
        state.points_to_world((1.0, 0.0, 0.0)), [[10.0, 1.0, 0.0]], atol=1e-15
    )


@pytest.mark.parametrize(
    "name", ["position", "momentum", "orientation", "angular_momentum", "velocity", "body_to_world"]
)
def test_a_states_values_cannot_be_changed_behind_its_back(name: str) -> None:
    state = State.create(CUBE)
    with pytest.raises(ValueError, match="read-only"):
        getattr(state, name)[0, 0] = 1.0


def test_a_state_keeps_nothing_of_the_arrays_it_was_made_from() -> None:
    position, momentum = np.zeros((1, 3)), np.zeros((1, 3))
    state = State.create(CUBE, position=position).recalculate(momentum=momentum)
    position[:] = momentum[:] = 7.0
    assert not state.position.any()
    assert not state.momentum.any()


def test_a_body_that_blew_up_is_told_apart_from_its_neighbours() -> None:
    state = State.create(Body.cube(count=3), velocity=(1.0, 0.0, 0.0))
    momentum = state.momentum.copy()
    momentum[1, 2] = math.inf
    assert state.recalculate(momentum=momentum).finite().tolist() == [True, False, True]


def test_a_taken_body_is_the_same_body_and_may_repeat() -> None:
    state = State.create(Body.cube([1.0, 2.0]), angular_velocity=[(1, 0, 0), (0, 3, 0)])
    taken = state.take([1, 1, 0])
    assert taken.body.size[:, 0].tolist() == [2.0, 2.0, 1.0]
    np.testing.assert_array_equal(taken.angular_velocity, state.angular_velocity[[1, 1, 0]])


WRONG_BODIES: list[tuple[str, dict[str, Any], str]] = [
    ("cube", {"mass": 0.0}, "mass must be positive, got 0.0"),
    ("cube", {"mass": -1.0}, "mass must be positive, got -1.0"),
    ("cube", {"mass": math.nan}, "mass must be finite"),
    ("cube", {"size": 0.0}, "size must be positive"),
    ("cube", {"size": (1.0, 2.0), "mass": (1.0, 1.0, 1.0)}, r"number of bodies: \[2, 3\]"),
    ("cube", {"size": np.ones((2, 3))}, "size of a cube"),
    ("cube", {"count": 0}, "at least 1"),
    ("box", {"size": (1.0, 2.0)}, r"size must have shape \(3,\)"),
    ("box", {"size": (1.0, 2.0, -3.0)}, "size must be positive, got -3.0"),
    ("box", {"size": (1.0, math.inf, 3.0)}, r"size must be finite, got inf at index \[1\]"),
    ("from_inertia", {"inertia": (1.0, 1.0, 3.0)}, "sum of the other two"),
]


@pytest.mark.parametrize(("maker", "arguments", "words"), WRONG_BODIES)
def test_an_impossible_body_is_refused(maker: str, arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        getattr(Body, maker)(**arguments)


WRONG_STATES: list[tuple[dict[str, Any], str]] = [
    ({"position": (0.0, 0.0)}, r"position must have shape \(3,\) or \(2, 3\) for 2 bodies"),
    ({"position": np.zeros((3, 3))}, "got \\(3, 3\\)"),
    ({"velocity": (0.0, math.nan, 0.0)}, r"velocity must be finite, got nan at index \[1\]"),
    ({"velocity": (0, 0, 0), "momentum": (0, 0, 0)}, "velocity or momentum, not both"),
    ({"angular_velocity": (0, 0, 0), "angular_momentum": (0, 0, 0)}, "not both"),
    ({"orientation": (1.0, 1.0, 0.0, 0.0)}, "unit quaternions"),
    ({"orientation": (0.0, 0.0, 0.0)}, "axis of 4"),
    ({"angular_momentum": "fast"}, "must be numbers"),
]


@pytest.mark.parametrize(("arguments", "words"), WRONG_STATES)
def test_an_impossible_state_is_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        State.create(Body.cube(count=2), **arguments)


def test_recalculating_with_another_number_of_bodies_is_refused() -> None:
    with pytest.raises(ValueError, match=r"momentum must have shape \(1, 3\), got \(2, 3\)"):
        State.create(CUBE).recalculate(momentum=np.zeros((2, 3)))


def test_points_of_another_number_of_bodies_are_refused() -> None:
    with pytest.raises(ValueError, match=r"points must have shape \(3,\), \(1, 3\) or \(1, K, 3\)"):
        State.create(CUBE).points_to_world(np.zeros((2, 3)))
