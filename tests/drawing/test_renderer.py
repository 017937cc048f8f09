"""Pictures of the game. Everything here needs OpenGL."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pytest

from roller_env.drawing.canvas import Picture
from roller_env.drawing.renderer import GameRenderer
from roller_env.game.cameras import MODE_BEHIND, MODE_FRONT, MODE_RETREAT, MODES
from roller_env.simulation import Simulation
from tests.builders import Game
from tests.drawing.course import START, change_state, count, course

pytestmark = pytest.mark.usefixtures("opengl")

SIZE = (160, 120)


class Filmed(Game):
    """A game with a camera on it."""

    def __init__(self, num_envs: int = 1) -> None:
        super().__init__(course(), num_envs=num_envs)
        self.renderer = GameRenderer(self.simulation, *SIZE)
        self.beginning = self.simulation.snapshot()

    def picture(self, camera: int = MODE_BEHIND, row: int = 0) -> Picture:
        return self.renderer.render(row, camera)


@pytest.fixture(scope="module")
def film() -> Iterator[Filmed]:
    filmed = Filmed(num_envs=2)
    yield filmed
    filmed.renderer.close()


@pytest.fixture
def game(film: Filmed) -> Filmed:
    """The one game that all tests here draw, as it began."""
    film.simulation.restore(film.beginning)
    return film


def differing(first: Picture, second: Picture) -> int:
    """Return how many pixels are not the same, but for noise."""
    return int((np.abs(first.astype(int) - second.astype(int)).max(axis=-1) > 8).sum())


def test_a_picture_has_the_size_asked_for_and_is_not_blank(game: Filmed) -> None:
    picture = game.picture()
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert picture.dtype == np.uint8
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500


def test_the_picture_changes_when_the_ball_rolls(game: Filmed) -> None:
    before = game.picture()
    game.play(1.0, "wa")
    assert differing(before, game.picture()) > 1000


def test_one_sees_the_ball_turn_on_the_spot(game: Filmed) -> None:
    before = game.picture()
    snapshot = game.simulation.snapshot()
    snapshot.bodies.orientation[:] = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)
    game.simulation.restore(snapshot)
    turned = game.picture()
    assert differing(before, turned) > 30
    edge = np.ones(turned.shape[:2], dtype=bool)
    edge[30:90, 50:110] = False
    assert np.array_equal(before[edge], turned[edge])


def test_a_taken_coin_is_not_seen_any_more(game: Filmed) -> None:
    change_state(game.simulation, {"plate/down": True})
    there = count(game.picture(), "gold")
    change_state(game.simulation, {"coin/taken": True})
    assert there > 20
    assert count(game.picture(), "gold") == 0


def test_coins_turn_as_time_passes(game: Filmed) -> None:
    before = game.picture()
    change_state(game.simulation, {"steps": 10})
    assert differing(before, game.picture()) > 10


def test_a_gate_is_red_while_it_is_shut_and_not_once_it_opens(game: Filmed) -> None:
    # The ball is partly red too.
    shut = count(game.picture(), "red")
    change_state(game.simulation, {"signals": True})
    assert count(game.picture(), "red") < shut - 50


def test_a_plate_says_whether_it_sinks_or_is_down(game: Filmed) -> None:
    idle = game.picture()
    change_state(game.simulation, {"plate/struck": True})
    sinking = game.picture()
    change_state(game.simulation, {"plate/down": True})
    down = game.picture()
    assert differing(idle, sinking) > 50
    assert count(down, "green") > count(sinking, "green") + 50


def test_a_lift_pad_lights_up_while_it_pushes(game: Filmed) -> None:
    dark = game.picture()
    change_state(game.simulation, {"lift_pad/thrust_s": 2.0})
    lit = game.picture()
    assert differing(dark, lit) > 100
    change_state(game.simulation, {"lift_pad/thrust_s": 0.0})
    assert np.array_equal(game.picture(), dark)


def test_every_camera_mode_shows_something_else(game: Filmed) -> None:
    change_state(game.simulation, {"camera/x": START[0] - 1.0, "camera/mode": MODE_RETREAT})
    pictures = [game.picture(mode) for mode in range(len(MODES))]
    for first, second in combinations(pictures, 2):
        assert differing(first, second) > 500


def test_a_retreat_that_nobody_started_has_ended(game: Filmed) -> None:
    assert np.array_equal(game.picture(MODE_RETREAT), game.picture(MODE_BEHIND))


def test_the_game_camera_is_where_the_game_has_put_it(game: Filmed) -> None:
    change_state(game.simulation, {"camera/mode": MODE_FRONT})
    assert np.array_equal(game.renderer.render(0, "game"), game.picture(MODE_FRONT))


def test_every_row_has_its_own_picture(game: Filmed) -> None:
    force = np.array([[5.08, 0.0], [0.0, 0.0]])
    for _ in range(20):
        game.simulation.step(force)
    assert differing(game.picture(row=0), game.picture(row=1)) > 500


def test_drawing_changes_nothing_in_the_game() -> None:
    seen, unseen = Filmed(), Filmed()
    for step in range(20):
        keys = "wa" if step < 10 else "d"
        seen.step(keys)
        unseen.step(keys)
        seen.renderer.render(0, step % len(MODES))
        assert_same_state(seen.simulation, unseen.simulation)
    seen.renderer.close()


def assert_same_state(first: Simulation, second: Simulation) -> None:
    one, other = first.snapshot(), second.snapshot()
    assert one.physics.tobytes() == other.physics.tobytes()
    for name, values in one.game.named().items():
        assert values.tobytes() == other.game.named()[name].tobytes(), name


def test_the_same_state_gives_the_same_picture_however_it_was_reached(game: Filmed) -> None:
    first = game.picture()
    game.play(1.0, "w")
    change_state(game.simulation, {"coin/taken": True, "signals": True, "lift_pad/thrust_s": 1.0})
    for mode in range(len(MODES)):
        game.picture(mode)
    game.simulation.restore(game.beginning)
    assert np.array_equal(game.picture(), first)


def test_two_renderers_do_not_disturb_each_other(game: Filmed) -> None:
    first = game.picture()
    other = GameRenderer(game.simulation, 80, 60)
    small = other.render(0, MODE_BEHIND)
    assert small.shape == (60, 80, 3)
    assert np.array_equal(game.picture(), first)
    other.close()
    assert np.array_equal(game.picture(), first)


def test_a_closed_renderer_can_be_used_again(game: Filmed) -> None:
    renderer = GameRenderer(game.simulation, *SIZE)
    first = renderer.render(0, MODE_BEHIND)
    renderer.close()
    renderer.close()
    assert np.array_equal(renderer.render(0, MODE_BEHIND), first)
    renderer.close()


def test_one_sees_through_a_wall_as_far_as_its_colours_alpha_says() -> None:
    """Both of its faces are drawn, and have it together."""
    seen = []
    for colour in ("#00000000", "#00000099"):
        wall = {"at": (-0.5, 0.0, 1.2), "size": (0.1, 8.0, 2.0), "material": "dark"}
        ground = {"at": (0.0, 0.0, -0.5), "size": (60.0, 40.0, 1.0)}
        materials = {"dark": {"colour": colour}, "default": {"colour": "#808080"}}
        game = Game(course(boxes=[ground, wall], materials=materials))
        renderer = GameRenderer(game.simulation, *SIZE)
        seen.append(renderer.render(0, MODE_BEHIND)[55:65, 70:90].mean())
        renderer.close()
    assert seen[1] / seen[0] == pytest.approx(0.4, abs=0.04)


def test_ten_thousand_coins_can_be_drawn() -> None:
    grid = {"centre": (52.0, 0.0, 0.6), "spacing": (1.0, 1.0), "count": (100, 100)}
    ground = {"at": (50.0, 0.0, -0.5), "size": (130.0, 130.0, 1.0), "material": "grey"}
    level = course(coins=[{"grid": grid}], plates=[], gates=[], boxes=[ground])
    crowded = Game(level)
    renderer = GameRenderer(crowded.simulation, *SIZE)
    assert count(renderer.render(0, MODE_BEHIND), "gold") > 1000
    renderer.close()
