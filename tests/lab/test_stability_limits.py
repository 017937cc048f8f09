"""Limits of stability are where they are predicted to be."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.lab.stability.contacts import CONTACTS, TAU_S, worst_return
from roller_env.lab.stability.limits import (
    EXACT,
    FULL,
    QUICK,
    WORDS,
    Limit,
    Quantity,
    judged,
    locate,
)
from roller_env.lab.stability.run import CASES
from roller_env.lab.stability.smooth import (
    SMOOTH,
    drag_limit,
    rk4_servo_limit,
    stability_polynomial,
)
from roller_env.physics.materials import restitution
from roller_env.rigid_body import INTEGRATORS, Integrator

DIFFER = {"speculative_exactly_touching"}
"""Where MuJoCo does not do what its manual says; the case's note has the reason."""

DEPART = {"bounce_rk4_4ms", "bounce_discrete_1ms"}
"""Where the formula is of a spring, and the method is not: the bands are of what it does."""

QUICK_CASES = [name for name, words in WORDS.items() if words["quick"]]


def test_every_limit_is_measured_and_has_words() -> None:
    assert {*SMOOTH, *CONTACTS} == set(WORDS)
    assert not SMOOTH.keys() & CONTACTS.keys()


@pytest.mark.parametrize("name", QUICK_CASES)
def test_a_limit_is_where_its_formula_puts_it(name: str) -> None:
    row = judged(name, CASES[name], QUICK)
    expected = "differs" if name in DIFFER else "departs" if name in DEPART else "holds"
    assert row["verdict"] == expected, (row["measured"], row["predicted"])


def test_a_band_wider_than_one_per_cent_says_why() -> None:
    silent = [
        name
        for name, words in WORDS.items()
        if (words["low"] < EXACT[0] or words["high"] > EXACT[1]) and not words["note"]
    ]
    assert not silent


def test_what_differs_from_its_prediction_says_why() -> None:
    assert all(WORDS[name]["note"] for name in DIFFER)


def test_every_limit_has_a_formula_a_source_and_a_criterion() -> None:
    for name, words in WORDS.items():
        for column in ("group", "quantity", "method", "formula", "source", "criterion"):
            assert isinstance(words[column], str), (name, column)
        # They stand in a Markdown table.
        assert "|" not in words["formula"] + words["quantity"] + words["method"], name


def test_what_has_no_limit_says_how_far_it_was_searched() -> None:
    for name, case in CASES.items():
        limited = math.isfinite(case.predicted)
        assert limited or math.isfinite(WORDS[name]["searched_to"]), name


@given(
    threshold=st.floats(1e-3, 1e3),
    below=st.floats(1.1, 50.0),
    above=st.floats(1.1, 50.0),
    tolerance=st.floats(1e-6, 0.1),
)
def test_bisection_finds_a_known_threshold(
    threshold: float, below: float, above: float, tolerance: float
) -> None:
    """From a guess on either side, in no more runs than doubling and halving need."""
    for guess in (threshold / below, threshold * above):
        tried: list[float] = []

        def holds(value: float) -> bool:
            tried.append(value)  # noqa: B023 - called in this round only
            return value < threshold

        found = locate(holds, guess, tolerance)
        last_good = max(value for value in tried if value < threshold)
        first_bad = min(value for value in tried if value >= threshold)
        assert last_good <= found <= first_bad
        assert first_bad / last_good - 1.0 <= tolerance
        doublings = 3.0 + math.log2(max(below, above))
        assert len(tried) <= doublings + 3 + math.log2(math.log(2.0) / math.log1p(tolerance) + 1.0)


@given(threshold=st.floats(1e-2, 1e2), off=st.floats(1e-3, 1e3))
def test_a_threshold_is_found_from_a_wrong_guess_too(threshold: float, off: float) -> None:
    found = locate(lambda value: value < threshold, threshold * off, 1e-3)
    assert found == pytest.approx(threshold, rel=1e-3)


def test_a_threshold_that_is_nowhere_near_the_guess_is_refused() -> None:
    with pytest.raises(ValueError, match="the threshold is not between"):
        locate(lambda value: value < 1e6, 1.0, 1e-3)
    with pytest.raises(ValueError, match="the threshold is not between"):
        locate(lambda value: value < 1e-6, 1.0, 1e-3)


@given(threshold=st.floats(0.5, 99.0))
def test_where_no_limit_is_expected_the_first_failure_is_the_limit(threshold: float) -> None:
    tried: list[float] = []

    def holds(_effort: object, value: float) -> bool:
        tried.append(value)
        return value < threshold

    assert Limit(math.inf, holds).measure(QUICK, searched_to=100.0) == tried[-1] >= threshold
    assert tried == sorted(tried)
    assert tried[0] == 0.5
    assert tried[-1] / 1.1 < threshold or threshold == 0.5


def test_what_never_fails_has_an_infinite_limit() -> None:
    assert Limit(math.inf, lambda _effort, _value: True).measure(QUICK, 2.0) == math.inf


@pytest.mark.parametrize(
    ("guess", "tolerance"),
    [(0.0, 0.1), (-1.0, 0.1), (math.inf, 0.1), (math.nan, 0.1), (1.0, 0.0), (1.0, 1.0)],
)
def test_a_search_that_makes_no_sense_is_refused(guess: float, tolerance: float) -> None:
    with pytest.raises(ValueError, match=rf"0 < guess.*found {guess:g} and {tolerance:g}"):
        locate(lambda value: value < 5.0, guess, tolerance)


@pytest.mark.parametrize(
    ("predicted", "measured", "verdict"),
    [
        (1.0, 1.1, "differs"),
        (1.0, 1.005, "holds"),
        (math.inf, 7.0, "differs"),
        (7.0, math.inf, "differs"),
        (7.0, math.nan, "differs"),
        (math.inf, math.inf, "holds"),
    ],
)
def test_a_wrong_prediction_is_found_to_be_wrong(
    predicted: float, measured: float, verdict: str
) -> None:
    """The harness itself can say no: the measured value a tenth off, and a limit where none is."""
    row = judged("servo_rk4_1", Quantity(predicted, lambda _effort: measured), QUICK)
    assert row["verdict"] == verdict
    if math.isfinite(predicted):
        assert row["ratio"] == pytest.approx(measured / predicted, nan_ok=True)


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
