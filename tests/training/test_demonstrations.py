"""Demonstrations are read as the training sees the game, and only where they are of its game."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roller_env.config import make_config
from roller_env.envs.single import RollerEnv
from roller_env.game.actions import forces
from roller_env.game.rewards import RewardWeights
from roller_env.level import load_level
from roller_env.replay import record_episode, save_replay
from roller_env.replay.datasets import to_minari
from roller_env.replay.scripted import PLAYER, ScriptedPlayer, relabelled
from roller_env.simulation import Simulation
from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.config_source import ConfigError
from roller_env.training.demonstrations import DemonstrationError, load_demonstrations
from tests.replay.recording import wandered
from tests.training.small import small_config


@pytest.fixture
def replays(tmp_path: Path) -> Path:
    """Return a directory with three replays."""
    for seed in range(3):
        save_replay(wandered("flat", seed=seed), tmp_path / f"{seed}.replay")
    return tmp_path


def training(**environment: Any) -> TrainingConfig:
    """Return a training with the replays' level and preset, and these options."""
    return small_config(environment={"physics": "fast"} | environment)


def test_an_episode_is_what_the_trainings_environment_gives(replays: Path) -> None:
    config = training(reward="shaped", observation="rays")
    demonstrations = load_demonstrations(str(replays), config)
    assert [len(one) for one in demonstrations] == [len(wandered("flat", seed=i)) for i in range(3)]
    environment = RollerEnv(**config.environment.keywords())
    for seed, demonstration in enumerate(demonstrations):
        seen, _ = environment.reset(seed=seed)
        assert isinstance(demonstration.observations, np.ndarray)
        assert demonstration.rewards is not None
        for step, action in enumerate(demonstration.actions):
            assert np.array_equal(seen, demonstration.observations[step])
            seen, reward, *_ = environment.step(action)
            assert reward == demonstration.rewards[step]


def test_a_game_that_was_left_in_its_intro_is_no_demonstration(replays: Path) -> None:
    left = wandered("flat", seed=7, intro=True, max_episode_steps=20)
    save_replay(left, replays / "left.replay")
    assert len(load_demonstrations(str(replays), training())) == 3


def test_keys_held_for_shorter_steps_than_the_trainings_are_thinned(tmp_path: Path) -> None:
    config = make_config(
        level="flat", physics="fast", control_dt_s=1 / 60, max_episode_steps=61, num_threads=1
    )

    def act(simulation: Simulation) -> Any:
        return forces("directions", np.array([simulation.state.steps[0] // 3 % 9]))

    for seed in range(2):
        played = record_episode(config, act, seed=seed)
        save_replay(played, tmp_path / f"{seed}.replay")
    demonstration = load_demonstrations(str(tmp_path), training())[0]
    assert demonstration.actions.tolist() == [step % 9 for step in range(21)]
    assert len(demonstration.observations) == 21
    assert demonstration.rewards is not None
    assert demonstration.rewards.sum() == played.result.total_reward


def test_from_the_scripted_player_one_learns_what_it_does_without_noise(
    tmp_path: Path,
) -> None:
    level, config = load_level("flat"), make_config(level="flat", physics="fast", num_threads=1)
    for seed in range(2):
        player = ScriptedPlayer(level, action_noise=0.3, seed=seed)
        played = record_episode(config, player, seed=seed, player=PLAYER)
        save_replay(played, tmp_path / f"{seed}.replay")
        save_replay(replace(played, player="somebody"), tmp_path / "other" / f"{seed}.replay")
    by_player = load_demonstrations(str(tmp_path), training())[1]
    by_somebody = load_demonstrations(str(tmp_path / "other"), training())[1]
    assert np.array_equal(forces("directions", by_player.actions), relabelled(played))
    assert np.array_equal(forces("directions", by_somebody.actions), played.force_n)
    assert not np.array_equal(by_player.actions, by_somebody.actions)


@pytest.mark.parametrize("reward", ["points", "shaped"])
def test_a_minari_data_set_is_read_by_name_and_by_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reward: str
) -> None:
    pytest.importorskip("minari", reason="the extra 'demos' is not installed")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    to_minari([wandered("flat", seed=seed) for seed in range(2)], "roller/flat/test-v0")
    config = training(reward=reward)
    by_name = load_demonstrations("roller/flat/test-v0", config)
    by_path = load_demonstrations(str(tmp_path / "roller" / "flat" / "test-v0"), config)
    for one, other in zip(by_name, by_path, strict=True):
        assert np.array_equal(one.actions, other.actions)
        assert np.array_equal(one.observations, other.observations)  # type: ignore[arg-type]
        # Points are what the data set's environment gave; what shaping would have is not known.
        assert (one.rewards is not None) == (reward == "points")


@pytest.mark.parametrize("coin", [1.0, 2.0])
def test_rewards_of_a_minari_data_set_count_where_the_training_has_the_same_weights(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, coin: float
) -> None:
    pytest.importorskip("minari", reason="the extra 'demos' is not installed")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    weights = RewardWeights(coin=2.0)
    played = [wandered("flat", seed=seed, reward_weights=weights) for seed in range(2)]
    to_minari(played, "roller/flat/test-v0")
    config = training(reward_weights={"coin": coin})
    for one in load_demonstrations("roller/flat/test-v0", config):
        assert (one.rewards is not None) == (coin == 2.0)


def test_a_data_set_of_keys_held_for_shorter_steps_becomes_the_trainings_actions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("minari", reason="the extra 'demos' is not installed")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    config = make_config(
        level="flat", physics="fast", control_dt_s=1 / 120, action="keys", max_episode_steps=90
    )
    played = [record_episode(config, ScriptedPlayer(load_level("flat")), seed=i) for i in range(2)]
    to_minari(played, "roller/flat/keys-v0")
    for number, replay in enumerate(played):
        save_replay(replay, tmp_path / "replays" / f"{number}.replay")
    by_set = load_demonstrations("roller/flat/keys-v0", training())
    by_replay = load_demonstrations(str(tmp_path / "replays"), training())
    for one, other in zip(by_set, by_replay, strict=True):
        assert one.actions.shape == (15,)
        assert np.array_equal(one.actions, other.actions)
        assert np.array_equal(one.observations, other.observations)  # type: ignore[arg-type]
        assert np.array_equal(one.rewards, other.rewards)  # type: ignore[arg-type]


def test_a_data_set_of_another_environment_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("minari", reason="the extra 'demos' is not installed")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    to_minari([wandered("flat", seed=seed) for seed in range(2)], "roller/flat/test-v0")
    with pytest.raises(DemonstrationError, match="its observations are"):
        load_demonstrations("roller/flat/test-v0", training(observation="rays"))
    other = small_config(level="bridge", environment={"physics": "fast"})
    with pytest.raises(DemonstrationError, match="found level 'flat', not 'bridge'"):
        load_demonstrations("roller/flat/test-v0", other)


def test_nothing_in_a_data_set_is_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("minari", reason="the extra 'demos' is not installed")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    to_minari([wandered("flat", seed=seed) for seed in range(2)], "roller/flat/test-v0")
    data = tmp_path / "roller" / "flat" / "test-v0" / "data"
    # The environment that it says it was made in is not imported.
    (tmp_path / "harm.py").write_text(f"open({str(tmp_path / 'harmed')!r}, 'w')")
    monkeypatch.syspath_prepend(tmp_path)
    metadata = json.loads((data / "metadata.json").read_text())
    said = json.loads(metadata["env_spec"]) | {"entry_point": "harm:make"}
    (data / "metadata.json").write_text(json.dumps(metadata | {"env_spec": json.dumps(said)}))
    assert len(load_demonstrations("roller/flat/test-v0", training())) == 2
    # Nor is anything unpickled.
    harm = b"cos\nsystem\n(S'touch harmed'\ntR."
    monkeypatch.chdir(tmp_path)
    for file in sorted(data.iterdir(), reverse=True):
        file.write_bytes(harm)
        with pytest.raises(DemonstrationError, match=r"not a whole|no replay, directory"):
            load_demonstrations(str(data.parent), training())
    assert not (tmp_path / "harmed").exists()
    pickle.loads(harm)
    assert (tmp_path / "harmed").exists()


def test_what_cannot_be_learnt_from_is_refused(
    replays: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "none"))
    with pytest.raises(DemonstrationError, match="found 1 episode; needed are two or more"):
        load_demonstrations(str(replays / "0.replay"), training())
    with pytest.raises(DemonstrationError, match="nothing: no replay"):
        load_demonstrations("nothing", training())
    with pytest.raises(DemonstrationError, match="level 'flat', which is not the level 'gate'"):
        load_demonstrations(str(replays), small_config(level="gate"))
    (replays / "0.replay").write_bytes(b"damaged")
    with pytest.raises(DemonstrationError, match=r"0\.replay: not a replay"):
        load_demonstrations(str(replays), training())


def test_cloning_is_configured_like_the_rest(tmp_path: Path) -> None:
    file = tmp_path / "training.yaml"
    file.write_text(small_config().to_yaml())
    config = load_config(file, ("demonstrations=somewhere", "cloning.epochs=3"))
    assert (config.demonstrations, config.cloning.epochs) == ("somewhere", 3)
    with pytest.raises(ConfigError, match=r"cloning\.epoch: unknown field; .*'epochs'"):
        load_config(file, ("cloning.epoch=3",))
