"""What a step is worth."""

from __future__ import annotations

from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.game.result import REWARD_TERMS
from roller_env.game.rewards import NEARNESS_M, RewardWeights, shaping
from roller_env.level import Level
from roller_env.pieces.coin import COIN
from tests.builders import Game, coin, make_level, resting
from tests.game.rails import Rails

ROUTE = {
    "points": [resting(), resting(10.0), resting(10.0, 10.0), resting(20.0, 10.0)],
    "radius": 1.0,
}
WAY_M = 30.0


def route_level(**pieces: object) -> Level:
    return make_level(**{"route": ROUTE} | pieces)


class Route:
    """A ball on a route, and its potential: what the simulation does with it in every step."""

    def __init__(self, level: Level | None = None):
        self._rails = Rails(level or route_level(), reward="shaped")
        self.state = self._rails.state

    def potential(self, x: float, y: float) -> float:
        self._rails.put(*resting(x, y))
        self._rails.wait(self._rails.step_s)
        return float(self.state.shaping.potential[0]) / RewardWeights().progress


def shaping_sum(potentials: list[float], discount: float, ends: bool = False) -> float:
    """Return the discounted sum of the shaping along a trajectory of potentials."""
    total = 0.0
    for step, (before, after) in enumerate(pairwise(potentials)):
        over = ends and step == len(potentials) - 2
        total += discount**step * shaping(before, after, over, discount)
    return total


# Points -------------------------------------------------------------------------------------------


def test_a_coin_is_paid_once() -> None:
    game = Game(make_level(coins=[coin(*resting(1.0))]))
    rewards = [game.step("w").reward[0] for _ in range(30)]
    rewards += [game.step("s").reward[0] for _ in range(60)]
    assert sum(rewards) == 1.0
    assert max(rewards) == 1.0


def test_several_coins_in_one_step_are_all_paid() -> None:
    rails = Rails(make_level(coins=[coin(*resting(0.1 * i)) for i in range(3)]))
    assert rails.go(resting(0.1)).terms[0].tolist() == [3.0, 0.0, 0.0, 0.0]
    assert rails.go(resting()).terms[0].tolist() == [0.0, 0.0, 0.0, 0.0]
    assert rails.state.reward_terms[0].tolist() == [3.0, 0.0, 0.0, 0.0]


def test_the_finish_and_the_fall_are_paid_by_their_weights() -> None:
    weights = RewardWeights(coin=2.0, finish=7.0, fall=-3.0)
    level = make_level(
        finish={"at": (3.0, 0.0, 0.5), "size": (1, 1, 1)}, coins=[coin(*resting(1.0))]
    )
    rails = Rails(level, weights=weights)
    events = rails.go(resting(5.0))
    assert events.terms[0].tolist() == [2.0, 7.0, 0.0, 0.0]
    assert events.reward.tolist() == [9.0]
    events = Rails(make_level(), weights=weights).go((0, 0, -40.0))
    assert events.terms[0].tolist() == [0.0, 0.0, -3.0, 0.0]
    assert events.reward.tolist() == [-3.0]


def test_the_terms_are_added_up_over_an_episode_and_kept_apart() -> None:
    rails = Rails(make_level(coins=[coin(*resting(1.0)), coin(*resting(9.0))]))
    total = sum(rails.go(resting(x)).reward[0] for x in (1.0, 5.0, 9.0))
    rails.go((0, 0, -40.0))
    assert rails.state.reward_terms[0].tolist() == [2.0, 0.0, -1.0, 0.0]
    assert rails.state.total_reward[0] == total - 1.0


def test_the_terms_are_those_that_have_weights() -> None:
    names = tuple(field.name for field in fields(RewardWeights))
    assert names == (*REWARD_TERMS, "completeness")


FINISH_AFTER_COINS = {
    "finish": {"at": (30.0, 0.0, 0.5), "size": (1, 1, 1)},
    "coins": [coin(*resting(x)) for x in (1.0, 3.0, 5.0, 7.0)],
}


@given(coins=st.integers(0, 4), completeness=st.floats(0.0, 8.0))
def test_the_finish_is_worth_less_for_the_coins_left_and_may_cost(
    coins: int, completeness: float
) -> None:
    weights = RewardWeights(coin=0.0, finish=40.0, completeness=completeness)
    rails = Rails(make_level(**FINISH_AFTER_COINS), weights=weights)
    for x in (1.0, 3.0, 5.0, 7.0)[:coins]:
        rails.go(resting(x))
    rails.go(resting(coins * 2.0 - 1.0, 5.0))
    rails.go(resting(30.0, 5.0))
    events = rails.go(resting(30.0))
    expected = 40.0 * (1.0 - completeness * (4 - coins) / 4)
    assert events.terms[0, 1] == pytest.approx(expected, abs=1e-9)


def test_the_finish_of_a_level_without_coins_is_always_paid_in_full() -> None:
    level = make_level(finish={"at": (3.0, 0.0, 0.5), "size": (1, 1, 1)})
    rails = Rails(level, weights=RewardWeights(completeness=3.0))
    assert rails.go(resting(3.0)).terms[0, 1] == RewardWeights().finish


@pytest.mark.parametrize("completeness", [-1.0, 101.0, float("nan")])
def test_a_completeness_that_would_pay_for_coins_left_is_refused(completeness: float) -> None:
    with pytest.raises(ValueError, match=r"reward_weights.completeness: found .* from 0 to 100"):
        RewardWeights(completeness=completeness)


def nearness_potential(rails: Rails, x: float, y: float) -> float:
    rails.put(*resting(x, y))
    rails.wait(rails.step_s)
    return float(rails.state.shaping.potential[0]) / RewardWeights().progress


@given(x=st.floats(-20.0, 20.0), y=st.floats(-20.0, 20.0))
def test_nearness_is_that_of_the_nearest_coin_left(x: float, y: float) -> None:
    places = np.array([resting(-9.0, 4.0), resting(3.0, 9.0), resting(3.0, -12.0), resting(14.0)])
    rails = Rails(make_level(coins=[coin(*place) for place in places]), reward="nearness")
    found = nearness_potential(rails, x, y)
    left = places[~rails.state.of(COIN).taken[0]]
    away = np.linalg.norm(left - resting(x, y), axis=1).min()
    assert found == pytest.approx(max(1.0 - away / NEARNESS_M, 0.0), abs=1e-12)


def test_when_no_coin_is_left_nearness_is_that_of_the_finish() -> None:
    level = make_level(
        coins=[coin(*resting(1.0))], finish={"at": (9.0, 0.0, 0.5), "size": (1, 1, 1)}
    )
    rails = Rails(level, reward="nearness")
    rails.go(resting(1.0))
    finish, ball = np.array([9.0, 0.0, 0.5]), np.array(resting(6.5))
    away = np.linalg.norm(finish - ball)
    assert nearness_potential(rails, 6.5, 0.0) == pytest.approx(1.0 - away / NEARNESS_M)


def test_nearness_needs_no_route_and_adds_up_to_nothing_but_where_an_episode_begins() -> None:
    discount, weight = 0.99, 8.0
    weights = RewardWeights(progress=weight)
    game = Game(
        make_level(coins=[coin(*resting(2.0, 1.0)), coin(*resting(4.0, -1.0))]),
        reward="nearness",
        discount=discount,
        reward_weights=weights,
    )
    plain = Game(make_level(coins=[coin(*resting(2.0, 1.0)), coin(*resting(4.0, -1.0))]))
    begin = float(game.simulation.state.shaping.potential[0])
    total = 0.0
    for step in range(40):
        held = "wa" if step % 7 < 3 else "wd"
        total += discount**step * (game.step(held).reward[0] - plain.step(held).reward[0])
    end = float(game.simulation.state.shaping.potential[0])
    assert begin > 0.0
    assert total == pytest.approx(discount**40 * end - begin, abs=1e-9)


def test_standing_still_is_worth_no_points() -> None:
    game = Game(make_level())
    assert sum(game.step().reward[0] for _ in range(20)) == 0.0


@pytest.mark.parametrize("name", ["coin", "finish", "fall", "progress"])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_weight_that_is_no_finite_number_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"reward_weights.{name}"):
        RewardWeights(**{name: value})


# Progress -----------------------------------------------------------------------------------------


def test_progress_is_the_share_of_the_route_that_lies_behind() -> None:
    route = Route()
    assert route.potential(0.0, 0.0) == 0.0
    assert route.potential(5.0, 0.0) == pytest.approx(5.0 / WAY_M)
    assert route.potential(10.0, 0.0) == pytest.approx(10.0 / WAY_M)
    assert route.potential(10.0, 5.0) == pytest.approx(15.0 / WAY_M)
    assert route.potential(10.0, 10.0) == pytest.approx(20.0 / WAY_M)
    assert route.potential(20.0, 10.0) == pytest.approx(1.0)


def test_progress_stays_between_0_and_1() -> None:
    route = Route()
    assert route.potential(-50.0, 30.0) == 0.0
    assert route.potential(500.0, 500.0) == 0.0


def test_a_waypoint_that_was_missed_does_not_draw_the_ball_back() -> None:
    """A ball thrown over a leg goes on from the leg where it comes down."""
    route = Route()
    assert route.potential(10.5, 8.0) == pytest.approx((20.0 - np.hypot(0.5, 2.0)) / WAY_M)
    before = route.potential(12.0, 10.0)
    assert before == pytest.approx(22.0 / WAY_M)
    assert route.potential(16.0, 10.0) > before


def test_a_leg_out_of_reach_is_not_skipped_to() -> None:
    route = Route()
    route.potential(15.0, 8.5)
    assert route.state.shaping.waypoint[0] == 0
    route.potential(15.0, 9.5)
    assert route.state.shaping.waypoint[0] == 3


def test_a_level_without_a_route_has_no_progress() -> None:
    route = Route(make_level())
    assert route.potential(5.0, 0.0) == 0.0


def test_a_shorter_routes_padding_is_never_followed() -> None:
    short = make_level(route={"points": [resting(), resting(4.0)], "radius": 1.0})
    rails = Rails(short, route_level(), make_level(), reward="shaped")
    for x in (1.0, 4.0, 4.0, 4.0, 4.0):
        rails.put(*resting(x))
        rails.wait(rails.step_s)
    progress = rails.state.shaping.potential / RewardWeights().progress
    np.testing.assert_allclose(progress, [1.0, 4.0 / WAY_M, 0.0])
    assert rails.state.shaping.waypoint.tolist() == [1, 1, 0]


# Shaping ------------------------------------------------------------------------------------------

walks = st.lists(
    st.tuples(st.floats(-3.0, 23.0, allow_nan=False), st.floats(-3.0, 13.0, allow_nan=False)),
    min_size=1,
    max_size=30,
)
discounts = st.sampled_from([0.9, 0.99, 0.999, 1.0])


@given(walks, discounts)
def test_shaping_telescopes_to_minus_the_starts_potential_at_an_end(
    walk: list[tuple[float, float]], discount: float
) -> None:
    """So it never changes which policy is best."""
    route = Route()
    potentials = [route.potential(x, y) for x, y in [(2.0, 0.0), *walk]]
    total = shaping_sum(potentials, discount, ends=True)
    assert total == pytest.approx(-potentials[0], abs=1e-12)


@given(walks, discounts)
def test_shaping_telescopes_to_the_last_potential_where_time_ran_out(
    walk: list[tuple[float, float]], discount: float
) -> None:
    route = Route()
    potentials = [route.potential(x, y) for x, y in [(2.0, 0.0), *walk]]
    expected = discount ** (len(potentials) - 1) * potentials[-1] - potentials[0]
    assert shaping_sum(potentials, discount) == pytest.approx(expected, abs=1e-12)


@given(st.floats(0.0, 20.0), st.integers(1, 50), discounts)
def test_hovering_pays_nothing_or_less(x: float, steps: int, discount: float) -> None:
    potential = Route().potential(x, 0.0)
    assert shaping_sum([potential] * (steps + 1), discount) <= 1e-12


@given(walks, discounts)
def test_circles_pay_nothing_net(walk: list[tuple[float, float]], discount: float) -> None:
    """Whoever comes back to where the route stood no further has gained nothing."""
    route = Route()
    for x, y in [*walk, walk[0]]:
        route.potential(x, y)
    circle = [route.potential(x, y) for x, y in [*walk, walk[0]]]
    if circle[0] == circle[-1]:
        assert shaping_sum(circle, discount) <= 1e-12


def test_going_on_pays_and_going_back_costs() -> None:
    route = Route()
    potentials = [route.potential(x, 0.0) for x in (2.0, 4.0, 3.0)]
    assert shaping_sum(potentials[:2], 0.99) > 0.0
    assert shaping_sum(potentials[1:], 0.99) < 0.0


@settings(max_examples=10, deadline=None)
@given(st.lists(st.sampled_from(["w", "a", "s", "d", "wa", ""]), min_size=5, max_size=40))
def test_in_the_game_shaping_is_all_that_differs_from_points(keys: list[str]) -> None:
    """And it telescopes there too, whatever is played."""
    level = route_level(coins=[coin(*resting(1.5))])
    discount, weight = 0.99, RewardWeights().progress
    shaped = Game(level, reward="shaped", discount=discount)
    plain = Game(level)
    first = Route(level).potential(0.0, 0.0)
    total, route = 0.0, Route(level)
    for step, held in enumerate(keys):
        extra = shaped.step(held).reward[0] - plain.step(held).reward[0]
        total += discount**step * extra
        last = route.potential(*shaped.position[:2])
    expected = weight * (discount ** len(keys) * last - first)
    assert total == pytest.approx(expected, abs=1e-3)


def test_the_fall_takes_the_potential_back() -> None:
    """A terminal state is worth nothing, however far along the route it lies."""
    island = {"at": (3.0, 0.0, -0.5), "size": (8.0, 4.0, 1.0)}
    game = Game(route_level(boxes=[island]), reward="shaped", discount=1.0)
    rewards = []
    while not game.state.over[0]:
        rewards.append(game.step("w").reward[0])
        assert len(rewards) < 400, "the ball never fell"
    assert game.state.fallen[0]
    assert sum(rewards) == pytest.approx(RewardWeights().fall, abs=1e-9)
