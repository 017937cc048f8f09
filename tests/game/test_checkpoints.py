"""A ball that has fallen goes on from the last checkpoint, where a level says so."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roller_env.level import Level, LevelError, load_level
from roller_env.pieces.checkpoint import CHECKPOINT
from roller_env.pieces.coin import COIN
from roller_env.pieces.lift_pad import LIFT_PAD
from tests.builders import Game, coin, make_level, resting
from tests.game.rails import Rails

FIRST = {"at": (5.0, 0.0, 0.5), "size": (0.5, 3.0, 1.0)}
SECOND = {"at": (9.0, 0.0, 0.5), "size": (0.5, 3.0, 1.0)}
DOWN = (20.0, 0.0, -40.0)


def level_of_checkpoints(**pieces: Any) -> Level:
    return make_level(**{"falls": "checkpoint", "checkpoints": [FIRST, SECOND]} | pieces)


def fall(rails: Rails) -> Any:
    """Let the ball fall from beside everything; it is then where it was put back."""
    rails.put(20.0, 0.0, 1.0)
    return rails.go(DOWN)


def test_after_a_fall_the_ball_is_at_rest_at_the_checkpoint_touched_last() -> None:
    rails = Rails(level_of_checkpoints())
    rails.go(resting(6.0))
    rails.go(resting(12.0))
    rails.go(resting(6.0), resting(4.0))
    rails.bodies.velocity[:] = 3.0
    rails.bodies.angular_velocity[:] = 5.0
    rails.bodies.orientation[:] = 0.5
    fall(rails)
    assert rails.bodies.position.tolist() == [list(FIRST["at"])]
    assert not rails.bodies.velocity.any()
    assert not rails.bodies.angular_velocity.any()
    assert rails.bodies.orientation.tolist() == [[1.0, 0.0, 0.0, 0.0]]
    assert not rails.state.over.any()


def test_before_any_checkpoint_the_ball_comes_back_to_the_start() -> None:
    rails = Rails(level_of_checkpoints())
    fall(rails)
    assert rails.bodies.position.tolist() == [list(resting())]


def test_checkpoints_alone_do_not_change_what_a_fall_is() -> None:
    rails = Rails(make_level(checkpoints=[FIRST]))
    rails.go(resting(6.0))
    fall(rails)
    assert rails.state.fallen[0]
    assert rails.bodies.position.tolist() == [list(DOWN)]


def test_every_fall_costs_and_coins_stay_collected() -> None:
    rails = Rails(level_of_checkpoints(coins=[coin(*resting(2.0))]))
    rails.go(resting(6.0))
    for _ in range(3):
        assert fall(rails).reward[0] == -1.0
    assert rails.state.of(COIN).taken.all()
    assert rails.state.reward_terms[0].tolist() == [1.0, 0.0, -3.0, 0.0]


def test_what_lies_behind_the_fall_is_not_touched() -> None:
    rails = Rails(level_of_checkpoints(finish={"at": (30.0, 0.0, 0.5), "size": (1.0, 1.0, 1.0)}))
    rails.put(20.0, 0.0, 1.0)
    rails.go(DOWN, resting(5.0), (30.0, 0.0, 0.5))
    assert rails.state.of(CHECKPOINT).last.tolist() == [-1]
    assert not rails.state.finished[0]


def test_a_ball_that_came_back_is_pushed_by_nothing() -> None:
    pad = {"at": (2.0, 0.0, 0.1), "size": (1.0, 1.0, 0.2)}
    rails = Rails(level_of_checkpoints(lift_pads=[pad]))
    rails.go(resting(2.0))
    assert rails.state.of(LIFT_PAD).thrust_s[0, 0] > 0.0
    fall(rails)
    assert rails.state.of(LIFT_PAD).thrust_s[0, 0] == 0.0
    assert rails.state.camera.mode[0] == 0


def test_the_way_back_is_paid_back_by_the_shaping() -> None:
    """With a discount of 1 it telescopes over falls too."""
    route = {"points": [resting(), resting(10.0)], "radius": 1.0}
    rails = Rails(level_of_checkpoints(route=route), reward="shaped")
    for x in (2.0, 5.0, 9.9):
        rails.go(resting(x))
    fall(rails)
    progress = rails.state.reward_terms[0, 3]
    assert progress == pytest.approx(rails.state.shaping.potential[0])


@pytest.mark.parametrize("physics", ["fast", "default", "accurate", "rigid"])
def test_in_the_game_it_goes_on_from_there(physics: str) -> None:
    island = {"at": (3.0, 0.0, -0.5), "size": (8.0, 4.0, 1.0)}
    point = {"at": resting(1.0), "size": (0.2, 3.0, 1.0)}
    game = Game(level_of_checkpoints(boxes=[island], checkpoints=[point]), physics=physics)
    falls = 0
    for _ in range(600):
        falls += game.step("w").reward[0] < 0.0
        if falls == 2:
            break
    assert falls == 2
    np.testing.assert_allclose(game.observed("position"), resting(1.0), rtol=1e-6)
    assert not game.observed("velocity").any()
    for _ in range(40):
        game.step()
    np.testing.assert_allclose(game.position, resting(1.0), atol=2e-3)
    kept = game.simulation.snapshot()
    first = [game.step("wa").reward[0] for _ in range(60)], game.position.tobytes()
    game.simulation.restore(kept)
    assert first == ([game.step("wa").reward[0] for _ in range(60)], game.position.tobytes())


def test_a_checkpoint_inside_a_solid_is_refused() -> None:
    level = level_of_checkpoints().model_dump()
    level["checkpoints"] = [{"at": (5.0, 0.0, 0.1), "size": (1.0, 1.0, 1.0)}]
    with pytest.raises(LevelError, match=r"checkpoints\[0\].at: the ball would come back inside"):
        load_level(level)
