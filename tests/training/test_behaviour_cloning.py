"""A policy that has seen how it is done does it, and goes on learning from there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.config import make_config
from roller_env.level import load_level
from roller_env.replay import record_episode, save_replay
from roller_env.replay.scripted import ScriptedPlayer
from roller_env.training.behaviour_cloning import (
    STATISTICS_ROLLOUTS,
    clone,
    start_from_demonstrations,
    weigh_statistics,
)
from roller_env.training.checkpoint import Checkpoint, load_checkpoint
from roller_env.training.config import CloningConfig, TrainingConfig
from roller_env.training.demonstrations import Demonstration, load_demonstrations
from roller_env.training.files import RunFiles
from roller_env.training.logs import read_progress
from roller_env.training.ppo import learn, make_environments, new_model
from roller_env.training.run import train
from tests.training.small import UPDATES, small_config

EPISODES = 5


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a directory of replays in which the scripted player collects the coins."""
    target = tmp_path_factory.mktemp("demonstrations")
    config = make_config(level="flat", physics="fast", num_threads=1)
    for seed in range(EPISODES):
        player = ScriptedPlayer(load_level("flat"), action_noise=0.1, seed=seed)
        save_replay(record_episode(config, player, seed=seed), target / f"{seed}.replay")
    return target


@pytest.fixture(autouse=True)
def _one_thread_of_torch() -> Iterator[None]:
    """Leave torch as it was: a training sets the process's number of threads."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def taught(directory: Path, **changes: Any) -> TrainingConfig:
    environment = {"physics": "fast", "reward": "shaped", "max_episode_steps": 40}
    fields: dict[str, Any] = {
        "environment": environment | changes.pop("environment", {}),
        "demonstrations": str(directory),
        "cloning": {"epochs": 12, "batch_size": 64, "learning_rate": 3e-3},
        "ppo": {"rollout_steps": 16, "batch_size": 64, "epochs": 2, "hidden_sizes": [32]},
    }
    return small_config(**(fields | changes))


def learner(config: TrainingConfig) -> PPO:
    return new_model(config, make_environments(config))


def normaliser_of(model: PPO) -> VecNormalize:
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    return normaliser


@pytest.mark.parametrize(
    "environment",
    [{}, {"action": "keys"}, {"action": "force"}, {"observation": "dict"}],
    ids=["directions", "keys", "force", "dict"],
)
def test_a_cloned_policy_does_what_was_demonstrated_in_episodes_it_never_saw(
    directory: Path, environment: dict[str, Any]
) -> None:
    config = taught(directory, environment=environment)
    demonstrations = load_demonstrations(str(directory), config)
    cloning = clone(learner(config), demonstrations, config.cloning, seed=0)
    assert cloning.samples + cloning.held_out == sum(map(len, demonstrations))
    assert cloning.held_out >= min(map(len, demonstrations))
    assert cloning.accuracy > cloning.chance + 0.15, cloning


def test_what_is_cloned_depends_on_the_seed_alone(directory: Path) -> None:
    config = taught(directory)
    demonstrations = load_demonstrations(str(directory), config)
    weights = []
    for seed in (0, 0, 1):
        model = learner(config)
        clone(model, demonstrations, CloningConfig(epochs=2), seed)
        weights.append(torch.cat([p.flatten() for p in model.policy.parameters()]).detach())
    assert torch.equal(weights[0], weights[1])
    assert not torch.equal(weights[0], weights[2])


def test_the_policy_kept_is_the_best_on_what_was_held_out(directory: Path) -> None:
    config = taught(directory)
    demonstrations = load_demonstrations(str(directory), config)
    # So fast that it soon knows the episodes by heart, and the others less and less.
    cloning = clone(
        learner(config), demonstrations, CloningConfig(epochs=40, learning_rate=0.03), seed=0
    )
    assert cloning.epochs < 40
    assert cloning.accuracy > cloning.chance


def test_normalisation_is_that_of_the_demonstrations_and_outweighs_a_rollout(
    directory: Path,
) -> None:
    config = taught(directory)
    model, demonstrations = learner(config), load_demonstrations(str(directory), config)
    clone(model, demonstrations, CloningConfig(epochs=1, held_out_fraction=0.01), seed=0)
    order = np.random.default_rng(0).permutation(EPISODES)
    learnt = [demonstrations[i] for i in order[1:]]
    seen = np.concatenate([one.observations for one in learnt])
    statistics: Any = normaliser_of(model).obs_rms
    assert statistics.mean == pytest.approx(seen.mean(axis=0), abs=1e-5)
    assert statistics.var == pytest.approx(seen.var(axis=0), rel=1e-3, abs=1e-5)
    samples = max(STATISTICS_ROLLOUTS * config.steps_per_update, 2 * len(seen))
    weigh_statistics(model, samples)
    assert statistics.count == normaliser_of(model).ret_rms.count == samples
    weigh_statistics(model, 1.0)
    assert statistics.count == samples


def test_the_value_network_knows_what_was_to_come(directory: Path) -> None:
    config = taught(directory)
    demonstrations = load_demonstrations(str(directory), config)
    model = learner(config)
    clone(model, demonstrations, CloningConfig(epochs=30, learning_rate=3e-3), seed=0)
    normaliser = normaliser_of(model)
    explained = []
    for demonstration in demonstrations:
        rewards = demonstration.rewards
        assert rewards is not None
        scale = np.sqrt(normaliser.ret_rms.var + normaliser.epsilon)
        powers = config.ppo.gamma ** np.arange(len(rewards))
        returns = [(powers[: len(rewards) - t] * rewards[t:]).sum() for t in range(len(rewards))]
        seen = normaliser.normalize_obs(demonstration.observations)
        with torch.no_grad():
            values = model.policy.predict_values(model.policy.obs_to_tensor(seen)[0])
        error = np.array(returns) / scale - values.numpy()[:, 0]
        explained.append(1.0 - error.var() / (np.array(returns) / scale).var())
    assert np.mean(explained) > 0.5


def test_rewards_that_are_not_known_leave_the_value_network_and_their_scale_alone(
    directory: Path,
) -> None:
    config = taught(directory)
    model = learner(config)
    before = [p.clone() for p in model.policy.value_net.parameters()]
    unknown = [
        Demonstration(one.observations, one.actions)
        for one in load_demonstrations(str(directory), config)
    ]
    clone(model, unknown, CloningConfig(epochs=2), seed=0)
    weigh_statistics(model, 1e6)
    after = list(model.policy.value_net.parameters())
    assert all(torch.equal(one, other) for one, other in zip(before, after, strict=True))
    assert normaliser_of(model).ret_rms.count < 1.0


def weights(checkpoint: Checkpoint) -> dict[str, torch.Tensor]:
    """Return the weights of a checkpoint's learner."""
    model = new_model(checkpoint.config, make_environments(checkpoint.config))
    checkpoint.restore(model)
    return model.policy.state_dict()


def test_a_training_goes_on_from_its_demonstrations_and_ends_the_same_if_it_was_stopped(
    directory: Path, tmp_path: Path
) -> None:
    config = taught(directory)
    whole = train(config, tmp_path / "whole")
    assert len(read_progress(whole.files.progress)) == UPDATES

    files = RunFiles(tmp_path / "stopped")
    files.directory.mkdir()
    cloning = start_from_demonstrations(config, load_demonstrations(str(directory), config), files)
    assert cloning.accuracy > cloning.chance
    begun = load_checkpoint(files.checkpoint)
    assert begun.progress.steps == 0
    cloned = weights(begun)
    # Out of time after its first update.
    hurried = config.model_copy(update={"wall_clock_budget_s": begun.progress.wall_s + 1e-3})
    _, progress = learn(hurried, files)
    assert progress.steps == config.steps_per_update
    model, _ = learn(config, files)
    for name, value in weights(load_checkpoint(whole.files.checkpoint)).items():
        assert torch.equal(model.policy.state_dict()[name], value), name
        assert not torch.equal(cloned[name], value), name


def test_a_run_is_not_begun_with_what_cannot_be_learnt_from(tmp_path: Path) -> None:
    config = taught(tmp_path / "nothing")
    with pytest.raises(ValueError, match="nothing: no replay"):
        train(config, tmp_path / "run")
    assert not (tmp_path / "run" / "config.yaml").exists()
