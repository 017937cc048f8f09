"""Where the cameras are and what turns one on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roller_env.game.cameras import MODES, camera_position, camera_target, follow_heading
from roller_env.level import Level
from tests.builders import Game, make_level, q, resting
from tests.game.rails import Rails

BEHIND, RETREAT, OVERHEAD, BELOW, FIRST_PERSON, FRONT = range(6)
HIGH = (0.0, 0.0, 100.0)


def level_with(*triggers: dict[str, Any], **pieces: Any) -> Level:
    return make_level(camera_triggers=triggers, start={"at": HIGH}, **pieces)


def box(kind: str, x: float) -> dict[str, Any]:
    """A trigger one metre thick across the way, its near face half a metre before x."""
    return {"kind": kind, "at": (x, 0.0, 100.0), "size": (1.0, 6.0, 6.0)}


def mode(rails: Rails) -> int:
    return int(rails.state.camera_mode[0])


# Where they are -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "name", "offset_q"),
    [
        (0, "behind", (-100, 0, 80)),
        (2, "overhead", (-10, 0, 80)),
        (3, "below", (-1, 0, -80)),
        (4, "first_person", (10, 0, 0)),
        (5, "front", (80, 0, 80)),
    ],
)
def test_a_camera_keeps_its_offset_from_the_ball(
    number: int, name: str, offset_q: tuple[float, float, float]
) -> None:
    assert MODES[number] == name
    ball = np.array([[3.0, -2.0, 5.0]])
    position = camera_position(np.array([number]), ball, np.array([77.0]))
    np.testing.assert_allclose((position - ball)[0] / 0.0254, offset_q, atol=1e-9)


def test_a_retreating_camera_is_80_quants_up_at_an_x_of_its_own() -> None:
    ball = np.array([[3.0, -2.0, 5.0]])
    position = camera_position(np.array([RETREAT]), ball, np.array([1.25]))
    np.testing.assert_allclose(position, [[1.25, -2.0, 5.0 + 80 * 0.0254]])


@pytest.mark.parametrize("number", [0, 1, 2, 3, 5])
def test_a_camera_looks_at_the_ball(number: int) -> None:
    ball, heading = np.array([[3.0, -2.0, 5.0]]), np.array([[0.0, 1.0, 0.0]])
    np.testing.assert_array_equal(camera_target(np.array([number]), ball, heading), ball)


def test_the_first_person_camera_looks_along_the_balls_motion() -> None:
    ball = np.array([[3.0, -2.0, 5.0]])
    heading = follow_heading(np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, -4.0, 3.0]]))
    eye = camera_position(np.array([FIRST_PERSON]), ball, np.zeros(1))
    looks = camera_target(np.array([FIRST_PERSON]), ball, heading) - eye
    np.testing.assert_allclose(looks, [[0.0, -0.8, 0.6]])


def test_the_first_person_camera_keeps_its_direction_when_the_ball_stands() -> None:
    last = np.array([[0.0, 1.0, 0.0]])
    for velocity in (0.0, 0.05, 0.1):
        now = follow_heading(last, np.array([[velocity, 0.0, 0.0]]))
        np.testing.assert_array_equal(now, last)
    np.testing.assert_allclose(np.linalg.norm(follow_heading(last, np.array([[0.11, 0, 0]]))), 1.0)


# What sets them -----------------------------------------------------------------------------------


def test_the_game_starts_with_the_camera_behind() -> None:
    rails = Rails(level_with())
    assert mode(rails) == BEHIND


@pytest.mark.parametrize("step_s", [1 / 60, 1 / 20, 1 / 10])
def test_the_overhead_camera_comes_1_667_s_after_the_entry(step_s: float) -> None:
    """In seconds, not in frames: the step's length hardly matters."""
    rails = Rails(level_with(box("overhead", 2.0)), step_s=step_s)
    rails.go((2.0, 0.0, 100.0))
    entered = rails.time_s
    while mode(rails) != OVERHEAD:
        assert rails.time_s < 5.0, "the camera never came"
        rails.wait(step_s)
    assert rails.time_s - entered == pytest.approx(100 / 60, abs=step_s + 1e-9)


def test_the_overhead_trigger_acts_on_every_entry() -> None:
    rails = Rails(level_with(box("overhead", 2.0)))
    for _ in range(3):
        rails.state.camera_mode[:] = FRONT
        rails.go((2.0, 0.0, 100.0))
        rails.wait(1.6)
        assert mode(rails) == FRONT
        rails.wait(0.1)
        assert mode(rails) == OVERHEAD
        rails.go(HIGH)


def test_the_overhead_trigger_does_not_act_again_while_the_ball_rests_in_it() -> None:
    rails = Rails(level_with(box("overhead", 2.0)))
    rails.go((2.0, 0.0, 100.0))
    rails.wait(2.0)
    rails.state.camera_mode[:] = FRONT
    rails.wait(5.0)
    assert mode(rails) == FRONT


def test_the_delay_runs_on_when_the_ball_has_left() -> None:
    rails = Rails(level_with(box("overhead", 2.0)))
    rails.go((5.0, 0.0, 100.0))
    rails.wait(1.75)
    assert mode(rails) == OVERHEAD


def test_the_retreat_trigger_acts_at_once_and_is_then_dead() -> None:
    rails = Rails(level_with(box("retreat", 2.0)))
    rails.state.camera_mode[:] = FRONT
    rails.go((2.0, 0.0, 100.0))
    assert mode(rails) == RETREAT
    rails.go(HIGH)
    rails.state.camera_mode[:] = FRONT
    rails.go((2.0, 0.0, 100.0))
    assert mode(rails) == FRONT


@pytest.mark.parametrize("step_s", [1 / 60, 1 / 20, 1 / 10])
def test_the_retreating_camera_goes_back_at_16_quants_a_second_to_100_behind(
    step_s: float,
) -> None:
    rails = Rails(level_with(box("retreat", 2.0)), step_s=step_s)
    rails.state.camera_mode[:] = OVERHEAD
    rails.go((2.0, 0.0, 100.0))
    began, x = rails.time_s, [float(rails.state.camera_x[0])]
    assert (x[0] - 2.0) / 0.0254 == pytest.approx(-10.0), "it starts where the camera was"
    while mode(rails) == RETREAT:
        assert rails.time_s < 20.0, "the camera never arrived"
        rails.wait(step_s)
        x.append(float(rails.state.camera_x[0]))
    np.testing.assert_allclose(np.diff(x) / 0.0254 / step_s, -16.0)
    assert mode(rails) == BEHIND
    assert rails.time_s - began == pytest.approx(90.0 / 16.0, abs=step_s + 1e-9)


def test_the_retreat_ends_sooner_when_the_ball_runs_away() -> None:
    rails = Rails(level_with(box("retreat", 2.0)))
    rails.state.camera_mode[:] = OVERHEAD
    rails.go((2.0, 0.0, 100.0))
    rails.go((2.0 + 89 * 0.0254, 0.0, 100.0))
    assert mode(rails) == RETREAT
    rails.go((2.0 + 90 * 0.0254, 0.0, 100.0))
    assert mode(rails) == BEHIND


def first_person_at(x: float) -> Level:
    return level_with({"kind": "first_person", "at": (x, 0.0, 100.0)})


@pytest.mark.parametrize(("distance_q", "within"), [(9.9, True), (10.1, False)])
def test_first_person_comes_within_10_quants_of_the_switch(distance_q: float, within: bool) -> None:
    rails = Rails(first_person_at(2.0))
    rails.go((2.0 - distance_q * 0.0254, 0.0, 100.0))
    assert (mode(rails) == FIRST_PERSON) == within


def test_first_person_is_set_as_long_as_the_ball_is_near_and_then_stays() -> None:
    rails = Rails(first_person_at(2.0))
    rails.go((2.0, 0.0, 100.0))
    rails.state.camera_mode[:] = FRONT
    rails.wait(0.05)
    assert mode(rails) == FIRST_PERSON
    rails.go((5.0, 0.0, 100.0))
    rails.wait(3.0)
    assert mode(rails) == FIRST_PERSON, "the original never takes it back"


def test_first_person_is_not_missed_by_a_fast_ball() -> None:
    rails = Rails(first_person_at(2.0))
    rails.go((30.0, 0.0, 100.0))
    assert mode(rails) == FIRST_PERSON


def test_of_two_triggers_in_one_step_the_later_one_counts() -> None:
    switch = {"kind": "first_person", "at": (2.0, 0.0, 100.0)}
    rails = Rails(level_with(box("retreat", 8.0), switch))
    rails.go((9.0, 0.0, 100.0))
    assert mode(rails) == RETREAT
    rails = Rails(level_with(box("retreat", 2.0), switch | {"at": (8.0, 0.0, 100.0)}))
    rails.go((9.0, 0.0, 100.0))
    assert mode(rails) == FIRST_PERSON


def test_a_trigger_entered_within_reach_of_a_switch_counts_after_it() -> None:
    """The ball has been near the first-person switch for a while, and enters the other now."""
    switch = {"kind": "first_person", "at": (2.0, 0.0, 100.0), "reach": 3.0}
    for triggers in ((switch, box("retreat", 3.0)), (box("retreat", 3.0), switch)):
        rails = Rails(level_with(*triggers))
        rails.go((1.0, 0.0, 100.0))
        assert mode(rails) == FIRST_PERSON
        rails.go((3.0, 0.0, 100.0))
        assert mode(rails) == RETREAT


def test_a_lift_pad_holds_the_camera_behind_while_it_pushes() -> None:
    pad = {"at": (2.0, 0.0, 100.0), "size": (1.0, 1.0, 1.0)}
    rails = Rails(level_with(lift_pads=[pad]))
    rails.go((3.5, 0.0, 100.0))
    for _ in range(90):
        rails.state.camera_mode[:] = OVERHEAD
        rails.wait(0.05)
        assert mode(rails) == BEHIND
    rails.wait(0.6)
    rails.state.camera_mode[:] = OVERHEAD
    rails.wait(0.05)
    assert mode(rails) == OVERHEAD, "the push is over"


def test_a_reset_puts_the_camera_behind() -> None:
    switch = {"kind": "first_person", "at": resting(1.0), "reach": 0.5}
    game = Game(make_level(camera_triggers=[switch]))
    game.play(1.0, "w")
    assert game.state.camera_mode[0] == FIRST_PERSON
    game.simulation.reset()
    assert game.state.camera_mode[0] == BEHIND


def test_triggers_have_no_substance() -> None:
    """A ball crosses the three kinds as if they were not there."""
    triggers = [
        {"kind": "overhead", "at": q(60, 0, 16), "size": q(16, 64, 64)},
        {"kind": "retreat", "at": q(100, 0, 16), "size": q(16, 64, 64)},
        {"kind": "first_person", "at": q(140, 0, 16)},
    ]
    with_triggers = Game(make_level(camera_triggers=triggers)).play(3.0, "w")
    without = Game(make_level()).play(3.0, "w")
    assert with_triggers[-1, 0] > q(150, 0, 0)[0]
    np.testing.assert_array_equal(with_triggers, without)
