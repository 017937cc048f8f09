"""What an agent is shown."""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from roller_env.game.observations import (
    HORIZONTAL_RAYS,
    RAY_ENTRIES,
    RAY_RANGE_M,
    SCAN_DEPTH_M,
    SCAN_SIDE,
    SCAN_SPACING_M,
    STATE_ENTRIES,
    STATE_SIZE,
    entries,
    layout,
    ray_directions,
    rotated,
    scan_offsets,
    split,
)
from roller_env.game.step import observe
from roller_env.level import load_level, shipped_levels
from roller_env.pieces.coin import NEAREST_COINS
from roller_env.pieces.gate import LOWERS_TO_M
from tests.builders import BALL_RADIUS_M, Game, coin, make_level, q, resting
from tests.game.rails import Rails

# Layout -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["state", "rays", "dict"])
def test_the_entries_lie_one_behind_the_other_and_fill_the_vector(mode: str) -> None:
    parts = entries(mode)  # type: ignore[arg-type]
    places = list(layout(parts).values())
    assert places[0].start == 0
    assert all(a.stop == b.start for a, b in pairwise(places))
    assert [place.stop - place.start for place in places] == [part.size for part in parts]
    assert len({part.name for part in parts}) == len(parts)
    observed = Game(make_level(), observation=mode).simulation.observe()
    assert observed.shape == (1, places[-1].stop)
    assert observed.dtype == np.float32


def test_pixels_have_no_entries() -> None:
    assert entries("pixels") == ()


def test_the_state_has_the_size_of_its_entries() -> None:
    assert sum(part.size for part in STATE_ENTRIES) == STATE_SIZE


@pytest.mark.parametrize("name", shipped_levels())
def test_every_number_lies_in_its_entrys_range_while_the_level_is_played(name: str) -> None:
    game = Game(load_level(name), num_envs=8, observation="rays")
    rng = np.random.default_rng(0)
    parts = game.simulation.entries
    for _ in range(100):
        game.simulation.step(rng.uniform(-8.0, 8.0, (8, 2)))
        for part, values in zip(
            parts, split(game.simulation.observe(), parts).values(), strict=True
        ):
            assert np.isfinite(values).all(), part.name
            assert (values >= part.low).all(), part.name
            assert (values <= part.high).all(), part.name


def test_split_gives_every_entry_its_part() -> None:
    vector = np.arange(2 * STATE_SIZE, dtype=np.float32).reshape(2, STATE_SIZE)
    parts = split(vector, STATE_ENTRIES)
    np.testing.assert_array_equal(np.concatenate(list(parts.values()), axis=1), vector)


# The ball -----------------------------------------------------------------------------------------


def test_the_ball_is_shown_where_it_is_and_as_it_moves() -> None:
    game = Game(make_level(start={"at": (1.0, -2.0, 50.0)}, gravity=0.001))
    game.place((1.5, -2.5, 50.5), (3.0, -4.0, 5.0))
    np.testing.assert_allclose(game.observed("position"), [1.5, -2.5, 50.5])
    np.testing.assert_allclose(game.observed("velocity"), [3.0, -4.0, 5.0])


def test_the_spin_is_shown_in_the_worlds_frame() -> None:
    """A ball that rolls forward (+x) spins about +y (to the left) at v/r, however it has turned."""
    game = Game(make_level())
    game.play(2.0, "w")
    speed = game.observed("velocity")[0]
    expected = [0.0, speed / BALL_RADIUS_M, 0.0]
    np.testing.assert_allclose(game.observed("angular_velocity"), expected, rtol=2e-3, atol=1e-4)
    game.play(1.3, "a")
    x, y, _ = game.observed("velocity")
    expected = [-y / BALL_RADIUS_M, x / BALL_RADIUS_M, 0.0]
    np.testing.assert_allclose(game.observed("angular_velocity"), expected, rtol=2e-3, atol=0.02)


@given(
    hnp.arrays(np.float64, 4, elements=st.floats(-1, 1)).filter(lambda a: np.linalg.norm(a) > 0.1),
    hnp.arrays(np.float64, 3, elements=st.floats(-50, 50)),
)
def test_vectors_are_rotated_as_mujoco_rotates_them(
    quaternion: np.ndarray, vector: np.ndarray
) -> None:
    quaternion = quaternion / np.linalg.norm(quaternion)
    expected = np.empty(3)
    mujoco.mju_rotVecQuat(expected, vector, quaternion)
    np.testing.assert_allclose(rotated(quaternion, vector), expected, atol=1e-12)


# Coins --------------------------------------------------------------------------------------------


def test_the_nearest_coins_are_shown_nearest_first_from_the_ball() -> None:
    at = [resting(9.0), resting(-3.0), resting(0.0, 5.0), resting(30.0), resting(4.0, -4.0)]
    game = Game(make_level(coins=[coin(*point) for point in at]))
    shown = game.observed("coins").reshape(NEAREST_COINS, 3)
    np.testing.assert_allclose(shown, [[-3, 0, 0], [0, 5, 0], [4, -4, 0], [9, 0, 0]], atol=1e-6)
    np.testing.assert_array_equal(game.observed("coins_present"), [1, 1, 1, 1])
    np.testing.assert_array_equal(game.observed("coins_left"), [1.0])


@given(st.lists(st.tuples(st.integers(-40, 40), st.integers(-40, 40)), min_size=1, max_size=12))
def test_whatever_coins_there_are_the_nearest_are_shown(places: list[tuple[int, int]]) -> None:
    coins = [coin(*resting(2.0 * x, 2.0 * y)) for x, y in places]
    game = Game(make_level(coins=coins))
    distances = np.sort([2.0 * np.hypot(x, y) for x, y in places])[:NEAREST_COINS]
    shown = np.linalg.norm(game.observed("coins").reshape(-1, 3), axis=1)
    np.testing.assert_allclose(shown[: len(distances)], distances, rtol=1e-6)
    assert not shown[len(distances) :].any()
    assert game.observed("coins_present").sum() == len(distances)


def test_a_ball_that_is_nowhere_sees_no_coin_and_does_not_disturb_the_others() -> None:
    rails = Rails(*[make_level(coins=[coin(*resting(2.0)), coin(*resting(7.0))])] * 2)
    rails.bodies.position[:] = [[np.nan, 0.0, 1.0], [1.0, 0.0, 1.0]]
    out = np.zeros((2, STATE_SIZE), dtype=np.float32)
    observe(rails.games.showing, rails.physics, rails.at, np.arange(2), out)
    np.testing.assert_array_equal(
        split(out, STATE_ENTRIES)["coins_present"], [[0, 0, 0, 0], [1, 1, 0, 0]]
    )


def test_a_taken_coin_is_not_shown() -> None:
    game = Game(make_level(coins=[coin(*resting(0.2)), coin(*resting(7.0))]))
    game.step()
    np.testing.assert_array_equal(game.observed("coins_left"), [0.5])
    np.testing.assert_array_equal(game.observed("coins_present"), [1, 0, 0, 0])
    x = game.position[0]
    np.testing.assert_allclose(game.observed("coins"), [7.0 - x] + [0.0] * 11, atol=1e-3)


def test_a_level_without_anything_shows_nothing() -> None:
    game = Game(make_level())
    for name in ("coins_left", "coins", "coins_present", "plate", "plate_present", "gate"):
        assert not game.observed(name).any(), name
    for name in ("gate_present", "gate_lowered", "pad", "pad_present", "thrust_left"):
        assert not game.observed(name).any(), name


# Plates, gates, pads ------------------------------------------------------------------------------


def machine_game() -> Game:
    """A ball that stands on a plate, with the plate's gate, another plate, and a pad."""
    level = make_level(
        start={"at": q(0, 0, 99)},
        plates=[
            {"name": "here", "at": q(0, 0, 72), "size": q(112, 112, 22), "opens": ["gate"]},
            {"name": "there", "at": q(0, 400, 72), "size": q(112, 112, 22), "opens": ["gate"]},
        ],
        gates=[
            {"name": "gate", "at": q(400, 0, 64), "size": q(16, 128, 224), "lowers_to": LOWERS_TO_M}
        ],
        lift_pads=[{"at": q(-300, 0, 2), "size": q(72, 72, 4)}],
    )
    return Game(level)


def test_plates_gates_and_pads_are_shown_from_the_ball() -> None:
    game = machine_game()
    np.testing.assert_allclose(game.observed("plate"), q(0, 0, 72 - 99), rtol=1e-6)
    np.testing.assert_allclose(game.observed("gate"), q(400, 0, 64 - 99), rtol=1e-6)
    np.testing.assert_allclose(game.observed("pad"), q(-300, 0, 2 - 99), rtol=1e-6)
    for name in ("plate_present", "gate_present", "pad_present"):
        assert game.observed(name)[0] == 1.0
    assert game.observed("plate_sinking")[0] == 0.0
    assert game.observed("gate_lowered")[0] == 0.0


def test_a_struck_plate_is_sinking_and_the_next_one_is_shown() -> None:
    game = machine_game()
    game.step()
    np.testing.assert_allclose(game.observed("plate"), q(0, 400, 72 - 99), atol=1e-3)
    assert game.observed("plate_sinking")[0] == 1.0
    game.play(4.0)
    assert game.observed("plate_sinking")[0] == 0.0


def test_a_gates_way_down_is_shown_and_an_open_one_is_not() -> None:
    game = machine_game()
    while not game.state.signals[0, 0]:
        game.step()
    game.play(1.5)
    lowered = game.observed("gate_lowered")[0]
    assert lowered == pytest.approx(game.slab("gate") / (-96 * 0.0254), rel=1e-5)
    assert 0.4 < lowered < 0.6
    height = game.observed("gate")[2] + game.position[2]
    assert height == pytest.approx(64 * 0.0254 + game.slab("gate"), abs=1e-5)
    game.play(3.0)
    for name in ("gate", "gate_present", "gate_lowered"):
        assert not game.observed(name).any(), name


def test_the_rest_of_a_pads_push_is_shown_in_seconds() -> None:
    game = Game(
        make_level(lift_pads=[{"at": q(0, 0, 2), "size": q(72, 72, 4)}], start={"at": q(0, 0, 20)})
    )
    game.step()
    assert game.observed("thrust_left")[0] == 5.0
    game.play(2.0)
    assert game.observed("thrust_left")[0] == pytest.approx(3.0)


def test_the_finish_and_the_time_left_are_shown() -> None:
    level = make_level(finish={"at": (6.0, 1.0, 0.5), "size": (1, 1, 1)}, time_limit_s=10.0)
    game = Game(level)
    np.testing.assert_allclose(game.observed("finish"), [6.0, 1.0, 0.5 - BALL_RADIUS_M], rtol=1e-6)
    assert game.observed("time_left")[0] == 1.0
    game.play(2.5)
    assert game.observed("time_left")[0] == pytest.approx(0.75)


# Rays ---------------------------------------------------------------------------------------------


def test_level_rays_go_round_from_forward_to_the_left() -> None:
    directions = ray_directions()
    assert directions.shape == (HORIZONTAL_RAYS, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    np.testing.assert_allclose(
        directions[[0, 4, 8, 12], :2], [[1, 0], [0, 1], [-1, 0], [0, -1]], atol=1e-12
    )


def test_rays_measure_the_way_to_walls() -> None:
    walls = [
        {"start": (5.0, -30.0), "end": (5.0, 30.0), "bottom": 0.0, "height": 2.0, "thickness": 0.2}
    ]
    game = Game(make_level(walls=walls), observation="rays")
    rays = split(game.simulation.observe(), entries("rays"))["rays"][0]
    for index in range(HORIZONTAL_RAYS):
        angle = 2 * np.pi * index / HORIZONTAL_RAYS
        expected = RAY_RANGE_M
        if np.cos(angle) > 1e-9:
            expected = min(4.9 / np.cos(angle), RAY_RANGE_M)
        assert rays[index] == pytest.approx(expected, rel=1e-5)


def test_the_height_scan_sees_edges_and_steps() -> None:
    """The floor ends 1 m ahead; a step of 0.5 m lies 1 m to the left."""
    floor = {"at": (-49.0, 0.0, -0.5), "size": (100.0, 100.0, 1.0)}
    step = {"at": (-49.0, 6.0, 0.25), "size": (100.0, 10.0, 0.5)}
    game = Game(make_level(boxes=[floor, step]), observation="rays")
    heights = split(game.simulation.observe(), entries("rays"))["heights"][0]
    grid = heights.reshape(SCAN_SIDE, SCAN_SIDE)
    line = (np.arange(SCAN_SIDE) - SCAN_SIDE // 2) * SCAN_SPACING_M
    for row, x in enumerate(line):
        for column, y in enumerate(line):
            expected = -SCAN_DEPTH_M if x > 1.0 else (0.5 if y > 1.0 else 0.0)
            assert grid[row, column] == pytest.approx(expected, abs=1e-5)


def test_the_height_scan_does_not_see_the_ball() -> None:
    game = Game(make_level(), observation="rays")
    heights = split(game.simulation.observe(), entries("rays"))["heights"][0]
    np.testing.assert_allclose(heights, 0.0, atol=1e-5)
    assert len(scan_offsets()) == SCAN_SIDE**2 == RAY_ENTRIES[1].size
