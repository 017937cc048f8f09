"""Replays as a Minari data set, the format in which Gymnasium's world exchanges demonstrations.

It needs the ``demos`` extra. Data sets are written to and read from this machine alone, in the
directory that the environment variable ``MINARI_DATASETS_PATH`` names (``~/.minari/datasets``).
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

import gymnasium as gym

from roller_env import ENV_IDS, __version__
from roller_env.config import EnvConfig
from roller_env.envs.spaces import action_space, observation_space
from roller_env.game.rewards import RewardWeights
from roller_env.level import load_level
from roller_env.physics.presets import PRESETS, PhysicsPreset
from roller_env.replay.contents import Replay
from roller_env.replay.errors import ReplayError
from roller_env.replay.experience import Experience, experiences

if TYPE_CHECKING:
    from minari import MinariDataset

_DATA_FORMAT: Final = "hdf5"
_ANY_LEVEL: Final = "classic"


def to_minari(
    replays: Sequence[Replay], dataset_id: str, *, author: str = "", **changes: Any
) -> MinariDataset:
    """Write replays as a Minari data set and return it.

    Observations, actions and rewards are computed by playing the replays again, every step of
    which is compared with the recording, so they are what the environment gave, to the bit.

    Args:
        replays: of one level, played with the same options.
        dataset_id: what to call it, such as ``roller/classic/human-v0``.
        author: who played, for others to know.
        changes: other options than the replays' own, such as ``observation="rays"``.

    Raises:
        ReplayError: a replay is not exact here, or its forces are none of the action mode's.
        ValueError: there are no replays, they are not of one game, or there is a data set of that
            name already.
        ImportError: Minari is not installed.
    """
    # Only this function needs it, and it takes a second to import.
    import minari
    from minari.data_collector import EpisodeBuffer

    if not replays:
        raise ValueError("replays: found none; a data set has at least one episode")
    first = replays[0]
    for replay in replays:
        if (replay.level, replay.options) != (first.level, first.options):
            raise ValueError(
                "replays: found different levels or options; a data set is of one environment"
            )
    config = first.config(**changes)
    episodes = [_buffer(EpisodeBuffer, e) for e in experiences(replays, **changes)]
    players = sorted({replay.player or "unknown" for replay in replays})
    with warnings.catch_warnings():
        # It recommends an e-mail address, a link to the code and an environment to evaluate in.
        warnings.filterwarnings("ignore", category=UserWarning, module="minari")
        return minari.create_dataset_from_buffers(
            dataset_id,
            buffer=episodes,
            env=environment_spec(config),
            action_space=action_space(config),
            observation_space=observation_space(config),
            algorithm_name=", ".join(players),
            author=author or None,
            description=f"{len(replays)} episodes of Roller's level {first.level.name!r}.",
            data_format=_DATA_FORMAT,
            requirements=[f"roller-env=={__version__}", f"mujoco=={version('mujoco')}"],
        )


def to_minari_by_level(replays: Sequence[Replay], prefix: str, **changes: Any) -> list[str]:
    """Write what a person played, whatever levels, as one data set a level and set of options.

    Args:
        replays: of any levels and options; those without a step are left out.
        prefix: of the data sets' names, such as ``roller/human``: then ``roller/human/classic-v0``,
            or the first version that there is none of yet.
        changes: see `to_minari`.

    Returns:
        The data sets' names.
    """
    from minari import list_local_datasets

    groups: dict[tuple[str, str], list[Replay]] = {}
    for replay in replays:
        if len(replay):
            key = (replay.level_hash, replay.options.model_dump_json())
            groups.setdefault(key, []).append(replay)
    written: list[str] = []
    for group in groups.values():
        known = {*list_local_datasets(), *written}
        names = (f"{prefix}/{group[0].level.name}-v{number}" for number in itertools.count())
        name = next(name for name in names if name not in known)
        to_minari(group, name, **changes)
        written.append(name)
    return written


def check_prefix(prefix: str) -> None:
    """Refuse, before anything is played, what `to_minari_by_level` could not write.

    Raises:
        ReplayError: Minari is not installed, or no data set can have such a name.
    """
    try:
        from minari.dataset.minari_dataset import parse_dataset_id
    except ImportError:
        raise ReplayError("a data set needs Minari: pip install 'roller-env[demos]'") from None
    try:
        parse_dataset_id(f"{prefix}/{_ANY_LEVEL}-v0")
    except ValueError:
        raise ReplayError(
            f"record: found {prefix!r}; the name of a data set begins with words of two or more "
            "letters, digits, - or _, and / between them, such as roller/human"
        ) from None


def environment_spec(config: EnvConfig) -> gym.envs.registration.EnvSpec | None:
    """Return the registered environment of a configuration, with the options that say it.

    None if they cannot be said in JSON, which is what a data set keeps: for a level that is not
    shipped, a preset without a name, or weights of one's own.
    """
    level = load_level(config.level)
    ids = [name for name, options in ENV_IDS.items() if options.get("level") == level.name]
    if not ids or load_level(level.name) != level or config.reward_weights != RewardWeights():
        return None
    physics = config.physics
    if isinstance(physics, PhysicsPreset):
        if PRESETS.get(physics.name) != physics:
            return None
        physics = physics.name
    names = ("action", "observation", "reward", "discount", "control_dt_s", "max_episode_steps")
    options = {name: getattr(config, name) for name in names} | {"physics": physics}
    environment = gym.make(ids[0], **options)
    try:
        return environment.spec
    finally:
        environment.close()


def _buffer(buffer: Any, experience: Experience) -> Any:
    truncated = experience.truncated.copy()
    # Minari wants every episode to end; one that was left is cut off there.
    truncated[-1] |= not experience.terminated[-1]
    return buffer(
        seed=experience.replay.seed,
        observations=experience.observations,
        actions=experience.actions,
        rewards=experience.rewards,
        terminations=experience.terminated,
        truncations=truncated,
    )
