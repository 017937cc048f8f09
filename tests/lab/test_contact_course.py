"""The game's own levels, movers and keys as scenes."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np
import pytest

from roller_env.game.actions import KEY_FORCE_N
from roller_env.lab.contact.course import (
    COURSE,
    GATE_PUSH,
    GameScene,
    played_plan,
)
from roller_env.lab.contact.scene import ContactScene
from roller_env.lab.methods import MUJOCO, MujocoMethod, without_warnings
from roller_env.lab.scene import Measure

GameSceneType = TypeVar("GameSceneType", bound=GameScene)


def until(scene: GameSceneType, moment_s: float) -> GameSceneType:
    """Return the scene until an early moment, where the reference is cheap."""
    measures = (Measure("position", "", "discretisation"),)
    return replace(
        scene,
        horizon_s=moment_s,
        moments_s=(moment_s,),
        measures=measures,
        reference_step_s=8e-5,
    )


def test_the_keys_go_through_the_games_rules() -> None:
    """They push, and the plate that the ball is driven onto sinks."""
    plan = played_plan("classic", COURSE.keys)
    assert sum(seconds for seconds, _ in plan) == pytest.approx(COURSE.horizon_s)
    force = np.array([ctrl[:2] for _, ctrl in plan])
    np.testing.assert_allclose(np.unique(force), [-KEY_FORCE_N, 0.0, KEY_FORCE_N])
    movers = np.array([ctrl[3:] for _, ctrl in plan])
    assert not movers[0].any()
    assert (movers[-1] < 0.0).any()


def test_before_any_impact_the_euler_family_is_ahead_by_h_over_t_and_rk4_is_exact() -> None:
    drive = until(replace(COURSE, keys=(("w", 1.0),)), 1.0)
    way = 0.5 * KEY_FORCE_N / 1.4
    for method in MUJOCO:
        error = drive.trial(method, 0.002).errors()["position"]
        if method == MujocoMethod("RK4"):
            assert error < 1e-8
        else:
            assert error == pytest.approx(0.002 * way, rel=1e-3)


def test_the_servo_takes_each_integrator_as_far_as_predicted() -> None:
    """Frequency 200 rad/s, ratio 1: Euler to .83 / 200 = 4.1 ms, implicitfast to 24 ms."""
    push = until(GATE_PUSH, 1.0)
    unlimited = push.trial(MujocoMethod("Euler"), 0.005)
    unlimited.model.actuator_forcelimited[:] = 0
    with without_warnings():
        assert not unlimited.errors()["position"] < push.failure
    # The game's servos have a limit of force, which keeps the blow-up small.
    assert push.trial(MujocoMethod("Euler"), 0.005).errors()["position"] < 0.01
    for method in (MujocoMethod("Euler"), MujocoMethod("implicitfast"), MujocoMethod("RK4")):
        assert push.trial(method, 0.002).errors()["position"] < 0.01
    assert push.trial(MujocoMethod("implicitfast"), 0.005).errors()["position"] < 0.01


def test_the_ball_is_pressed_against_the_gate_until_it_has_sunk() -> None:
    path = GATE_PUSH.trial(MujocoMethod("implicitfast"), 0.002).path
    x = path.qpos[:, 0]
    assert np.ptp(x[path.time < 2.4]) < 2e-3
    assert x[-1] - x[0] > 0.2


@pytest.mark.parametrize("scene", [GATE_PUSH, COURSE], ids=lambda scene: scene.name)
def test_the_contacts_are_the_same_at_every_step(scene: ContactScene) -> None:
    models = [scene.trial(MujocoMethod("RK4"), dt_s).model for dt_s in (0.005, 0.001)]
    np.testing.assert_array_equal(models[0].geom_solref, models[1].geom_solref)
    np.testing.assert_array_equal(models[0].geom_solimp, models[1].geom_solimp)
    assert (models[0].geom_solref[models[0].geom_priority == 1] < 0.0).all(), "direct form"
