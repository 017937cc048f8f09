"""Where the cameras are and what turns one on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roller_env.game.cameras import MODES, camera_position, camera_target
from roller_env.level import Level
from roller_env.pieces.camera_trigger import OVERHEAD_WAITS
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
    return int(rails.state.camera.mode[0])


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
    ball = np.array([[3.0, -2.0, 5.0]])
    np.testing.assert_array_equal(camera_target(np.array([number]), ball), ball)


@pytest.mark.parametrize("keys", ["w", "a", "s", "d"])
def test_in_first_person_w_stays_forward_wherever_the_ball_rolls(keys: str) -> None:
    """The picture shows what lies along +x, level, and W pushes along +x."""
    switch = {"kind": "first_person", "at": resting(), "reach": 0.5}
    game = Game(make_level(camera_triggers=[switch]))
    game.play(1.0, keys)
    assert game.state.camera.mode[0] == FIRST_PERSON
    ball, number = game.position[None], np.array([FIRST_PERSON])
    eye = camera_position(number, ball, np.zeros(1))
    np.testing.assert_allclose(camera_target(number, ball) - eye, [[1.0, 0.0, 0.0]], atol=1e-12)


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
        rails.state.camera.mode[:] = FRONT
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
    rails.state.camera.mode[:] = FRONT
    rails.wait(5.0)
    assert mode(rails) == FRONT


def test_the_delay_runs_on_when_the_ball_has_left() -> None:
    rails = Rails(level_with(box("overhead", 2.0)))
    rails.go((5.0, 0.0, 100.0))
    rails.wait(1.75)
    assert mode(rails) == OVERHEAD


def test_an_entry_while_the_overhead_camera_is_still_to_come_counts_too() -> None:
    """Each entry waits for itself: what was set after the first one's end is set over again."""
    rails = Rails(level_with(box("overhead", 2.0)))
    rails.go((2.0, 0.0, 100.0))
    rails.go(HIGH)
    rails.wait(0.9)
    rails.go((2.0, 0.0, 100.0))
    rails.wait(0.7)
    assert mode(rails) == OVERHEAD, "1.7 s after the first entry"
    rails.state.camera.mode[:] = FRONT
    rails.wait(0.9)
    assert mode(rails) == FRONT
    rails.wait(0.1)
    assert mode(rails) == OVERHEAD, "1.7 s after the second"


STEP_S = 0.05
SOON = st.sampled_from(["", "", "in", "front"])


@settings(deadline=None, max_examples=60)
@given(st.lists(SOON, min_size=1, max_size=160))
def test_every_entry_sets_the_overhead_camera_after_its_own_wait(moments: list[str]) -> None:
    """Whatever else sets the camera in between; up to `OVERHEAD_WAITS` entries at once."""
    rails = Rails(level_with(box("overhead", 2.0), box("overhead", 2.5)), step_s=STEP_S)
    entries: list[int] = []
    expected = BEHIND
    for step, moment in enumerate([*moments, *[""] * 36]):
        if moment == "front":
            rails.state.camera.mode[:] = expected = FRONT
        is_in = moment == "in" and (not entries or step - entries[-1] > 1)
        waiting = [entry for entry in entries if step - entry < 34]
        is_in &= len(waiting) < OVERHEAD_WAITS
        rails.go((2.0, 0.0, 100.0) if is_in else HIGH)
        # 100 frames are 33 and a third steps.
        if any(step - entry == 34 for entry in entries):
            expected = OVERHEAD
        if is_in:
            entries.append(step)
        assert mode(rails) == expected, step


def test_more_entries_than_are_kept_still_end_with_the_newest() -> None:
    rails = Rails(level_with(box("overhead", 2.0)))
    for _ in range(2 * OVERHEAD_WAITS):
        rails.go((2.0, 0.0, 100.0))
        rails.go(HIGH)
    rails.wait(1.55)
    rails.state.camera.mode[:] = FRONT
    rails.wait(0.05)
    assert mode(rails) == FRONT
    rails.wait(0.05)
    assert mode(rails) == OVERHEAD


def test_the_retreat_trigger_acts_at_once_and_is_then_dead() -> None:
    rails = Rails(level_with(box("retreat", 2.0)))
    rails.state.camera.mode[:] = FRONT
    rails.go((2.0, 0.0, 100.0))
    assert mode(rails) == RETREAT
    rails.go(HIGH)
    rails.state.camera.mode[:] = FRONT
    rails.go((2.0, 0.0, 100.0))
    assert mode(rails) == FRONT


@pytest.mark.parametrize("step_s", [1 / 60, 1 / 20, 1 / 10])
def test_the_retreating_camera_goes_back_at_16_quants_a_second_to_100_behind(
    step_s: float,
) -> None:
    rails = Rails(level_with(box("retreat", 2.0)), step_s=step_s)
    rails.state.camera.mode[:] = OVERHEAD
    rails.go((2.0, 0.0, 100.0))
    began, x = rails.time_s, [float(rails.state.camera.x[0])]
    assert (x[0] - 2.0) / 0.0254 == pytest.approx(-10.0), "it starts where the camera was"
    while mode(rails) == RETREAT:
        assert rails.time_s < 20.0, "the camera never arrived"
        rails.wait(step_s)
        x.append(float(rails.state.camera.x[0]))
    np.testing.assert_allclose(np.diff(x) / 0.0254 / step_s, -16.0)
    assert mode(rails) == BEHIND
    assert rails.time_s - began == pytest.approx(90.0 / 16.0, abs=step_s + 1e-9)


def test_the_retreat_ends_sooner_when_the_ball_runs_away() -> None:
    rails = Rails(level_with(box("retreat", 2.0)))
    rails.state.camera.mode[:] = OVERHEAD
    rails.go((2.0, 0.0, 100.0))
    rails.go((2.0 + 89 * 0.0254, 0.0, 100.0))
    assert mode(rails) == RETREAT
    rails.go((2.0 + 90 * 0.0254, 0.0, 100.0))
    assert mode(rails) == BEHIND


BACK_THERE = (-3.0, 0.0, 100.0)
PAD = {"at": BACK_THERE, "size": (1.0, 1.0, 1.0)}
SWITCH = {"kind": "first_person", "at": BACK_THERE}


@pytest.mark.parametrize(
    ("triggers", "pads"),
    [
        ([box("overhead", -3.0)], []),
        ([SWITCH], []),
        ([box("retreat", -3.0)], []),
        ([], [PAD]),
    ],
    ids=["overhead", "first person", "another retreat", "lift pad"],
)
def test_nothing_cuts_a_retreat_short_and_it_ends_behind_the_ball(
    triggers: list[dict[str, Any]], pads: list[dict[str, Any]]
) -> None:
    """The original's loop looks at no mode and then sets 0: neither does a lift pad end it."""
    rails = Rails(level_with(box("retreat", 2.0), *triggers, lift_pads=pads))
    rails.state.camera.mode[:] = FRONT
    rails.go((2.0, 0.0, 100.0))
    x = float(rails.state.camera.x[0])
    assert mode(rails) == RETREAT
    rails.go(BACK_THERE)
    rails.go(HIGH)
    while mode(rails) == RETREAT:
        assert rails.time_s < 20.0, "the camera never arrived"
        rails.wait(rails.step_s)
    assert mode(rails) == BEHIND
    glided = x / 0.0254 + 100.0
    assert rails.time_s == pytest.approx(glided / 16.0, abs=3 * rails.step_s)
    rails.wait(2.0)
    assert mode(rails) == BEHIND, "what was set meanwhile is lost"


def test_a_first_person_switch_that_the_ball_is_still_in_acts_when_the_retreat_is_over() -> None:
    """The original's switch sets its mode in every frame."""
    rails = Rails(level_with(box("retreat", 2.0), SWITCH | {"at": (2.0, 0.0, 100.0)}))
    rails.state.camera.mode[:] = OVERHEAD
    rails.go((1.0, 0.0, 100.0))
    rails.go((1.7, 0.0, 100.0))
    assert mode(rails) == RETREAT
    rails.go((2.0, 0.0, 100.0))
    assert mode(rails) == RETREAT
    rails.wait(90.0 / 16.0 + 0.2)
    assert mode(rails) == FIRST_PERSON


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
    rails.state.camera.mode[:] = FRONT
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
        rails.state.camera.mode[:] = OVERHEAD
        rails.wait(0.05)
        assert mode(rails) == BEHIND
    rails.wait(0.6)
    rails.state.camera.mode[:] = OVERHEAD
    rails.wait(0.05)
    assert mode(rails) == OVERHEAD, "the push is over"


def test_a_reset_puts_the_camera_behind() -> None:
    switch = {"kind": "first_person", "at": resting(1.0), "reach": 0.5}
    game = Game(make_level(camera_triggers=[switch]))
    game.play(1.0, "w")
    assert game.state.camera.mode[0] == FIRST_PERSON
    game.simulation.reset()
    assert game.state.camera.mode[0] == BEHIND


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
