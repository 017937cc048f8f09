"""The report's axes and the game's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from roller_env.rigid_body import (
    OPENGL_TO_GAME,
    REPORT_TO_GAME,
    RK4,
    AxesMap,
    Body,
    State,
    advance,
    gravity,
    push_at,
    quaternion,
    total,
)
from roller_env.rigid_body.arrays import Float64
from tests.rigid_body.bodies import EXAMPLES, attitude_error, boxes, orientations, states, vectors

MAPS = [REPORT_TO_GAME, OPENGL_TO_GAME]
RIGHT, UP, Z = np.eye(3)


@pytest.mark.parametrize("axes", MAPS)
def test_right_is_minus_y_and_up_is_z_in_the_game(axes: AxesMap) -> None:
    assert axes.vector(RIGHT).tolist() == [0.0, -1.0, 0.0]
    assert axes.vector(UP).tolist() == [0.0, 0.0, 1.0]


def test_the_reports_z_is_forward_and_opengls_is_backward() -> None:
    assert REPORT_TO_GAME.vector(Z).tolist() == [1.0, 0.0, 0.0]
    assert OPENGL_TO_GAME.vector(Z).tolist() == [-1.0, 0.0, 0.0]


def test_right_up_forward_is_left_handed_and_right_up_backward_is_not() -> None:
    for axes, hand in ((REPORT_TO_GAME, -1.0), (OPENGL_TO_GAME, 1.0)):
        x, y, z = (axes.vector(axis) for axis in np.eye(3))
        np.testing.assert_array_equal(np.cross(x, y), hand * z)
        assert axes.handedness == hand
        assert axes.inverse.handedness == hand


@EXAMPLES
@given(vectors(1), vectors(1))
def test_a_torque_is_an_axial_vector(arm: Float64, force: Float64) -> None:
    for axes in MAPS:
        np.testing.assert_allclose(
            axes.axial(np.cross(arm, force)),
            np.cross(axes.vector(arm), axes.vector(force)),
            atol=1e-14,
        )


@EXAMPLES
@given(orientations(2), vectors(2))
def test_renaming_axes_and_turning_may_be_done_in_either_order(q: Float64, v: Float64) -> None:
    for axes in MAPS:
        np.testing.assert_allclose(
            axes.vector(quaternion.rotate(q, v)),
            quaternion.rotate(axes.quaternion(q), axes.vector(v)),
            atol=2e-14,
        )


@EXAMPLES
@given(orientations(2), vectors(2))
def test_the_inverse_map_undoes_the_map(q: Float64, v: Float64) -> None:
    for axes in MAPS:
        np.testing.assert_array_equal(axes.inverse.vector(axes.vector(v)), v)
        np.testing.assert_array_equal(axes.inverse.axial(axes.axial(v)), v)
        np.testing.assert_array_equal(axes.inverse.quaternion(axes.quaternion(q)), q)
        np.testing.assert_array_equal(axes.inverse.extent(axes.extent(v)), v)


def renamed(state: State, axes: AxesMap) -> State:
    return State.create(
        Body.box(axes.extent(state.body.size), state.body.mass),
        position=axes.vector(state.position),
        momentum=axes.vector(state.momentum),
        orientation=axes.quaternion(state.orientation),
        angular_momentum=axes.axial(state.angular_momentum),
    )


@EXAMPLES
@given(states(boxes(1)))
def test_physics_in_the_reports_axes_is_the_games_physics_renamed(state: State) -> None:
    down, thrust, nozzle = (0.0, -9.8044, 0.0), (1.0, 2.0, -0.5), (0.3, -0.2, 0.1)
    theirs = advance(
        state, RK4, 0.01, 5, load=total(gravity(down), push_at(thrust, nozzle, in_body=True))
    )
    for axes in MAPS:
        weight = gravity(axes.vector(down))
        assert weight(state, 0.0).force[0, 2] < 0.0
        jet = push_at(axes.vector(thrust), axes.vector(nozzle), in_body=True)
        ours = advance(renamed(state, axes), RK4, 0.01, 5, load=total(weight, jet))
        np.testing.assert_allclose(ours.position, axes.vector(theirs.position), atol=1e-12)
        np.testing.assert_allclose(
            ours.angular_momentum, axes.axial(theirs.angular_momentum), atol=1e-9
        )
        assert attitude_error(ours, renamed(theirs, axes)) < 1e-10


@pytest.mark.parametrize(
    "rows",
    [
        ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0)),
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ],
)
def test_what_is_no_renaming_of_axes_is_refused(
    rows: tuple[tuple[float, float, float], ...],
) -> None:
    with pytest.raises(ValueError, match="signed permutation"):
        AxesMap(rows)


def test_a_vector_of_another_width_is_refused() -> None:
    with pytest.raises(ValueError, match="vector must end in an axis of 3"):
        REPORT_TO_GAME.vector((1.0, 2.0))
    with pytest.raises(ValueError, match="quaternion must end in an axis of 4"):
        REPORT_TO_GAME.quaternion((1.0, 0.0, 0.0))
