"""Forces and torques, the report's statements about them, and its two damaged formulae."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.rigid_body import (
    RK4,
    Body,
    PiecewiseConstantForce,
    State,
    Wrench,
    advance,
    constant,
    derivative_of,
    driving_torque,
    exact,
    force_at,
    gravity,
    key_sequence,
    linear_drag,
    on_axle,
    push_at,
    total,
    velocity_at,
)
from roller_env.rigid_body.arrays import Float64, dot
from roller_env.rigid_body.forces import KEY_FORCE_N, Load
from tests.rigid_body.bodies import EXAMPLES, boxes, states, tumbling, vectors

CUBE = State.create(Body.cube())


# --- the report's statements -----------------------------------------------------------------


@EXAMPLES
@given(states(boxes(3)), vectors(3), vectors(3))
def test_a_push_at_any_point_of_a_body_on_ice_accelerates_its_centre_by_f_over_m(
    state: State, force: Float64, point: Float64
) -> None:
    dt = 1e-3
    after = advance(state, RK4, dt, 1, load=lambda s, _t: force_at(s, force, point))
    acceleration = (after.velocity - state.velocity) / dt
    np.testing.assert_allclose(acceleration, force / state.body.mass[:, None], rtol=1e-9, atol=1e-8)


def test_a_push_at_the_rim_both_moves_and_turns_a_free_wheel_but_one_on_its_axle_only_turns() -> (
    None
):
    wheel = State.create(Body.from_inertia((1.0, 1.0, 2.0), mass=4.0))
    push = push_at((3.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    free = advance(wheel, RK4, 0.01, 50, load=push)
    held = advance(wheel, RK4, 0.01, 50, load=on_axle(push, (0.0, 0.0, 1.0)))
    assert free.velocity[0, 0] == pytest.approx(3.0 / 4.0 * 0.5)
    np.testing.assert_array_equal(held.position, wheel.position)
    np.testing.assert_array_equal(held.momentum, wheel.momentum)
    np.testing.assert_array_equal(held.angular_momentum, free.angular_momentum)
    assert held.angular_velocity[0, 2] < -0.5


def test_an_axle_takes_up_every_torque_but_that_about_itself() -> None:
    wrench = on_axle(constant((1, 2, 3), torque=(4, 5, 6)), (0, 2, 0))(CUBE, 0.0)
    assert not wrench.force.any()
    assert wrench.torque.tolist() == [[0.0, 5.0, 0.0]]


def test_the_driving_torque_brings_the_cube_to_ten_radians_a_second_in_time() -> None:
    inertia = 1.0 / 6.0
    spun = advance(CUBE, RK4, 0.01, 100, load=driving_torque())
    expected = 10.0 * -math.expm1(-1.0 / (10.0 * inertia))
    assert spun.angular_velocity[0, 0] == pytest.approx(expected, rel=1e-8)
    terminal = CUBE.recalculate(angular_momentum=np.array([[10.0 * inertia, 0.0, 0.0]]))
    np.testing.assert_allclose(driving_torque()(terminal, 0.0).torque, 0.0, atol=1e-15)


# --- the mended formulae, and what goes wrong with the printed ones ----------------------------


@EXAMPLES
@given(states(boxes(2)), vectors(2), vectors(2))
def test_a_force_does_the_work_that_the_body_gains(
    state: State, force: Float64, point: Float64
) -> None:
    wrench = force_at(state, force, point)
    gained = dot(wrench.force, state.velocity) + dot(wrench.torque, state.angular_velocity)
    done = dot(force, velocity_at(state, point))
    np.testing.assert_allclose(gained, done, rtol=1e-9, atol=1e-9)


def test_the_printed_torque_turns_the_body_against_the_push() -> None:
    force, point = np.array([[0.0, 1.0, 0.0]]), np.array([[0.5, 0.0, 0.0]])
    mended = force_at(CUBE, force, point)
    printed = Wrench(force, np.cross(force, point - CUBE.position))

    def rate_of_the_pushed_point(wrench: Wrench) -> float:
        """Return the velocity that the pushed point gains along the push in a millisecond."""
        after = advance(CUBE, RK4, 1e-3, 1, load=lambda _s, _t: wrench)
        return float(velocity_at(after, point)[0, 1]) * 1e3

    # A cube of 1 kg and 1 m: 1 N at a face gives 1 + 0.5^2 * 6 = 2.5 m/s^2 where it pushes.
    assert rate_of_the_pushed_point(mended) == pytest.approx(2.5, rel=1e-3)
    # Printed, the corner comes towards the hand that pushes it: energy out of nothing.
    assert rate_of_the_pushed_point(printed) == pytest.approx(-0.5, rel=1e-3)


@EXAMPLES
@given(states(boxes(2)), vectors(2), vectors(2))
def test_the_distance_between_two_points_of_a_rigid_body_stays(
    state: State, a: Float64, b: Float64
) -> None:
    approach = dot(a - b, velocity_at(state, a) - velocity_at(state, b))
    np.testing.assert_allclose(approach, 0.0, atol=1e-9)


def test_the_printed_velocity_of_a_point_tears_the_body_apart() -> None:
    spinning = CUBE.recalculate(angular_momentum=np.array([[0.0, 0.0, 1.0]]))
    corner = np.array([[0.5, 0.5, 0.5]])

    def printed_velocity(state: State, point: Float64) -> Float64:
        return state.velocity + state.angular_velocity * (point - state.position)

    growth = dot(
        corner, printed_velocity(spinning, corner) - printed_velocity(spinning, 0 * corner)
    )
    assert growth[0] == pytest.approx(6.0 * 0.25)
    np.testing.assert_allclose(velocity_at(spinning, corner), [[-3.0, 3.0, 0.0]], atol=1e-14)


@EXAMPLES
@given(tumbling(2), vectors(2, largest=1.0))
def test_the_velocity_of_a_point_is_how_fast_the_point_moves(
    state: State, body_point: Float64
) -> None:
    h = 1e-4
    ahead, behind = (
        exact.projectile(exact.asymmetric_top(state, t), t, (0, 0, 0)) for t in (h, -h)
    )
    moved = (ahead.points_to_world(body_point) - behind.points_to_world(body_point)) / (2 * h)
    point = state.points_to_world(body_point)
    # The difference quotient's own error is h^2/6 times the third derivative, up to |w|^3.
    np.testing.assert_allclose(velocity_at(state, point), moved, rtol=0, atol=2e-4)


# --- loads -----------------------------------------------------------------------------------


def test_gravity_gives_every_mass_the_same_acceleration_and_no_torque() -> None:
    state = State.create(Body.cube(mass=(0.5, 7.0)))
    wrench = gravity((0.0, 0.0, -9.8044))(state, 0.0)
    np.testing.assert_allclose(
        wrench.force / state.body.mass[:, None], [[0.0, 0.0, -9.8044]] * 2, rtol=1e-15
    )
    assert not wrench.torque.any()


def test_drag_works_against_the_velocity_with_a_coefficient_for_each_body() -> None:
    state = State.create(Body.cube(count=2), velocity=(2.0, 0.0, -1.0))
    force = linear_drag((0.5, 3.0))(state, 0.0).force
    assert force.tolist() == [[-1.0, 0.0, 0.5], [-6.0, 0.0, 3.0]]


def test_a_thruster_turns_with_the_body_and_a_rope_does_not() -> None:
    turned = State.create(Body.cube(), orientation=(math.sqrt(0.5), 0, 0, math.sqrt(0.5)))
    thruster = push_at((1, 0, 0), (0, 1, 0), in_body=True)(turned, 0.0)
    rope = push_at((1, 0, 0), (0, 1, 0))(turned, 0.0)
    np.testing.assert_allclose(thruster.force, [[0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(thruster.torque, [[0, 0, -1]], atol=1e-15)
    np.testing.assert_allclose(rope.force, [[1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(rope.torque, [[0, 0, 0]], atol=1e-15)


def test_loads_add_up_and_no_load_is_nothing() -> None:
    wrench = total(constant((1, 0, 0)), constant((0, 2, 0), torque=(0, 0, 3)))(CUBE, 0.0)
    assert wrench.force.tolist() == [[1.0, 2.0, 0.0]]
    assert wrench.torque.tolist() == [[0.0, 0.0, 3.0]]
    assert not np.any(total()(CUBE, 0.0))


# --- keys ------------------------------------------------------------------------------------


def test_keys_push_along_the_games_axes_and_two_push_on_the_diagonal() -> None:
    keys = key_sequence([(0.0, "W"), (1.0, "WA"), (2.0, "AD"), (3.0, "S"), (4.0, "")])
    pushes = [keys.force_at_time(t + 0.5).tolist() for t in range(5)]
    f = KEY_FORCE_N
    assert f == pytest.approx(5.08)
    assert pushes == [[f, 0, 0], [f, f, 0], [0, 0, 0], [-f, 0, 0], [0, 0, 0]]
    assert keys.force_at_time(-0.1).tolist() == [0.0, 0.0, 0.0]


@EXAMPLES
@given(st.integers(1, 10_000), st.sampled_from([1e-3, 1 / 60, 0.1, 1 / 120]))
def test_a_key_pressed_on_a_step_counts_from_that_step_whatever_the_rounding(
    step: int, dt: float
) -> None:
    keys = key_sequence([(round(step * dt, 12), "W")])
    assert keys.force_at_time(step * dt)[0] > 0.0
    assert keys.force_at_time((step - 1) * dt)[0] == 0.0


def test_held_keys_are_integrated_without_error_by_every_order() -> None:
    keys = key_sequence([(0.0, "W"), (0.5, "WD"), (1.2, "")])
    truth = exact.reference(CUBE, 2.0, held=keys)
    driven = advance(CUBE, RK4, 0.1, 20, held=keys)
    np.testing.assert_allclose(driven.momentum, truth.momentum, atol=1e-13)
    np.testing.assert_allclose(driven.position, truth.position, atol=1e-13)
    assert driven.momentum[0].tolist() == pytest.approx([1.2 * KEY_FORCE_N, -0.7 * KEY_FORCE_N, 0])


# --- wrong input -----------------------------------------------------------------------------


def half_a_wrench(state: State, _t: float) -> Wrench:
    return Wrench(np.zeros(3), np.zeros((state.count, 3)))


WRONG_LOADS: list[tuple[Load, str]] = [
    (half_a_wrench, r"the load's force must have shape \(1, 3\), got \(3,\)"),
    (gravity(np.zeros((2, 3))), r"acceleration must have shape \(3,\) or \(1, 3\) for 1 body"),
    (linear_drag((1.0, 1.0)), r"coefficient must be one number or have shape \(1,\), got \(2,\)"),
    (lambda s, _t: force_at(s, (0, 0, math.nan), (0, 0, 0)), "force must be finite"),
]


@pytest.mark.parametrize(("load", "words"), WRONG_LOADS)
def test_a_load_that_does_not_fit_its_bodies_is_refused(load: Load, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        derivative_of(load)(CUBE, 0.0)


WRONG_ARGUMENTS: list[tuple[Any, tuple[Any, ...], str]] = [
    (gravity, ((0, 0, math.nan),), "acceleration must be finite"),
    (linear_drag, (-1.0,), "coefficient must not be negative, got -1"),
    (driving_torque, ((1, 0, 0), -0.1), "damping must not be negative"),
    (on_axle, (constant(), (0, 0, 0)), "zero vector"),
    (key_sequence, ([(0.0, "WX")],), r"unknown keys \['X'\]: the keys are \['A', 'D', 'S', 'W'\]"),
    (key_sequence, ([(1.0, "W"), (1.0, "")],), "rising times"),
    (key_sequence, ([],), "one or more rising times"),
    (PiecewiseConstantForce, (np.zeros(1), np.zeros((2, 3))), r"forces must have shape \(1, 3\)"),
]


@pytest.mark.parametrize(("maker", "arguments", "words"), WRONG_ARGUMENTS)
def test_an_impossible_load_is_refused_when_it_is_made(
    maker: Any, arguments: tuple[Any, ...], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        maker(*arguments)
