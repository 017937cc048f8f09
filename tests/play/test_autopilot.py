"""An agent as the player of a person's game."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roller_env.envs.single import RollerEnv
from roller_env.play.autopilot import load_autopilot
from roller_env.play.session import GameSession
from roller_env.training import train
from roller_env.training.files import RunError
from tests.play.lane import play
from tests.training.small import small_config


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of one update: an agent that can play, if not well."""
    directory = tmp_path_factory.mktemp("runs") / "small"
    train(small_config(total_steps=8 * 16, evaluation_episodes=2), directory)
    return directory


def test_the_game_that_is_watched_is_the_game_of_the_evaluation_bit_for_bit(run: Path) -> None:
    config, autopilot = load_autopilot(run)
    assert (config.level, config.control_dt_s, config.max_episode_steps) == ("flat", 1 / 20, 40)
    session = GameSession(config, skip_intro=True, seed=3, agent=autopilot)
    session.start()
    play(session, 1.0)
    assert session.agent_plays
    env = RollerEnv(**config.keywords())
    observation, _ = env.reset(seed=3)
    for _ in range(int(session.simulation.state.steps[0])):
        observation, *_ = env.step(autopilot.policy(observation[None])[0])
    assert session.simulation.state.steps[0] == pytest.approx(20, abs=1)
    assert (env.simulation.qpos == session.simulation.qpos).all()


def test_what_it_thinks_is_told_by_the_names_of_what_it_sees(run: Path) -> None:
    config, autopilot = load_autopilot(run)
    session = GameSession(config, skip_intro=True, seed=3, agent=autopilot)
    insight = autopilot.insight(session.simulation)
    assert list(insight.entries) == [entry.name for entry in session.simulation.entries]
    assert insight.actions == ("none", "W", "WA", "A", "AS", "S", "SD", "D", "WD")
    assert sum(insight.probabilities) == pytest.approx(1.0)
    chosen = int(autopilot(session.simulation))
    assert insight.probabilities[chosen] == max(insight.probabilities)
    assert np.isfinite(insight.value)


def test_it_can_be_shown_on_another_level_and_physics(run: Path) -> None:
    config, _ = load_autopilot(run, level="bridge", physics="default")
    assert (config.level, config.preset.name, config.control_dt_s) == ("bridge", "default", 1 / 20)


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="has no"):
        load_autopilot(tmp_path)
