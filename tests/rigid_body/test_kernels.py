"""The compiled loops: the numbers that NumPy gave before them, and the same on every way to run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from roller_env.rigid_body import (
    INTEGRATORS,
    RK4,
    Body,
    Integrator,
    Load,
    PiecewiseConstantForce,
    State,
    Wrench,
    advance,
    constant,
    driving_torque,
    gravity,
    key_sequence,
    linear_drag,
    on_axle,
    push_at,
    quaternion,
    total,
    trajectory,
)
from roller_env.rigid_body.arrays import Float64
from roller_env.rigid_body.forces import BuiltInLoad
from roller_env.rigid_body.integrators import ExplicitEuler, RungeKutta4

NUMPY: Final = json.loads(Path(__file__).with_name("numpy_results.json").read_text())
"""{method: {run: primary values after 40 steps of 20 ms}}, from the NumPy loops that these replace
(the commit before this test): position, momentum, orientation and angular momentum, a row a body.
"""

BOXES = State.create(
    Body.box([(0.1, 0.4, 0.9), (0.5, 0.6, 0.8)], (10.0, 2.0)),
    position=[(0.3, -0.2, 0.5), (0.0, 0.4, 0.1)],
    velocity=[(-0.9, 0.4, 0.1), (0.5, -0.3, 1.0)],
    orientation=[(0.5, 0.5, -0.5, 0.5), (1.0, 0.0, 0.0, 0.0)],
    angular_velocity=[(1.0, -2.0, 1.5), (2.0, 1.0, -1.0)],
)
CUBES = State.create(
    Body.cube([1.0, 0.5], (1.0, 3.0)),
    velocity=(1.0, 2.0, 3.0),
    angular_velocity=(3.0, -5.0, 2.0),
    orientation=(0.8, 0.2, -0.4, 0.4),
)
EVERY_LOAD: Load = total(
    gravity((0.0, 0.0, -2.0)),
    constant((0.3, 0.1, 0.0), (0.01, -0.02, 0.03)),
    linear_drag((1.5, 0.6)),
    driving_torque((0.1, 0.05, -0.1), (0.05, 0.02)),
    push_at((0.4, -0.2, 0.3), (0.05, 0.1, -0.2), in_body=True),
    push_at([(0.1, 0.2, 0.3), (-0.2, 0.1, 0.0)], (0.0, 0.1, 0.1)),
)
AXLE: Load = on_axle(
    total(driving_torque(), push_at((0.0, 0.5, 0.0), (0.3, 0.0, 0.1))), (1.0, 2.0, -1.0)
)
KEYS = key_sequence([(0.0, "W"), (0.25, "WA"), (0.61, "D")])

RUNS: Final[dict[str, tuple[State, Load, PiecewiseConstantForce | None]]] = {
    "boxes, every load, keys": (BOXES, EVERY_LOAD, KEYS),
    "cubes, every load, keys": (CUBES, EVERY_LOAD, KEYS),
    "boxes on an axle": (BOXES, AXLE, None),
    "free boxes": (BOXES, total(), None),
}
METHODS: Final[dict[str, Integrator]] = {
    **INTEGRATORS,
    "rk4, textbook": RungeKutta4(renormalise_stages=False),
    "rk4, raw": RungeKutta4(renormalise=False, renormalise_stages=False),
    "explicit_euler, raw": ExplicitEuler(renormalise=False),
}


def users_own(load: Load) -> Load:
    """Return a load that is no built-in one, and does the same."""

    def mine(state: State, t: float) -> Wrench:
        return load(state, t)

    return mine


def primary(state: State) -> Float64:
    return np.hstack([state.position, state.momentum, state.orientation, state.angular_momentum])


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize("method", NUMPY)
def test_compiled_methods_and_loads_give_what_numpy_gave(method: str, run: str) -> None:
    state, load, held = RUNS[run]
    after = primary(advance(state, METHODS[method], 0.02, 40, load=load, held=held))
    numpys = np.array(NUMPY[method][run])
    np.testing.assert_allclose(after, numpys, rtol=0.0, atol=2e-14 * np.abs(numpys).max())


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize("method", METHODS)
def test_a_load_of_ones_own_is_integrated_like_a_built_in_one(method: str, run: str) -> None:
    state, load, held = RUNS[run]
    compiled = advance(state, METHODS[method], 0.02, 10, load=load, held=held)
    python = advance(state, METHODS[method], 0.02, 10, load=users_own(load), held=held)
    # Each way adds the keys to the other forces at a moment of its own, which rounds differently.
    np.testing.assert_allclose(primary(compiled), primary(python), rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("method", METHODS)
def test_a_trajectory_is_the_same_steps_one_by_one(method: str) -> None:
    *_, last = trajectory(BOXES, METHODS[method], 0.02, 10, load=EVERY_LOAD, held=KEYS)
    at_once = advance(BOXES, METHODS[method], 0.02, 10, load=EVERY_LOAD, held=KEYS)
    np.testing.assert_array_equal(primary(last), primary(at_once))


def test_no_step_changes_nothing() -> None:
    raw = BOXES.recalculate(orientation=2.0 * BOXES.orientation, renormalise=False)
    assert advance(raw, RK4, 0.1, 0, load=EVERY_LOAD) is raw


def test_sums_and_axles_of_built_in_loads_are_built_in_and_of_others_are_not() -> None:
    mine = users_own(gravity((0.0, 0.0, -1.0)))
    assert isinstance(on_axle(total(EVERY_LOAD, gravity((0, 0, 1))), (0, 0, 1)), BuiltInLoad)
    assert not isinstance(total(EVERY_LOAD, mine), BuiltInLoad)
    assert not isinstance(on_axle(mine, (0, 0, 1)), BuiltInLoad)


def test_an_axle_in_an_axle_lets_through_what_both_do() -> None:
    load = on_axle(on_axle(EVERY_LOAD, (1.0, 1.0, 0.0)), (1.0, 0.0, 0.0))
    torque = EVERY_LOAD(BOXES, 0.0).torque
    along = 0.5 * (torque[:, 0] + torque[:, 1])
    wrench = load(BOXES, 0.0)
    np.testing.assert_allclose(wrench.torque[:, 0], along, rtol=1e-15)
    assert not wrench.torque[:, 1:].any()
    assert not wrench.force.any()


def test_a_built_in_load_serves_any_number_of_bodies_one_after_the_other() -> None:
    weight = gravity((0.0, 0.0, -2.0))
    assert weight(CUBES, 0.0).force[:, 2].tolist() == [-2.0, -6.0]
    assert weight(CUBES.take([1]), 0.0).force[:, 2].tolist() == [-6.0]
    assert weight(BOXES, 0.0).force[:, 2].tolist() == [-20.0, -4.0]


# --- momentum in body axes -------------------------------------------------------------------


def test_momentum_in_body_axes_is_carried_to_the_last_bit() -> None:
    method = INTEGRATORS["rk4_body"]
    halfway = advance(BOXES, method, 0.01, 50)
    np.testing.assert_array_equal(
        primary(advance(halfway, method, 0.01, 50)), primary(advance(BOXES, method, 0.01, 100))
    )
    own = quaternion.rotate_inverse(halfway.rotation, halfway.angular_momentum)
    np.testing.assert_allclose(halfway.body_angular_momentum, own, rtol=1e-14)
    taken = halfway.take([1]).body_angular_momentum
    np.testing.assert_array_equal(taken, halfway.body_angular_momentum[1:])


def test_a_state_that_is_turned_or_spun_forgets_the_momentum_that_was_carried() -> None:
    state = advance(BOXES, INTEGRATORS["rk4_body"], 0.01, 5)
    twice = state.recalculate(angular_momentum=2.0 * state.angular_momentum)
    np.testing.assert_allclose(
        twice.body_angular_momentum, 2.0 * state.body_angular_momentum, rtol=1e-14
    )
    upright = state.recalculate(orientation=quaternion.identity(2))
    np.testing.assert_array_equal(upright.body_angular_momentum, state.angular_momentum)
    moved = state.recalculate(position=np.zeros((2, 3)))
    np.testing.assert_array_equal(moved.body_angular_momentum, state.body_angular_momentum)


def test_body_axes_lose_a_free_bodys_momentum_which_world_axes_keep() -> None:
    lost = {
        name: np.abs(
            advance(BOXES, INTEGRATORS[name], 0.02, 100).angular_momentum - BOXES.angular_momentum
        ).max()
        for name in ("rk4", "rk4_body")
    }
    assert lost["rk4"] == 0.0
    assert 1e-9 < lost["rk4_body"] < 1e-4


def test_a_wrench_that_python_gives_may_be_shared_and_changed() -> None:
    shared = np.zeros((2, 3))

    def growing(state: State, t: float) -> Wrench:
        shared[:] = [t, 0.0, 0.0]
        return Wrench(shared, shared)

    after = advance(CUBES, RK4, 0.5, 2, load=growing)
    np.testing.assert_allclose(after.momentum - CUBES.momentum, [[0.5, 0, 0]] * 2, rtol=1e-14)
