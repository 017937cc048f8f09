"""The batch stepper is nothing but many `mj_step` loops."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roller_env.compile.compiled import CompiledLevel, compile_level
from roller_env.physics.stepper import Stepper
from tests.builders import Float64, make_level, q, resting

WORLDS, SUBSTEPS, ROUNDS = 5, 7, 12


@pytest.fixture(scope="module")
def compiled() -> CompiledLevel:
    """A ball between a plate, a gate and two walls: every kind of contact and of actuator."""
    gate = {"name": "gate", "at": (2.0, 0.0, 0.5), "size": (0.2, 3.0, 1.0), "lowers_to": -1.0}
    plate = {
        "name": "plate",
        "at": (-0.5, 0.0, -0.2),
        "size": (1.0, 1.0, 0.6),
        "opens": ["gate"],
        "sinks_to": -0.4,
    }
    walls = [
        {"start": (-3.0, 1.5), "end": (3.0, 1.5), "bottom": 0.0, "height": 1.0},
        {"start": (-3.0, -1.5), "end": (3.0, -2.5), "bottom": 0.0, "height": 1.0},
    ]
    start = {"at": resting(1.0)}
    return compile_level(make_level(gates=[gate], plates=[plate], walls=walls, start=start))


def random_controls(model: mujoco.MjModel, rng: np.random.Generator) -> Float64:
    controls = rng.uniform(-1.0, 1.0, (ROUNDS, WORLDS, model.nu))
    controls[:, :, :3] *= 30.0
    return controls


def plain_loop(model: mujoco.MjModel, controls: Float64) -> Float64:
    """Return the state after every round of one world, stepped by `mj_step`."""
    data = mujoco.MjData(model)
    spec = mujoco.mjtState.mjSTATE_INTEGRATION
    states = np.empty((len(controls), mujoco.mj_stateSize(model, spec)))
    for index, control in enumerate(controls):
        data.ctrl[:] = control
        for _ in range(SUBSTEPS):
            mujoco.mj_step(model, data)
        mujoco.mj_getState(model, data, states[index], spec)
    return states


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_stepping_is_bit_for_bit_a_plain_mj_step_loop(
    compiled: CompiledLevel, threads: int
) -> None:
    controls = random_controls(compiled.model, np.random.default_rng(1))
    stepper = Stepper(compiled.model, WORLDS, SUBSTEPS, threads)
    for index in range(ROUNDS):
        stepper.ctrl[:] = controls[index]
        stepper.advance()
        for world in range(WORLDS):
            expected = plain_loop(compiled.model, controls[: index + 1, world])[-1]
            if index == ROUNDS - 1:
                np.testing.assert_array_equal(stepper.state[world], expected)


def test_stepping_some_worlds_is_bit_for_bit_the_same_and_leaves_the_others(
    compiled: CompiledLevel,
) -> None:
    rng = np.random.default_rng(2)
    controls = random_controls(compiled.model, rng)
    stepper = Stepper(compiled.model, WORLDS, SUBSTEPS, 2)
    taken: list[list[Float64]] = [[] for _ in range(WORLDS)]
    for index in range(ROUNDS):
        rows = np.flatnonzero(rng.random(WORLDS) < 0.5)
        others = np.setdiff1d(np.arange(WORLDS), rows)
        before = stepper.state[others].copy()
        stepper.ctrl[rows] = controls[index, rows]
        stepper.advance(rows)
        np.testing.assert_array_equal(stepper.state[others], before)
        for row in rows:
            taken[row].append(controls[index, row])
    for world in range(WORLDS):
        assert taken[world], "every world was stepped at least once"
        expected = plain_loop(compiled.model, np.array(taken[world]))[-1]
        np.testing.assert_array_equal(stepper.state[world], expected)


@pytest.mark.parametrize("rows", [None, np.array([1, 3])])
def test_the_path_holds_the_position_before_the_first_and_after_every_substep(
    compiled: CompiledLevel, rows: np.ndarray | None
) -> None:
    stepper = Stepper(compiled.model, WORLDS, SUBSTEPS, 1)
    stepper.ctrl[:] = random_controls(compiled.model, np.random.default_rng(3))[0]
    chosen = np.arange(WORLDS) if rows is None else rows
    first = stepper.qpos[chosen].copy()
    path = stepper.advance(rows)
    assert path.shape == (len(chosen), SUBSTEPS + 1, compiled.model.nq)
    np.testing.assert_array_equal(path[:, 0], first)
    np.testing.assert_array_equal(path[:, -1], stepper.qpos[chosen])
    data = mujoco.MjData(compiled.model)
    data.ctrl[:] = stepper.ctrl[chosen[0]]
    for substep in range(SUBSTEPS):
        mujoco.mj_step(compiled.model, data)
        np.testing.assert_array_equal(path[0, substep + 1], data.qpos)


def test_a_state_row_copied_back_brings_back_the_same_future(compiled: CompiledLevel) -> None:
    stepper = Stepper(compiled.model, 2, SUBSTEPS, 1)
    stepper.ctrl[:, 0] = 20.0
    for _ in range(5):
        stepper.advance()
    kept = stepper.state[0].copy()
    future = [stepper.advance()[0].copy() for _ in range(5)]
    stepper.reset(np.array([1]))
    stepper.state[1] = kept
    for expected in future:
        np.testing.assert_array_equal(stepper.advance(np.array([1]))[0], expected)


def test_a_world_that_diverges_is_reported_and_its_neighbours_do_not_notice(
    compiled: CompiledLevel, tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(str(tmp_path))  # MuJoCo writes its warnings to a log in the current directory
    healthy = Stepper(compiled.model, WORLDS, SUBSTEPS, 2)
    stepper = Stepper(compiled.model, WORLDS, SUBSTEPS, 2)
    stepper.qvel[2, 0] = np.nan
    for _ in range(4):
        healthy.advance()
        stepper.advance()
    np.testing.assert_array_equal(stepper.diverged(), [False, False, True, False, False])
    others = [0, 1, 3, 4]
    np.testing.assert_array_equal(stepper.state[others], healthy.state[others])
    stepper.reset(np.array([2]))
    assert not stepper.diverged().any()
    stepper.advance()
    assert np.isfinite(stepper.qpos).all()


def test_a_world_with_enormous_speed_is_reported_too(
    compiled: CompiledLevel, tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(str(tmp_path))
    stepper = Stepper(compiled.model, 2, SUBSTEPS, 1)
    stepper.qvel[1, 0] = 1e12
    stepper.advance()
    np.testing.assert_array_equal(stepper.diverged(), [False, True])


def test_rays_measure_the_way_to_the_first_surface_and_pass_through_the_ball() -> None:
    walls = [
        {"start": (3.0, -5.0), "end": (3.0, 5.0), "bottom": 0.0, "height": 1.0, "thickness": 0.5}
    ]
    compiled = compile_level(make_level(walls=walls))
    stepper = Stepper(compiled.model, 2, 1, 1)
    stepper.qpos[1, 0] = 1.0
    origins = stepper.qpos[:, None, :3].repeat(3, axis=1)
    directions = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    distances = stepper.rays(origins, directions, compiled.ball_body)
    height = float(stepper.qpos[0, 2])
    np.testing.assert_allclose(distances[0], [2.75, height, np.inf])
    np.testing.assert_allclose(distances[1], [1.75, height, np.inf])
    only_second = stepper.rays(origins[1:], directions, compiled.ball_body, np.array([1]))
    np.testing.assert_array_equal(only_second, distances[1:])


def test_rays_see_a_gate_where_it_is_now() -> None:
    gate = {"name": "gate", "at": (2.0, 0.0, 0.5), "size": (0.2, 3.0, 1.0), "lowers_to": -1.0}
    plate = {
        "name": "plate",
        "at": (-3.0, 0.0, 0.4),
        "size": (1.0, 1.0, 0.8),
        "opens": ["gate"],
        "sinks_to": 0.0,
    }
    compiled = compile_level(make_level(gates=[gate], plates=[plate]))
    stepper = Stepper(compiled.model, 2, 1, 1)
    stepper.qpos[1, compiled.gate_qpos[0]] = -1.0
    forward = np.array([[1.0, 0.0, 0.0]])
    origins = stepper.qpos[:, None, :3].copy()
    distances = stepper.rays(origins, forward, compiled.ball_body)
    np.testing.assert_allclose(distances[:, 0], [1.9, np.inf])


def test_looking_does_not_change_what_happens(compiled: CompiledLevel) -> None:
    steppers = [Stepper(compiled.model, 2, SUBSTEPS, 1) for _ in range(2)]
    forward = np.array([[1.0, 0.0, 0.0]])
    for _ in range(10):
        for stepper in steppers:
            stepper.ctrl[:, 0] = 20.0
            stepper.advance()
        steppers[0].rays(steppers[0].qpos[:, None, :3].copy(), forward, compiled.ball_body)
    np.testing.assert_array_equal(steppers[0].state, steppers[1].state)


def test_quants_place_the_ball_where_the_original_would() -> None:
    compiled = compile_level(make_level(start={"at": q(100.0, 0.0, 50.0)}))
    stepper = Stepper(compiled.model, 1, 1, 1)
    np.testing.assert_allclose(stepper.qpos[0, :3], [2.54, 0.0, 1.27])
