"""The order of events, and levels side by side in one table."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.game.kinds import RULES
from roller_env.game.observations import STATE_ENTRIES, STATE_SIZE, split
from roller_env.game.step import Games, observe
from roller_env.game.tables import LevelTable
from roller_env.level import Level, load_level, shipped_levels
from roller_env.pieces.coin import COIN
from roller_env.pieces.finish import FINISH
from roller_env.pieces.lift_pad import LIFT_PAD
from roller_env.pieces.plate import PLATE
from roller_env.pieces.rules import FAR_M
from tests.builders import BALL_RADIUS_M, coin, make_level, q, resting
from tests.game.rails import Rails
from tests.strategies import levels

HIGH = (0.0, 0.0, 100.0)
REACH = 30 * 0.0254


def sky_level(**pieces: Any) -> Level:
    """Everything happens at 100 m, far from the ground; the finish's near face is at x = 10."""
    plain = {
        "start": {"at": HIGH},
        "finish": {"at": (10.5, 0.0, 100.0), "size": (1.0, 4.0, 4.0)},
    }
    return make_level(**plain | pieces)


# Order --------------------------------------------------------------------------------------------

TOUCHES_FINISH_AT = 10.0 - BALL_RADIUS_M - 1e-4


def test_a_coin_reached_in_the_same_instant_as_the_finish_counts() -> None:
    """The ball meets both at the very start of the path, where it is in both."""
    at = (TOUCHES_FINISH_AT + 0.1, 0.0, 100.0)
    rails = Rails(sky_level(coins=[coin(*at)]))
    rails.put(*at)
    events = rails.go((12.0, 0.0, 100.0))
    assert events.entry[0, rails.table.own(FINISH).region] == 0.0
    assert events.coins.tolist() == [[True]]
    assert events.finished[0]


@pytest.mark.parametrize(("ahead_m", "counts"), [(-0.01, True), (0.01, False)])
def test_a_coin_behind_the_finish_does_not_count(ahead_m: float, counts: bool) -> None:
    at = (TOUCHES_FINISH_AT + REACH + ahead_m, 0.0, 100.0)
    rails = Rails(sky_level(coins=[coin(*at)]))
    events = rails.go((40.0, 0.0, 100.0))
    assert events.finished[0]
    assert rails.state.coins[0] == counts


def test_nothing_behind_the_finish_happens() -> None:
    box = {"at": (20.0, 0.0, 100.0), "size": (1.0, 4.0, 4.0)}
    level = sky_level(
        lift_pads=[box],
        camera_triggers=[box | {"kind": "retreat"}],
        plates=[box | {"name": "p", "opens": ["g"], "size": (1.0, 4.0, 0.1)}],
        gates=[box | {"name": "g", "at": (30.0, 0.0, 100.0)}],
        ball={"radius": 0.7},
    )
    rails = Rails(level)
    rails.go((40.0, 0.0, 100.64))
    assert rails.state.finished[0]
    assert not rails.state.of(PLATE).struck.any()
    assert not rails.state.of(LIFT_PAD).thrust_s.any()
    assert rails.state.camera.mode[0] == 0


def test_the_finish_before_the_fall_finishes_and_the_fall_before_the_finish_falls() -> None:
    level = sky_level(kill_height=50.0, boxes=[], finish={"at": (0, 0, 60), "size": (1, 1, 1)})
    rails = Rails(level)
    events = rails.go((0.0, 0.0, 0.0))
    assert (events.finished[0], events.fallen[0]) == (True, False)
    # Past the finish's side, under the kill height, and up into it.
    rails = Rails(level)
    events = rails.go((5.0, 0.0, 60.0), (5.0, 0.0, 40.0), (0.0, 0.0, 60.0))
    assert (events.finished[0], events.fallen[0]) == (False, True)


def test_in_the_same_instant_the_finish_comes_before_the_fall() -> None:
    level = sky_level(kill_height=50.0, boxes=[], finish={"at": (0, 0, 50.6), "size": (9, 9, 1)})
    rails = Rails(level)
    rails.put(0.0, 0.0, 50.0)
    events = rails.go((0.0, 0.0, 50.0))
    assert (events.finished[0], events.fallen[0]) == (True, False)


def test_a_coin_above_the_kill_height_counts_and_one_below_does_not() -> None:
    """Unchecked: the checker refuses a coin that can only be reached after the fall."""
    pieces = {"kill_height": 50.0, "coins": [coin(0, 0, 60), coin(0, 0, 50 - REACH - 0.1)]}
    level = Level.model_validate(sky_level(boxes=[]).model_dump() | pieces)
    rails = Rails(level)
    rails.go((0.0, 0.0, 20.0))
    assert rails.state.fallen[0]
    np.testing.assert_array_equal(rails.state.of(COIN).taken, [[True, False]])


def test_events_at_the_same_moment_have_the_order_of_their_kinds() -> None:
    assert [rules.name for rules in RULES] == [
        "coin",
        "plate",
        "switch",
        "gate",
        "platform",
        "fan",
        "lift_pad",
        "spring",
        "bumper",
        "teleporter",
        "hazard",
        "camera_trigger",
        "checkpoint",
        "finish",
    ]


def test_what_begins_in_a_step_acts_from_the_next() -> None:
    """The task of a step is the one that it began with."""
    pad = {"at": (2.0, 0.0, 100.0), "size": (1.0, 1.0, 1.0)}
    rails = Rails(sky_level(lift_pads=[pad]))
    rails.prepare()
    assert rails.bodies.force_n[0, 2] == 0.0
    rails.go((2.0, 0.0, 100.0))
    rails.prepare()
    assert rails.bodies.force_n[0, 2] == pytest.approx(12.7)


# Side by side -------------------------------------------------------------------------------------


def assert_same_games(together: Rails, alone: Rails, row: int) -> None:
    """Compare a row of a padded table with the same level's own table."""
    everything = together.state.named()
    for name, theirs in alone.state.named().items():
        ours = everything[name][row : row + 1]
        if name == "touching":
            for rules in RULES:
                mine, own = together.table.own(rules), alone.table.own(rules)
                ours_kind = ours[:, mine.region : mine.region + mine.regions]
                theirs_kind = theirs[:, own.region : own.region + own.regions]
                np.testing.assert_array_equal(ours_kind[:, : own.regions], theirs_kind)
                assert not ours_kind[:, own.regions :].any()
        elif ours.ndim > 1:
            width = theirs.shape[1]
            np.testing.assert_array_equal(ours[:, :width], theirs, err_msg=name)
            rest = ours[:, width:]
            waits = name == "camera_trigger/delay_s"
            assert (np.isinf(rest) if waits else rest == 0).all(), name
        else:
            np.testing.assert_array_equal(ours, theirs, err_msg=name)


def random_walk(rng: np.random.Generator, table: LevelTable, steps: int) -> np.ndarray:
    """Return a path, (steps + 1, 3), from region to region of a table's only level."""
    places = np.concatenate([table.regions.centre[0], table.of(COIN).at[0]])
    real = places[places[:, 0] < FAR_M]
    goals = real[rng.integers(len(real), size=steps)] + rng.normal(0.0, 0.5, (steps, 3))
    goals[:, 2] += 0.5
    return np.concatenate([table.start[:1], goals])


@settings(max_examples=12, deadline=None)
@given(st.lists(levels(), min_size=2, max_size=4), st.integers(0, 2**32 - 1))
def test_levels_in_one_table_play_as_each_does_alone(drawn: list[Level], seed: int) -> None:
    rng = np.random.default_rng(seed)
    alone = [Rails(level) for level in drawn]
    together = Rails(*drawn)
    walks = [random_walk(rng, rails.table, steps=6) for rails in alone]
    for step in range(6):
        pieces = np.stack([np.linspace(walk[step], walk[step + 1], 5) for walk in walks])
        all_events = together.follow(pieces)
        for row, rails in enumerate(alone):
            if rails.state.terminated[0]:
                continue
            events = rails.follow(pieces[row : row + 1])
            assert all_events.end[row] == events.end[0]
            assert all_events.collected[row] == events.collected[0] == events.coins[0].sum()
            assert_same_games(together, rails, row)


def test_the_shipped_levels_share_a_table() -> None:
    shipped = [load_level(name) for name in shipped_levels()]
    table = LevelTable.of_levels(shipped)
    for row, level in enumerate(shipped):
        own = LevelTable.of_levels([level])
        for rules in RULES:
            mine, theirs = table.own(rules), own.own(rules)
            ours = table.regions.centre[row, mine.region : mine.region + mine.regions]
            wanted = own.regions.centre[0, theirs.region : theirs.region + theirs.regions]
            np.testing.assert_array_equal(ours[: theirs.regions], wanted)
            real = table.regions.real[row, mine.region : mine.region + mine.regions]
            assert real.sum() == theirs.regions
        coins, alone = table.of(COIN), own.of(COIN)
        count = alone.total[0]
        assert coins.total[row] == count
        np.testing.assert_array_equal(coins.at[row, :count], alone.at[0])
        np.testing.assert_array_equal(coins.order[row, :count], alone.order[0])
        assert table.routes.length[row] == own.routes.length[0]


def test_an_env_plays_the_level_that_it_is_said_to_play() -> None:
    near, far = sky_level(), sky_level(finish={"at": (50.5, 0, 100), "size": (1, 4, 4)})
    games = Games(LevelTable.of_levels([near, far]), np.array([1, 0, 1]), np.full(3, 100))
    rails = Rails(near, near, near)
    out = np.zeros((3, STATE_SIZE), dtype=np.float32)
    observe(games.showing, rails.physics, rails.at, np.arange(3), out)
    finish = split(out, STATE_ENTRIES)["finish"]
    np.testing.assert_array_equal(finish[:, 0], [50.5, 10.5, 50.5])


def test_a_table_of_no_levels_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one"):
        LevelTable.of_levels([])


def test_a_plate_and_a_gate_of_different_levels_do_not_meet() -> None:
    """Row 0's plate opens its own second gate; row 1 has one gate and no plate named so."""
    gate = {"name": "a", "at": q(400, 0, 64), "size": q(16, 128, 224)}
    plate = {"name": "p", "at": q(0, 0, 72), "size": q(112, 112, 22)}
    start = {"at": q(0, 0, 99)}
    two = make_level(
        plates=[
            plate | {"opens": ["b"]},
            plate | {"name": "r", "at": q(0, 300, 72), "opens": ["a"]},
        ],
        gates=[gate, gate | {"name": "b", "at": q(600, 0, 64)}],
        start=start,
    )
    one = make_level(plates=[plate | {"opens": ["a"]}], gates=[gate], start=start)
    rails = Rails(two, one)
    rails.wait(4.0)
    np.testing.assert_array_equal(rails.state.signals, [[False, True], [True, False]])


def test_the_ball_touches_what_it_rests_on() -> None:
    """Soft contacts leave a ball a hair above or below the surface."""
    pad = {"at": (0.0, 0.0, 0.1), "size": (2.0, 2.0, 0.2)}
    for gap, touches in ((-1e-3, True), (5e-5, True), (2e-4, False)):
        rails = Rails(make_level(lift_pads=[pad], start={"at": (0.0, 0.0, 5.0)}))
        x, y, z = resting()
        rails.put(x, y, z + 0.2 + gap)
        rails.wait(0.05)
        assert bool(rails.state.of(LIFT_PAD).thrust_s[0, 0] > 0.0) == touches
