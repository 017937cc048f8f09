"""A Minari data set of replays holds what its environment gives, and says which that is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from roller_env.config import make_config
from roller_env.game.actions import forces
from roller_env.game.rewards import RewardWeights
from roller_env.level import load_level
from roller_env.physics.presets import PRESETS, PhysicsPreset, physics_preset
from roller_env.play.session import GameSession, play_config
from roller_env.replay import Replay, ReplayError, record_episode
from roller_env.replay.datasets import (
    NothingPlayed,
    check_prefix,
    environment_spec,
    to_minari,
    to_minari_by_level,
)
from roller_env.replay.keeper import ReplayKeeper
from tests.builders import make_level
from tests.replay.recording import pushed_otherwise, straight_on, wandered

minari = pytest.importorskip("minari", reason="the extra 'demos' is not installed")

# That the data set asks for this package, which a checkout on the path does not install.
pytestmark = pytest.mark.filterwarnings("ignore:Package roller-env is not installed:UserWarning")


@pytest.fixture(autouse=True)
def _here_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep data sets in the test's own directory."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


@pytest.mark.parametrize("observation", ["state", "dict"])
def test_the_environment_that_a_data_set_names_gives_it_again(observation: str) -> None:
    played = [wandered("bridge", seed=seed, reward="shaped") for seed in (3, 4)]
    to_minari(played, "roller/bridge/test-v0", author="a test", observation=observation)
    data_set = minari.load_dataset("roller/bridge/test-v0")
    assert data_set.total_episodes == 2
    assert data_set.total_steps == sum(map(len, played))
    environment = data_set.recover_environment()
    for replay, episode in zip(played, data_set.iterate_episodes(), strict=True):
        seen, _ = environment.reset(seed=replay.seed)
        total = 0.0
        for step, action in enumerate(episode.actions):
            assert _same(seen, episode.observations, step)
            seen, reward, terminated, truncated, _ = environment.step(action)
            assert (reward, terminated) == (episode.rewards[step], episode.terminations[step])
            assert truncated == episode.truncations[step]
            total += reward
        assert _same(seen, episode.observations, len(episode.actions))
        assert total == replay.result.total_reward


def _same(seen: Any, observations: Any, step: int) -> bool:
    if isinstance(seen, dict):
        return all(_same(seen[name], observations[name], step) for name in seen)
    return bool(np.array_equal(seen, observations[step]))


def test_an_episode_that_was_left_is_cut_off_at_its_end() -> None:
    data_set = to_minari([straight_on("gate", 10, physics="fast")], "roller/gate/left-v0")
    (episode,) = data_set.iterate_episodes()
    assert episode.truncations.tolist() == 9 * [False] + [True]
    assert not episode.terminations.any()


def test_a_data_set_is_of_one_game() -> None:
    with pytest.raises(ValueError, match="different levels or options"):
        to_minari([wandered("flat"), wandered("bridge")], "roller/both-v0")
    with pytest.raises(ValueError, match="found none"):
        to_minari([], "roller/none-v0")


def test_a_data_set_is_not_overwritten() -> None:
    to_minari([wandered("flat")], "roller/flat/once-v0")
    with pytest.raises(ValueError, match="already exists"):
        to_minari([wandered("flat")], "roller/flat/once-v0")


def test_what_was_played_on_several_levels_becomes_a_data_set_of_each() -> None:
    nothing = straight_on("gate", 0, physics="fast")
    played = [wandered("flat"), nothing, wandered("bridge"), wandered("flat", seed=1)]
    written = to_minari_by_level(played, "roller/human")
    assert written.names == ("roller/human/flat-v0", "roller/human/bridge-v0")
    assert written.problems == ()
    assert minari.load_dataset("roller/human/flat-v0").total_episodes == 2
    assert to_minari_by_level(played[:1], "roller/human").names == ("roller/human/flat-v1",)


def left_in_the_intro(level: str, then_s: float = 0.0) -> list[Replay]:
    """Return the games of somebody who presses R at once, and plays for ``then_s`` after that."""
    keeper = ReplayKeeper()
    session = GameSession(play_config(level, "fast"), seed=0, observers=[keeper])
    session.start()
    session.advance(0.1, "w")
    session.restart()
    for _ in range(round(then_s / 0.1)):
        session.advance(0.1, "w")
    session.close()
    assert keeper.replays[0].intro
    assert len(keeper.replays[0]) == 12
    return keeper.replays


def test_who_presses_r_in_the_intro_loses_no_data_set() -> None:
    left = left_in_the_intro("flat")
    written = to_minari_by_level([*left, wandered("bridge")], "roller/human")
    assert written.names == ("roller/human/bridge-v0",)
    assert written.problems == ()
    with pytest.raises(NothingPlayed, match="level 'flat': the keys never worked"):
        to_minari(left, "roller/flat/left-v0")


def test_a_game_that_was_left_in_its_intro_is_no_episode_of_a_data_set() -> None:
    played = left_in_the_intro("flat", then_s=0.5)
    assert len(played) == 2
    data_set = to_minari(played, "roller/flat/human-v0")
    assert (data_set.total_episodes, data_set.total_steps) == (1, 60)


def test_a_level_that_cannot_be_written_costs_no_other_its_data_set(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    create = minari.create_dataset_from_buffers

    def full(name: str, **rest: Any) -> Any:
        data_set = create(name, **rest)
        if "bridge" in name:
            raise OSError(28, "No space left on device")
        return data_set

    monkeypatch.setattr(minari, "create_dataset_from_buffers", full)
    other = pushed_otherwise(wandered("gate", max_episode_steps=20), 3)
    played = [other, wandered("bridge"), wandered("flat")]
    written = to_minari_by_level(played, "roller/human")
    assert written.names == ("roller/human/flat-v0",)
    not_exact, no_space = written.problems
    assert "data set roller/human/gate-v0 not written: 1 of 1 replays" in not_exact
    assert "data set roller/human/bridge-v0 not written: [Errno 28] No space left" in no_space
    # Nothing is left of what was begun, so that the name is free.
    assert not (tmp_path / "roller" / "human" / "bridge-v0").exists()
    monkeypatch.undo()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    assert to_minari_by_level(played[1:2], "roller/human").names == ("roller/human/bridge-v0",)


def test_a_directory_that_is_no_data_set_any_more_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "roller" / "human" / "flat-v0").mkdir(parents=True)
    assert to_minari_by_level([wandered("flat")], "roller/human").names == ("roller/human/flat-v1",)


def test_a_spec_says_all_of_an_environment_and_no_more() -> None:
    spec = environment_spec(make_config(level="gate", physics="fast", reward="shaped"))
    assert spec.id == "Roller/Gate-v0"
    assert spec.kwargs == {"level": "gate", "physics": "fast", "reward": "shaped"}
    every: list[dict[str, Any]] = [
        {"level": "gate", "physics": PRESETS["fast"]},
        {"level": make_level()},
        {"level": make_level(name="gate")},
        {"level": "gate", "physics": PhysicsPreset("fast", dt_s=1 / 60)},
        {"level": "gate", "reward_weights": RewardWeights(coin=2.0), "max_episode_steps": 9},
    ]
    for options in every:
        config = make_config(**options, num_threads=1)
        spec = EnvSpec.from_json(environment_spec(config).to_json())
        recovered: Any = gym.make(spec).unwrapped
        assert replace(recovered.config, level="flat", physics="default") == replace(
            config, level="flat", physics="default"
        )
        assert recovered.simulation.level == load_level(config.level)
        assert recovered.simulation.preset == physics_preset(config.physics)


def test_minari_recovers_an_environment_whose_options_are_objects() -> None:
    level = make_level(name="mine")
    config = make_config(
        level=level,
        physics=PhysicsPreset("mine", dt_s=0.01, integrator="Euler"),
        reward_weights=RewardWeights(coin=2.0),
        max_episode_steps=5,
        num_threads=1,
    )
    played = record_episode(config, lambda simulation: forces("directions", [1]), seed=3)
    to_minari([played], "roller/mine-v0")
    data_set = minari.load_dataset("roller/mine-v0")
    recovered = data_set.recover_environment()
    assert recovered.unwrapped.config == config
    (episode,) = data_set.iterate_episodes()
    seen = [recovered.reset(seed=3)[0]]
    seen.extend(recovered.step(action)[0] for action in episode.actions)
    assert [o.tobytes() for o in seen] == [o.tobytes() for o in episode.observations]


@pytest.mark.parametrize("prefix", ["x", "my games", "/roller", "roller/", ""])
def test_what_cannot_begin_the_name_of_a_data_set_is_refused(prefix: str) -> None:
    with pytest.raises(ReplayError, match=f"record: found '{prefix}'; .* such as roller/human"):
        check_prefix(prefix)
    check_prefix("roller/human")
    check_prefix("mine")
