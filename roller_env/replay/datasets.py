"""Replays as a Minari data set, the format in which Gymnasium's world exchanges demonstrations.

It needs the ``demos`` extra. Data sets are written to and read from this machine alone, in the
directory that the environment variable ``MINARI_DATASETS_PATH`` names (``~/.minari/datasets``).
"""

from __future__ import annotations

import itertools
import shutil
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

import gymnasium as gym

from roller_env import ENV_IDS, __version__
from roller_env.config import EnvConfig
from roller_env.envs.spaces import action_space, entries_of, observation_space
from roller_env.level import load_level
from roller_env.physics.presets import PRESETS
from roller_env.replay.contents import Replay
from roller_env.replay.errors import ReplayError
from roller_env.replay.experience import Experience, experiences

if TYPE_CHECKING:
    from minari import MinariDataset

_DATA_FORMAT: Final = "hdf5"
_ANY_LEVEL: Final = "classic"
_ANY_LEVEL_ID: Final = "Roller/Level-v0"


class NothingPlayed(ReplayError):
    """Replays in which the keys never worked, of which there is nothing to learn."""


def to_minari(
    replays: Sequence[Replay], dataset_id: str, *, author: str = "", **changes: Any
) -> MinariDataset:
    """Write replays as a Minari data set and return it.

    Observations, actions and rewards are computed by playing the replays again, every checksum of
    which is compared with the recording, so they are what the environment gave, to the bit.

    Args:
        replays: of one level, played with the same options; those in which the keys never worked,
            having been left in the intro, are left out.
        dataset_id: what to call it, such as ``roller/classic/human-v0``.
        author: who played, for others to know.
        changes: other options than the replays' own, such as ``observation="rays"``.

    Raises:
        NothingPlayed: in none of them did the keys ever work.
        ReplayError: a replay is not exact here, or its forces are none of the action mode's.
        ValueError: there are no replays, they are not of one game, or there is a data set of that
            name already.
        ImportError: Minari is not installed.
        OSError: it cannot be written; nothing is left of it.
    """
    # Only this function needs it, and it takes a second to import.
    import minari
    from minari.data_collector import EpisodeBuffer

    if not replays:
        raise ValueError("replays: found none; a data set has at least one episode")
    first = replays[0]
    for replay in replays:
        if replay.environment_key != first.environment_key:
            raise ValueError(
                "replays: found different levels or options; a data set is of one environment"
            )
    config = first.config(**changes)
    episodes = [_buffer(EpisodeBuffer, e) for e in experiences(replays, **changes) if len(e)]
    if not episodes:
        raise NothingPlayed(
            f"level {first.level.name!r}: the keys never worked, so nothing was done"
        )
    players = sorted({replay.player or "unknown" for replay in replays})
    with warnings.catch_warnings(), _all_or_nothing(dataset_id):
        # It recommends an e-mail address, a link to the code and an environment to evaluate in.
        warnings.filterwarnings("ignore", category=UserWarning, module="minari")
        return minari.create_dataset_from_buffers(
            dataset_id,
            buffer=episodes,
            env=environment_spec(config),
            action_space=action_space(config),
            observation_space=observation_space(config, entries_of(config)),
            algorithm_name=", ".join(players),
            author=author or None,
            description=f"{len(episodes)} episodes of Roller's level {first.level.name!r}.",
            data_format=_DATA_FORMAT,
            requirements=[f"roller-env=={__version__}", f"mujoco=={version('mujoco')}"],
        )


@contextmanager
def _all_or_nothing(dataset_id: str) -> Iterator[None]:
    """Leave no half of a data set, whose name would be taken and which nobody could read."""
    from minari.storage import get_dataset_path

    path = get_dataset_path(dataset_id)
    was_there = path.exists()
    try:
        yield
    except BaseException:
        if not was_there:
            shutil.rmtree(path, ignore_errors=True)
        raise


@dataclass(frozen=True)
class Written:
    """What came of writing data sets of several games.

    Attributes:
        names: of the data sets.
        problems: what could not be written, and why, a line each.
    """

    names: tuple[str, ...]
    problems: tuple[str, ...]


def to_minari_by_level(replays: Sequence[Replay], prefix: str, **changes: Any) -> Written:
    """Write what a person played, whatever levels, as one data set a level and set of options.

    Whatever happens to one of them, the others are written.

    Args:
        replays: of any levels and options; those in which the keys never worked are left out.
        prefix: of the data sets' names, such as ``roller/human``: then ``roller/human/classic-v0``,
            or the first version that there is none of yet.
        changes: see `to_minari`.
    """
    from minari.storage import get_dataset_path

    groups: dict[tuple[str, str], list[Replay]] = {}
    for replay in replays:
        groups.setdefault(replay.environment_key, []).append(replay)
    names: list[str] = []
    problems: list[str] = []
    for group in groups.values():
        level = group[0].level.name
        candidates = (f"{prefix}/{level}-v{number}" for number in itertools.count())
        name = next(name for name in candidates if not get_dataset_path(name).exists())
        try:
            to_minari(group, name, **changes)
        except NothingPlayed:
            continue
        except Exception as error:  # noqa: BLE001 - the other levels are to be written
            problems.append(f"data set {name} not written: {error or type(error).__name__}")
            continue
        names.append(name)
    return Written(tuple(names), tuple(problems))


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


def environment_spec(config: EnvConfig) -> gym.envs.registration.EnvSpec:
    """Return the spec of the environment of a configuration, for `gymnasium.make` and for JSON.

    It is of the level's own id if the level is a shipped one, and names what differs from the
    options' defaults. The time limit is among them, so that it is the environment's own, which the
    agent sees, and not Gymnasium's.
    """
    level = load_level(config.level)
    ids = [name for name, fixed in ENV_IDS.items() if fixed.get("level") == level.name]
    is_shipped = bool(ids) and load_level(level.name) == level
    spec = gym.spec(ids[0] if is_shipped else _ANY_LEVEL_ID)
    is_named = PRESETS.get(config.preset.name) == config.preset
    plainer = replace(
        config,
        level=level.name if is_shipped else level,
        physics=config.preset.name if is_named else config.preset,
        num_threads=EnvConfig.num_threads,
    )
    return replace(spec, kwargs={**spec.kwargs, **plainer.differences(EnvConfig())})


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
