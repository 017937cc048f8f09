"""What a ball on parabolas meets, against closed forms and dense sampling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from roller_env.pieces.coin import COIN_REACH_M
from roller_env.pieces.sweep import ANYWHERE, bounds, time_of_fall, visit
from tests.builders import Float64

G = 9.8044
STEP_S = 1 / 20
ORIGIN = (0.0, 0.0, 0.0)


def thrown(place: list[float], velocity: list[float], time_s: float = STEP_S) -> Float64:
    """Return the path of a ball in free flight, (2, 6)."""
    p, v, a = np.array(place), np.array(velocity), np.array([0.0, 0.0, -G])
    bend = 0.5 * time_s**2 * a
    return np.array([[*p, *bend], [*(p + time_s * v + bend), 0.0, 0.0, 0.0]])


def along(path: Float64, share: Float64) -> Float64:
    """Return places, (n, 3), on the only piece of a path."""
    p, q, b, s = path[0, :3], path[1, :3], path[0, 3:], np.asarray(share)[:, None]
    places: Float64 = p + s * (q - p - b) + s**2 * b
    return places


def test_a_ball_falling_on_a_coin_touches_it_when_the_law_of_falling_says() -> None:
    """s = g t^2 / 2: exact to the nanosecond, where samples 1/240 s apart were off by 9 us."""
    fallen = 0.009
    path = thrown([0.0, 0.0, COIN_REACH_M + fallen], [0.0, 0.0, 0.0])
    time, inside = visit(path, ORIGIN, ORIGIN, COIN_REACH_M, ANYWHERE, False)
    assert time * STEP_S == pytest.approx(np.sqrt(2.0 * fallen / G), abs=1e-12)
    assert inside


@pytest.mark.parametrize("miss_m", [-1e-9, 1e-9])
def test_a_coin_under_the_top_of_a_throw_is_taken_if_the_ball_comes_as_near_as_that(
    miss_m: float,
) -> None:
    """The ends of the piece are both a centimetre away; only the arc comes near."""
    half_s = 0.5 * STEP_S
    top = -COIN_REACH_M - miss_m
    path = thrown([0.0, 0.0, top - 0.5 * G * half_s**2], [0.0, 0.0, G * half_s])
    time, _ = visit(path, ORIGIN, ORIGIN, COIN_REACH_M, ANYWHERE, False)
    assert (time < np.inf) == (miss_m < 0.0)
    if miss_m < 0.0:
        early = np.sqrt(2.0 * -miss_m / G)
        assert time * STEP_S == pytest.approx(half_s - early, abs=1e-9)


def test_a_ball_is_over_the_kill_height_until_the_law_of_falling_says() -> None:
    path = thrown([3.0, 0.0, -20.0], [4.0, 0.0, -1.0])
    fall = time_of_fall(path, -20.03) * STEP_S
    assert 1.0 * fall + 0.5 * G * fall**2 == pytest.approx(0.03, abs=1e-12)


def test_a_ball_that_dips_below_the_kill_height_between_two_knots_has_fallen() -> None:
    path = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 8.0], [2.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
    assert time_of_fall(path, 0.0) == pytest.approx(0.5 - np.sqrt(0.125))
    assert time_of_fall(path, -1.01) == np.inf


numbers = st.floats(-1.0, 1.0, allow_nan=False)
vectors = st.tuples(numbers, numbers, numbers)


@settings(max_examples=200, deadline=None)
@given(vectors, vectors, vectors, vectors, st.floats(0.0, 0.5), st.floats(-2.0, 0.5))
def test_entries_on_parabolas_are_those_that_dense_sampling_finds(
    start: tuple[float, ...],
    end: tuple[float, ...],
    bend: tuple[float, ...],
    size: tuple[float, ...],
    radius: float,
    floor: float,
) -> None:
    path = np.array([[*start, *bend], [*end, 0.0, 0.0, 0.0]]) * 2.0
    half = np.abs(size)

    def depth(share: float) -> float:
        at = along(path, np.array([share]))[0]
        out = np.maximum(np.abs(at) - half, 0.0)
        return float(max(np.linalg.norm(out) - radius, floor - at[2]))

    time, inside = visit(path, ORIGIN, tuple(half), radius, floor, True)
    shares = np.linspace(0.0, 1.0, 1001)
    depths = np.array([depth(share) for share in shares])
    if abs(depths[-1]) > 1e-12:
        assert inside == (depths[-1] <= 0.0)
    low, high = bounds(path)
    places = along(path, shares)
    assert (places >= np.array(low) - 1e-12).all()
    assert (places <= np.array(high) + 1e-12).all()
    if depths[0] <= 0.0:
        return
    entered = np.flatnonzero(depths <= -1e-9)
    if len(entered):
        first = int(entered[0])
        # Between two samples it may have touched before; that it did is asked below.
        if depths[first - 1] > 0.0:
            assert time <= brentq(depth, shares[first - 1], shares[first], xtol=1e-13) + 1e-7
    if time < np.inf:
        assert depth(time) <= 2e-12
