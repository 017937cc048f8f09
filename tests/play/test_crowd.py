"""Balls of an agent beside a game."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest

from roller_env.config import EnvConfig
from roller_env.play.crowd import Crowd
from roller_env.play.scene import Scene
from roller_env.play.session import GameSession
from roller_env.play.wire import frame_bytes
from roller_env.training.files import RunError
from roller_env.training.policy import TrainedPolicy
from tests.play.lane import game, lane, play
from tests.training.small import small_config


class Forward(TrainedPolicy):
    """In the place of a trained policy: goes forward, and counts how often it is asked."""

    def __init__(self, control_dt_s: float = 1 / 10) -> None:
        self.config = small_config(environment={"control_dt_s": control_dt_s})
        self.asked = 0

    def __call__(self, observations: Any, /) -> np.ndarray:
        self.asked += 1
        return np.full(len(observations), 1)


def test_every_ball_begins_with_the_game_and_decides_as_often_as_in_its_training() -> None:
    policy = Forward()
    crowd = Crowd(policy, 8)
    level = lane(start={"at": (0.0, 0.0, 0.4064), "jitter": (0.3, 0.3)}, coins=[])
    session = game(level, observers=[crowd])
    begun = crowd.centres(1.0)
    assert len(np.unique(begun[:, 1])) == 8
    play(session, 1.0)
    assert policy.asked == 10
    assert (crowd.centres(1.0)[:, 0] > begun[:, 0] + 1.0).all()
    play(session, 6.0)
    # At the finish each has begun again.
    assert crowd.centres(1.0)[:, 0].max() < 7.0
    session.restart()
    assert np.abs(crowd.centres(1.0)[:, 0]).max() <= 0.3


def test_pages_see_them() -> None:
    crowd = Crowd(Forward(), 3)
    session = game(observers=[crowd])
    play(session, 0.5)
    frame = session.frame()
    scene = Scene(session.level)
    found = frame_bytes(frame, scene, crowd=crowd.centres(frame.fraction))
    alone = frame_bytes(frame, scene)
    assert found[: len(alone)] == alone
    (count,) = struct.unpack_from("<H", found, len(alone))
    near = np.frombuffer(found, "<i2", offset=len(alone) + 2).reshape(count, 3) / 100
    assert near == pytest.approx(crowd.centres(frame.fraction), abs=0.006)


def test_an_agent_that_decides_within_the_games_steps_is_refused() -> None:
    config = EnvConfig(level=lane(), control_dt_s=1 / 10)
    with pytest.raises(RunError, match=r"found an agent that decides every 0\.05 s beside a game"):
        GameSession(config, observers=[Crowd(Forward(1 / 20), 1)])


@pytest.mark.parametrize("count", [0, -1, 257])
def test_a_crowd_of_no_size_is_refused(count: int) -> None:
    with pytest.raises(ValueError, match=f"agents: found {count}"):
        Crowd(Forward(), count)
