"""Free motions: what the known answers say, what is conserved, and how MuJoCo and ours compare."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.lab.free import (
    ASYMMETRIC_TOP,
    BENCHMARK_BOX,
    COMPLEX_BOX,
    CONSTANT_SPIN,
    DAMPED_SPIN,
    DRAG,
    FREE_SCENES,
    GRAVITY_M_S2,
    MIDDLE_AXIS,
    PROJECTILE,
    QUANTITIES,
    SIMPLE_BOX,
    SYMMETRIC_TOP,
    Acting,
    FreeScene,
    one_two_five,
)
from roller_env.lab.methods import FREE, MUJOCO, Method, MujocoMethod, RigidBodyMethod
from roller_env.lab.scene import SteadyTrial, measure
from roller_env.rigid_body import (
    EXPLICIT_EULER,
    LIE_RK4,
    RK4,
    SPLITTING2,
    SPLITTING4,
    Integrator,
    State,
    exact,
    quaternion,
)
from tests.rigid_body.bodies import EXAMPLES

MUJOCO_RK4 = MujocoMethod("RK4")
every_scene = pytest.mark.parametrize("scene", FREE_SCENES, ids=lambda scene: scene.name)
every_method = pytest.mark.parametrize("method", FREE, ids=lambda method: method.name)


def errors(scene: FreeScene, method: Method, dt_s: float) -> dict[str, float]:
    trial = scene.trial(method, dt_s)
    trial.run()
    return dict(trial.errors())


# --- the answers are right -------------------------------------------------------------------


@every_scene
def test_the_closed_form_is_what_the_reference_integration_finds(scene: FreeScene) -> None:
    truth = scene.over(1.0).truth
    found = exact.reference(scene.start, 1.0, scene.acting.load())
    assert found.position[0] == pytest.approx(truth.position[-1], rel=1e-11, abs=1e-11)
    assert found.momentum[0] == pytest.approx(truth.momentum[-1], rel=1e-11, abs=1e-11)
    assert quaternion.angle_between(found.rotation[0], truth.rotation[-1]) < 1e-11
    assert found.angular_momentum[0] == pytest.approx(
        truth.angular_momentum[-1], rel=1e-11, abs=1e-11
    )


@every_scene
@every_method
def test_every_method_comes_near_the_answer_with_a_small_step(
    scene: FreeScene, method: Method
) -> None:
    for name, error in errors(scene.over(0.1), method, 2e-3).items():
        assert error < 0.04, name  # a first order method is late by a step or two of fifty


@every_scene
def test_both_fourth_order_methods_agree_to_a_billionth_over_a_second(scene: FreeScene) -> None:
    for method in (MUJOCO_RK4, RigidBodyMethod(LIE_RK4)):
        for name, error in errors(scene.over(1.0), method, 1e-3).items():
            assert error < 1e-9, (method.name, name)


def test_the_published_box_has_the_published_moments() -> None:
    moments = SIMPLE_BOX.start.body.inertia[0]
    assert moments == pytest.approx((0.80833, 0.68333, 0.14167), abs=1e-5)


def test_the_wobble_grows_at_the_rate_of_the_linearised_equations() -> None:
    _, growth = QUANTITIES["growth"]
    predicted = exact.middle_axis_growth_rate(MIDDLE_AXIS.start.body.inertia[0], 2.0)
    assert growth(MIDDLE_AXIS, MIDDLE_AXIS.truth)[0] == pytest.approx(predicted, rel=3e-3)


def test_the_spin_about_the_middle_axis_turns_over_within_the_scene() -> None:
    body_spin = quaternion.rotate_inverse(
        MIDDLE_AXIS.truth.rotation, MIDDLE_AXIS.truth.angular_velocity
    )
    assert body_spin[0, 1] == pytest.approx(2.0, rel=1e-2)
    assert body_spin[:, 1].min() == pytest.approx(-2.0, rel=0.1)


def test_the_reports_cube_nears_ten_radians_a_second() -> None:
    spin = DAMPED_SPIN.truth.angular_velocity[-1]
    assert spin == pytest.approx((10.0 * (1.0 - math.exp(-0.1 * 10.0 * 6.0)), 0.0, 0.0), rel=1e-12)


# --- errors that are known in advance --------------------------------------------------------


@pytest.mark.parametrize("method", MUJOCO[:4], ids=lambda method: method.name)
@pytest.mark.parametrize("dt_s", [0.02, 0.002])
def test_mujocos_euler_family_falls_too_far_by_half_a_step(
    method: MujocoMethod, dt_s: float
) -> None:
    trial = PROJECTILE.trial(method, dt_s)
    trial.run()
    distance = quaternion.norm(PROJECTILE.truth.position).max()
    predicted = -GRAVITY_M_S2[2] * dt_s * PROJECTILE.horizon_s / 2.0
    assert trial.errors()["position"] * distance == pytest.approx(predicted, rel=1e-9)


@pytest.mark.parametrize("dt_s", [0.1, 0.05, 0.02])
def test_runge_kutta_is_late_by_the_predicted_angle_at_constant_spin(dt_s: float) -> None:
    predicted = CONSTANT_SPIN.horizon_s * 3.0 * (3.0 * dt_s) ** 4 / 5120.0
    assert errors(CONSTANT_SPIN, RigidBodyMethod(RK4), dt_s)["attitude"] == pytest.approx(
        predicted, rel=2e-2
    )


@pytest.mark.parametrize("method", [SPLITTING2, SPLITTING4], ids=lambda method: method.name)
def test_a_splitting_is_exact_on_the_symmetric_top(method: Integrator) -> None:
    found = errors(SYMMETRIC_TOP, RigidBodyMethod(method), 0.5)
    assert max(found.values()) < 1e-13


def test_mujocos_runge_kutta_sees_joint_damping_in_its_stages() -> None:
    coarse, fine = (errors(DRAG.over(1.0), MUJOCO_RK4, dt)["velocity"] for dt in (0.02, 0.01))
    assert coarse / fine == pytest.approx(16.0, rel=0.1)


def test_implicitfast_loses_a_tumbling_boxs_energy_and_euler_gains_it() -> None:
    weightless = replace(
        COMPLEX_BOX,
        start=State.create(BENCHMARK_BOX, angular_velocity=(0.1, 5.0, 0.1)),
        acting=Acting(),
    )

    def energy_ratio(method: MujocoMethod) -> float:
        trial = weightless.trial(method, 1e-3)
        trial.run()
        before, after = weightless.start.kinetic_energy(), trial.reached.kinetic_energy()
        return float(after[-1] / before[0])

    assert energy_ratio(MujocoMethod("Euler")) == pytest.approx(1.024, abs=0.002)
    assert energy_ratio(MujocoMethod("implicitfast")) == pytest.approx(0.976, abs=0.002)


@EXAMPLES
@given(st.floats(0.001, 0.05), st.integers(1, 4))
def test_ours_conserves_angular_momentum_at_any_step(dt_s: float, steps: int) -> None:
    scene = ASYMMETRIC_TOP.over(10.0 * dt_s * steps)
    for method in (EXPLICIT_EULER, SPLITTING2):
        assert errors(scene, RigidBodyMethod(method), dt_s)["angular_momentum"] == 0.0


# --- where methods fail ----------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(DRAG.limits_s))
def test_drag_blows_up_just_beyond_the_predicted_step(name: str) -> None:
    method = next(one for one in FREE if one.name == name)

    def speed_error(share: float) -> float:
        dt_s = share * DRAG.limits_s[name]
        return errors(DRAG.over(10.0 * 40 * dt_s), method, dt_s)["velocity"]

    assert speed_error(0.99) < 1.0
    assert not speed_error(1.03) < 1e3


def test_a_failed_run_is_a_point_that_says_so_and_not_an_exception() -> None:
    (shown, *_) = measure(DRAG, RigidBodyMethod(EXPLICIT_EULER), 1.0, 1)
    assert shown["failed"]
    assert shown["error"] > 1.0


# --- the scenes as such ----------------------------------------------------------------------


@every_scene
def test_every_time_step_of_a_scene_divides_the_time_between_its_moments(scene: FreeScene) -> None:
    assert list(scene.time_steps_s) == sorted(scene.time_steps_s, reverse=True)
    for dt_s in scene.time_steps_s:
        assert scene.steps_to_a_moment(dt_s) * dt_s == pytest.approx(scene.moment_s)


@pytest.mark.parametrize("dt_s", [0.3, 0.0, -0.1, 2.0, math.nan])
def test_a_time_step_that_does_not_fit_is_refused(dt_s: float) -> None:
    with pytest.raises(ValueError, match=r"drag: the time step must divide 1 s .* found"):
        DRAG.trial(MUJOCO_RK4, dt_s)


def test_a_trial_can_be_run_again_with_the_same_result() -> None:
    for method in (MUJOCO_RK4, RigidBodyMethod(RK4)):
        trial = COMPLEX_BOX.over(1.0).trial(method, 0.02)
        assert isinstance(trial, SteadyTrial)
        trial.run()
        once = trial.errors()
        trial.run_part()
        trial.run()
        assert trial.errors() == once


def test_time_steps_are_one_two_and_five_times_powers_of_ten() -> None:
    assert one_two_five(0.5, 0.01) == (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
    assert one_two_five(1.0, 1e-4)[-3:] == (5e-4, 2e-4, 1e-4)
