"""Fixed steps under frames of any length, and the picture between two steps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.rigid_body import (
    RK4,
    Body,
    FixedStepPacer,
    Pose,
    State,
    advance,
    exact,
    gravity,
    interpolate,
    quaternion,
)
from tests.rigid_body.bodies import EXAMPLES

STEP_S = 1.0 / 120.0
GRAVITY = (0.0, 0.0, -9.8044)
frames = st.lists(st.floats(0.0, 0.06), min_size=1, max_size=60)


@EXAMPLES
@given(frames)
def test_no_time_is_lost_or_made_whatever_the_frames(lengths: list[float]) -> None:
    pacer = FixedStepPacer(STEP_S)
    steps = sum(pacer.advance(length) for length in lengths)
    accounted = steps * STEP_S + pacer.dropped_s + pacer.fraction * STEP_S
    assert accounted == pytest.approx(sum(lengths), abs=1e-9)
    assert 0.0 <= pacer.fraction < 1.0
    assert pacer.dropped_s == 0.0


@EXAMPLES
@given(st.integers(1, 8), st.sampled_from([30.0, 60.0, 90.0, 144.0]))
def test_a_steady_display_gets_an_even_number_of_steps(multiple: int, rate_hz: float) -> None:
    pacer = FixedStepPacer(1.0 / (rate_hz * multiple))
    counts = {pacer.advance(1.0 / rate_hz) for _ in range(1000)}
    assert counts == {multiple}


def test_a_slow_frame_may_not_ask_for_more_than_the_cap_and_the_rest_is_dropped() -> None:
    pacer = FixedStepPacer(step_s=0.01, max_steps=5)
    assert pacer.advance(0.303) == 5
    assert pacer.dropped_s == pytest.approx(0.25)
    assert pacer.fraction == pytest.approx(0.3)
    # What was dropped is not asked for later.
    assert pacer.advance(0.01) == 1


def test_a_fast_display_draws_between_steps() -> None:
    pacer = FixedStepPacer(step_s=0.01)
    drawn = [(pacer.advance(0.004), round(pacer.fraction, 6)) for _ in range(5)]
    assert drawn == [(0, 0.4), (0, 0.8), (1, 0.2), (0, 0.6), (1, 0.0)]


@EXAMPLES
@given(frames, st.floats(0.0, 20.0))
def test_a_drawn_body_is_where_the_exact_motion_was_one_step_ago(
    lengths: list[float], spin: float
) -> None:
    thrown = State.create(Body.cube(), velocity=(3, 0, 5), angular_velocity=(0, spin, 0))
    pacer, previous, current, clock = FixedStepPacer(STEP_S), thrown, thrown, 0.0
    for length in lengths:
        for _ in range(pacer.advance(length)):
            previous, current = current, advance(current, RK4, STEP_S, 1, load=gravity(GRAVITY))
        clock += length
    if current is thrown:
        return
    drawn = interpolate(previous.pose, current.pose, pacer.fraction)
    shown_s = clock - STEP_S
    truth = exact.projectile(exact.constant_spin(thrown, shown_s), shown_s, GRAVITY)
    # A chord leaves a parabola by a h^2 / 8 at most; the rest is the drift of float64 sums.
    assert np.abs(drawn.position - truth.position).max() <= 9.8044 * STEP_S**2 / 8.0 + 1e-9
    late = clock * spin * (spin * STEP_S) ** 4 / 5120.0
    assert quaternion.angle_between(drawn.orientation, truth.orientation)[0] <= late + 1e-8


def test_the_chord_is_furthest_from_the_parabola_in_the_middle_by_an_eighth_of_a_h_squared() -> (
    None
):
    body = State.create(Body.cube())
    after = exact.projectile(body, STEP_S, GRAVITY)
    middle = interpolate(body.pose, after.pose, 0.5).position
    truth = exact.projectile(body, STEP_S / 2.0, GRAVITY).position
    assert truth[0, 2] - middle[0, 2] == pytest.approx(9.8044 * STEP_S**2 / 8.0)


def test_drawing_turns_the_short_way_when_the_quaternions_sign_flips() -> None:
    body = State.create(Body.cube())
    half = quaternion.from_axis_angle((0, 0, 1), 0.2)[None]
    flipped = Pose(body.position, -quaternion.multiply(half, body.orientation))
    drawn = interpolate(body.pose, flipped, 0.5)
    assert quaternion.angle_between(drawn.orientation, body.orientation)[0] == pytest.approx(0.1)


def test_the_ends_of_the_interval_are_the_two_states() -> None:
    a = State.create(Body.cube(count=2), position=[(0, 0, 0), (1, 1, 1)])
    b = State.create(a.body, position=(5, 6, 7), orientation=(0, 1, 0, 0))
    drawn = interpolate(a.pose, b.pose, (0.0, 1.0))
    np.testing.assert_array_equal(drawn.position, [a.position[0], b.position[1]])
    truth = np.stack([a.orientation[0], b.orientation[1]])
    assert quaternion.angle_between(drawn.orientation, truth).max() < 1e-15


@pytest.mark.parametrize("frame_s", [-0.001, math.nan, math.inf])
def test_a_frame_of_no_real_length_is_refused(frame_s: float) -> None:
    with pytest.raises(ValueError, match="frame_s must be a number of seconds, not negative"):
        FixedStepPacer(STEP_S).advance(frame_s)


@pytest.mark.parametrize("step_s", [0.0, -0.01, math.nan])
def test_a_step_of_no_length_is_refused(step_s: float) -> None:
    with pytest.raises(ValueError, match="step_s must be a positive number of seconds"):
        FixedStepPacer(step_s)


def test_a_cap_of_no_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="max_steps must be at least 1, got 0"):
        FixedStepPacer(STEP_S, max_steps=0)


def test_poses_that_do_not_fit_and_fractions_outside_the_step_are_refused() -> None:
    one, two = State.create(Body.cube()).pose, State.create(Body.cube(count=2)).pose
    with pytest.raises(ValueError, match=r"position has shape \(1, 3\) before and \(2, 3\) after"):
        interpolate(one, two, 0.5)
    with pytest.raises(ValueError, match="fraction must be from 0 to 1"):
        interpolate(one, one, 1.5)
