"""Limits of stability are where they are predicted to be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.lab.stability.bisection import bisect, first_failure, locate
from roller_env.lab.stability.cases import EXACT, FULL, QUICK, Case, Effort, Finding, judged
from roller_env.lab.stability.impact import worst_return
from roller_env.lab.stability.run import CASES, GROUPS
from roller_env.lab.stability.scenes import TAU_S
from roller_env.lab.stability.smooth import drag_limit, rk4_servo_limit, stability_polynomial
from roller_env.physics.materials import restitution
from roller_env.rigid_body import INTEGRATORS, Integrator

DIFFER = {"speculative_exactly_touching"}
"""Where MuJoCo does not do what its manual says; the case's note has the reason."""

QUICK_CASES = [name for name, case in CASES.items() if case.quick]


@pytest.mark.parametrize("name", QUICK_CASES)
def test_a_limit_is_where_its_formula_puts_it(name: str) -> None:
    row = judged(CASES[name], QUICK)
    expected = "differs" if name in DIFFER else "holds"
    assert row["verdict"] == expected, (row["measured"], row["predicted"])


def test_a_band_wider_than_one_per_cent_says_why() -> None:
    silent = [
        name
        for name, case in CASES.items()
        if (case.band[0] < EXACT[0] or case.band[1] > EXACT[1]) and not case.note
    ]
    assert not silent


def test_what_differs_from_its_prediction_says_why() -> None:
    assert all(CASES[name].note for name in DIFFER)


def test_every_limit_has_a_formula_a_source_and_a_criterion() -> None:
    for case in CASES.values():
        assert case.formula, case.name
        assert case.source, case.name
        assert case.criterion, case.name
        # They stand in a Markdown table.
        assert "|" not in case.formula + case.quantity + case.method, case.name
        assert case.group in GROUPS


def test_what_has_no_limit_says_how_far_it_was_searched() -> None:
    for case in CASES.values():
        assert math.isfinite(case.predicted) or math.isfinite(case.searched_to), case.name


@given(
    threshold=st.floats(1e-3, 1e3),
    below=st.floats(1.1, 50.0),
    above=st.floats(1.1, 50.0),
    tolerance=st.floats(1e-6, 0.1),
)
def test_bisection_finds_a_known_threshold(
    threshold: float, below: float, above: float, tolerance: float
) -> None:
    found = bisect(lambda value: value < threshold, threshold / below, threshold * above, tolerance)
    assert found.holds < threshold <= found.fails
    assert found.fails / found.holds - 1.0 <= tolerance
    assert found.holds <= found.value <= found.fails
    assert found.runs <= 3 + math.log2(math.log(below * above) / math.log1p(tolerance) + 1.0)


@given(threshold=st.floats(1e-2, 1e2), off=st.floats(1e-3, 1e3))
def test_a_threshold_is_found_from_a_wrong_guess_too(threshold: float, off: float) -> None:
    found = locate(lambda value: value < threshold, threshold * off, 1e-3)
    assert found.value == pytest.approx(threshold, rel=1e-3)


def test_a_threshold_that_is_nowhere_near_the_guess_is_refused() -> None:
    with pytest.raises(ValueError, match="the threshold is not between"):
        locate(lambda value: value < 1e6, 1.0, 1e-3)
    with pytest.raises(ValueError, match="the threshold is not between"):
        locate(lambda value: value < 1e-6, 1.0, 1e-3)


@given(threshold=st.floats(0.5, 99.0))
def test_the_first_failure_is_the_first_value_past_the_threshold(threshold: float) -> None:
    values = np.arange(1.0, 101.0)
    found = first_failure(lambda value: value < threshold, values)
    assert found.fails == math.ceil(threshold)
    assert found.runs == math.ceil(threshold)


def test_what_never_fails_has_an_infinite_threshold() -> None:
    found = first_failure(lambda _: True, (1.0, 2.0))
    assert found.value == math.inf
    assert found.holds == 2.0


@pytest.mark.parametrize(
    ("low", "high", "tolerance", "message"),
    [
        (0.0, 1.0, 0.1, "0 < low < high"),
        (2.0, 1.0, 0.1, "0 < low < high"),
        (1.0, math.inf, 0.1, "0 < low < high"),
        (1.0, math.nan, 0.1, "0 < low < high"),
        (1.0, 9.0, 0.0, "tolerance: found 0"),
        (1.0, 2.0, 0.1, "2 holds"),
        (6.0, 9.0, 0.1, "6 fails"),
    ],
)
def test_a_bracket_that_makes_no_sense_is_refused(
    low: float, high: float, tolerance: float, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        bisect(lambda value: value < 5.0, low, high, tolerance)


@pytest.mark.parametrize("values", [(), (2.0, 1.0), (0.0, 1.0), (1.0, math.nan)])
def test_values_that_do_not_rise_are_refused(values: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=r"rise|at least one"):
        first_failure(lambda _: True, values)


def test_a_wrong_prediction_is_found_to_be_wrong() -> None:
    """The harness itself can say no: the measured value a tenth off, and a limit where none is."""
    off = _case(predicted=1.0, measured=1.1)
    assert judged(off, QUICK)["verdict"] == "differs"
    assert judged(off, QUICK)["ratio"] == pytest.approx(1.1)
    assert judged(_case(predicted=math.inf, measured=7.0), QUICK)["verdict"] == "differs"
    assert judged(_case(predicted=7.0, measured=math.inf), QUICK)["verdict"] == "differs"
    assert judged(_case(predicted=7.0, measured=math.nan), QUICK)["verdict"] == "differs"
    assert judged(_case(predicted=math.inf, measured=math.inf), QUICK)["verdict"] == "holds"


def _case(predicted: float, measured: float) -> Case:
    def measure(_effort: Effort) -> Finding:
        return Finding(measured)

    return Case("case", "group", "what", "how", predicted, "f", "source", "criterion", measure)


def test_the_full_effort_is_finer_than_the_quick_one() -> None:
    assert FULL.tolerance < QUICK.tolerance < EXACT[1] - 1.0
    assert FULL.steps > QUICK.steps
    assert FULL.phases > QUICK.phases


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_a_stability_polynomial_is_the_exponential_to_the_methods_order(
    method: Integrator,
) -> None:
    found = stability_polynomial(method).coef.tolist()[: method.order + 1]
    wanted = [1.0 / math.factorial(power) for power in range(method.order + 1)]
    assert found == pytest.approx(wanted, abs=1e-12)


def test_the_limits_of_runge_kutta_are_those_of_the_books() -> None:
    """Hairer & Wanner: 2.785 on the real axis, 2 sqrt 2 on the imaginary one."""
    assert drag_limit(INTEGRATORS["rk4"]) == pytest.approx(2.78529, abs=1e-5)
    assert rk4_servo_limit(0.0) == pytest.approx(2.0 * math.sqrt(2.0), abs=1e-9)
    assert rk4_servo_limit(1.0) == pytest.approx(2.78529, abs=1e-5)


@pytest.mark.parametrize("ratio", [0.05, 0.2, 0.7, 1.0, 1.5])
def test_a_contact_of_many_steps_gives_back_what_the_spring_does(ratio: float) -> None:
    """The Euler step of the spring, written out, becomes the spring as the step vanishes."""
    assert worst_return(1e-3, ratio) == pytest.approx(restitution(ratio), abs=2e-3)


def test_a_contact_of_one_step_gives_back_what_that_step_does() -> None:
    step, ratio = (1 / 120) / (TAU_S * 0.1), 0.1
    assert worst_return(step, ratio) == pytest.approx(step**2 + 2 * ratio * step - 1.0)
    assert worst_return(step, ratio) == pytest.approx(17.2, abs=0.05)
