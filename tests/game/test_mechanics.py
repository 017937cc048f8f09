"""The mechanics of the original, one statement a test.

Everything is in the original's quants (q) where the original's numbers are meant.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from roller_env.game.step import HANGING_S, INTRO_S
from roller_env.level import Level
from roller_env.level.schema import Ball
from roller_env.pieces.gate import LOWERS_TO_M, Gate
from roller_env.pieces.lift_pad import LIFT_PAD, LiftPad
from roller_env.pieces.plate import PLATE, SINKS_TO_M, Plate
from tests.builders import BALL_RADIUS_M, GRAVITY, Game, coin, make_level, q, resting
from tests.game.rails import Rails

Q = 0.0254


# Constants ----------------------------------------------------------------------------------------


def test_the_originals_constants_are_the_defaults() -> None:
    level = make_level()
    assert level.gravity == pytest.approx(386 * Q) == pytest.approx(9.8044)
    assert level.kill_height == pytest.approx(-1129 * Q) == pytest.approx(-28.68, abs=0.005)
    ball = Ball()
    assert (ball.radius / Q, ball.mass_kg) == pytest.approx((16.0, 1.0))
    assert (ball.friction, ball.elasticity) == (0.3, 0.0)
    plate = Plate(name="p", at=(0, 0, 2), size=(1, 1, 1), opens=("g",))
    assert (plate.speed / Q, SINKS_TO_M / Q) == pytest.approx((1.6, 67.0))
    gate = Gate(name="g", at=(0, 0, 2), size=(1, 1, 1))
    assert (gate.speed / Q, LOWERS_TO_M / Q) == pytest.approx((32.0, -32.0))
    pad = LiftPad(at=(0, 0, 0), size=(1, 1, 1))
    assert (pad.force_n, pad.duration_s) == pytest.approx((12.7, 5.0))


def test_a_key_makes_the_ball_roll_with_3_629_m_s2() -> None:
    game = Game(make_level())
    game.play(2.0, "w")
    assert game.observed("velocity")[0] / 2.0 == pytest.approx(3.629, rel=1e-3)


# Intro --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("control_dt_s", [1 / 60, 1 / 20, 1 / 8])
def test_the_keys_work_six_seconds_after_loading_and_not_before(control_dt_s: float) -> None:
    game = Game(make_level(), control_dt_s)
    game.simulation.reset(intro=True)
    game.play(5.99, "w")
    assert game.position[0] == 0.0
    game.play(6.0 - round(5.99 / control_dt_s) * control_dt_s, "w")
    assert abs(game.position[0]) < 1e-6
    assert INTRO_S == 6.0
    game.play(1.0, "w")
    assert game.position[0] == pytest.approx(0.5 * 3.629, rel=0.03)


@pytest.mark.parametrize("control_dt_s", [1 / 60, 1 / 20, 1 / 8])
def test_the_ball_hangs_through_the_splash_second_and_ten_frames_and_then_falls(
    control_dt_s: float,
) -> None:
    """However long a step is: it is let go within one."""
    game = Game(make_level(start={"at": (0.0, 0.0, 10.0)}), control_dt_s)
    game.simulation.reset(intro=True)
    assert math.isclose(HANGING_S, 1.0 + 10 / 60)
    heights = game.play(2.0)[:, 2]
    elapsed = control_dt_s * np.arange(1, len(heights) + 1)
    assert (heights[elapsed <= HANGING_S + 1e-9] == 10.0).all()
    fall_s = elapsed[-1] - HANGING_S
    # Euler's steps of 1/240 s are half a step ahead.
    assert 10.0 - heights[-1] == pytest.approx(GRAVITY * fall_s * (fall_s + 1 / 240) / 2, rel=1e-6)
    game.play(1.5)
    assert game.position[2] == pytest.approx(BALL_RADIUS_M, abs=1e-2), "still in the intro"


def test_nothing_happens_while_the_ball_hangs() -> None:
    """No coin is taken and no pad fires, though the ball is in reach of both; then both do."""
    pad = {"at": q(0, 0, -4), "size": q(64, 64, 8)}
    floor = {"at": (0.0, 0.0, -2.0), "size": (40.0, 40.0, 3.0)}
    level = make_level(coins=[coin(*resting())], lift_pads=[pad], boxes=[floor])
    game = Game(level, control_dt_s=1 / 60)
    game.simulation.reset(intro=True)
    game.play(HANGING_S)
    assert (game.state.coins[0], game.state.of(LIFT_PAD).thrust_s[0, 0]) == (0, 0.0)
    game.step()
    assert (game.state.coins[0], game.state.of(LIFT_PAD).thrust_s[0, 0]) == (1, 5.0)


def test_games_with_and_without_an_intro_stand_side_by_side() -> None:
    """A row in its splash hangs, its neighbours play on, each as it would alone."""
    level = make_level(start={"at": (0.0, 0.0, 3.0), "jitter": (0.5, 0.5)})
    together, alone = Game(level, num_envs=3), Game(level)
    together.simulation.reset()
    together.simulation.reset(np.array([1]), intro=True)
    starts = [together.simulation.snapshot(np.array([row])) for row in range(3)]
    paths = []
    for _ in range(40):
        together.step("wa")
        paths.append(together.simulation.ball_position)
    for row in range(3):
        alone.simulation.restore(starts[row])
        path = alone.play(2.0, "wa")
        np.testing.assert_array_equal(np.array(paths)[:, row], path)


def test_without_the_intro_the_keys_work_at_once() -> None:
    game = Game(make_level())
    game.play(0.5, "w")
    assert game.position[0] > 0.3


# Plates -------------------------------------------------------------------------------------------

BUTTON = {"name": "plate", "at": q(0, 0, 72), "size": q(112, 112, 22), "opens": ["gate"]}
GATE = {
    "name": "gate",
    "at": q(400, 0, 64),
    "size": q(16, 128, 224),
    "lowers_to": LOWERS_TO_M,
}
ON_PLATE = q(0, 0, 83 + 16)


def plate_level(**pieces: Any) -> Level:
    """A ball that stands on a plate, and the gate that the plate opens."""
    plain: dict[str, Any] = {"plates": [BUTTON], "gates": [GATE], "start": {"at": ON_PLATE}}
    return make_level(**plain | pieces)


def test_a_plate_sinks_at_1_6_quants_a_second_until_67_quants() -> None:
    game = Game(plate_level())
    game.step()
    assert game.state.of(PLATE).struck[0, 0]
    game.play(1.0)
    before = game.slab("plate")
    game.play(1.0)
    assert (game.slab("plate") - before) / Q == pytest.approx(-1.6, rel=0.02)
    game.play(3.0)
    assert 72.0 + game.slab("plate") / Q == pytest.approx(67.0, abs=1.6 / 60 + 1e-3)


def test_a_plates_flag_is_set_only_when_it_is_down() -> None:
    game = Game(plate_level(), control_dt_s=1 / 20)
    game.step()
    while not game.state.of(PLATE).down[0, 0]:
        assert game.slab("plate") / Q > -5.0
        assert not game.state.signals[0, 0]
        assert game.simulation.time_s[0] < 10.0, "the plate never came down"
        game.step()
    assert game.slab("plate") / Q <= -5.0
    assert game.simulation.time_s[0] == pytest.approx(0.05 + 5.0 / 1.6, abs=0.1)


@pytest.mark.parametrize(("height_q", "counts"), [(24.9, False), (25.0, True), (25.1, True)])
def test_a_plate_is_struck_only_from_more_than_25_quants_above_it(
    height_q: float, counts: bool
) -> None:
    """On rails: a ball that touches the plate's edge with its centre at that height."""
    rails = Rails(plate_level(start={"at": q(0, 0, 200)}))
    rails.put(*q(-90, 0, 72 + height_q))
    rails.go(q(-56 - 4, 0, 72 + height_q))
    assert rails.state.of(PLATE).struck[0, 0] == counts


def test_a_hit_from_the_side_does_not_count() -> None:
    """The ball rolls against a plate as high as itself and pushes on."""
    wall = BUTTON | {"at": q(100, 0, 13), "size": q(64, 112, 26), "sinks_to": 0.0}
    game = Game(plate_level(plates=[wall], start={"at": resting()}))
    game.play(4.0, "w")
    touches_at = q(100 - 32 - 16, 0, 0)[0]
    assert game.position[0] == pytest.approx(touches_at, abs=1e-3)
    assert not game.state.of(PLATE).struck[0, 0]


def test_a_ball_of_16_quants_counts_only_on_plates_thicker_than_18_quants() -> None:
    for thickness, counts in ((17.8, False), (18.2, True)):
        rails = Rails(
            Level.model_validate(
                {
                    "name": "thin",
                    "start": {"at": q(0, 0, 72 + thickness / 2 + 16 + 10)},
                    "finish": {"at": (90, 0, 0), "size": (1, 1, 1)},
                    "plates": [BUTTON | {"size": q(112, 112, thickness)}],
                }
            )
        )
        rails.go(q(0, 0, 72 + thickness / 2 + 16))
        assert rails.state.of(PLATE).struck[0, 0] == counts


def test_a_plate_goes_on_sinking_when_the_ball_leaves() -> None:
    game = Game(plate_level())
    game.step()
    game.place(q(200, 200, 16))
    game.play(4.0)
    assert game.slab("plate") / Q <= -5.0
    assert game.state.of(PLATE).down[0, 0]


def test_a_plate_fires_once_while_the_ball_rests_on_it() -> None:
    rails = Rails(plate_level())
    region = rails.table.own(PLATE).region
    struck = [bool(np.isfinite(rails.go(ON_PLATE).entry[0, region])) for _ in range(100)]
    assert struck == [True] + [False] * 99


def test_a_struck_plate_is_not_struck_again_when_the_ball_comes_back() -> None:
    rails = Rails(plate_level(start={"at": q(0, 0, 200)}))
    region, struck = rails.table.own(PLATE).region, []
    for _ in range(3):
        struck.append(bool(np.isfinite(rails.go(ON_PLATE).entry[0, region])))
        rails.go(q(0, 0, 200))
    assert struck == [True, False, False]


def test_gates_wait_and_then_lower_at_32_quants_a_second_until_minus_32() -> None:
    game = Game(plate_level())
    while not game.state.signals[0, 0]:
        assert abs(game.slab("gate")) < 1e-6, "it waits for the plate"
        assert game.simulation.time_s[0] < 10.0, "the gate never opened"
        game.step()
    game.play(1.0)
    before = game.slab("gate")
    game.play(1.0)
    assert (game.slab("gate") - before) / Q == pytest.approx(-32.0, rel=0.02)
    game.play(2.0)
    assert 64.0 + game.slab("gate") / Q == pytest.approx(-32.0, abs=32 / 60 + 1e-3)


def test_a_gate_stops_the_ball_until_it_is_open() -> None:
    start = {"at": q(350, 0, 16)}
    short = BUTTON | {"at": q(0, 0, 70)}
    gate = GATE | {"at": q(400, 0, 31), "size": q(16, 128, 60)}
    game = Game(plate_level(plates=[short], gates=[gate], start=start))
    game.play(3.0, "w")
    assert game.position[0] / Q == pytest.approx(400 - 8 - 16, abs=0.1)
    game.state.of(PLATE).struck[:] = True
    game.play(8.0, "w")
    assert game.position[0] / Q > 420


def test_a_plate_opens_only_the_gates_that_it_names() -> None:
    gates = [GATE | {"name": name, "at": q(400, 300 * i, 64)} for i, name in enumerate("abc")]
    plates = [
        BUTTON | {"name": "first", "opens": ["a", "c"]},
        BUTTON | {"name": "second", "at": q(-300, 0, 72), "opens": ["b"]},
    ]
    game = Game(plate_level(plates=plates, gates=gates))
    game.play(8.0)
    opened = [game.slab(name) / Q < -90 for name in "abc"]
    assert opened == [True, False, True]
    game.place(q(-300, 0, 99))
    game.play(8.0)
    assert all(game.slab(name) / Q < -90 for name in "abc")


def test_any_one_of_two_plates_opens_their_gate_and_it_lowers_once() -> None:
    plates = [BUTTON, BUTTON | {"name": "other", "at": q(-300, 0, 72)}]
    game = Game(plate_level(plates=plates))
    game.play(8.0)
    open_at = game.slab("gate")
    game.place(q(-300, 0, 99))
    game.play(6.0)
    assert game.slab("gate") == pytest.approx(open_at, abs=1e-9)


# Coins --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("distance_q", "taken"), [(29.9, True), (30.1, False)])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0), (0, 0, 1), (0.6, 0.0, 0.8)])
def test_a_coin_is_taken_30_quants_from_the_balls_centre(
    distance_q: float, taken: bool, direction: tuple[float, float, float]
) -> None:
    at = np.array([0.0, 0.0, 5.0]) + distance_q * Q * np.array(direction)
    game = Game(make_level(coins=[coin(*at)], start={"at": (0.0, 0.0, 5.0)}, gravity=0.001))
    game.step()
    assert game.state.coins[0] == taken


def test_a_coin_has_no_substance_and_counts_once() -> None:
    level = make_level(coins=[coin(*resting(1.0))])
    game = Game(level)
    path = game.play(2.0, "w")
    np.testing.assert_array_equal(path, Game(make_level()).play(2.0, "w"))
    game.play(2.0, "s")
    assert game.state.coins[0] == 1


def test_all_coins_in_reach_are_taken_at_once() -> None:
    coins = [coin(*resting(0.1 * i)) for i in range(5)]
    game = Game(make_level(coins=coins))
    game.step()
    assert game.state.coins[0] == 5


# Lift pads ----------------------------------------------------------------------------------------

PAD = {"at": q(0, 0, 2), "size": q(72, 72, 4)}
ON_PAD = q(0, 0, 4 + 16)


def lift_level(**pieces: Any) -> Level:
    """A ball that stands on a pad, with nothing around."""
    return make_level(**{"lift_pads": [PAD], "start": {"at": ON_PAD}} | pieces)


@pytest.mark.parametrize("physics", ["fast", "default", "accurate", "rigid"])
def test_a_pad_lifts_1425_quants_while_it_pushes_and_1846_with_the_coast(physics: str) -> None:
    game = Game(lift_level(), physics=physics)
    game.step()
    assert game.state.of(LIFT_PAD).thrust_s[0, 0] == 5.0
    ground = game.position[2]
    pushed = game.play(5.0)
    assert (pushed[-1, 2] - ground) / Q == pytest.approx(1425.0, rel=0.01)
    coast = game.play(2.0)
    assert (coast[:, 2].max() - ground) / Q == pytest.approx(1846.0, rel=0.01)
    assert coast[:, 2].max() - ground == pytest.approx(46.9, rel=0.01)


def test_a_pad_pushes_with_12_7_newtons() -> None:
    """Net of gravity 114 quant/s^2."""
    game = Game(lift_level())
    game.play(2.05)
    velocity = game.observed("velocity")[2]
    assert velocity / 2.0 / Q == pytest.approx(114.0, rel=0.01)


def test_a_pad_fires_again_when_the_ball_falls_back_on_it() -> None:
    game = Game(lift_level())
    game.play(5.05)
    assert game.state.of(LIFT_PAD).thrust_s[0, 0] == 0.0
    fired = 0
    for _ in range(round(12.0 / 0.05)):
        before = game.state.of(LIFT_PAD).thrust_s[0, 0]
        game.step()
        fired += game.state.of(LIFT_PAD).thrust_s[0, 0] > before
    assert fired == 1
    assert game.position[2] > 5.0, "and it lifts the ball again"


def test_a_pad_does_not_fire_while_it_pushes() -> None:
    """On rails: the ball comes back four times in five seconds."""
    rails = Rails(lift_level(start={"at": q(0, 0, 200)}))
    rails.go(ON_PAD)
    for _ in range(4):
        rails.go(q(0, 0, 200))
        rails.go(ON_PAD)
    rails.go(q(0, 0, 200))
    pushed = 5.0 - 9 * rails.step_s
    assert rails.state.of(LIFT_PAD).thrust_s[0, 0] == pytest.approx(pushed)
    rails.wait(pushed)
    assert rails.state.of(LIFT_PAD).thrust_s[0, 0] == 0.0
    rails.go(ON_PAD)
    assert rails.state.of(LIFT_PAD).thrust_s[0, 0] == 5.0


def test_a_pad_does_not_fire_again_under_a_ball_that_stays_on_it() -> None:
    """Entering counts, not being there: here the ball is held down."""
    rails = Rails(lift_level())
    rails.wait(12.0)
    assert rails.state.of(LIFT_PAD).thrust_s[0, 0] == 0.0


def test_two_pads_have_timers_of_their_own_and_their_forces_add() -> None:
    pads = [PAD, PAD | {"at": q(200, 0, 2)}]
    rails = Rails(lift_level(lift_pads=pads))
    rails.wait(0.05)
    rails.put(*q(200, 0, 100))
    rails.wait(1.0)
    rails.go(q(200, 0, 20))
    np.testing.assert_allclose(rails.state.of(LIFT_PAD).thrust_s, [[5.0 - 1.05, 5.0]])


HALF = {"size": q(36, 72, 4)}
LEFT, RIGHT = PAD | HALF | {"at": q(-18, 0, 2)}, PAD | HALF | {"at": q(18, 0, 2)}


def test_two_pads_under_the_ball_that_do_not_touch_push_with_both_forces() -> None:
    apart = [LEFT | {"at": q(-18.1, 0, 2)}, RIGHT | {"at": q(18.1, 0, 2)}]
    game = Game(lift_level(lift_pads=apart))
    game.play(1.05)
    net = 2 * 12.7 - GRAVITY
    assert game.observed("velocity")[2] == pytest.approx(net, rel=0.01)


@pytest.mark.parametrize("overlap", [0.0, 5.0, 36.0])
def test_a_pad_split_in_two_throws_the_ball_as_high_as_a_whole_one(overlap: float) -> None:
    game = Game(lift_level(lift_pads=[LEFT, RIGHT | {"at": q(18 - overlap, 0, 2)}]))
    assert game.play(8.0)[:, 2].max() - BALL_RADIUS_M == pytest.approx(46.9, rel=0.02)


def test_pads_that_touch_have_one_timer_and_the_first_one_entered_pushes() -> None:
    strong = RIGHT | {"force_n": 40.0, "duration_s": 2.0}
    rails = Rails(lift_level(lift_pads=[LEFT, strong], start={"at": q(100, 0, 20)}))
    rails.go(q(-18, 0, 20))
    np.testing.assert_array_equal(rails.state.of(LIFT_PAD).thrust_s, [[0.0, 2.0]])
    rails.go(q(-18, 0, 200), q(-18, 0, 20))
    np.testing.assert_allclose(rails.state.of(LIFT_PAD).thrust_s, [[0.0, 1.95]])
    rails.go(q(-18, 0, 200))
    rails.wait(2.0)
    rails.go(q(-18, 0, 20))
    np.testing.assert_array_equal(rails.state.of(LIFT_PAD).thrust_s, [[5.0, 0.0]])


def test_a_pad_is_solid() -> None:
    block = {"at": (3.0, 0.0, 0.5), "size": (1.0, 4.0, 1.0), "force_n": 9.9}
    game = Game(make_level(lift_pads=[block], ball={"friction": 0.0}))
    path = game.play(1.8, "w")
    assert path[:, 0].max() == pytest.approx(2.5 - BALL_RADIUS_M, abs=0.02)


def test_a_tubes_walls_hold_the_ball() -> None:
    """The ball is lifted through a tube while a key pushes it against the wall."""
    tube = {"start": q(0, 0, 60), "end": q(0, 0, 1500), "inner_radius": q(56, 0, 0)[0]}
    game = Game(lift_level(tubes=[tube]))
    game.step()
    game.play(1.0)
    path = game.play(4.0, "w")
    inside = path[(path[:, 2] > 2.0) & (path[:, 2] < 35.0)]
    assert len(inside) > 50
    reach = (56 - 16) * Q / math.cos(math.pi / 16)
    assert np.linalg.norm(inside[:, :2], axis=1).max() < reach + 0.01


# Finish -------------------------------------------------------------------------------------------


def finish_level(**pieces: Any) -> Level:
    return make_level(**{"finish": {"at": (3.0, 0.0, 0.5), "size": (1.0, 4.0, 1.0)}} | pieces)


def test_the_finish_freezes_the_ball() -> None:
    game = Game(finish_level())
    game.play(3.0, "w")
    assert game.state.finished[0]
    where = game.position
    transition = game.step("w")
    np.testing.assert_array_equal(game.position, where)
    assert not transition.stepped[0]
    assert transition.terminated[0]


def test_the_finish_is_reached_when_the_balls_surface_touches_it() -> None:
    for gap, reached in ((0.001, False), (-0.001, True)):
        rails = Rails(finish_level())
        rails.go(resting(2.5 - BALL_RADIUS_M - gap))
        assert rails.state.finished[0] == reached


@pytest.mark.parametrize(("taken", "percent"), [(0, 0.0), (1, 25.0), (3, 75.0), (4, 100.0)])
def test_the_score_is_the_percentage_of_the_coins(taken: int, percent: float) -> None:
    near = [coin(*resting(0.1 * i)) for i in range(taken)]
    far = [coin(*resting(-50.0 - i)) for i in range(4 - taken)]
    game = Game(finish_level(coins=near + far))
    game.play(3.0, "w")
    results = game.simulation.results(np.array([0]))
    assert results["success"][0]
    assert results["score_percent"][0] == percent
    assert results["coins"][0] == taken


def test_a_level_without_coins_scores_100_at_the_finish_and_nothing_before() -> None:
    game = Game(finish_level())
    with np.errstate(all="raise"):
        assert game.simulation.results(np.array([0]))["score_percent"][0] == 0.0
        game.play(3.0, "w")
        assert game.simulation.results(np.array([0]))["score_percent"][0] == 100.0


def test_a_fall_on_a_level_without_coins_scores_nothing() -> None:
    game = Game(make_level(boxes=[{"at": (0.0, 0.0, -0.5), "size": (1.0, 1.0, 1.0)}]))
    game.play(5.0, "w")
    results = game.simulation.results(np.array([0]))
    assert results["fall"][0]
    assert results["score_percent"][0] == 0.0


# Fall and reset -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("depth_q", "fallen"), [(-1128.9, False), (-1129.0, True)])
def test_the_ball_has_fallen_at_minus_1129_quants(depth_q: float, fallen: bool) -> None:
    rails = Rails(make_level())
    rails.put(50.0, 0.0, -5.0)
    events = rails.go((50.0, 0.0, depth_q * Q))
    assert events.fallen[0] == fallen
    assert rails.state.fallen[0] == fallen


def test_a_ball_that_rolls_off_the_floor_falls() -> None:
    island = {"at": (0.0, 0.0, -0.5), "size": (4.0, 4.0, 1.0)}
    game = Game(make_level(boxes=[island]))
    game.play(2.0, "w")
    assert not game.state.over[0]
    game.play(2.5, "w")
    assert game.state.fallen[0]
    assert game.position[2] < -1129 * Q
    assert game.simulation.results(np.array([0]))["fall"][0]


def test_a_reset_gives_a_fresh_level_with_control_on() -> None:
    """Plate flag, camera mode, points and the slabs; and the keys work at once."""
    switch = {"kind": "first_person", "at": ON_PLATE, "reach": 1.0}
    level = plate_level(
        coins=[coin(*ON_PLATE)],
        camera_triggers=[switch],
        lift_pads=[PAD | {"at": q(200, 0, 2)}],
    )
    game = Game(level)
    fresh = game.state.copy_rows().named()
    first = game.simulation.observe()
    game.play(5.0)
    assert game.state.coins[0] == 1
    assert game.state.of(PLATE).down[0, 0]
    assert game.slab("gate") < -0.5
    game.place(q(200, 0, 20))
    game.play(0.5)
    assert game.state.of(LIFT_PAD).thrust_s[0, 0] > 0.0
    game.simulation.reset()
    for name, array in game.state.named().items():
        np.testing.assert_array_equal(array, fresh[name], err_msg=name)
    np.testing.assert_array_equal(game.simulation.observe(), first)
    assert game.slab("gate") == game.slab("plate") == 0.0
    x = game.position[0]
    game.play(0.5, "w")
    assert game.position[0] > x + 0.1


# Faults of the original that are not carried over -------------------------------------------------


def test_the_lift_does_not_depend_on_how_often_the_game_is_stepped() -> None:
    rises = []
    for control_dt_s in (1 / 60, 1 / 20, 1 / 10):
        game = Game(lift_level(), control_dt_s)
        while game.state.of(LIFT_PAD).thrust_s[0, 0] == 0.0:
            game.step()
        rises.append(game.play(7.0)[:, 2].max())
    assert rises == pytest.approx([rises[0]] * 3, rel=2e-4)


def test_a_push_that_ends_within_a_step_gives_its_whole_impulse_and_no_more() -> None:
    speeds = []
    for control_dt_s in (1 / 60, 1 / 20, 1 / 8):
        game = Game(
            lift_level(lift_pads=[PAD | {"duration_s": 0.33, "force_n": 50.0}]), control_dt_s
        )
        while game.state.of(LIFT_PAD).thrust_s[0, 0] == 0.0:
            game.step()
        game.play(0.5)
        speeds.append(game.observed("velocity")[2] + GRAVITY * 0.5)
    assert speeds == pytest.approx([50.0 * 0.33] * 3, rel=2e-3)


def test_the_score_can_be_100_and_counts_more_than_two_digits() -> None:
    grid = {"grid": {"centre": resting(), "spacing": (0.03, 0.03), "count": (11, 11)}}
    game = Game(make_level(coins=[grid]))
    game.step()
    results = game.simulation.results(np.array([0]))
    assert (results["coins"][0], results["score_percent"][0]) == (121, 100.0)


def test_the_coins_are_counted_from_the_first_moment() -> None:
    """The original zeroed the counter after the coins had counted themselves."""
    game = Game(make_level(coins=[coin(*resting(5.0)), coin(*resting(-5.0))]))
    assert game.simulation.coins_in_level[0] == 2
    assert game.observed("coins_left")[0] == 1.0


def test_hitting_a_plate_again_does_not_make_it_sink_faster() -> None:
    game = Game(plate_level())
    game.step()
    for _ in range(5):
        game.place(q(0, 0, 140))
        game.play(0.4)
    before = game.slab("plate")
    game.place(q(0, 0, 110))
    game.play(0.5)
    assert (game.slab("plate") - before) / 0.5 / Q == pytest.approx(-1.6, rel=0.05)
