"""The player's camera: the game's modes, and the person's choice among them."""

from __future__ import annotations

import numpy as np
import pytest

from roller_env.game.cameras import (
    MODE_BEHIND,
    MODE_BELOW,
    MODE_FIRST_PERSON,
    MODE_OVERHEAD,
    MODE_RETREAT,
)
from roller_env.play.camera import PlayerCamera, View
from roller_env.units import quants

BALL = np.array([3.0, 2.0, 1.0])
FRAME_S = 1.0 / 60.0
GLIDE_M_S = quants(16.0)


def follow(camera: PlayerCamera, game_mode: int = MODE_BEHIND, frames: int = 1) -> View:
    view = View(BALL, BALL)
    for _ in range(frames):
        view = camera.follow(game_mode, BALL, FRAME_S)
    return view


@pytest.mark.parametrize(
    ("presses", "offset"),
    [
        (0, (-100.0, 0.0, 80.0)),
        (1, (-10.0, 0.0, 80.0)),
        (2, (-1.0, 0.0, -80.0)),
        (3, (10.0, 0.0, 0.0)),
        (4, (80.0, 0.0, 80.0)),
        (6, (-100.0, 0.0, 80.0)),
    ],
)
def test_the_next_camera_goes_round_the_originals_modes(
    presses: int, offset: tuple[float, float, float]
) -> None:
    camera = PlayerCamera()
    follow(camera)
    for _ in range(presses):
        camera.next()
        view = follow(camera)
    view = follow(camera)
    assert view.position - BALL == pytest.approx([quants(length) for length in offset])


def test_all_cameras_but_the_first_person_look_at_the_ball() -> None:
    camera = PlayerCamera()
    for _ in range(6):
        target = follow(camera).target
        if camera.mode != MODE_FIRST_PERSON:
            assert target == pytest.approx(BALL)
        camera.next()


def test_the_glide_retreats_at_16_quants_a_second_from_where_the_camera_is() -> None:
    camera = PlayerCamera()
    overhead = follow(camera, MODE_OVERHEAD)
    gliding = follow(camera, MODE_RETREAT)
    assert gliding.position[0] == pytest.approx(overhead.position[0] - GLIDE_M_S * FRAME_S)
    later = follow(camera, MODE_RETREAT, frames=60)
    assert later.position[0] == pytest.approx(gliding.position[0] - GLIDE_M_S)
    assert later.position[1:] - BALL[1:] == pytest.approx([0.0, quants(80.0)])


def test_the_glide_ends_behind_the_ball_in_mode_0() -> None:
    camera = PlayerCamera()
    follow(camera, MODE_OVERHEAD)
    # From 10 to 100 quants behind the ball, at 16 a second.
    follow(camera, MODE_RETREAT, frames=round(90.0 / 16.0 * 60.0) - 3)
    assert camera.mode == MODE_RETREAT
    view = follow(camera, MODE_RETREAT, frames=6)
    assert camera.mode == MODE_BEHIND
    assert view.position[0] - BALL[0] == pytest.approx(quants(-100.0))


def test_a_person_asks_for_the_glide_from_the_front_and_it_leads_behind_the_ball() -> None:
    camera = PlayerCamera()
    for _ in range(5):
        camera.next()
        view = follow(camera)
    assert camera.mode == MODE_RETREAT
    assert view.position[0] - BALL[0] == pytest.approx(quants(80.0) - GLIDE_M_S * FRAME_S)
    # From 80 quants ahead to 100 behind, at 16 a second.
    follow(camera, frames=round(180.0 / 16.0 * 60.0) - 4)
    assert camera.mode == MODE_RETREAT
    follow(camera, frames=6)
    assert camera.mode == MODE_BEHIND


def test_a_persons_choice_lasts_until_the_game_changes_the_mode() -> None:
    camera = PlayerCamera()
    follow(camera, MODE_BEHIND)
    for _ in range(2):
        camera.next()
    follow(camera, MODE_BEHIND, frames=100)
    assert camera.mode == MODE_BELOW
    follow(camera, MODE_OVERHEAD)
    assert camera.mode == MODE_OVERHEAD


def test_the_end_of_the_games_own_glide_does_not_undo_the_choice() -> None:
    camera = PlayerCamera()
    follow(camera, MODE_OVERHEAD)
    follow(camera, MODE_RETREAT)
    for _ in range(3):
        camera.next()
    follow(camera, MODE_BEHIND)
    assert camera.mode == MODE_BELOW


def test_a_new_game_begins_behind_the_ball() -> None:
    camera = PlayerCamera()
    follow(camera, MODE_OVERHEAD)
    camera.reset()
    assert follow(camera).position - BALL == pytest.approx([quants(-100.0), 0.0, quants(80.0)])


def test_the_first_person_looks_level_along_the_way_that_w_pushes() -> None:
    camera = PlayerCamera()
    follow(camera, MODE_FIRST_PERSON)
    for rolled in ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, -0.5]):
        view = camera.follow(MODE_FIRST_PERSON, BALL + np.array(rolled), FRAME_S)
        assert view.target - view.position == pytest.approx([1.0, 0.0, 0.0])
