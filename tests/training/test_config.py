"""A training configuration is checked whole, and before anything runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from roller_env.game.rewards import RewardWeights
from roller_env.level import shipped_levels
from roller_env.training.config import ConfigError, TrainingConfig, load_config
from tests.training.small import small_config

CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))


def written(directory: Path, text: str) -> Path:
    file = directory / "training.yaml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("file", CONFIGS, ids=lambda file: file.stem)
def test_every_shipped_configuration_is_valid_and_is_of_the_level_it_is_named_after(
    file: Path,
) -> None:
    config = load_config(file)
    assert file.stem == f"{config.algorithm}_{config.level}"


def test_every_shipped_level_has_a_configuration() -> None:
    assert {load_config(file).level for file in CONFIGS} == set(shipped_levels())


def test_what_is_written_is_read_back_equal(tmp_path: Path) -> None:
    config = small_config(wall_clock_budget_s=1.5)
    assert load_config(written(tmp_path, config.to_yaml())) == config


def test_a_level_alone_is_a_configuration(tmp_path: Path) -> None:
    assert load_config(written(tmp_path, "level: gate")) == TrainingConfig(level="gate")


def test_an_override_reaches_a_field_inside_another(tmp_path: Path) -> None:
    file = written(tmp_path, "level: flat\nppo: {gamma: 0.9, epochs: 2}")
    overrides = ["ppo.gamma=0.5", "seed=7", "environment.reward=shaped"]
    config = load_config(file, overrides)
    assert (config.ppo.gamma, config.ppo.epochs, config.seed) == (0.5, 2, 7)
    assert config.environment == {"reward": "shaped"}


def test_the_environment_shapes_rewards_with_the_discount_of_the_learner() -> None:
    options = small_config(ppo={"gamma": 0.97, "rollout_steps": 1024}).environment_options
    assert options["discount"] == 0.97


def test_the_evaluation_may_be_held_elsewhere_than_the_training() -> None:
    config = small_config(evaluation_environment={"physics": "default"})
    assert config.environment_options["physics"] == "fast"
    assert config.evaluation_options == config.environment_options | {"physics": "default"}


def test_reward_weights_are_given_by_name() -> None:
    config = small_config(environment={"reward_weights": {"coin": 2.0}})
    assert config.environment_options["reward_weights"] == RewardWeights(coin=2.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("levle: flat", "levle: unknown field; known are 'level'"),
        ("levle: flat", "did you mean 'level'?"),
        ("levle: flat", "level: Field required"),
        ("level: flat\nppo: {gama: 0.9}", "ppo.gama: unknown field; known are 'rollout_steps'"),
        ("level: flat\nppo: {gama: 0.9}", "did you mean 'gamma'?"),
        ("level: flat\nppo: {gamma: 1.5}", "ppo.gamma: Input should be less than or equal to 1"),
        ("level: flat\nppo: {gamma: 1.5}", "found 1.5"),
        ("level: flat\nseed: -1", "seed: Input should be greater than or equal to 0; found -1"),
        ("level: flat\nnum_envs: many", "num_envs: Input should be a valid integer"),
        ("level: flat\nwall_clock_budget_s: .inf", "wall_clock_budget_s: Input should be a finite"),
        ("level: flat\nppo: {batch_size: 5000}", "ppo.batch_size 5000 does not divide the 32768"),
        ("level: flat\nenvironment: {rewrad: shaped}", "did you mean 'reward'?"),
        ("level: flat\nenvironment: {reward: shapely}", "did you mean 'shaped'?"),
        ("level: flat\nenvironment: {level: gate}", "level is a field of the training itself"),
        ("level: flat\nenvironment: {reward_weights: {coins: 1}}", "did you mean 'coin'?"),
        ("level: flat\nenvironment: {reward_weights: 3}", "reward_weights: expected any of 'coin'"),
        ("level: [", "not YAML"),
        ("- level", "expected fields such as 'level: classic'"),
    ],
)
def test_a_mistake_is_told_with_its_place_and_what_would_be_right(
    tmp_path: Path, text: str, message: str
) -> None:
    file = written(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        load_config(file)
    assert message in str(caught.value)
    assert all(line.startswith(str(file)) for line in str(caught.value).splitlines()[:1])


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("seed", "expected field=value"),
        ("seed.x=1", "'seed' has no fields of its own"),
        ("seed=[", "the value is not YAML"),
        ("sed=1", "did you mean 'seed'?"),
    ],
)
def test_a_mistake_in_an_override_is_told(tmp_path: Path, override: str, message: str) -> None:
    file = written(tmp_path, "level: flat\nseed: 1")
    with pytest.raises(ConfigError) as caught:
        load_config(file, [override])
    assert message in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.yaml: No such file"):
        load_config(tmp_path / "nowhere.yaml")


def test_two_configurations_are_compared_field_by_field() -> None:
    mine = small_config()
    theirs = small_config(seed=4, environment={"reward": "points", "physics": "fast"})
    assert mine.differences(theirs) == [
        "environment.max_episode_steps: 40, None",
        "environment.reward: 'shaped', 'points'",
        "seed: 3, 4",
    ]
    assert mine.differences(small_config()) == []
