"""Input of any size and shape: what is plainly meant is done exactly, all else is refused."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.rigid_body import (
    RK4,
    Body,
    FixedStepPacer,
    State,
    Wrench,
    advance,
    constant,
    driving_torque,
    exact,
    gravity,
    key_sequence,
    on_axle,
    push_at,
    quaternion,
    total,
)
from roller_env.rigid_body.arrays import Float64, numbers
from roller_env.rigid_body.forces import Load
from tests.rigid_body.bodies import EXAMPLES, attitude_error, orientations, tumbling, vectors

TWO = State.create(Body.cube([1.0, 2.0]), angular_velocity=(1.0, 2.0, 3.0))


@pytest.fixture(autouse=True)
def no_warning_instead_of_an_error() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


# --- what a load returns ---------------------------------------------------------------------

UNFIT: dict[str, Any] = {
    "one row": np.ones(3),
    "one row of a matrix": np.ones((1, 3)),
    "a column": np.ones((2, 1)),
    "a number": 1.0,
    "an array of no axes": np.array(1.0),
    "a list for one body": [1.0, 2.0, 3.0],
    "three bodies": np.ones((3, 3)),
    "another axis": np.ones((1, 2, 3)),
    "ragged lists": [[1.0, 2.0, 3.0], [1.0]],
    "words": [["a", "b", "c"]] * 2,
    "nothing": None,
    "complex numbers": np.ones((2, 3), dtype=complex),
    "truth values": np.ones((2, 3), dtype=bool),
}


def used_through(how: str) -> Callable[[Load], State]:
    """Return what runs a load: alone, added up, on an axle, with keys, or as the exact motion's."""
    keys = key_sequence([(0.0, "W")])
    return {
        "alone": lambda load: advance(TWO, RK4, 0.1, 1, load=load),
        "in total": lambda load: advance(TWO, RK4, 0.1, 1, load=total(load)),
        "in a sum": lambda load: advance(TWO, RK4, 0.1, 1, load=total(constant((1, 0, 0)), load)),
        "on an axle": lambda load: advance(TWO, RK4, 0.1, 1, load=on_axle(load, (1, 0, 0))),
        "beside keys": lambda load: advance(TWO, RK4, 0.1, 1, load=load, held=keys),
        "exactly": lambda load: exact.reference(TWO, 0.1, load),
    }[how]


WAYS = ["alone", "in total", "in a sum", "on an axle", "beside keys", "exactly"]


@pytest.mark.parametrize("how", WAYS)
@pytest.mark.parametrize("half", ["force", "torque"])
@pytest.mark.parametrize("unfit", UNFIT.values(), ids=UNFIT.keys())
def test_a_load_that_is_not_one_row_a_body_is_refused_and_never_stretched(
    how: str, half: str, unfit: Any
) -> None:
    wrench = {"force": np.zeros((2, 3)), "torque": np.zeros((2, 3))} | {half: unfit}
    with pytest.raises(ValueError, match=f"the load's {half} must (have shape|be numbers)"):
        used_through(how)(lambda _s, _t: Wrench(**wrench))


@pytest.mark.parametrize("how", WAYS)
@pytest.mark.parametrize(
    "unfit", [None, 1.0, np.zeros((2, 3)), (np.zeros((2, 3)),), [np.zeros((2, 3))] * 3, "ab"]
)
def test_a_load_that_is_no_force_and_torque_is_refused(how: str, unfit: Any) -> None:
    with pytest.raises(ValueError, match=r"a load must return a Wrench|the load's force must be"):
        used_through(how)(lambda _s, _t: unfit)


@pytest.mark.parametrize("how", WAYS)
def test_a_plain_pair_of_lists_is_a_load_like_any_other(how: str) -> None:
    force, torque = [[1, 2, 3], [4, 5, 6]], [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
    plain = used_through(how)(lambda _s, _t: (force, torque))  # type: ignore[arg-type, return-value]
    proper = used_through(how)(constant(force, torque))
    np.testing.assert_array_equal(plain.momentum, proper.momentum)
    np.testing.assert_array_equal(plain.orientation, proper.orientation)


@pytest.mark.parametrize(
    ("maker", "arguments"),
    [
        (constant, (1.0,)),
        (constant, ((1.0, 2.0),)),
        (constant, ((1, 2, 3), np.ones((2, 1)))),
        (gravity, (-9.8,)),
        (gravity, (np.ones((2, 2, 3)),)),
        (driving_torque, (1.0,)),
        (push_at, ((1, 0, 0), 0.5)),
        (push_at, (5.0, (1, 0, 0))),
        (on_axle, (constant(), 1.0)),
    ],
)
def test_a_load_of_the_wrong_width_is_refused_when_it_is_made(
    maker: Any, arguments: tuple[Any, ...]
) -> None:
    with pytest.raises(ValueError, match=r"must have shape \(3,\) or \(N, 3\)"):
        maker(*arguments)


# --- numbers that are none -------------------------------------------------------------------


@pytest.mark.parametrize(
    "value", ["1.5", True, 1j, None, 10**400, [1, "2"], np.datetime64("2026-01-01"), [[1], [1, 2]]]
)
def test_what_is_no_number_is_refused_though_numpy_would_make_one(value: Any) -> None:
    with pytest.raises(ValueError, match="mass must be"):
        numbers("mass", value)


@pytest.mark.parametrize("dt", ["0.1", None, np.array([0.1, 0.2]), -0.1, 0.0, math.nan, math.inf])
def test_a_step_of_no_length_is_refused(dt: Any) -> None:
    with pytest.raises(ValueError, match="dt must be"):
        advance(TWO, RK4, dt, 1)


@pytest.mark.parametrize("steps", [-1, 1.0, 2.5, True, "3", None, np.array([1, 2])])
def test_steps_that_cannot_be_counted_are_refused(steps: Any) -> None:
    with pytest.raises(ValueError, match="steps must"):
        advance(TWO, RK4, 0.1, steps)


def test_numpys_numbers_are_numbers() -> None:
    steps, dt = np.int64(3), np.float32(0.5)
    np.testing.assert_array_equal(
        advance(TWO, RK4, dt, steps).orientation,  # type: ignore[arg-type]
        advance(TWO, RK4, 0.5, 3).orientation,
    )
    assert Body.cube(count=np.int32(2)).count == 2  # type: ignore[arg-type]


@pytest.mark.parametrize("start_s", [math.nan, math.inf, "0"])
def test_a_beginning_at_no_time_is_refused(start_s: Any) -> None:
    with pytest.raises(ValueError, match="start_s must be"):
        advance(TWO, RK4, 0.1, 1, start_s=start_s)
    with pytest.raises(ValueError, match="start_s must be"):
        exact.reference(TWO, 0.1, start_s=start_s)


# --- bodies beyond any number ----------------------------------------------------------------


@pytest.mark.parametrize(
    "body",
    [
        {"size": 1e200},
        {"size": 1e-170},
        {"mass": 1e-320},
        {"mass": sys.float_info.max},
        {"size": 1e150, "mass": 1e10},
        {"size": [1.0, 1e200]},
    ],
)
def test_a_cube_whose_inertia_no_number_holds_is_refused(body: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"(mass|inertia).* must be from 1e-300 to 1e\+300"):
        Body.cube(**body)


@pytest.mark.parametrize("moment", [1e-320, 5e-324, 1e305])
def test_moments_that_have_no_inverse_are_refused(moment: float) -> None:
    with pytest.raises(ValueError, match="inertia must be from"):
        Body.from_inertia([moment] * 3)
    with pytest.raises(ValueError, match="must be from"):
        Body.box([math.sqrt(moment)] * 3, 1.0)


MAGNITUDES = st.floats(-307.0, 307.0).map(lambda exponent: 10.0**exponent)


@EXAMPLES
@given(MAGNITUDES, MAGNITUDES)
def test_a_body_is_made_of_finite_numbers_with_inverses_or_not_made(
    size: float, mass: float
) -> None:
    makers: list[Callable[[], Body]] = [
        lambda: Body.cube(size, mass),
        lambda: Body.box((size, 2 * size, size), mass),
        lambda: Body.from_inertia((size, size, 1.5 * size), mass),
    ]
    for make in makers:
        try:
            body = make()
        except ValueError as error:
            assert "must be" in str(error)  # noqa: PT017 - either outcome is right
            continue
        for value in (body.mass, body.inverse_mass, body.inertia, body.inverse_inertia):
            assert (value > sys.float_info.min).all()
            assert (value < math.inf).all()
        np.testing.assert_allclose(body.inertia * body.inverse_inertia, 1.0, rtol=1e-15)


@pytest.mark.parametrize(
    "motion", [{"velocity": (1e300, 0, 0)}, {"angular_velocity": (0, 1e300, 0)}]
)
def test_a_momentum_that_no_number_holds_is_refused(motion: dict[str, Any]) -> None:
    heavy = Body.cube(1e3, 1e20)
    with pytest.raises(ValueError, match="momentum must be finite"):
        State.create(heavy, **motion)


# --- which bodies ----------------------------------------------------------------------------

CROWD = State.create(Body.cube([1.0, 2.0, 3.0]), position=np.eye(3))


@EXAMPLES
@given(st.lists(st.booleans(), min_size=3, max_size=3).filter(any))
def test_a_mask_takes_the_bodies_that_it_marks(mask: list[bool]) -> None:
    for given_mask in (mask, np.array(mask), tuple(mask)):
        taken = CROWD.take(given_mask)
        assert taken.body.size[:, 0].tolist() == [i + 1.0 for i in range(3) if mask[i]]
        np.testing.assert_array_equal(taken.position, CROWD.position[np.array(mask)])
        assert Body.take(CROWD.body, given_mask).count == sum(mask)


@pytest.mark.parametrize(
    "rows",
    [
        [True, False],
        [[True, False, True]],
        [0.0, 1.0],
        [0.5],
        1,
        [3],
        [-4],
        [],
        [False] * 3,
        "01",
        [None],
        [[0, 1]],
    ],
)
def test_rows_that_mean_no_bodies_are_refused(rows: Any) -> None:
    for whose in (CROWD, CROWD.body):
        with pytest.raises(ValueError, match="indices"):
            whose.take(rows)


def test_a_state_takes_no_values_of_another_shape_or_kind() -> None:
    wrong: list[Any] = [np.ones(3), np.ones((1, 3)), 1.0, [["a"] * 3] * 3, np.ones((3, 3)) * 1j]
    for value in wrong:
        with pytest.raises(ValueError, match="momentum must"):
            CROWD.recalculate(momentum=value)
    for tensor in (CROWD.over_inertia, CROWD.times_inertia):
        with pytest.raises(ValueError, match=r"vector must have shape \(3, 3\), got \(3,\)"):
            tensor(np.ones(3))


# --- lengths of any magnitude ----------------------------------------------------------------

SCALES = st.integers(-1000, 900)


@EXAMPLES
@given(vectors(1), SCALES)
def test_a_length_is_right_whatever_its_magnitude(vector: Float64, exponent: int) -> None:
    scaled = np.ldexp(vector, exponent)
    square = sum(Fraction(x) ** 2 for x in scaled[0].tolist())
    size = Fraction(float(quaternion.norm(scaled)[0]))
    # Below the normal numbers a float64's spacing is 2^-1074, wherever it is.
    slack = Fraction(2) ** -1073
    assert (size - slack) ** 2 <= square * (1 + Fraction(1, 10**15)) or size <= slack
    assert (size + slack) ** 2 >= square * (1 - Fraction(1, 10**15))


@EXAMPLES
@given(orientations(2), st.integers(-1070, 1020))
def test_the_norm_of_a_quaternion_does_not_matter_to_its_direction(
    q: Float64, exponent: int
) -> None:
    kept = np.ldexp(np.ldexp(q, exponent), -exponent)
    unit = quaternion.normalise(np.ldexp(q, exponent))
    np.testing.assert_allclose(unit, quaternion.normalise(kept), rtol=0, atol=4e-16)


@pytest.mark.parametrize("q", [[0.0] * 4, [math.nan] * 4, [math.inf, 0, 0, 0]])
def test_normalising_what_has_no_direction_gives_nan_and_no_error(q: list[float]) -> None:
    assert np.isnan(quaternion.normalise(np.array(q))).any()


@EXAMPLES
@given(vectors(1), st.floats(-50.0, 50.0), st.integers(-1060, 1020))
def test_the_length_of_an_axis_does_not_matter(
    axis: Float64, angle_rad: float, exponent: int
) -> None:
    axis = np.round(axis, 3) + np.array([0.0, 0.0, 6.0])
    kept = np.ldexp(np.ldexp(axis, exponent), -exponent)
    turned = quaternion.from_axis_angle(np.ldexp(axis, exponent), angle_rad)
    np.testing.assert_allclose(
        turned, quaternion.from_axis_angle(kept, angle_rad), rtol=0, atol=4e-16
    )
    assert quaternion.norm(turned)[0] == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("size", [1e170, 1e308, 1e-170, 5e-324])
def test_an_axis_of_any_length_turns(size: float) -> None:
    turned = quaternion.from_axis_angle((size, 0, 0), 1.0)
    assert turned.tolist() == pytest.approx([math.cos(0.5), math.sin(0.5), 0.0, 0.0], abs=1e-16)
    held = on_axle(constant(torque=(3.0, 1.0, 0.0)), (size, 0, 0))(CROWD, 0.0)
    np.testing.assert_allclose(held.torque, [[3.0, 0.0, 0.0]] * 3)


def test_an_axis_and_angles_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match=r"axis \(2, 3\) and angle_rad \(3,\)"):
        quaternion.from_axis_angle(np.ones((2, 3)), np.ones(3))


def test_a_rotation_vector_of_any_length_is_a_rotation() -> None:
    for size in (1e-320, 1e-160, 1e160, 1e300):
        q = quaternion.from_rotation_vector(np.array([[0.0, size, 0.0]]))
        assert quaternion.norm(q)[0] == pytest.approx(1.0, abs=1e-15)


@EXAMPLES
@given(tumbling(1), st.integers(-400, 400), st.integers(-250, 250))
def test_a_tops_motion_does_not_depend_on_the_units_of_time_and_mass(
    top: State, time: int, mass: int
) -> None:
    body = Body.from_inertia(np.ldexp(top.body.inertia, mass), top.body.mass)
    other = State.create(
        body,
        orientation=top.orientation,
        angular_momentum=np.ldexp(top.angular_momentum, mass - time),
    )
    truth = exact.asymmetric_top(top, 2.0)
    assert attitude_error(exact.asymmetric_top(other, math.ldexp(2.0, time)), truth) < 1e-11


@pytest.mark.parametrize("size", [1e-170, 1.0, 1e140])
def test_a_spin_across_the_torque_is_seen_at_any_magnitude(size: float) -> None:
    across = State.create(Body.cube(), angular_momentum=(0.0, size, 0.0))
    with pytest.raises(ValueError, match="along the torque"):
        exact.damped_spin(across, 1.0, (size, 0.0, 0.0), 0.1)
    box = State.create(Body.box((1, 2, 3)), angular_momentum=(size, size, 0.0))
    with pytest.raises(ValueError, match="use symmetric_top or asymmetric_top"):
        exact.constant_spin(box, 1.0)


@pytest.mark.parametrize("scale", [1e-290, 1e-200, 1.0, 1e200, 1e290])
def test_a_wobble_grows_as_fast_in_any_unit_of_inertia(scale: float) -> None:
    rate = exact.middle_axis_growth_rate(np.array([1.0, 2.0, 3.0]) * scale, -2.0)
    assert rate == pytest.approx(2.0 / math.sqrt(3.0), rel=1e-15)
    with pytest.raises(ValueError, match="spin_rad_s must be finite"):
        exact.middle_axis_growth_rate((1.0, 2.0, 3.0), math.nan)


# --- frames of any length --------------------------------------------------------------------


@EXAMPLES
@given(MAGNITUDES, st.lists(MAGNITUDES, max_size=5), st.integers(1, 10))
def test_a_pacer_takes_frames_of_any_length(
    step_s: float, frames_s: list[float], most: int
) -> None:
    pacer = FixedStepPacer(step_s, max_steps=most)
    for frame_s in frames_s:
        assert 0 <= pacer.advance(frame_s) <= most
        assert 0.0 <= pacer.fraction < 1.0 + 1e-9
        assert 0.0 <= pacer.dropped_s < math.inf


@pytest.mark.parametrize("most", [0, -1, 2.5, True, "8"])
def test_a_pacer_of_no_whole_number_of_steps_is_refused(most: Any) -> None:
    with pytest.raises(ValueError, match="max_steps must be"):
        FixedStepPacer(0.01, max_steps=most)


def test_a_list_that_is_half_a_mask_is_refused() -> None:
    mixed: Any = [True, 0, 1]
    with pytest.raises(ValueError, match="a mask or whole numbers, not some of both"):
        Body.cube(size=1.0, mass=[1.0, 2.0, 3.0]).take(mixed)


def test_truth_values_are_no_numbers_wherever_they_stand() -> None:
    wrong: Any = True
    state = State.create(Body.cube(size=1.0, mass=1.0))
    with pytest.raises(ValueError, match="dt must be one number, got True"):
        advance(state, RK4, wrong, 1)
    with pytest.raises(ValueError, match="axis must be numbers"):
        quaternion.from_axis_angle((wrong, 0, 0), 1.0)


def test_rotations_take_plain_tuples() -> None:
    half = quaternion.slerp((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), 0.5)
    assert half == pytest.approx(quaternion.from_rotation_vector((0.0, 0.0, np.pi / 2)))
