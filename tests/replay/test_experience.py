"""What is computed from a replay is what the environment gave, to the bit."""

from __future__ import annotations

import weakref
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from roller_env.envs.single import RollerEnv
from roller_env.game.actions import forces
from roller_env.game.step import INTRO_S
from roller_env.replay import ReplayError, record_episode
from roller_env.replay import experience as experience_module
from roller_env.replay.checksums import row_count
from roller_env.replay.experience import experiences
from tests.replay.recording import pushed_otherwise, straight_on, wandered


def equal(one: Any, other: Any) -> bool:
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(equal(one[name], other[name]) for name in one)
    return bool(np.array_equal(one, other))


@pytest.mark.parametrize("observation", ["state", "rays", "dict"])
@pytest.mark.parametrize("action", ["directions", "keys", "force"])
def test_an_environment_given_the_actions_gives_the_same_again(
    observation: str, action: str
) -> None:
    options = {"observation": observation, "action": action, "reward": "shaped"}
    played = wandered("bridge", seed=11)
    (experience,) = experiences([played], **options)
    environment = RollerEnv(level="bridge", physics="fast", **options)
    seen, _ = environment.reset(seed=11)
    for step in range(len(experience)):
        assert equal(seen, _at(experience.observations, step))
        seen, reward, terminated, truncated, _ = environment.step(experience.actions[step])
        assert reward == experience.rewards[step]
        assert terminated == experience.terminated[step]
        assert truncated == experience.truncated[step]
    assert equal(seen, _at(experience.observations, len(experience)))
    assert experience.terminated[-1]
    assert len(experience) == len(played)


def _at(observations: Any, step: int) -> Any:
    if isinstance(observations, dict):
        return {name: values[step] for name, values in observations.items()}
    return observations[step]


def test_replays_of_all_lengths_and_levels_keep_their_order() -> None:
    played = [wandered(level, seed=seed) for seed in (1, 2) for level in ("bridge", "flat")]
    played += [wandered("flat", seed=3)]
    together = experiences(played)
    for replay, experience in zip(played, together, strict=True):
        (alone,) = experiences([replay])
        assert experience.replay is replay
        assert len(experience) == len(replay)
        assert equal(experience.observations, alone.observations)
        assert np.array_equal(experience.rewards, alone.rewards)


def test_no_more_is_held_than_is_played_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    played = [wandered("flat", seed=seed, max_episode_steps=30) for seed in range(6)]
    assert {len(replay) for replay in played} == {30}
    monkeypatch.setattr(experience_module, "STATES_AT_ONCE", 2 * 31)
    yielded = experiences(iter(played))
    tables = [weakref.ref(_table(next(yielded).observations)) for _ in range(6)]
    assert [table() is None for table in tables] == [True, True, True, True, False, False]
    assert next(yielded, None) is None
    assert [table() for table in tables] == [None] * 6


def _table(observations: Any) -> Any:
    """Return the array of all who were played together, of which this is a part."""
    while observations.base is not None:
        observations = observations.base
    return observations


def test_there_is_nothing_to_learn_from_the_intro() -> None:
    played = wandered("flat", intro=True, max_episode_steps=200)
    (experience,) = experiences([played])
    assert len(played) - len(experience) == round(INTRO_S / played.options.control_dt_s)
    assert len(experience.observations) == len(experience) + 1
    assert experience.rewards.sum() == played.result.total_reward


def test_an_episode_that_was_left_before_its_end_has_none() -> None:
    (experience,) = experiences([straight_on("gate", 10, physics="fast")])
    assert not experience.terminated.any()
    assert not experience.truncated.any()


def test_a_replay_that_is_not_exact_here_teaches_nothing() -> None:
    with pytest.raises(ReplayError, match=r"1 of 1 replays .* are other games at step 10, in ball"):
        list(experiences([pushed_otherwise(wandered("flat"), 5)]))


@pytest.mark.parametrize("option", ["physics", "control_dt_s", "level"])
def test_the_game_itself_is_the_replays_own(option: str) -> None:
    with pytest.raises(ValueError, match=f"{option}: these are the replay's own"):
        experiences([wandered("flat")], **{option: "fast"})


def test_pictures_are_not_made_again() -> None:
    with pytest.raises(ValueError, match="choose state, rays or dict"):
        list(experiences([wandered("flat")], observation="pixels"))


def test_of_a_game_that_was_left_in_its_intro_nothing_remains() -> None:
    long, left = (wandered("flat", intro=True, max_episode_steps=200, seed=n) for n in (1, 2))
    steps = 30
    sums = replace(left.checksums, table=left.checksums.table[: row_count(steps, 10)])
    left = replace(left, actions=left.actions[:steps], checksums=sums)
    together = list(experiences([left, long]))
    assert [len(one) for one in together] == [0, 200 - round(INTRO_S / 0.05)]
    assert len(together[0].observations) == 1
    assert len(next(experiences([left]))) == 0


def test_a_weaker_push_than_a_keys_is_no_action_of_keys() -> None:
    config = wandered("flat", action="force").config()
    push = forces("force", np.array([[0.4, 0.0]], dtype=np.float32))
    weaker = record_episode(config, lambda _: push, seed=0)
    for mode in ("directions", "keys"):
        with pytest.raises(ReplayError, match=f"step 0, .* is no action of mode '{mode}'"):
            list(experiences([weaker], action=mode))
