"""SimBenchmark's measures by hand and against its own published numbers."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path as File
from typing import Any

import numpy as np
import pytest
from pandas import read_csv

from roller_env.arrays import Float64
from roller_env.lab.contact.simbenchmark import (
    BOUNCING,
    DROPPED_PILE,
    PILE,
    ROLLING_XY,
    ROLLING_Y,
    SCENES,
    Rolling,
    squared_penetration,
)
from roller_env.lab.methods import MujocoMethod
from roller_env.lab.simulate import Path

EULER = MujocoMethod("Euler")

PUBLISHED = read_csv(File(__file__).with_name("simbenchmark.csv"))
"""SimBenchmark's data without error reduction: ``test`` (the scene that it belongs beside),
``engine`` (with solver and integrator where there was a choice), ``dt_s``, ``error`` (its measure;
infinite where the simulation blew up) and ``wall_s`` (CPU seconds of its machine of 2018).

From ``data/rolling/default.csv``, ``data/bouncing/sample.csv``, ``data/666/sample.csv``.
"""

NAMED = {scene.name: scene for scene in SCENES}


def published(test: str, engine: str, dt_s: float) -> Any:
    (row,) = [
        one
        for one in PUBLISHED.itertuples()
        if (one.test, one.engine, one.dt_s) == (test, engine, dt_s)
    ]
    return row


def test_every_published_row_stands_beside_a_scene() -> None:
    assert set(PUBLISHED.test) == set(NAMED)
    for row in PUBLISHED.itertuples():
        assert row.dt_s in NAMED[row.test].time_steps_s


def test_the_box_and_the_balls_accelerate_as_worked_out_by_hand() -> None:
    """f1 = 0.4 * 35 * 9.81 = 137.34 N; f2 = 12.66 / 10 / (3.5 + 2.5) = 0.211 N."""
    box, ball = ROLLING_Y.accelerations_m_s2
    assert box == pytest.approx((150.0 - 137.34 - 25 * 0.211) / 10.0)
    assert ball == pytest.approx(0.211)


def rolled(scene: Rolling, time: Float64, box: Float64, ball: Float64) -> float:
    """Return the error of a box and a first ball of these velocities."""
    qvel = np.hstack([box, np.zeros_like(box), ball])
    return scene.judge(Path(time, np.empty((len(time), 0)), qvel), EULER)["velocity"]


@pytest.mark.parametrize("scene", [ROLLING_Y, ROLLING_XY], ids=lambda scene: scene.name)
def test_exact_velocities_have_no_error(scene: Rolling) -> None:
    time = np.linspace(0.0, 1.0, 11)
    way = np.array([*scene.direction, 0.0])
    box, ball = (np.multiply.outer(a * time, way) for a in scene.accelerations_m_s2)
    assert rolled(scene, time, box, ball) == pytest.approx(0.0, abs=1e-30)
    box[3] += (0.1, 0.0, -0.2)
    assert rolled(scene, time, box, ball) == pytest.approx(0.05 / 10)


def test_a_box_that_does_not_move_has_the_error_published_for_those_that_did_not() -> None:
    """ODE's and DART's friction pyramids held the box; their figure is the closed form's."""
    time = np.linspace(0.0, 4.0, 4001)
    still = np.zeros((4001, 3))
    row = published("rolling-xy", "ODE quick", 1e-3)
    assert rolled(ROLLING_XY, time, still, still) == pytest.approx(row.error, rel=2e-6)


@pytest.mark.parametrize("scene", [ROLLING_Y, ROLLING_XY], ids=lambda scene: scene.name)
def test_rolling_errs_as_mujoco_150_did(scene: Rolling) -> None:
    """The box hops on its soft contact as it slides, so the figure is one of a band.

    SimBenchmark's own rows of one integrator spread by 1.4 with solver and tolerance.
    """
    row = published(scene.name, "MuJoCo 1.50 CG Euler", 1e-3)
    error = scene.trial(MujocoMethod("Euler"), 1e-3).errors()["velocity"]
    assert row.error / 1.5 < error < row.error * 1.5


def test_the_pyramidal_cone_lets_the_box_run_away_unless_pushed_along_an_edge() -> None:
    method = MujocoMethod("Euler", "pyramidal")
    assert ROLLING_Y.trial(method, 0.01).errors()["velocity"] < ROLLING_Y.failure
    assert ROLLING_XY.trial(method, 0.01).errors()["velocity"] > 10.0 * ROLLING_XY.failure


def test_the_energy_error_by_hand() -> None:
    """Two samples count and the last does not; in one every ball is 1 mm high and spins."""
    assert BOUNCING.energy_j == pytest.approx(24034.5)
    qpos, qvel = np.zeros((3, 49, 7)), np.zeros((3, 49, 6))
    qpos[:, :, 2] = [[5.0], [5.0 + 1e-3], [-1.0]]
    qvel[1, :, 3] = 2.0
    path = Path(np.arange(3.0), qpos.reshape(3, -1), qvel.reshape(3, -1))
    off = 49 * (10.0 * 9.81 * 1e-3 + 0.5 * (0.4 * 10.0 * 0.1**2) * 4.0)
    assert BOUNCING.judge(path, EULER)["energy"] == pytest.approx(off**2 / 2.0)


def test_the_games_elasticity_closes_the_row_that_mujoco_lacked() -> None:
    """As the Euler engines of the published table, whose flights have the same error."""
    error = BOUNCING.trial(MujocoMethod("Euler"), 0.01).errors()["energy"]
    assert error < published("bouncing", "Bullet", 1e-2).error
    assert error < published("bouncing", "DART Dantzig", 1e-2).error


def test_the_discrete_integrator_loses_the_energy() -> None:
    errors = BOUNCING.trial(MujocoMethod("discrete"), 0.02).errors()
    assert errors["energy"] > BOUNCING.failure


def test_the_penetration_by_hand() -> None:
    """Balls of 0.1 m: two 0.15 m apart, the third 0.05 m into the ground and far away."""
    centres = np.array([[0.0, 0.0, 1.0], [0.15, 0.0, 1.0], [5.0, 5.0, 0.05]])
    assert squared_penetration(centres, 0.1) == pytest.approx(0.05**2 + 0.05**2)


def test_all_balls_at_the_origin_by_hand() -> None:
    assert math.comb(216, 2) == 23_220
    assert DROPPED_PILE.empty_sample_m2 == pytest.approx(23_220 * 0.2**2 + 216 * 0.1**2)


def test_the_published_666_of_mujoco_is_its_empty_first_sample() -> None:
    row = published("666-dropped", "MuJoCo 1.50 CG Euler", 1e-2)
    errors = DROPPED_PILE.trial(MujocoMethod("Euler"), 1e-2).errors()
    assert errors["as_published"] == pytest.approx(row.error, rel=2e-3)
    assert errors["penetration"] < row.error / 200.0


def test_the_pile_overlaps_less_than_with_the_rigid_contacts_published() -> None:
    error = PILE.trial(MujocoMethod("Euler"), 1e-2).errors()["penetration"]
    assert error < published("666", "RaiSim", 1e-2).error / 10.0


def test_the_pile_begins_without_overlap_and_the_same_every_time() -> None:
    short = replace(PILE, horizon_s=2.0)
    one, two = (short.trial(MujocoMethod("Euler"), 0.02).path.qpos for _ in range(2))
    np.testing.assert_array_equal(one, two)
    assert squared_penetration(one[0].reshape(216, 7)[:, :3], 0.1) == 0.0
