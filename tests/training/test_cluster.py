"""What of a training on a cluster needs no cluster; `make cluster` tries the rest with Ray."""

from __future__ import annotations

import importlib.util
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from stable_baselines3.common.running_mean_std import RunningMeanStd

from roller_env import cli
from roller_env.training.checkpoint import (
    CLUSTER,
    Checkpoint,
    CheckpointError,
    Progress,
    load_checkpoint,
    write_checkpoint,
)
from roller_env.training.cluster import RAY, check_cluster
from roller_env.training.config import TrainingConfig
from roller_env.training.files import RunError, RunFiles
from roller_env.training.network import network_of, network_spaces
from roller_env.training.normalisation import Moments, merged
from roller_env.training.policy import TrainedPolicy
from roller_env.training.ppo import make_environments, new_model
from roller_env.training.rllib_weights import from_rllib, to_rllib
from roller_env.training.rollout import Rollout
from roller_env.training.run import train
from roller_env.training.vector import RecipeVectorEnv, part_of
from tests.training.small import small_config


@pytest.fixture
def ray_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let all go on that looks whether Ray is installed, and no further."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name)


@pytest.mark.parametrize(
    "address", ["auto", "local", "10.0.0.1:6379", "head.example:1", "[::1]:6379", "a-b_c.d:65535"]
)
def test_a_cluster_has_an_address(address: str, ray_is_there: None) -> None:
    check_cluster(small_config(), address)


@pytest.mark.parametrize(
    "address",
    ["", "Auto", "10.0.0.1", "head:", ":6379", "head:0", "head:65536", "ray://head:10001", "a b:1"],
)
def test_what_is_no_address_is_refused(address: str, ray_is_there: None) -> None:
    with pytest.raises(RunError, match="must be auto"):
        check_cluster(small_config(), address)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"cluster": {"runners": 3}}, "num_envs: found 8; must be a multiple of the 3 runners"),
        ({"cluster": {"learners": 3}}, "ppo.batch_size: found 64; must be a multiple of the 3"),
        ({"environment": {"observation": "dict"}}, "environment.observation: found 'dict'"),
        ({"environment": {"observation": "pixels"}}, "environment.observation: found 'pixels'"),
        ({"environment": {"action": "force"}}, "environment.action: found 'force'"),
        ({"environment": {"action": "keys"}}, "environment.action: found 'keys'"),
        ({"demonstrations": "here"}, "leave out --demos"),
        (
            {"ppo": {"rollout_steps": 16, "batch_size": 64, "target_kl": 0.01}},
            "ppo.target_kl: RLlib's PPO has no such end",
        ),
    ],
)
def test_what_a_cluster_cannot_train_is_refused_before_anything_runs(
    changes: dict[str, Any], said: str, ray_is_there: None
) -> None:
    with pytest.raises(RunError, match=said.replace(".", r"\.")):
        check_cluster(small_config(**changes), "local")


def test_without_ray_a_cluster_is_refused_with_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match="--cluster needs Ray") as refusal:
        cli.main(["train", "flat", "--cluster", "local", "--runs", str(tmp_path)])
    assert f"pip install '{RAY}'" in str(refusal.value)
    assert not list(tmp_path.iterdir())


def test_the_version_of_ray_that_is_named_is_that_of_the_extra() -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    assert RAY in project["project"]["optional-dependencies"]["cluster"]


def module_of_rllib(config: TrainingConfig, inputs: int, actions: int) -> torch.nn.ModuleDict:
    """Return layers as RLlib's default PPO module has them, by its names, with random weights."""

    def mlp(*sizes: int) -> torch.nn.ModuleDict:
        activation = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "elu": torch.nn.ELU}
        layers: list[torch.nn.Module] = []
        for below, size in pairwise(sizes):
            layers += [torch.nn.Linear(below, size), activation[config.ppo.activation]()]
        return torch.nn.ModuleDict(
            {"net": torch.nn.ModuleDict({"mlp": torch.nn.Sequential(*layers)})}
        )

    def head(outputs: int) -> torch.nn.ModuleDict:
        last = torch.nn.Sequential(torch.nn.Linear(hidden[-1], outputs))
        return torch.nn.ModuleDict({"net": torch.nn.ModuleDict({"mlp": last})})

    hidden = config.ppo.hidden_sizes
    encoders = {f"{part}_encoder": mlp(inputs, *hidden) for part in ("actor", "critic")}
    parts = {"encoder": torch.nn.ModuleDict(encoders), "pi": head(actions), "vf": head(1)}
    return torch.nn.ModuleDict(parts)


@settings(max_examples=12)
@given(
    st.lists(st.integers(1, 12), min_size=1, max_size=3),
    st.sampled_from(["tanh", "relu", "elu"]),
    st.integers(0, 2**31),
)
def test_a_policy_made_of_rllib_s_weights_does_what_rllib_s_module_does(
    hidden: list[int], activation: str, seed: int
) -> None:
    ppo = {"rollout_steps": 16, "batch_size": 64, "hidden_sizes": hidden, "activation": activation}
    config = small_config(ppo=ppo, normalise_observations=False)
    seen, done = network_spaces(config, None)
    assert seen.shape is not None
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        module = module_of_rllib(config, seen.shape[0], 9)
        observations = torch.randn(16, *seen.shape)
    weights = from_rllib(config, module.state_dict())
    policy = TrainedPolicy(network_of(config, seen, done, weights), None, config)

    def forward(encoder: str, head: str) -> torch.Tensor:
        inner = module["encoder"][f"{encoder}_encoder"]["net"]["mlp"](observations)  # type: ignore[index]
        out: torch.Tensor = module[head]["net"]["mlp"](inner)  # type: ignore[index]
        return out

    with torch.no_grad():
        logits, values = forward("actor", "pi"), forward("critic", "vf")
        np.testing.assert_allclose(policy.network.predict_values(observations), values, rtol=1e-4)
        distribution = policy.network.get_distribution(observations).distribution
        assert isinstance(distribution, torch.distributions.Categorical)
        expected = logits - logits.logsumexp(dim=1, keepdim=True)
        np.testing.assert_allclose(distribution.logits, expected, rtol=1e-4, atol=1e-5)
    np.testing.assert_array_equal(policy(observations.numpy()), distribution.logits.argmax(dim=1))
    back = to_rllib(config, weights)
    assert back.keys() == module.state_dict().keys()


def test_the_weights_of_a_runner_make_no_policy() -> None:
    config = small_config()
    runner_s = module_of_rllib(config, 5, 9).state_dict()
    del runner_s["vf.net.mlp.0.weight"]
    with pytest.raises(ValueError, match=r"vf.net.mlp.0.weight: not there; .*vf_share_layers"):
        from_rllib(config, runner_s)


def moments_of(samples: list[np.ndarray[Any, Any]]) -> Moments:
    statistics = RunningMeanStd(shape=(2,))
    for batch in samples:
        statistics.update(batch)
    return {"mean": statistics.mean, "variance": statistics.var, "count": statistics.count}


@given(
    st.integers(0, 2**31),
    st.integers(0, 10_000),
    st.lists(st.integers(0, 500), max_size=4),
    st.floats(0.0, 100.0),
)
def test_what_several_runners_saw_from_one_base_on_is_what_one_would_have_seen(
    seed: int, seen: int, more: list[int], drift: float
) -> None:
    rng = np.random.default_rng(seed)
    base = [rng.normal(3.0, 2.0, (seen, 2))] if seen else []
    parts = [rng.normal(drift * number, 0.1, (count, 2)) for number, count in enumerate(more)]
    told = [moments_of([*base, part] if len(part) else base) for part in parts]
    whole = moments_of([*base, *(part for part in parts if len(part))])
    found = merged(moments_of(base), told)
    assert found["count"] == pytest.approx(whole["count"])
    np.testing.assert_allclose(found["mean"], whole["mean"], rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(found["variance"], whole["variance"], rtol=1e-6, atol=1e-6)


def test_a_runner_that_knows_less_than_the_base_adds_nothing() -> None:
    rng = np.random.default_rng(0)
    base = moments_of([rng.normal(size=(100, 2))])
    found = merged(base, [moments_of([rng.normal(size=(10, 2))])])
    assert found["count"] == base["count"]
    np.testing.assert_array_equal(found["mean"], base["mean"])


def test_the_parts_of_runners_are_the_whole_and_share_no_seed() -> None:
    config = small_config(num_envs=48, cluster={"runners": 4})
    parts = [part_of(config, number) for number in range(4)]
    assert sum(part.num_envs for part in parts) == config.num_envs
    seeds: list[int] = []
    for part in parts:
        rows = make_environments(part).environments.num_envs
        seeds += range(part.seed, part.seed + rows)
    assert len(set(seeds)) == len(seeds)


@pytest.fixture(scope="module")
def played() -> tuple[RecipeVectorEnv, Rollout, list[Any]]:
    """Return environments, their rollout of random actions, and what each step returned."""
    # Long enough that practice ends before the episode's time does.
    options = {"physics": "relaxed", "control_dt_s": 0.1, "max_episode_steps": 150}
    envs = RecipeVectorEnv(small_config(num_envs=16, environment=options))
    envs.reset()
    rng, rollout, steps = np.random.default_rng(1), Rollout(envs), []
    step = envs.step

    def kept(actions: Any) -> Any:
        steps.append((actions, *step(actions)))
        return steps[-1][1:]

    envs.step = kept  # type: ignore[method-assign]
    for _ in range(200):
        actions = rng.integers(9, size=envs.num_envs)
        logits = rng.normal(size=(envs.num_envs, 9)).astype(np.float32)
        rollout.step(actions, logits, logits[:, 0])
    return envs, rollout, steps


def test_a_rollout_s_pieces_are_all_that_happened_each_step_once(
    played: tuple[RecipeVectorEnv, Rollout, list[Any]],
) -> None:
    _, rollout, steps = played
    pieces = list(rollout.pieces())
    for name, column in (("actions", 0), ("rewards", 2)):
        # Row by row, as the pieces are.
        whole = np.stack([step[column] for step in steps], axis=1).ravel()
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in pieces]), whole)
    for piece in pieces:
        n = len(piece.actions)
        sizes = (len(piece.rewards), len(piece.logits), len(piece.log_probability))
        assert sizes == (n, n, n)
        assert len(piece.observations) == n + 1


def test_a_piece_ends_where_its_episode_does_with_what_was_seen_last(
    played: tuple[RecipeVectorEnv, Rollout, list[Any]],
) -> None:
    envs, rollout, steps = played
    ended = [piece for piece in rollout.pieces() if piece.terminated or piece.truncated]
    expected = []
    for row in range(envs.num_envs):
        for _, _, _, terminated, truncated, info in steps:
            if terminated[row] or truncated[row]:
                expected.append((info["final_obs"][row], terminated[row], truncated[row]))
    assert len(ended) == len(expected) > envs.num_envs
    for piece, (final, terminated, truncated) in zip(ended, expected, strict=True):
        np.testing.assert_array_equal(piece.observations[-1], final)
        assert (piece.terminated, piece.truncated) == (terminated, truncated)
    # Practice is cut short, which is no end of the game; the level's time is one.
    assert {piece.truncated for piece in ended} == {False, True}
    assert len(envs.ended) == len(expected)


def test_environments_that_are_put_back_go_on_with_the_same_bits() -> None:
    first, second = (RecipeVectorEnv(small_config(seed=seed)) for seed in (1, 2))
    rng = np.random.default_rng(0)
    first.reset()
    for _ in range(60):
        first.step(rng.integers(9, size=first.num_envs))
    second.restore(first.snapshot())
    np.testing.assert_array_equal(second.observations, first.observations)
    for _ in range(60):
        actions = rng.integers(9, size=first.num_envs)
        for one, other in zip(first.step(actions)[:4], second.step(actions)[:4], strict=True):
            np.testing.assert_array_equal(one, other)


def test_a_run_is_the_same_on_another_number_of_runners(
    tmp_path: Path,
) -> None:
    (tmp_path / "run.json").write_text("{}")
    (tmp_path / "evaluation.md").write_text("")
    (tmp_path / "config.yaml").write_text(small_config(cluster={"runners": 2}).to_yaml())
    assert train(small_config(cluster={"runners": 4}), tmp_path, resume=True).was_finished
    with pytest.raises(RunError, match="num_envs: 8, 16"):
        train(small_config(num_envs=16), tmp_path, resume=True)


def test_one_machine_does_not_go_on_with_a_cluster_s_training(tmp_path: Path) -> None:
    config, file = small_config(), RunFiles(tmp_path).checkpoint
    state = {CLUSTER: {"policy": {"weights": np.zeros(3, dtype=np.float32)}}}
    write_checkpoint(Checkpoint(file, config, Progress(steps=5), state))
    kept = load_checkpoint(file)
    np.testing.assert_array_equal(kept.state[CLUSTER]["policy"]["weights"], np.zeros(3))
    with pytest.raises(CheckpointError, match="go on with --cluster"):
        kept.restore(new_model(config, make_environments(config)))
