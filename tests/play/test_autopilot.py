"""An agent as the player of a person's game."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roller_env.config import EnvConfig
from roller_env.play.autopilot import Autopilot, load_autopilot
from roller_env.play.session import GameSession
from roller_env.simulation import Simulation
from roller_env.training import train
from roller_env.training.files import RunError
from tests.play.lane import FRAME_S, Witness, lane, play
from tests.training.small import small_config

STEPS_PER_ACTION = 24


class Zigzag:
    """A policy that goes forward and left by turns, and keeps what it saw."""

    def __init__(self) -> None:
        self.seen: list[np.ndarray] = []

    def __call__(self, observations: Any, /) -> np.ndarray:
        self.seen.append(observations.copy())
        return np.array([1 if len(self.seen) % 2 else 3])


def watched(policy: Zigzag) -> tuple[GameSession, Witness]:
    witness = Witness()
    config = EnvConfig(level=lane(coins=[]), action="directions", control_dt_s=1 / 240)
    session = GameSession(
        config,
        skip_intro=True,
        seed=1,
        agent=Autopilot(policy, STEPS_PER_ACTION),
        observers=[witness],
    )
    session.start()
    return session, witness


def test_an_action_holds_as_long_as_in_training() -> None:
    policy = Zigzag()
    session, witness = watched(policy)
    play(session, 0.5)
    steps = len(witness.forces[0])
    assert len(policy.seen) == -(-steps // STEPS_PER_ACTION)
    pushes = [tuple(np.sign(force[0]).astype(int).tolist()) for force in witness.forces[0]]
    for step, push in enumerate(pushes):
        assert push == ((1, 0) if step // STEPS_PER_ACTION % 2 == 0 else (0, 1))


def test_it_sees_what_an_environment_shows() -> None:
    policy = Zigzag()
    session, witness = watched(policy)
    play(session, 0.3)
    simulation = Simulation(session.config, 1)
    simulation.seed([np.random.Generator(np.random.PCG64(1))])
    simulation.reset()
    for step, force in enumerate(witness.forces[0]):
        if step % STEPS_PER_ACTION == 0:
            assert (policy.seen[step // STEPS_PER_ACTION] == simulation.observe()).all()
        simulation.step(force)


def test_given_the_ball_back_it_looks_before_it_acts() -> None:
    policy = Zigzag()
    session, _ = watched(policy)
    play(session, 0.33)
    play(session, 2 * FRAME_S, "s")
    asked = len(policy.seen)
    session.hand_back()
    play(session, FRAME_S)
    assert len(policy.seen) == asked + 1


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of one update: an agent that can play, if not well."""
    directory = tmp_path_factory.mktemp("runs") / "small"
    train(small_config(total_steps=8 * 16, evaluation_episodes=2), directory)
    return directory


def test_a_trained_agent_plays_its_own_game_in_steps_as_fine_as_a_persons(run: Path) -> None:
    config, autopilot = load_autopilot(run)
    assert config.level == "flat"
    assert config.substeps == 1
    # 40 control steps of 1/20 s, in steps of 1/120 s.
    assert config.max_episode_steps == 240
    session = GameSession(config, skip_intro=True, seed=1, agent=autopilot)
    session.start()
    play(session, 1.0)
    assert session.agent_plays
    assert session.result.time_s == pytest.approx(1.0, abs=0.02)


def test_it_can_be_shown_on_another_level_and_physics(run: Path) -> None:
    config, _ = load_autopilot(run, level="bridge", physics="default")
    assert (config.level, config.control_dt_s) == ("bridge", 1 / 240)
    assert config.max_episode_steps == 480


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="has no"):
        load_autopilot(tmp_path)
