"""Quaternions as rotations."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.rigid_body import quaternion
from roller_env.rigid_body.arrays import Float64
from tests.rigid_body.bodies import EXAMPLES, exact_product, orientations, vectors

X, Y, Z = np.eye(3)


def about(axis: Float64, angle_rad: float) -> Float64:
    return quaternion.from_axis_angle(axis, angle_rad)


def test_a_positive_quarter_turn_about_x_takes_y_to_z_as_the_right_hand_says() -> None:
    quarter = about(X, math.pi / 2)
    np.testing.assert_allclose(quaternion.rotate(quarter, Y), Z, atol=1e-15)
    np.testing.assert_allclose(quaternion.rotate(quarter, Z), -Y, atol=1e-15)


@EXAMPLES
@given(orientations(1), orientations(1))
def test_the_product_is_hamiltons_to_the_last_digits(a: Float64, b: Float64) -> None:
    product = quaternion.multiply(a, b)[0]
    exact = exact_product(
        [Fraction(x) for x in a[0].tolist()], [Fraction(x) for x in b[0].tolist()]
    )
    np.testing.assert_allclose(product, [float(x) for x in exact], rtol=0, atol=4e-16)


@EXAMPLES
@given(orientations(4), orientations(4), vectors(4))
def test_a_product_turns_by_its_right_factor_first(a: Float64, b: Float64, v: Float64) -> None:
    one_by_one = quaternion.rotate(a, quaternion.rotate(b, v))
    np.testing.assert_allclose(
        quaternion.rotate(quaternion.multiply(a, b), v), one_by_one, atol=2e-14
    )


@EXAMPLES
@given(orientations(4), vectors(4))
def test_the_matrix_turns_like_the_quaternion_and_is_a_rotation(q: Float64, v: Float64) -> None:
    matrix = quaternion.to_matrix(q)
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", matrix, v), quaternion.rotate(q, v), atol=2e-14
    )
    np.testing.assert_allclose(
        matrix @ np.swapaxes(matrix, 1, 2), np.broadcast_to(np.eye(3), (4, 3, 3)), atol=2e-15
    )
    np.testing.assert_allclose(np.linalg.det(matrix), 1.0, atol=4e-15)


@EXAMPLES
@given(orientations(4), vectors(4))
def test_turning_back_undoes_turning(q: Float64, v: Float64) -> None:
    np.testing.assert_allclose(quaternion.rotate_inverse(q, quaternion.rotate(q, v)), v, atol=2e-14)


@EXAMPLES
@given(vectors(4, largest=1.8))
def test_a_rotation_vector_shorter_than_half_a_turn_comes_back(v: Float64) -> None:
    back = quaternion.to_rotation_vector(quaternion.from_rotation_vector(v))
    np.testing.assert_allclose(back, v, atol=4e-15)


def test_tiny_rotation_vectors_lose_nothing() -> None:
    tiny = np.array([[1e-9, -2e-12, 3e-200]])
    back = quaternion.to_rotation_vector(quaternion.from_rotation_vector(tiny))
    np.testing.assert_allclose(back, tiny, rtol=1e-15)


@EXAMPLES
@given(orientations(1), vectors(1), st.floats(-15.0, 0.49))
def test_the_attitude_error_sees_angles_that_an_arc_cosine_cannot(
    q: Float64, axis: Float64, exponent: float
) -> None:
    angle = 10.0**exponent
    axis += 10.0 * X
    turned = quaternion.multiply(about(axis[0], angle)[None], q)
    assert quaternion.angle_between(q, turned)[0] == pytest.approx(angle, rel=1e-9, abs=4e-16)
    assert quaternion.angle_between(q, -turned)[0] == pytest.approx(angle, rel=1e-9, abs=4e-16)


def test_an_arc_cosine_would_lose_an_angle_of_a_thousand_millionth() -> None:
    q, turned = about(X, 0.0), about(X, 1e-9)
    assert 2.0 * math.acos(float(q @ turned)) == 0.0
    assert quaternion.angle_between(q, turned) == pytest.approx(1e-9, rel=1e-12)


@EXAMPLES
@given(orientations(3), orientations(3), st.floats(0.0, 1.0))
def test_slerp_goes_the_short_way_at_constant_speed(
    a: Float64, b: Float64, fraction: float
) -> None:
    between = quaternion.slerp(a, b, fraction)
    whole = quaternion.angle_between(a, b)
    np.testing.assert_allclose(quaternion.norm(between), 1.0, atol=1e-14)
    np.testing.assert_allclose(
        quaternion.angle_between(a, between), fraction * whole, rtol=0, atol=1e-14
    )
    np.testing.assert_allclose(
        quaternion.angle_between(between, b), (1.0 - fraction) * whole, rtol=0, atol=1e-14
    )


@EXAMPLES
@given(orientations(3), orientations(3), st.floats(0.0, 1.0))
def test_slerp_gives_the_same_rotation_whichever_sign_the_second_has(
    a: Float64, b: Float64, fraction: float
) -> None:
    relative = quaternion.multiply(quaternion.conjugate(a), b)
    # At exactly half a turn both ways are equally short.
    b = np.where(np.abs(relative[:, :1]) < 1e-6, a, b)
    one, other = quaternion.slerp(a, b, fraction), quaternion.slerp(a, -b, fraction)
    assert quaternion.angle_between(one, other).max() < 1e-14


@EXAMPLES
@given(orientations(2), vectors(2))
def test_spin_is_the_rate_of_the_orientation(q: Float64, omega: Float64) -> None:
    h = 1e-5
    ahead = quaternion.multiply(quaternion.from_rotation_vector(h * omega), q)
    behind = quaternion.multiply(quaternion.from_rotation_vector(-h * omega), q)
    np.testing.assert_allclose(
        quaternion.spin(omega, q), (ahead - behind) / (2 * h), rtol=0, atol=1e-8
    )


@EXAMPLES
@given(orientations(2), vectors(2))
def test_spin_never_points_off_the_unit_sphere(q: Float64, omega: Float64) -> None:
    np.testing.assert_allclose(np.sum(quaternion.spin(omega, q) * q, axis=1), 0.0, atol=4e-15)


def test_a_roughly_unit_quaternion_is_renormalised() -> None:
    q = quaternion.checked_unit("q", [0.7071, 0.0, 0.7071, 0.0])
    assert quaternion.norm(q) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ([2.0, 0.0, 0.0, 0.0], "norm 2"),
        ([0.0, 0.0, 0.0, 0.0], "norm 0"),
        ([1.0, 0.0, 0.0], "axis of 4"),
        ([1.0, 0.0, math.nan, 0.0], "finite"),
        ("north", "numbers"),
    ],
)
def test_what_is_no_orientation_is_refused(value: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        quaternion.checked_unit("orientation", value)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("axis", "angle", "words"),
    [((0, 0, 0), 1.0, "zero vector"), ((1, 0), 1.0, "axis of 3"), ((1, 0, 0), math.inf, "finite")],
)
def test_what_is_no_axis_is_refused(axis: tuple[float, ...], angle: float, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        quaternion.from_axis_angle(axis, angle)
