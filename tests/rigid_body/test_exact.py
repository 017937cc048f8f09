"""The closed forms, against each other, against an integration and against 40 digits."""

from __future__ import annotations

import itertools
import math
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from roller_env.rigid_body import (
    Body,
    State,
    constant,
    driving_torque,
    exact,
    gravity,
    key_sequence,
    linear_drag,
    quaternion,
    total,
)
from roller_env.rigid_body.arrays import Float64, dot
from tests.rigid_body.bodies import (
    EXAMPLES,
    FREE_BOX_SIZE_M,
    attitude_error,
    cubes,
    orientations,
    states,
    tumbling,
    vectors,
)

FREE_BOX = Body.box(FREE_BOX_SIZE_M, 10.0)
times = st.floats(0.0, 10.0)


# --- linear motion ---------------------------------------------------------------------------


@EXAMPLES
@given(states(cubes(2)), vectors(2), times)
def test_a_projectile_keeps_its_energy_and_its_horizontal_speed(
    state: State, acceleration: Float64, t: float
) -> None:
    flown = exact.projectile(state, t, acceleration)

    def energy(s: State) -> Float64:
        height = dot(s.position, acceleration)
        return 0.5 * dot(s.velocity, s.velocity) - height

    np.testing.assert_allclose(energy(flown), energy(state), rtol=1e-11, atol=1e-9)
    np.testing.assert_array_equal(flown.orientation, state.orientation)


@EXAMPLES
@given(states(cubes(2)), st.floats(0.01, 10.0), vectors(1), times, times)
def test_drag_for_two_spans_of_time_is_drag_for_their_sum(
    state: State, c: float, force: Float64, first: float, second: float
) -> None:
    at_once = exact.linear_drag(state, first + second, c, force)
    in_two = exact.linear_drag(exact.linear_drag(state, first, c, force), second, c, force)
    scale = 1.0 + np.abs(at_once.position).max() + np.abs(force).max() / c * 20.0
    np.testing.assert_allclose(in_two.position, at_once.position, rtol=0, atol=1e-13 * scale)
    np.testing.assert_allclose(
        in_two.velocity, at_once.velocity, rtol=0, atol=1e-13 * (1 + np.abs(force).max() / c)
    )


@EXAMPLES
@given(states(cubes(1)), vectors(1), st.floats(0.1, 10.0), st.sampled_from([0.0, 1e-12, 1e-9]))
def test_weak_drag_is_nearly_no_drag(state: State, force: Float64, t: float, rate: float) -> None:
    dragged = exact.linear_drag(state, t, rate * float(state.body.mass[0]), force)
    free = exact.projectile(state, t, force / state.body.mass[:, None])
    fastest = np.abs(state.velocity).max() + np.abs(free.velocity).max()
    bound = rate * t * fastest * t + 1e-13 * (1.0 + np.abs(free.position).max() + fastest * t)
    np.testing.assert_allclose(dragged.position, free.position, rtol=0, atol=bound)


# --- rotation --------------------------------------------------------------------------------


@EXAMPLES
@given(states(cubes(3)), st.floats(-10.0, 10.0))
def test_every_top_formula_agrees_with_constant_spin_where_both_hold(
    state: State, t: float
) -> None:
    spun, top = exact.constant_spin(state, t), exact.symmetric_top(state, t)
    assert attitude_error(spun, top) < 1e-12


@EXAMPLES
@given(tumbling(3), times)
def test_a_free_top_keeps_its_energy_and_its_angular_momentum(state: State, t: float) -> None:
    after = exact.asymmetric_top(state, t)
    np.testing.assert_array_equal(after.angular_momentum, state.angular_momentum)
    np.testing.assert_allclose(
        after.kinetic_energy(), state.kinetic_energy(), rtol=1e-10, atol=1e-13
    )


@EXAMPLES
@given(tumbling(3), times, times)
def test_tumbling_for_two_spans_of_time_is_tumbling_for_their_sum(
    state: State, first: float, second: float
) -> None:
    at_once = exact.asymmetric_top(state, first + second)
    in_two = exact.asymmetric_top(exact.asymmetric_top(state, first), second)
    assert attitude_error(at_once, in_two) < 1e-9


@EXAMPLES
@given(tumbling(2), times)
def test_tumbling_forward_and_back_comes_home(state: State, t: float) -> None:
    home = exact.asymmetric_top(exact.asymmetric_top(state, t), -t)
    assert attitude_error(home, state) < 1e-9


@EXAMPLES
@given(tumbling(2), times)
def test_the_tumble_obeys_eulers_equations_in_the_body_frame(state: State, t: float) -> None:
    h = 1e-4

    def omega(at: float) -> Float64:
        after = exact.asymmetric_top(state, at)
        return after.vectors_to_body(after.angular_velocity)

    now, inertia = omega(t), state.body.inertia
    rate = (omega(t + h) - omega(t - h)) / (2.0 * h)
    euler = np.cross(inertia * now, now) / inertia
    # Central difference: h^2 / 6 times a third derivative of the order of |w|^4.
    speed = quaternion.norm(now).max()
    np.testing.assert_allclose(rate, euler, rtol=0, atol=1e-8 * (1.0 + speed**4) + 1e-7)


@pytest.mark.parametrize("outer", [0, 2])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_steady_spin_about_an_outer_axis_is_a_tumble_without_wobble(
    outer: int, sign: float
) -> None:
    for size in itertools.permutations((1.0, 2.0, 3.0)):
        body = Body.box(size)
        axis = body.axes_by_inertia[0, outer]
        state = State.create(body, angular_velocity=sign * 3.0 * np.eye(3)[axis])
        assert (
            attitude_error(exact.asymmetric_top(state, 7.0), exact.constant_spin(state, 7.0))
            < 1e-13
        )


@EXAMPLES
@given(orientations(1), vectors(1), st.permutations([0, 1, 2]), st.booleans(), times)
def test_a_nearly_symmetric_top_moves_nearly_like_a_symmetric_one(
    q: Float64, momentum: Float64, axes: list[int], oblate: bool, t: float
) -> None:
    moments = np.array([1.0, 1.0, 1.6 if oblate else 0.4])[axes]
    nearly = np.array([1.0, 1.0 + 2e-6, 1.6 if oblate else 0.4])[axes]
    # On the line between turning and swinging the two differ for good.
    assume((np.abs(quaternion.rotate_inverse(q, momentum)) > 0.1).all())
    top = State.create(Body.from_inertia(moments), orientation=q, angular_momentum=momentum)
    other = State.create(Body.from_inertia(nearly), orientation=q, angular_momentum=momentum)
    close = exact.asymmetric_top(other, t)
    assert attitude_error(exact.symmetric_top(top, t), close) < 1e-3


def test_tops_agree_with_an_independent_integration() -> None:
    rng = np.random.default_rng(4)
    body = Body.from_inertia([(1.0, 2.0, 3.0), (3.0, 1.0, 2.0), (2.0, 2.0, 1.0), (1.0, 3.0, 3.0)])
    state = State.create(
        body,
        orientation=quaternion.normalise(rng.normal(size=(4, 4))),
        angular_velocity=rng.normal(size=(4, 3)) * 3.0,
    )
    truth = exact.reference(state, 3.0)
    assert attitude_error(exact.asymmetric_top(state.take([0, 1]), 3.0), truth.take([0, 1])) < 1e-12
    assert attitude_error(exact.symmetric_top(state.take([2, 3]), 3.0), truth.take([2, 3])) < 1e-12


def taylor_tumble(state: State, seconds: int, steps: int) -> list[Decimal]:
    """Return the orientation of one free body by Taylor series of order 24 in 40 digits.

    Nothing of the package is used: q' = q (0, w) / 2 and L' = L x w in the body frame, with the
    float64 values of ``state`` taken as exact.
    """
    q = [Decimal(x) for x in state.orientation[0].tolist()]
    inertia = [Decimal(x) for x in state.body.inertia[0].tolist()]
    length = sum((x * x for x in q), Decimal(0)).sqrt()
    q = [x / length for x in q]
    world = [Decimal(0), *(Decimal(x) for x in state.angular_momentum[0].tolist())]
    back = [q[0], *(-x for x in q[1:])]
    momentum = decimal_product(decimal_product(back, world), q)[1:]
    h = Decimal(seconds) / steps
    for _ in range(steps):
        ls, qs = [momentum], [q]
        ws = [[a / b for a, b in zip(momentum, inertia, strict=True)]]
        for k in range(24):
            rate_l, rate_q = [Decimal(0)] * 3, [Decimal(0)] * 4
            for j in range(k + 1):
                a, b = ls[j], ws[k - j]
                turned = (
                    a[1] * b[2] - a[2] * b[1],
                    a[2] * b[0] - a[0] * b[2],
                    a[0] * b[1] - a[1] * b[0],
                )
                rate_l = [x + y for x, y in zip(rate_l, turned, strict=True)]
                spun = decimal_product(qs[j], [Decimal(0), *b])
                rate_q = [x + y / 2 for x, y in zip(rate_q, spun, strict=True)]
            ls.append([x / (k + 1) for x in rate_l])
            qs.append([x / (k + 1) for x in rate_q])
            ws.append([a / b for a, b in zip(ls[-1], inertia, strict=True)])
        momentum = [sum((c[i] * h**k for k, c in enumerate(ls)), Decimal(0)) for i in range(3)]
        q = [sum((c[i] * h**k for k, c in enumerate(qs)), Decimal(0)) for i in range(4)]
    return q


def decimal_product(a: list[Decimal], b: list[Decimal]) -> list[Decimal]:
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]


@pytest.mark.parametrize("omega", [(0.1, 5.0, 0.1), (3.0, -5.0, 2.0)])
def test_the_closed_form_has_thirteen_correct_digits(omega: tuple[float, float, float]) -> None:
    state = State.create(FREE_BOX, orientation=(0.5, 0.5, -0.5, 0.5), angular_velocity=omega)
    with localcontext(prec=40):
        coarse, fine = (taylor_tumble(state, 2, steps) for steps in (30, 45))
        assert max(abs(a - b) for a, b in zip(coarse, fine, strict=True)) < Decimal("1e-20")
        found = [Decimal(x) for x in exact.asymmetric_top(state, 2.0).orientation[0].tolist()]
        off = decimal_product([found[0], *(-x for x in found[1:])], fine)
        angle = 2 * sum((x * x for x in off[1:]), Decimal(0)).sqrt()
    assert angle < Decimal("5e-14")


def test_a_spin_about_the_middle_axis_runs_away_at_the_predicted_rate() -> None:
    i1, i2, i3 = 1.0, 2.0, 3.0
    spin, wobble, t = 5.0, 1e-6, 1.2
    rate = exact.middle_axis_growth_rate((i3, i1, i2), spin)
    assert rate == pytest.approx(5.0 * math.sqrt(1.0 / 3.0))
    # Along the direction that only grows; any other also has a part that decays.
    start = (wobble, spin, wobble * i1 * rate / ((i2 - i3) * spin))
    body = State.create(Body.from_inertia((i1, i2, i3)), angular_velocity=start)
    after = exact.reference(body, t)
    omega = after.vectors_to_body(after.angular_velocity)[0]
    assert math.log(omega[0] / wobble) / t == pytest.approx(rate, rel=1e-6)
    assert math.log(omega[2] / start[2]) / t == pytest.approx(rate, rel=1e-6)
    with pytest.raises(ValueError, match="separatrix"):
        exact.asymmetric_top(body, t)


@EXAMPLES
@given(states(cubes(2)), st.floats(0.01, 2.0), st.floats(-3.0, 3.0), times)
def test_a_damped_spin_turns_as_far_as_its_angular_velocity_adds_up_to(
    state: State, damping: float, share: float, t: float
) -> None:
    # Gauss-Legendre quadrature of omega(t), which knows nothing of the formula for the angle.
    torque = np.array([[1.0, 0.5, -0.2]])
    state = State.create(state.body, orientation=state.orientation, angular_velocity=share * torque)
    inertia = state.body.inertia[:, :1]
    rate, end = damping / inertia, torque / damping
    expected = end + (share * torque - end) * np.exp(-rate * t)
    after = exact.damped_spin(state, t, torque, damping)
    np.testing.assert_allclose(after.angular_velocity, expected, rtol=1e-9, atol=1e-11)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    # The transient may be a thousand times shorter than t: integrate it in its own time.
    span = np.minimum(t, 40.0 / rate)
    at = span[:, :, None] * (nodes + 1.0) / 2.0
    excess = np.sum(np.exp(-rate[:, :, None] * at) * weights, axis=2) * span / 2.0
    turn = end * t + (share * torque - end) * excess
    truth = quaternion.multiply(quaternion.from_rotation_vector(turn), state.orientation)
    assert quaternion.angle_between(after.orientation, truth).max() < 1e-8


def test_the_reports_cube_has_turned_by_the_integral_of_its_spin() -> None:
    cube = State.create(Body.cube())
    after = exact.damped_spin(cube, 5.0, (1.0, 0.0, 0.0), 0.1)
    truth = exact.reference(cube, 5.0, driving_torque())
    assert attitude_error(after, truth) < 1e-11
    np.testing.assert_allclose(after.angular_momentum, truth.angular_momentum, rtol=1e-13)


def test_the_reference_follows_linear_motion_and_keys() -> None:
    cube = State.create(Body.cube(mass=2.0), velocity=(1.0, 2.0, 3.0))
    drag = exact.linear_drag(cube, 3.0, 0.7, (0.0, 0.0, -4.0))
    pulled = exact.reference(cube, 3.0, total(linear_drag(0.7), constant((0.0, 0.0, -4.0))))
    np.testing.assert_allclose(pulled.position, drag.position, rtol=1e-13)
    np.testing.assert_allclose(pulled.momentum, drag.momentum, rtol=1e-12)
    fallen = exact.reference(cube, 2.0, gravity((0, 0, -9.8)))
    np.testing.assert_allclose(fallen.position, exact.projectile(cube, 2.0, (0, 0, -9.8)).position)
    keys = key_sequence([(0.25, "W"), (0.75, "")], key_force_n=4.0)
    pushed = exact.reference(cube, 1.0, held=keys)
    np.testing.assert_allclose(pushed.velocity, [[2.0, 2.0, 3.0]], rtol=1e-14)
    np.testing.assert_allclose(pushed.position, [[1.0 + 0.25 + 0.25, 2.0, 3.0]], rtol=1e-13)


def test_one_call_gives_a_whole_trajectory() -> None:
    body = State.create(FREE_BOX, velocity=(1.0, 0.0, 0.0), angular_velocity=(1.0, 2.0, 3.0))
    at = np.linspace(0.0, 2.0, 5)
    path = exact.projectile(exact.asymmetric_top(body.take([0] * 5), at), at, (0, 0, -9.8))
    for row, t in enumerate(at):
        alone = exact.projectile(exact.asymmetric_top(body, t), t, (0, 0, -9.8))
        np.testing.assert_allclose(path.position[row], alone.position[0], rtol=1e-15)
        assert attitude_error(path.take([row]), alone) < 1e-15


SPINNING = State.create(FREE_BOX, angular_velocity=(1.0, 2.0, 3.0))
CUBE = State.create(Body.cube(), angular_velocity=(1.0, 2.0, 3.0))
WRONG: list[tuple[Any, tuple[Any, ...], str]] = [
    (exact.constant_spin, (SPINNING, 1.0), "use symmetric_top or asymmetric_top"),
    (exact.symmetric_top, (SPINNING, 1.0), "use asymmetric_top"),
    (exact.asymmetric_top, (CUBE, 1.0), "three different moments"),
    (exact.damped_spin, (SPINNING, 1.0, (1, 2, 3), 0.1), "three equal moments"),
    (exact.damped_spin, (CUBE, 1.0, (1, 0, 0), 0.1), "along the torque"),
    (exact.damped_spin, (CUBE, 1.0, (1, 2, 3), -0.1), "damping must not be negative"),
    (exact.linear_drag, (CUBE, 1.0, -1.0), "coefficient must not be negative"),
    (exact.projectile, (CUBE, math.nan, (0, 0, 0)), "t_s must be finite"),
    (exact.projectile, (CUBE, (1.0, 2.0), (0, 0, 0)), r"t_s must be one number or have shape"),
    (exact.projectile, (CUBE, 1.0, (0, 0)), r"acceleration must have shape"),
    (exact.reference, (CUBE, -1.0), "t_s must not be negative"),
    (exact.middle_axis_growth_rate, ((1.0, 2.0), 1.0), r"inertia must have shape \(3,\)"),
]


@pytest.mark.parametrize(("function", "arguments", "words"), WRONG)
def test_a_motion_without_that_answer_is_refused(
    function: Any, arguments: tuple[Any, ...], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        function(*arguments)
