"""Orders: the slope of error over time step, and what theory says of it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.lab.free import (
    ASYMMETRIC_TOP,
    CONSTANT_SPIN,
    DRAG,
    FREE_SCENES,
    SYMMETRIC_TOP,
    FreeScene,
)
from roller_env.lab.methods import FREE
from roller_env.lab.orders import (
    EXACT,
    EXPECTATIONS,
    FLOOR,
    REASONS,
    agrees,
    expected,
    measured_orders,
    slope,
)

HALVED = [0.1 / 2**k for k in range(8)]


@pytest.mark.parametrize(
    "scene",
    [ASYMMETRIC_TOP, SYMMETRIC_TOP, CONSTANT_SPIN, DRAG],
    ids=lambda scene: scene.name,
)
def test_every_slope_is_what_theory_expects(scene: FreeScene) -> None:
    orders = list(measured_orders(scene, quick=True))
    assert len(orders) == len(scene.methods) * len(scene.measures)
    assert [one for one in orders if not one["agrees"]] == []


@given(st.floats(0.5, 5.0), st.floats(1e-2, 1.0))
def test_the_slope_of_a_power_is_its_exponent(order: float, scale: float) -> None:
    measured, smallest, largest = slope(HALVED[:5], [scale * dt**order for dt in HALVED[:5]])
    assert measured == pytest.approx(order, rel=1e-9)
    assert smallest in HALVED[3:5]
    assert largest == 8.0 * smallest


def test_rounding_is_left_out_of_a_slope() -> None:
    order, smallest, largest = slope(HALVED, [max(dt**4 * 2e-5, 3e-15) for dt in HALVED])
    assert order == pytest.approx(4.0)
    assert (smallest, largest) == (HALVED[3], HALVED[0])


def test_too_few_errors_above_rounding_give_no_slope() -> None:
    assert math.isnan(slope(HALVED, [max(dt**4 * 1e-6, 3e-15) for dt in HALVED])[0])


def test_what_is_rounding_at_every_step_is_exact() -> None:
    assert slope(HALVED, [FLOOR / 10.0] * len(HALVED))[0] == EXACT


@pytest.mark.parametrize("broken", [math.nan, math.inf])
def test_a_slope_over_a_failed_run_is_no_number(broken: float) -> None:
    assert math.isnan(slope(HALVED[:4], [broken, 1e-2, 1e-3, 1e-4])[0])
    assert math.isnan(slope(HALVED[:4], [1e-1, 1e-2, 1e-3, broken])[0])


def test_a_slope_that_is_off_by_more_than_its_share_does_not_agree() -> None:
    assert agrees(4.0, 4.14)
    assert not agrees(4.0, 4.16)
    assert not agrees(4.0, math.nan)
    assert not agrees(4.0, EXACT)


def test_every_expectation_is_about_scenes_errors_and_methods_that_exist() -> None:
    measures = {scene.name: {one.name for one in scene.measures} for scene in FREE_SCENES}
    methods = {method.name for method in FREE}
    for one in EXPECTATIONS:
        assert REASONS[one.reason]
        assert one.methods <= methods
        for scene in one.scenes:
            assert one.measures & measures[scene], one


def test_only_an_expectation_changes_a_methods_order() -> None:
    for method in FREE:
        assert expected("drag", "velocity", method) == (method.order, "")
        order, reason = expected("simple-box", "velocity", method)
        assert (order, bool(reason)) == (EXACT, True)
