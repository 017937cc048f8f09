"""Demonstrations: what was seen and done in episodes worth imitating."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from tqdm import tqdm

from roller_env.arrays import Float64
from roller_env.config import EnvConfig, make_config
from roller_env.envs.spaces import Observations, action_mode, entries_of, observation_space
from roller_env.game.actions import ActionMode, forces
from roller_env.level import load_level
from roller_env.problems import shown
from roller_env.replay import Replay, ReplayError, load_replay
from roller_env.replay.actions import recorded_actions
from roller_env.replay.experience import Experience, experiences
from roller_env.replay.file import SUFFIX
from roller_env.replay.scripted import PLAYER, relabelled
from roller_env.training.config import TrainingConfig


class DemonstrationError(ValueError):
    """Demonstrations that a training cannot begin with; the message says why."""


@dataclass(frozen=True, eq=False)
class Demonstration:
    """One episode.

    Attributes:
        observations: (T, ...) float32, as the training's environment gives them.
        actions: (T, ...) what was done then.
        rewards: (T,) float64, what came of it in the training's environment; None if that is not
            known, which it is not of a data set with other rewards.
    """

    observations: Observations
    actions: npt.NDArray[Any]
    rewards: Float64 | None = None

    def __len__(self) -> int:
        """Return the number of decisions."""
        return len(self.actions)


def chosen(observations: Any, rows: Any) -> Any:
    """Return some rows of observations, of each entry if they are a dict."""
    if isinstance(observations, dict):
        return {name: values[rows] for name, values in observations.items()}
    return observations[rows]


def load_demonstrations(source: str, config: TrainingConfig) -> list[Demonstration]:
    """Read demonstrations for a training.

    Args:
        source: a replay file, a directory of them, a directory that holds a Minari data set, or
            the name of one of this machine's (`roller_env.replay.datasets`).
        config: of the training; replays are played again to be seen as its environment shows them.

    Returns:
        The episodes, at least two: one has to be held out.

    Raises:
        DemonstrationError: there are none, they are of another level, they cannot be read, or
            other observations than the training's are in them.
    """
    wanted = config.environment
    path = Path(source)
    try:
        if path.is_file() or list(path.glob(f"*{SUFFIX}")):
            files = [path] if path.is_file() else sorted(path.glob(f"*{SUFFIX}"))
            episodes = _from_replays([load_replay(file) for file in files], wanted)
        else:
            episodes = _from_data_set(source, wanted)
    except ReplayError as error:
        raise DemonstrationError(f"{shown(source)}: {error}") from None
    if len(episodes) < 2:
        raise DemonstrationError(
            f"{shown(source)}: found {len(episodes)} episode; needed are two or more, since some "
            "are held out to see what was learnt"
        )
    return episodes


def _from_replays(replays: Sequence[Replay], wanted: EnvConfig) -> list[Demonstration]:
    level = load_level(wanted.level)
    for replay in replays:
        if replay.level != level:
            raise DemonstrationError(
                f"found a replay of level {replay.level.name!r}, which is not the level "
                f"{level.name!r} that is trained on, as it is now"
            )
    names = ("observation", "action", "reward", "reward_weights", "discount")
    played = experiences(replays, **{name: getattr(wanted, name) for name in names})
    # Thinned one by one: a person's game has ten times the states that are learnt from.
    return [
        _thinned(
            Demonstration(e.observations, _worth_imitating(e, wanted.action), e.rewards),
            wanted.control_dt_s / e.replay.options.control_dt_s,
        )
        for e in tqdm(played, total=len(replays), desc="demonstrations", unit=" episodes")
        # In an episode that was left in its intro, nothing was done.
        if len(e)
    ]


def _worth_imitating(experience: Experience, mode: ActionMode) -> npt.NDArray[Any]:
    """Return an episode's actions; those of the scripted player are relabelled: without noise."""
    replay = experience.replay
    if replay.player != PLAYER or replay.level.route is None:
        return experience.actions
    # The episode is without its intro.
    return recorded_actions(mode, relabelled(replay)[len(replay) - len(experience) :])


def _thinned(demonstration: Demonstration, ratio: float) -> Demonstration:
    """Return an episode at control steps that are ``ratio`` times as long.

    A person is asked for keys more often than an agent, and then mostly holds them.
    """
    rows = np.arange(0, len(demonstration), max(1, round(ratio)))
    rewards = demonstration.rewards
    return Demonstration(
        observations=chosen(demonstration.observations, rows),
        actions=demonstration.actions[rows],
        rewards=None if rewards is None else np.add.reduceat(rewards, rows),
    )


def _data_set(source: str) -> Any:
    try:
        import minari
    except ImportError:
        raise DemonstrationError(
            f"{shown(source)}: no such replay or directory of replays; for Minari's data sets, "
            "pip install 'roller-env[demos]'"
        ) from None
    try:
        if (Path(source) / "data").is_dir():
            return minari.MinariDataset(Path(source) / "data")
        return minari.load_dataset(source, download=False)
    except (FileNotFoundError, ValueError) as error:
        # None that can be found, or no name that one could have.
        raise DemonstrationError(
            f"{shown(source)}: no replay, directory of replays or Minari data set: {error}"
        ) from None


def _from_data_set(source: str, wanted: EnvConfig) -> list[Demonstration]:
    """Read a Minari data set, whose files (JSON and HDF5) may hold anything at all."""
    try:
        return _from_minari(_data_set(source), wanted)
    except DemonstrationError:
        raise
    except (LookupError, MemoryError, OSError, TypeError, ValueError) as error:
        raise DemonstrationError(
            f"{shown(source)}: not a whole Minari data set: {type(error).__name__}: {error}"
        ) from None


def _from_minari(data_set: Any, wanted: EnvConfig) -> list[Demonstration]:
    found, needed = data_set.observation_space, observation_space(wanted, entries_of(wanted))
    if found != needed:
        raise DemonstrationError(
            f"{data_set.id}: its observations are {_brief(found)}; the training's are "
            f"{_brief(needed)}"
        )
    spec, level = data_set.env_spec, load_level(wanted.level)
    # One that does not name its environment is taken for a recording of the training's, but for
    # what it rewards.
    recorded = wanted if spec is None else make_config(**spec.kwargs)
    played = load_level(recorded.level)
    if played != level:
        raise DemonstrationError(f"{data_set.id}: found level {played.name!r}, not {level.name!r}")
    is_rewarded_so = spec is not None and all(
        getattr(recorded, name) == getattr(wanted, name)
        for name in ("reward", "reward_weights", "discount")
    )
    ratio = wanted.control_dt_s / recorded.control_dt_s
    mode = action_mode(data_set.action_space)
    if mode is None:
        found = _brief(data_set.action_space)
        raise DemonstrationError(f"{data_set.id}: its actions, {found}, are not of this game")
    return [
        _thinned(
            Demonstration(
                observations=episode.observations,
                actions=recorded_actions(wanted.action, forces(mode, episode.actions)),
                rewards=np.asarray(episode.rewards, np.float64) if is_rewarded_so else None,
            ),
            ratio,
        )
        for episode in data_set.iterate_episodes()
        if len(episode.actions)
    ]


def _brief(space: gym.Space[Any]) -> str:
    text = type(space).__name__
    return f"{text}{space.shape}" if space.shape else str(space)
