"""A training configuration is checked whole, and before anything runs."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from roller_env.config import EnvConfig
from roller_env.game.rewards import RewardWeights
from roller_env.level import load_level, shipped_levels
from roller_env.physics.presets import PhysicsPreset
from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.config_source import ConfigError
from tests.training.small import small_config

BOMB = "abcdefghijklmnopqrstuvwxyz"
RECIPE = Path(__file__).parents[2] / "configs" / "ppo.yaml"


def written(directory: Path, text: str) -> Path:
    file = directory / "training.yaml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("level", shipped_levels())
def test_the_shipped_recipe_is_valid_on_every_shipped_level(level: str) -> None:
    config = load_config(RECIPE, [f"level={level}"])
    assert config.level == level
    assert config.evaluation_environment.physics == "default"


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
    assert config.environment == EnvConfig(level="flat", reward="shaped", discount=0.5)


def test_the_environment_shapes_rewards_with_the_discount_of_the_learner() -> None:
    ppo = {"gamma": 0.97, "rollout_steps": 1024}
    assert small_config(ppo=ppo).environment.discount == 0.97
    assert small_config(ppo=ppo).evaluation_environment.discount == 0.97
    config = small_config(ppo=ppo, environment={"discount": 0.5})
    assert config.environment.discount == 0.5


def test_the_evaluation_may_be_held_elsewhere_than_the_training() -> None:
    config = small_config(evaluation_environment={"physics": "default"})
    assert config.environment.physics == "fast"
    assert config.evaluation_environment == replace(config.environment, physics="default")


def test_reward_weights_are_given_by_name() -> None:
    config = small_config(environment={"reward_weights": {"coin": 2.0}})
    assert config.environment.reward_weights == RewardWeights(coin=2.0)


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
        (
            "level: flat\nenvironment: {level: gate}",
            "environment.level: is a field of the training",
        ),
        ("level: flat\nenvironment: {reward_weights: {coins: 1}}", "did you mean 'coin'?"),
        (
            "level: flat\nenvironment: {reward_weights: 3}",
            "reward_weights: found 3; must be a RewardWeights or a mapping with its fields coin,",
        ),
        ("level: flat\nenvironment: {reward: shapely}", "yaml:2:23: environment.reward: found"),
        ("level: flat\nseed: 1\nseed: 2", "yaml:3:1: seed: given twice, first on line 2"),
        ("level: flat\ntotal_steps: true", "2:14: total_steps: Input should be a valid integer"),
        ("level: flat\ntotal_steps: 2_500", "found '2_500' (write it without '_')"),
        (f"level: flat\nseed: {'1' * 5000}", "seed: Input should be a valid integer; found inf"),
        (f"level: flat\nseed: {'1' * 39}", "seed: Input should be less than 2147483648"),
        ("level: flat\nseed: 2026-11-26", "found '2026-11-26'"),
        ("level: 2026-11-26\nseed: x", "seed: Input should be a valid integer"),
        ("level: 7", "level: Input should be a valid string; found 7"),
        ("level: flat\nnormalise_rewards: yes", "Input should be a valid boolean; found 'yes'"),
        ("level: flat\nppo: {gamma: '0.9'}", "ppo.gamma: Input should be a valid number"),
        ('level: "\\e[31mflat"', "level: must be text that can be printed"),
        ("level: flat\nnum_envs: 1e18", "num_envs: Input should be less than or equal to 1000000"),
        ("level: flat\nppo: {hidden_sizes: [4, 1000000000]}", "ppo.hidden_sizes[1]: Input should"),
        (
            "level: flat\nnum_envs: 1e6\nppo: {rollout_steps: 1e6}",
            "1000000000000 samples of a rollout; allowed are at most 100000000",
        ),
        (
            "level: flat\nevaluation_environment: {observation: rays}",
            "an agent can be judged only with the observations",
        ),
        ("level: !!python/object/apply:os.system ['true']", "found the tag"),
        ("level: [", "not valid YAML"),
        ("- level", "found a list; wanted a mapping of fields"),
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
        ("seed=[", "not valid YAML"),
        ("seed=true", "--set 'seed=true': seed: Input should be a valid integer; found True"),
        ("seed=&a [*a]", "stands inside what it repeats"),
        ("=1", "expected field=value"),
        ("ppo..gamma=1", "expected field=value"),
        (f"environment{'.physics' * 5000}=1", "expected field=value"),
        ("sed=1", "did you mean 'seed'?"),
    ],
)
def test_a_mistake_in_an_override_is_told(tmp_path: Path, override: str, message: str) -> None:
    file = written(tmp_path, "level: flat\nseed: 1")
    with pytest.raises(ConfigError) as caught:
        load_config(file, [override])
    assert message in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.yaml: there is no such file"):
        load_config(tmp_path / "nowhere.yaml")
    written(tmp_path, "level: flat")
    with pytest.raises(ConfigError, match=r"did you mean 'training\.yaml'"):
        load_config(tmp_path / "trainign.yaml")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("x" * 300, "cannot be read: File name too long"),
        ("latin.yaml", "found the byte 0xe4, which is not UTF-8"),
        ("directory.yaml", "not a file"),
        ("a\0b", "there is no such file"),
    ],
)
def test_what_cannot_be_read_is_told(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "latin.yaml").write_bytes("level: flät".encode("latin1"))
    (tmp_path / "directory.yaml").mkdir()
    with pytest.raises(ConfigError, match=message):
        load_config(tmp_path / name)


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    file = tmp_path / "training.yaml"
    os.mkfifo(file)
    with pytest.raises(ConfigError, match=r"training\.yaml: not a file"):
        load_config(file)


def test_all_mistakes_are_told_at_once_each_with_its_place(tmp_path: Path) -> None:
    file = written(tmp_path, "level: flat\nseed: -1\nppo:\n  gamma: 2\n  epoch: 3\nspeed: 1\n")
    with pytest.raises(ConfigError) as caught:
        load_config(file, ["num_envs=0"])
    places = [(problem.field, problem.line, problem.column) for problem in caught.value.problems]
    assert places == [
        ("num_envs", None, None),
        ("seed", 2, 7),
        ("ppo.gamma", 4, 10),
        ("ppo.epoch", 5, 3),
        ("speed", 6, 1),
    ]


def test_all_mistakes_in_an_environments_options_are_told_each_with_its_place(
    tmp_path: Path,
) -> None:
    text = """level: flat
environment:
  rewrad: shaped
  action: keyz
  reward_weights: {coin: much, fall: .inf, finis: 1}
  physics: {name: mine, dt_s: 0, solver: PSG}
  level: gate
  width: 1
evaluation_environment:
  control_dt_s: 0.07
  camera: 9
"""
    with pytest.raises(ConfigError) as caught:
        load_config(written(tmp_path, text), ["environment.discount=2"])
    told = {(problem.field, problem.line): problem.what for problem in caught.value.problems}
    assert list(told) == [
        ("environment.discount", None),
        ("environment.rewrad", 3),
        ("environment.action", 4),
        ("environment.reward_weights", 5),
        ("environment.reward_weights.coin", 5),
        ("environment.reward_weights.fall", 5),
        ("environment.physics.dt_s", 6),
        ("environment.physics.solver", 6),
        ("environment.level", 7),
        ("environment.width", 8),
        ("evaluation_environment.control_dt_s", 10),
        ("evaluation_environment.camera", 11),
    ]
    assert "unknown field; known are 'action', " in told["environment.rewrad", 3]
    assert "did you mean 'reward'?" in told["environment.rewrad", 3]
    assert "did you mean 'finish'?" in told["environment.reward_weights", 5]
    assert "did you mean 'keys'?" in told["environment.action", 4]


def test_an_environment_is_given_as_options_as_a_configuration_or_as_what_was_written() -> None:
    level = load_level("gate")
    preset = PhysicsPreset("mine", dt_s=1 / 60)
    env = EnvConfig(level="flat", physics=preset, reward_weights=RewardWeights(coin=3.0))
    config = TrainingConfig(level="flat", environment=env)  # type: ignore[call-arg, unused-ignore]
    assert config.environment == config.evaluation_environment == env
    assert TrainingConfig.model_validate_json(config.model_dump_json()) == config
    assert set(config.model_dump(mode="json")["environment"]) == {"physics", "reward_weights"}
    elsewhere = config.on_level("gate")
    assert elsewhere == TrainingConfig(level="gate", environment=env)
    assert load_level(elsewhere.evaluation_environment.level) == level


def test_names_of_before_are_taken_with_a_warning(tmp_path: Path) -> None:
    text = "level: flat\npractice_share: 0.25\ncloning: {held_out_share: 0.5}\n"
    with pytest.warns(DeprecationWarning, match="is called .* now") as warned:
        config = load_config(written(tmp_path, text))
    assert (config.start_state_curriculum, config.cloning.held_out_fraction) == (0.25, 0.5)
    assert {str(one.message) for one in warned} == {
        "practice_share is called start_state_curriculum now",
        "held_out_share is called held_out_fraction now",
    }
    assert "share" not in config.to_yaml()
    wrong = "level: flat\npractice_share: 2\ncloning:\n  held_out_share: 1\n"
    with pytest.warns(DeprecationWarning, match="now"), pytest.raises(ConfigError) as caught:
        load_config(written(tmp_path, wrong))
    places = [(problem.field, problem.line) for problem in caught.value.problems]
    assert places == [("practice_share", 2), ("cloning.held_out_share", 4)]


def test_what_a_run_of_before_wrote_is_the_same_configuration(tmp_path: Path) -> None:
    """Earlier versions wrote the options as they were given, defaults among them."""
    text = """level: flat
environment: {reward: shaped, physics: fast, action: directions, discount: 0.99}
evaluation_environment: {physics: default, reward: shaped}
"""
    config = load_config(written(tmp_path, text))
    assert config.model_dump(mode="json")["evaluation_environment"] == {"physics": "default"}
    shorter = {"reward": "shaped", "physics": "fast"}
    same = {
        "level": "flat",
        "environment": shorter,
        "evaluation_environment": {"physics": "default"},
    }
    assert config.differences(TrainingConfig.model_validate(same)) == []


@pytest.mark.parametrize(
    "text",
    [
        "a: &a [x, x]\n" + "".join(f"{b}: &{b} [*{a}, *{a}]\n" for a, b in pairwise(BOMB)),
        "level: " + "[" * 900 + "]" * 900,
        "level: " + "{a: " * 900 + "1" + "}" * 900,
        "level: flat\n" + "# " + "x" * 2**21,
    ],
    ids=["aliases", "lists", "mappings", "length"],
)
def test_a_file_that_asks_for_endless_work_is_refused_at_once(tmp_path: Path, text: str) -> None:
    file = written(tmp_path, text)
    begin_s = time.process_time()
    with pytest.raises(ConfigError):
        load_config(file)
    assert time.process_time() - begin_s < 5.0


@given(name=st.text(st.characters(codec="utf-8").filter(str.isprintable), min_size=1))
@example("1e3")
@example("0x1F")
@example("null")
@example("~")
@example("2026-11-26")
@example("1_000")
@example(".inf")
@example("a: b # c")
def test_any_name_is_written_and_read_back(
    tmp_path_factory: pytest.TempPathFactory, name: str
) -> None:
    config = TrainingConfig(level="flat", demonstrations=name)
    file = written(tmp_path_factory.mktemp("config"), config.to_yaml())
    assert load_config(file) == config


@given(text=st.text(max_size=60))
def test_an_override_is_taken_or_refused_and_nothing_else(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    file = written(tmp_path_factory.getbasetemp(), "level: flat")
    for override in (text, f"seed={text}", f"{text}=1"):
        with suppress(ConfigError):
            load_config(file, [override])


def test_names_are_told_without_what_a_terminal_obeys(tmp_path: Path) -> None:
    file = tmp_path / "red\x1b[31m.yaml"
    for overrides in ([], ["level=\x1b[31m"]):
        with pytest.raises(ConfigError) as caught:
            load_config(file, overrides)
        assert "\\x1b[31m" in str(caught.value)
        assert "\x1b" not in str(caught.value)
        file.write_text("level: flat")


def test_two_configurations_are_compared_field_by_field() -> None:
    mine = small_config()
    theirs = small_config(seed=4, environment={"reward": "points", "physics": "fast"})
    assert mine.differences(theirs) == [
        "environment.max_episode_steps: 40, None",
        "environment.reward: 'shaped', 'points'",
        "seed: 3, 4",
    ]
    assert mine.differences(small_config()) == []
