"""The integrators: order, what they conserve, where they fail, and what they cost."""

from __future__ import annotations

import doctest
import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env import rigid_body
from roller_env.rigid_body import (
    BUSS2,
    BUSS3,
    EXPLICIT_EULER,
    INTEGRATORS,
    LIE_RK4,
    RK4,
    RK4_BODY,
    SEMI_IMPLICIT_EULER,
    SPLITTING2,
    SPLITTING4,
    Body,
    Integrator,
    State,
    Wrench,
    advance,
    constant,
    derivative_of,
    driving_torque,
    exact,
    gravity,
    integrator,
    key_sequence,
    linear_drag,
    push_at,
    quaternion,
    total,
    trajectory,
)
from roller_env.rigid_body.arrays import Float64
from roller_env.rigid_body.forces import Load, none
from roller_env.rigid_body.integrators import ExplicitEuler, RungeKutta4
from tests.rigid_body.bodies import (
    EXAMPLES,
    FREE_BOX_SIZE_M,
    attitude_error,
    boxes,
    cubes,
    errors,
    slope,
    states,
    tumbling,
)

METHODS = list(INTEGRATORS.values())
RAW_RK4 = RungeKutta4(renormalise=False, renormalise_stages=False)
"""Four numbers added like any others, and never made a rotation again."""

every_method = pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)

STEPS = {1: (50, 100, 200, 400), 2: (20, 40, 80, 160), 3: (60, 120, 240, 480), 4: (10, 20, 40, 80)}
"""Steps a second for each order: where the leading term rules and rounding is far."""

TWO_BOXES = State.create(
    Body.box([FREE_BOX_SIZE_M, (0.5, 0.6, 0.8)], (10.0, 2.0)),
    position=[(0.3, -0.2, 0.5), (0.0, 0.4, 0.1)],
    velocity=[(-0.9, 0.4, 0.1), (0.5, -0.3, 1.0)],
    orientation=[(0.5, 0.5, -0.5, 0.5), (1.0, 0.0, 0.0, 0.0)],
    angular_velocity=[(1.0, -2.0, 1.5), (2.0, 1.0, -1.0)],
)


def spring_in_the_wind(state: State, t: float) -> Wrench:
    """Pull to the origin, and push and twist by something that depends on the time."""
    force = -6.0 * state.position + np.array([math.sin(3.0 * t), math.cos(2.0 * t), 0.5 * t])
    torque = np.tile([0.02 * math.cos(4.0 * t), 0.05 * t, 0.0], (state.count, 1))
    return Wrench(force, torque)


EVERYTHING: Load = total(
    gravity((0.0, 0.0, -2.0)),
    spring_in_the_wind,
    linear_drag((1.5, 0.6)),
    driving_torque((0.1, 0.05, -0.1), (0.05, 0.02)),
    push_at((0.4, -0.2, 0.3), (0.05, 0.1, -0.2), in_body=True),
)
"""Forces of position, attitude, velocity, spin and time at once, all of them smooth."""


@cache
def driven_truth() -> State:
    return exact.reference(TWO_BOXES, 1.0, EVERYTHING)


def measured_orders(
    method: Integrator, state: State, load: Load, truth: State
) -> tuple[dict[str, float], dict[str, list[float]]]:
    """Return the slope of every primary value's error over a second, and the errors."""
    steps = STEPS[method.order]
    runs = [errors(advance(state, method, 1.0 / n, n, load=load), truth) for n in steps]
    error = {name: [run[name] for run in runs] for name in runs[0]}
    return {name: slope(steps, values) for name, values in error.items()}, error


# --- order -----------------------------------------------------------------------------------


@every_method
def test_every_error_of_a_driven_box_falls_with_the_methods_order(method: Integrator) -> None:
    orders, error = measured_orders(method, TWO_BOXES, EVERYTHING, driven_truth())
    for name, order in orders.items():
        assert order == pytest.approx(method.order, abs=0.15), (name, error[name])


@every_method
def test_the_attitude_of_a_free_tumble_falls_with_the_methods_order(method: Integrator) -> None:
    truth = exact.asymmetric_top(TWO_BOXES, 1.0)
    steps = STEPS[method.order]
    error = [attitude_error(advance(TWO_BOXES, method, 1.0 / n, n), truth) for n in steps]
    assert slope(steps, error) == pytest.approx(method.order, abs=0.15), error


@every_method
def test_a_step_calls_the_derivative_as_often_as_the_method_says(method: Integrator) -> None:
    calls: list[float] = []

    def counting(state: State, t: float) -> Wrench:
        calls.append(t)
        return none(state, t)

    method.step(TWO_BOXES, derivative_of(counting), 5.0, 0.1)
    assert len(calls) == method.evaluations
    assert min(calls) >= 5.0 - 0.1
    assert max(calls) <= 5.0 + 0.1 + 1e-12


# --- many bodies -----------------------------------------------------------------------------


@every_method
def test_a_body_moves_bit_for_bit_as_if_it_were_alone(method: Integrator) -> None:
    rng = np.random.default_rng(1)
    body = Body.box(rng.uniform(0.2, 2.0, (50, 3)), rng.uniform(0.5, 5.0, 50))
    crowd = State.create(
        body, velocity=rng.normal(size=(50, 3)), angular_velocity=rng.normal(size=(50, 3))
    )
    load = total(gravity((0, 0, -9.8)), driving_torque(), push_at((1, 2, 3), (0.1, 0, 0)))
    together = advance(crowd, method, 0.02, 3, load=load)
    for row in (0, 17, 49):
        alone = advance(crowd.take([row]), method, 0.02, 3, load=load)
        for name in ("position", "momentum", "orientation", "angular_momentum"):
            np.testing.assert_array_equal(getattr(together, name)[row], getattr(alone, name)[0])


@every_method
def test_a_body_that_blows_up_leaves_its_neighbours_alone(method: Integrator) -> None:
    crowd = State.create(Body.cube(count=3), velocity=(1.0, 0.0, 0.0))
    with np.errstate(all="ignore"):
        after = advance(crowd, method, 1.0, 120, load=linear_drag((0.1, 1e3, 0.1)))
    assert after.finite().tolist() == [True, False, True]


# --- what is conserved -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "method", [one for one in METHODS if one is not RK4_BODY], ids=lambda method: method.name
)
@EXAMPLES
@given(state=states(boxes(2)))
def test_angular_momentum_is_conserved_to_the_last_bit(method: Integrator, state: State) -> None:
    after = advance(state, method, 0.01, 5)
    np.testing.assert_array_equal(after.angular_momentum, state.angular_momentum)
    np.testing.assert_array_equal(after.momentum, state.momentum)


def test_angular_momentum_is_conserved_while_angular_velocity_is_not() -> None:
    box = State.create(Body.box(FREE_BOX_SIZE_M, 10.0), angular_velocity=(0.1, 5.0, 0.1))
    cube = State.create(Body.cube(0.5, 10.0), angular_velocity=(0.1, 5.0, 0.1))
    swing = [
        np.ptp([s.angular_velocity[0] for s in trajectory(body, RK4, 0.01, 300)], axis=0).max()
        for body in (box, cube)
    ]
    assert swing[0] > 3.0
    assert swing[1] == 0.0
    np.testing.assert_array_equal(
        advance(box, RK4, 0.01, 300).angular_momentum, box.angular_momentum
    )


@EXAMPLES
@given(tumbling(1), st.floats(0.005, 0.05))
def test_a_higher_order_loses_less_of_a_tumbles_energy(state: State, dt: float) -> None:
    speed = quaternion.norm(state.angular_velocity)[0] + 1e-9
    dt = min(dt, 0.2 / speed)
    before = state.kinetic_energy()
    lost = [
        abs(advance(state, method, dt, 20).kinetic_energy() - before).max()
        for method in (SEMI_IMPLICIT_EULER, LIE_RK4, SPLITTING4)
    ]
    floor = 1e-13 * before.max()
    assert lost[1] <= 0.2 * lost[0] + floor
    assert lost[2] <= 0.2 * lost[0] + floor


def test_a_splitting_keeps_its_energy_error_bounded_and_runge_kutta_does_not() -> None:
    top = State.create(Body.from_inertia((1.0, 2.0, 3.0)), angular_velocity=(2.0, 3.0, 1.0))
    before = top.kinetic_energy()[0]

    def worst(method: Integrator) -> tuple[float, float]:
        """Return the largest relative energy error in the first and the last quarter."""
        error = [
            abs(s.kinetic_energy()[0] / before - 1.0) for s in trajectory(top, method, 0.1, 400)
        ]
        return max(error[:100]), max(error[-100:])

    for method in (SPLITTING2, SPLITTING4):
        first, last = worst(method)
        assert last == pytest.approx(first, rel=0.02)
    first, last = worst(RK4)
    assert last > 2.5 * first


# --- constant spin ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    "method",
    [LIE_RK4, BUSS2, BUSS3, SPLITTING2, SPLITTING4, SEMI_IMPLICIT_EULER],
    ids=lambda m: m.name,
)
@EXAMPLES
@given(state=states(cubes(2)))
def test_methods_that_turn_are_exact_at_constant_spin_at_any_step(
    method: Integrator, state: State
) -> None:
    after = advance(state, method, 0.7, 4)
    assert attitude_error(after, exact.constant_spin(state, 2.8)) < 1e-13


@pytest.mark.parametrize("method", [SPLITTING2, SPLITTING4], ids=lambda m: m.name)
@pytest.mark.parametrize("inertia", [(1.0, 1.0, 1.7), (1.5, 1.0, 1.0), (1.0, 0.3, 1.0)])
def test_a_splitting_is_exact_on_a_symmetric_top_at_any_step(
    method: Integrator, inertia: tuple[float, float, float]
) -> None:
    top = State.create(Body.from_inertia(inertia), angular_velocity=(1.0, 2.0, 3.0))
    after = advance(top, method, 0.5, 6)
    assert attitude_error(after, exact.symmetric_top(top, 3.0)) < 1e-13


def spinning(rad_s: float) -> State:
    return State.create(Body.cube(), angular_velocity=(0.0, rad_s, 0.0))


def norm_after_a_step(method: Integrator, angle_rad: float) -> float:
    """Return the norm of the orientation after one step in which the cube turns by an angle."""
    after = method.step(spinning(angle_rad), derivative_of(none), 0.0, 1.0)
    return float(quaternion.norm(after.orientation)[0])


@EXAMPLES
@given(st.floats(0.01, 6.0))
def test_explicit_euler_stretches_the_quaternion_every_step(angle: float) -> None:
    raw = ExplicitEuler(renormalise=False)
    assert norm_after_a_step(raw, angle) == pytest.approx(math.hypot(1.0, angle / 2.0), rel=1e-15)


@EXAMPLES
@given(st.floats(0.01, 6.0))
def test_runge_kutta_shrinks_the_quaternion_by_its_stability_polynomial(angle: float) -> None:
    z = angle / 2.0
    polynomial = math.sqrt(1.0 - z**6 / 72.0 + z**8 / 576.0)
    assert norm_after_a_step(RAW_RK4, angle) == pytest.approx(polynomial, rel=2e-15, abs=2e-15)


@pytest.mark.parametrize(("stages", "share"), [(False, 1.0), (True, 5.0 / 8.0)])
def test_runge_kutta_loses_the_predicted_norm_before_renormalising(
    stages: bool, share: float
) -> None:
    method = RungeKutta4(renormalise=False, renormalise_stages=stages)
    for angle in (0.05, 0.1, 0.2):
        predicted = share * (angle / 2.0) ** 6 / 144.0
        assert 1.0 - norm_after_a_step(method, angle) == pytest.approx(
            predicted, rel=1e-2, abs=4e-16
        )


def test_the_reports_method_recalculates_whenever_primary_values_change() -> None:
    seen: list[State] = []

    def watching(state: State, t: float) -> Wrench:
        seen.append(state)
        return none(state, t)

    INTEGRATORS["rk4"].step(spinning(2.0), derivative_of(watching), 0.0, 0.5)
    norms = [float(quaternion.norm(state.orientation)[0]) for state in seen]
    assert norms == pytest.approx([1.0] * 4, abs=1e-15)


@pytest.mark.parametrize(("stages", "share"), [(False, 1.0), (True, 3.0 / 8.0)])
def test_runge_kutta_is_late_by_the_predicted_angle(stages: bool, share: float) -> None:
    spin, duration = 3.0, 4.0
    method = RungeKutta4(renormalise_stages=stages)
    for steps in (100, 200, 400):
        dt = duration / steps
        after = advance(spinning(spin), method, dt, steps)
        off = quaternion.to_rotation_vector(
            quaternion.multiply(
                after.orientation,
                quaternion.conjugate(exact.constant_spin(spinning(spin), duration).orientation),
            )
        )
        predicted = share * duration * spin * (dt * spin) ** 4 / 1920.0
        assert off[0].tolist() == pytest.approx([0.0, -predicted, 0.0], rel=1e-2, abs=1e-13)


# --- where they fail -------------------------------------------------------------------------


def bisected(fails: Callable[[float], bool], below: float, above: float) -> float:
    """Return the number between two at which a method begins to fail."""
    assert not fails(below)
    assert fails(above)
    for _ in range(45):
        middle = 0.5 * (below + above)
        below, above = (below, middle) if fails(middle) else (middle, above)
    return above


KUTTA3_REAL_LIMIT = 2.512745326618329
"""Real root of 1 - z + z^2/2 - z^3/6 = -1."""

RUNGE_KUTTA_REAL_LIMIT = 2.785293563405282
"""Real root of 1 - z + z^2/2 - z^3/6 + z^4/24 = 1."""


@pytest.mark.parametrize(
    ("method", "limit"),
    [
        (EXPLICIT_EULER, 2.0),
        (SEMI_IMPLICIT_EULER, 2.0),
        (BUSS2, 2.0),
        (SPLITTING2, 2.0),
        (BUSS3, KUTTA3_REAL_LIMIT),
        (RK4, RUNGE_KUTTA_REAL_LIMIT),
        (LIE_RK4, RUNGE_KUTTA_REAL_LIMIT),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_drag_blows_up_beyond_the_predicted_step(method: Integrator, limit: float) -> None:
    coasting = State.create(Body.cube(), velocity=(1.0, 0.0, 0.0), angular_velocity=(0.0, 1.0, 0.0))
    inertia = float(coasting.body.inertia[0, 0])

    def speeds_up(step: float) -> bool:
        load = total(linear_drag(step), driving_torque((0, 0, 0), step * inertia))
        after = method.step(coasting, derivative_of(load), 0.0, 1.0)
        linear, angular = abs(after.velocity[0, 0]), abs(after.angular_velocity[0, 1])
        assert linear == pytest.approx(angular, rel=1e-12)
        return bool(linear > 1.0)

    assert bisected(speeds_up, 1.0, 4.0) == pytest.approx(limit, rel=1e-9)


def test_runge_kutta_without_renormalising_diverges_above_four_root_two() -> None:
    limit = bisected(lambda angle: norm_after_a_step(RAW_RK4, angle) > 1.0, 4.0, 7.0)
    assert limit == pytest.approx(4.0 * math.sqrt(2.0), rel=1e-9)


def test_runge_kutta_that_renormalises_stays_a_rotation_at_any_step() -> None:
    for angle in (1.0, 5.0, 8.0, 50.0):
        after = advance(spinning(angle), RK4, 1.0, 50)
        assert quaternion.norm(after.orientation)[0] == pytest.approx(1.0, abs=1e-15)


def test_explicit_euler_feeds_every_oscillation_and_the_symplectic_methods_do_not() -> None:
    swinging = State.create(Body.cube(), velocity=(1.0, 0.0, 0.0))

    def energy_after(method: Integrator) -> float:
        after = advance(
            swinging, method, 0.05, 300, load=lambda s, _t: Wrench(-s.position, 0.0 * s.position)
        )
        return float(np.sum(after.position**2 + after.velocity**2))

    # Each explicit step multiplies amplitude^2 by 1 + dt^2.
    assert energy_after(EXPLICIT_EULER) == pytest.approx((1.0 + 0.05**2) ** 300, rel=1e-9)
    for method in (SEMI_IMPLICIT_EULER, SPLITTING2, SPLITTING4):
        assert energy_after(method) == pytest.approx(1.0, abs=0.06)


# --- momentum form against velocity form ------------------------------------------------------


def velocity_form(state: State, dt: float, steps: int, load: Load) -> State:
    """Integrate velocity and angular velocity instead of momenta, by the textbook's Runge-Kutta.

    The other way to write the same equations: m v' = F and I w' = torque - w x (I w).
    """

    def as_state(y: Float64) -> State:
        moved = state.recalculate(position=y[:, :3], orientation=y[:, 6:10], renormalise=False)
        return moved.recalculate(
            momentum=y[:, 3:6] * state.body.mass[:, None],
            angular_momentum=moved.times_inertia(y[:, 10:]),
        )

    def rate(y: Float64, t: float) -> Float64:
        now = as_state(y)
        force, torque = load(now, t)
        omega = y[:, 10:]
        turning = torque - np.cross(omega, now.times_inertia(omega))
        acceleration = force / state.body.mass[:, None]
        spin = quaternion.spin(omega, y[:, 6:10])
        return np.hstack([y[:, 3:6], acceleration, spin, now.over_inertia(turning)])

    y = np.hstack([state.position, state.velocity, state.orientation, state.angular_velocity])
    for k in range(steps):
        t = k * dt
        k1 = rate(y, t)
        k2 = rate(y + 0.5 * dt * k1, t + 0.5 * dt)
        k3 = rate(y + 0.5 * dt * k2, t + 0.5 * dt)
        k4 = rate(y + dt * k3, t + dt)
        y = y + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        y[:, 6:10] = quaternion.normalise(y[:, 6:10])
    return as_state(y)


@EXAMPLES
@given(states(cubes(2)))
def test_on_a_cube_momentum_form_and_velocity_form_are_the_same_but_for_rounding(
    state: State,
) -> None:
    load = total(
        gravity((0, 0, -9.8)),
        push_at((1, 2, -1), (0.1, 0, 0.2)),
        lambda s, _t: Wrench(-0.2 * s.momentum, -0.3 * s.angular_momentum),
    )
    textbook = RungeKutta4(renormalise_stages=False)
    ours = advance(state, textbook, 0.01, 10, load=load)
    other = velocity_form(state, 0.01, 10, load)
    np.testing.assert_allclose(ours.position, other.position, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(ours.momentum, other.momentum, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(ours.angular_velocity, other.angular_velocity, rtol=1e-9, atol=1e-9)
    assert attitude_error(ours, other) < 1e-9


def test_on_a_box_the_forms_agree_to_their_order_and_only_momentum_is_conserved() -> None:
    steps = STEPS[4]
    apart = [
        attitude_error(
            advance(TWO_BOXES, RK4, 1.0 / n, n, load=EVERYTHING),
            velocity_form(TWO_BOXES, 1.0 / n, n, EVERYTHING),
        )
        for n in steps
    ]
    assert slope(steps, apart) == pytest.approx(4.0, abs=0.25)
    free = velocity_form(TWO_BOXES, 0.05, 40, none)
    lost = np.abs(free.angular_momentum - TWO_BOXES.angular_momentum).max()
    assert lost > 1e-6
    ours = advance(TWO_BOXES, RK4, 0.05, 40)
    np.testing.assert_array_equal(ours.angular_momentum, TWO_BOXES.angular_momentum)


# --- the driver ------------------------------------------------------------------------------


@every_method
def test_a_constant_force_is_integrated_exactly_by_every_method_of_order_two(
    method: Integrator,
) -> None:
    body = State.create(Body.cube(mass=2.0), velocity=(1.0, 2.0, 3.0))
    after = advance(body, method, 0.1, 30, load=gravity((0.0, 0.0, -9.8)))
    truth = exact.projectile(body, 3.0, (0.0, 0.0, -9.8))
    # The Euler family is off by g dt T / 2, early or late.
    off = {EXPLICIT_EULER.name: 9.8 * 0.1 * 3.0 / 2.0, SEMI_IMPLICIT_EULER.name: -9.8 * 0.3 / 2.0}
    np.testing.assert_allclose(after.momentum, truth.momentum, rtol=1e-13)
    assert after.position[0, 2] - truth.position[0, 2] == pytest.approx(
        off.get(method.name, 0.0), abs=1e-12
    )


@every_method
def test_keys_are_held_through_the_step_in_which_they_are_pressed(method: Integrator) -> None:
    cube = State.create(Body.cube())
    keys = key_sequence([(0.0, "W"), (0.3, "A"), (0.5, "")], key_force_n=1.0)
    states_ = list(trajectory(cube, method, 0.1, 7, held=keys))
    pushed = np.array([s.momentum[0, :2] for s in states_])
    expected = [[0.1, 0], [0.2, 0], [0.3, 0], [0.3, 0.1], [0.3, 0.2], [0.3, 0.2], [0.3, 0.2]]
    np.testing.assert_allclose(pushed, expected, atol=1e-14)


def test_a_run_may_be_cut_in_two() -> None:
    load = total(spring_in_the_wind, driving_torque())
    keys = key_sequence([(0.2, "WA"), (0.6, "S")])
    whole = advance(TWO_BOXES, RK4, 0.01, 100, load=load, held=keys)
    half = advance(TWO_BOXES, RK4, 0.01, 50, load=load, held=keys)
    again = advance(half, RK4, 0.01, 50, load=load, held=keys, start_s=0.5)
    assert max(errors(again, whole).values()) < 1e-14


def test_the_example_at_the_head_of_the_package_is_true() -> None:
    result = doctest.testmod(rigid_body)
    assert result.attempted > 0
    assert result.failed == 0


def test_a_load_may_be_constant() -> None:
    after = advance(spinning(0.0), RK4, 0.5, 2, load=constant((2, 0, 0), torque=(0, 0, 3)))
    assert after.momentum.tolist() == [[2.0, 0.0, 0.0]]
    assert after.angular_momentum.tolist() == [[0.0, 0.0, 3.0]]


# --- wrong input -----------------------------------------------------------------------------


@every_method
@pytest.mark.parametrize("dt", [-0.01, 0.0, math.nan, math.inf])
def test_a_step_of_no_length_is_refused(method: Integrator, dt: float) -> None:
    with pytest.raises(ValueError, match="dt must be a positive number of seconds"):
        method.step(TWO_BOXES, derivative_of(none), 0.0, dt)
    with pytest.raises(ValueError, match="dt must be a positive number of seconds"):
        advance(TWO_BOXES, method, dt, 1)


def test_a_negative_number_of_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="steps must not be negative, got -1"):
        advance(TWO_BOXES, RK4, 0.1, -1)


def test_a_method_is_found_by_its_name_or_the_nearest_is_suggested() -> None:
    assert integrator("lie_rk4") is LIE_RK4
    with pytest.raises(ValueError, match="did you mean 'splitting4'"):
        integrator("spliting4")
