"""What every contact scene promises to the runner."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roller_env.lab.contact import CONTACT_SCENES
from roller_env.lab.contact.rolling import Skid
from roller_env.lab.contact.scene import ContactScene, steps_of
from roller_env.lab.methods import RIGID_BODY, MujocoMethod, without_warnings
from roller_env.lab.scene import SteadyTrial, measure

SCENES = {scene.name: scene for scene in CONTACT_SCENES}
scenes = pytest.mark.parametrize("scene", CONTACT_SCENES, ids=SCENES)


def test_no_two_scenes_have_one_name() -> None:
    assert len(SCENES) == len(CONTACT_SCENES)


@scenes
def test_time_steps_are_1_2_5_and_end_where_the_scene_ends(scene: ContactScene) -> None:
    steps = list(scene.time_steps_s)
    assert steps == sorted(steps, reverse=True)
    for dt_s in steps:
        assert round(dt_s / 10.0 ** math.floor(math.log10(dt_s) + 1e-9)) in (1, 2, 5)
        assert steps_of(scene.horizon_s, dt_s) * dt_s == pytest.approx(scene.horizon_s)


@scenes
def test_a_trial_tells_how_much_of_the_horizon_is_timed(scene: ContactScene) -> None:
    dt_s = scene.time_steps_s[0]
    trial = scene.trial(scene.methods[0], dt_s)
    assert isinstance(trial, SteadyTrial)
    assert 0.0 < trial.part_s <= scene.horizon_s + 1e-9
    assert trial.model.opt.timestep == dt_s


@pytest.mark.parametrize(
    ("name", "dt_s"),
    [
        ("incline", 0.01),
        ("skid-45", 0.005),
        ("bounce", 0.005),
        ("restitution", 0.002),
        ("rolling-xy", 0.02),
        ("bouncing", 0.05),
        ("666", 0.05),
    ],
)
def test_what_is_timed_are_the_same_steps_as_what_is_judged(name: str, dt_s: float) -> None:
    scene = SCENES[name]
    trial = scene.trial(MujocoMethod("implicitfast"), dt_s)
    assert list(trial.errors()) == [one.name for one in scene.measures]
    assert trial.path.time[-1] == pytest.approx(scene.horizon_s)
    trial.run_part()
    begin_s = 1.0 if name == "666" else 0.0
    end = round((begin_s + trial.part_s) / dt_s)
    np.testing.assert_array_equal(trial.data.qpos, trial.path.qpos[end])
    np.testing.assert_array_equal(trial.data.qvel, trial.path.qvel[end])


def test_a_trial_can_be_run_again() -> None:
    trial = SCENES["bounce"].trial(MujocoMethod("RK4"), 0.002)
    first = dict(trial.errors())
    trial.run_part()
    trial.run()
    assert trial.errors() == first


def test_a_method_that_errs_too_much_is_reported_as_failed() -> None:
    """Contact damping B takes the Euler family to h = 2 / B, 9.3 ms for the game's contact."""
    skid = SCENES["skid-0"]
    assert isinstance(skid, Skid)
    coarse = measure(skid, MujocoMethod("Euler"), 0.01, repeats=1)
    fine = measure(skid, MujocoMethod("Euler"), 0.005, repeats=1)
    assert all(point["failed"] for point in coarse)
    assert not any(point["failed"] for point in fine)


def test_a_simulation_that_diverges_is_reported_as_failed_with_no_number() -> None:
    """Euler takes the damping of a servo whose force has no limit to 4.1 ms."""
    scene = SCENES["gate-push"]
    trial = scene.trial(MujocoMethod("Euler"), 0.02)
    trial.model.actuator_forcelimited[:] = 0
    with without_warnings():
        errors = trial.errors()
    assert set(errors) == {one.name for one in scene.measures}
    assert all(math.isnan(error) for error in errors.values())


def test_an_error_beyond_the_scenes_limit_is_a_failure() -> None:
    with without_warnings():
        far, near = (
            measure(SCENES["bounce"], MujocoMethod("Euler"), dt_s, repeats=1)[0]
            for dt_s in (0.02, 0.001)
        )
    assert far["failed"]
    assert not near["failed"]


def test_the_rigid_body_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"push: found method 'ours explicit_euler'.*MuJoCo RK4"):
        SCENES["push"].trial(RIGID_BODY[0], 0.01)


@pytest.mark.parametrize("dt_s", [0.0, -0.01, 3.0, math.nan])
def test_a_step_that_is_none_is_refused(dt_s: float) -> None:
    with pytest.raises(ValueError, match="dt_s: found"):
        SCENES["push"].trial(MujocoMethod("RK4"), dt_s)


def test_a_step_that_does_not_end_with_the_scene_is_refused_with_one_that_does() -> None:
    with pytest.raises(ValueError, match=r"found 0\.03.*2 s; the nearest that fits is 0\.0298507"):
        SCENES["push"].trial(MujocoMethod("RK4"), 0.03)
