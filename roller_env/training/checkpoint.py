"""A training at the boundary of two updates, in one file that is whole or not there.

Everything the continuation depends on is inside: weights and optimizer, normalisation statistics,
the state of every environment, of every random generator and of the step counter. A run that was
killed and resumed therefore ends with the same bits as one that never stopped.

The file is one header line with the SHA-256 of all that follows, and an uncompressed zip archive of
two members: ``state.json``, whatever is not an array, and ``arrays.safetensors``, whatever is.
Nothing in it can be executed, whoever wrote it.
"""

from __future__ import annotations

import hashlib
import io
import json
import random
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import safetensors.numpy
import torch
from pydantic import ValidationError
from pydantic_core import from_json
from safetensors import SafetensorError
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.arrays import Int64
from roller_env.envs.sb3 import VecSnapshot
from roller_env.game.actions import DIRECTIONS
from roller_env.game.cameras import MODES
from roller_env.pieces.coin import COIN
from roller_env.problems import shown
from roller_env.simulation import Snapshot, joined
from roller_env.training.config import TrainingConfig
from roller_env.training.curriculum import (
    CurriculumSnapshot,
    StartStateCurriculum,
    separate,
)
from roller_env.training.exploration import Journeys
from roller_env.training.files import RunError, read_whole, write_atomically
from roller_env.training.normalisation import running_moments, set_running_moments

CLUSTER: Final = "cluster"
"""Name in a checkpoint's state under which all is that a training on a cluster left."""

Tree = dict[str, Any]
"""Names to arrays, to JSON's values, or to such trees."""

MAX_BYTES: Final = 2**32

_HEADER: Final = b"roller-checkpoint-3 sha256 "
"""Starts the file; the number is the format's, raised when an old file can no longer be read."""

_HEADER_LENGTH: Final = len(_HEADER) + hashlib.sha256().digest_size * 2 + 1
_STATE, _ARRAYS = "state.json", "arrays.safetensors"
_BETWEEN_NAMES: Final = "/"
_VARYING: Final = ("physics", "game", "level_of_row", "generators")
"""Of a `Snapshot`; its other fields are what the configuration says."""

_OF_CURRICULUM: Final = (
    "success",
    "age",
    "idle",
    "anchor",
    "task",
    "from_start",
    "clock",
    "generator",
)
_JOURNEYS: Final = tuple(field.name for field in fields(Journeys))

_REMEDY: Final = "remove the run's directory to train again from the start"


class CheckpointError(RuntimeError):
    """A checkpoint that cannot be used; the message names the file, the fault and the way out."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a training is.

    Attributes:
        steps: environment steps, over all environments.
        wall_s: seconds spent training, over all sessions.
        mastery: share of the coins taken in games that end at the finish, others counting nothing:
            a running mean over episodes.
        final_from: steps after which the training began to end; None before.
    """

    steps: int = 0
    wall_s: float = 0.0
    mastery: float = 0.0
    final_from: int | None = None


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """What a checkpoint file holds; `restore` brings it to life.

    Attributes:
        file: where it was read.
        config: of the training.
        progress: when the checkpoint was written.
        state: of the learner, the environments and the random generators.
    """

    file: Path
    config: TrainingConfig
    progress: Progress
    state: Tree

    def restore(self, model: PPO) -> None:
        """Put a learner, its environments and the random generators where they were.

        Args:
            model: a new one, made as the configuration says.

        Raises:
            CheckpointError: the checkpoint is that of another learner.
        """
        if CLUSTER in self.state:
            message = "of a training on a cluster; go on with --cluster"
            raise CheckpointError(f"{shown(self.file)}: {message}")
        try:
            _set_state(model, self.state)
        except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
            raise CheckpointError(
                f"{shown(self.file)}: not of a training with this configuration ({error}); "
                f"{_REMEDY}"
            ) from error


def save_checkpoint(file: Path, model: PPO, config: TrainingConfig, progress: Progress) -> None:
    """Write a checkpoint of a learner of Stable-Baselines3; see `write_checkpoint`.

    Args:
        file: to replace.
        model: between two updates, with its environments inside a VecNormalize.
        config: of the training.
        progress: so far.

    Raises:
        OSError: the disk is full or not writable; the old checkpoint is still there.
    """
    write_checkpoint(Checkpoint(file, config, progress, _state(model)))


def write_checkpoint(checkpoint: Checkpoint) -> None:
    """Write a checkpoint; whenever the process dies, its file is the old one or the new one.

    Raises:
        OSError: the disk is full or not writable; the old checkpoint is still there.
    """
    config, progress = checkpoint.config, checkpoint.progress
    flat = _flat(checkpoint.state)
    arrays = {name: value for name, value in flat.items() if isinstance(value, np.ndarray)}
    facts = {
        "config": config.model_dump(mode="json"),
        "progress": asdict(progress),
        "state": {name: value for name, value in flat.items() if name not in arrays},
    }
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as container:
        container.writestr(_STATE, json.dumps(facts))
        container.writestr(_ARRAYS, safetensors.numpy.save(arrays))
    body = archive.getvalue()
    header = _HEADER + hashlib.sha256(body).hexdigest().encode() + b"\n"
    write_atomically(checkpoint.file, header + body)


def load_checkpoint(file: Path) -> Checkpoint:
    """Read a checkpoint.

    Raises:
        CheckpointError: not readable, not a checkpoint of this format, or damaged.
    """
    try:
        content = read_whole(file, MAX_BYTES)
    except RunError as error:
        raise CheckpointError(str(error)) from None
    header, body = content[:_HEADER_LENGTH], content[_HEADER_LENGTH:]
    if not header.startswith(_HEADER):
        message = f"{shown(file)}: not a checkpoint of this version of Roller; {_REMEDY}"
        raise CheckpointError(message)
    if header != _HEADER + hashlib.sha256(body).hexdigest().encode() + b"\n":
        raise _damaged(file, "its content does not match its hash")
    try:
        facts, arrays = _members(body)
        return Checkpoint(
            file=file,
            config=TrainingConfig.model_validate(facts["config"]),
            progress=_progress(facts["progress"]),
            state=_nested({**facts["state"], **arrays}),
        )
    except (zipfile.BadZipFile, SafetensorError, ValidationError) as error:
        raise _damaged(file, str(error)) from None
    except (LookupError, TypeError, ValueError) as error:
        raise _damaged(file, f"{type(error).__name__}: {error}") from None


def _progress(told: Mapping[str, Any]) -> Progress:
    """Return the progress that a checkpoint tells of; of one without a mastery, none."""
    final_from = told.get("final_from")
    return Progress(
        steps=int(told["steps"]),
        wall_s=float(told["wall_s"]),
        mastery=float(told.get("mastery", 0.0)),
        final_from=None if final_from is None else int(final_from),
    )


def _members(body: bytes) -> tuple[Any, dict[str, npt.NDArray[Any]]]:
    """Return the content of the archive's members; what is compressed in it is not unpacked."""
    with zipfile.ZipFile(io.BytesIO(body)) as container:
        for name in (_STATE, _ARRAYS):
            if container.getinfo(name).file_size > len(body):
                raise ValueError(f"{name} is larger than the file")
        return from_json(container.read(_STATE)), safetensors.numpy.load(container.read(_ARRAYS))


def _damaged(file: Path, fault: str) -> CheckpointError:
    return CheckpointError(f"{shown(file)}: damaged ({fault}); {_REMEDY}")


# A learner as a tree, and back -------------------------------------------------------------------


def _state(model: PPO) -> Tree:
    normaliser, environments = _wrappers(model)
    policy, optimizer = model.policy.state_dict(), model.policy.optimizer.state_dict()
    return {
        "policy": {name: weights.numpy() for name, weights in policy.items()},
        # What Adam is told is the configuration's; this is what it has found.
        "optimizer": {
            str(number): {name: value.numpy() for name, value in moments.items()}
            for number, moments in optimizer["state"].items()
        },
        "learner": {
            "steps": model.num_timesteps,
            "updates": model._n_updates,
            "observations": model._last_obs,
            "episode_starts": model._last_episode_starts,
        },
        "normaliser": {**running_moments(normaliser), "returns": normaliser.returns},
        "environments": curriculum_tree(environments.snapshot()),
        "random": _random_state(),
    }


def _set_state(model: PPO, state: Tree) -> None:
    normaliser, environments = _wrappers(model)
    # Environments are stepped only after a reset, and what this learner would write shows which
    # arrays a checkpoint of it has; all that it changes is replaced.
    observations = normaliser.reset()
    if state["learner"]["updates"]:
        model._last_obs = observations
        model._last_episode_starts = np.ones(model.n_envs, dtype=bool)
    _check_arrays(_flat(state), _flat(_state(model)))
    model.policy.load_state_dict(_tensors(state["policy"]))
    optimizer = model.policy.optimizer
    moments = {int(number): _tensors(m) for number, m in state.get("optimizer", {}).items()}
    check_moments(moments, [p for group in optimizer.param_groups for p in group["params"]])
    optimizer.load_state_dict({**optimizer.state_dict(), "state": moments})
    learner = state["learner"]
    model.num_timesteps, model._n_updates = int(learner["steps"]), int(learner["updates"])
    model._last_obs = learner["observations"]
    model._last_episode_starts = learner["episode_starts"]
    set_running_moments(normaliser, state["normaliser"])
    normaliser.returns = state["normaliser"]["returns"]
    environments.restore(curriculum_of(state["environments"], environments.snapshot()))
    # Last, because making and resetting a learner draws numbers.
    _set_random_state(state["random"])


def _wrappers(model: PPO) -> tuple[VecNormalize, StartStateCurriculum]:
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    environments = normaliser.venv
    assert isinstance(environments, StartStateCurriculum)
    return normaliser, environments


def curriculum_tree(snapshot: CurriculumSnapshot) -> Tree:
    """Return the tree that `curriculum_of` reads back."""
    kept_for = [task for task, games in snapshot.games.items() for _ in games]
    games = [game for games in snapshot.games.values() for game in games]
    return {
        "level": snapshot.environments.games.levels[0].model_dump_json(),
        "games": _of_snapshot(snapshot.environments.games),
        "returns": snapshot.environments.returns,
        "lengths": snapshot.environments.lengths,
        "ticks": len(snapshot.recent),
        "recent": _of_snapshot(joined(snapshot.recent)) if snapshot.recent else {},
        "kept_for": kept_for,
        "kept": _of_snapshot(joined(games)) if games else {},
        "journeys": {name: getattr(snapshot.journeys, name) for name in _JOURNEYS},
        **{name: getattr(snapshot, name) for name in _OF_CURRICULUM},
    }


def curriculum_of(tree: Tree, own: CurriculumSnapshot) -> CurriculumSnapshot:
    """Return the snapshot that a tree is, of the kind that the environments' own is.

    Raises:
        ValueError: it is of another level, or numbers point at what is not there.
    """
    games, rows, ticks = own.environments.games, len(own.age), int(tree["ticks"])
    if tree["level"] != games.levels[0].model_dump_json():
        raise ValueError(
            f"the level {games.levels[0].name!r} has been changed since it was written"
        )
    kept_for, tasks = np.array(tree["kept_for"], dtype=np.int64), len(own.success)
    _check_numbers("kept_for", kept_for, 0, tasks)
    _check_numbers("task", tree["task"], -1, tasks)
    coins = games.game.of(COIN).taken.shape[1]
    _check_numbers("aim", tree["journeys"]["aim"], -1, coins + 1)
    _check_numbers("direction", tree["journeys"]["direction"], 0, len(DIRECTIONS))
    kept: dict[int, list[Snapshot]] = {}
    if len(kept_for):
        each = separate(_snapshot(tree["kept"], games, len(kept_for)))
        for task, game in zip(kept_for.tolist(), each, strict=True):
            kept.setdefault(task, []).append(game)
    recent: tuple[Snapshot, ...] = ()
    if ticks:
        whole = _snapshot(tree["recent"], games, ticks * rows)
        recent = tuple(whole.take(tick * rows + np.arange(rows)) for tick in range(ticks))
    return CurriculumSnapshot(
        environments=VecSnapshot(
            games=_snapshot(tree["games"], games, rows),
            returns=tree["returns"],
            lengths=tree["lengths"],
        ),
        recent=recent,
        games=kept,
        journeys=Journeys(**{name: tree["journeys"][name] for name in _JOURNEYS}),
        **{name: tree[name] for name in _OF_CURRICULUM},
    )


def _check_numbers(name: str, numbers: Int64, low: int, end: int) -> None:
    """Refuse numbers outside of ``low`` to ``end``, which is not one of them.

    Raises:
        ValueError: says which.
    """
    wrong = numbers[(numbers < low) | (numbers >= end)]
    if len(wrong):
        raise ValueError(f"{name}: found {wrong[0]}; must be {low} to {end - 1}")


def _of_snapshot(snapshot: Snapshot) -> Tree:
    varying = {name: getattr(snapshot, name) for name in _VARYING}
    return {**varying, "game": snapshot.game.named()}


def _snapshot(tree: Tree, own: Snapshot, rows: int) -> Snapshot:
    """Return the snapshot of so many rows that a tree is, of the environments that ``own`` is of.

    Raises:
        ValueError: arrays are missing or of another shape, or numbers point at what is not there.
    """
    wanted = _flat(_of_snapshot(own))
    like = {
        name: np.empty((rows, *value.shape[1:]), value.dtype)
        for name, value in wanted.items()
        if isinstance(value, np.ndarray)
    }
    _check_arrays(_flat(tree), {**wanted, **like})
    game, route = _flat(tree["game"]), own.levels[0].route
    # The compiled rules look these up without asking whether they are there.
    for name, numbers, count in (
        ("level_of_row", tree["level_of_row"], 1),
        ("camera/mode", game["camera/mode"], len(MODES)),
        ("waypoint", game["shaping/waypoint"], 1 if route is None else len(route.points)),
    ):
        _check_numbers(name, numbers, 0, count)
    generators = tuple(tree["generators"])
    if len(generators) != rows:
        raise ValueError(f"generators: found {len(generators)}; wanted {rows}")
    state = own.game.with_arrays(game)
    return replace(own, **{**tree, "game": state, "generators": generators})


def _random_state() -> Tree:
    return {
        "python": random.getstate(),
        # The generator SB3 shuffles samples with.
        "numpy": np.random.get_state(legacy=False),  # noqa: NPY002
        "torch": torch.get_rng_state().numpy(),
    }


def _set_random_state(state: Tree) -> None:
    version, numbers, gauss = state["python"]
    random.setstate((version, tuple(numbers), gauss))
    np.random.set_state(state["numpy"])  # noqa: NPY002
    torch.set_rng_state(torch.from_numpy(state["torch"]))


# Trees -------------------------------------------------------------------------------------------


def _flat(tree: Mapping[str, Any], prefix: str = "") -> Tree:
    """Return the leaves of a tree by the names on the way to each."""
    flat: Tree = {}
    for name, value in tree.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}{_BETWEEN_NAMES}")
        else:
            flat[prefix + name] = value
    return flat


def _nested(flat: Tree) -> Tree:
    """Return the tree whose leaves these are; one without leaves is not there."""
    tree: Tree = {}
    for path, value in flat.items():
        *parents, leaf = path.split(_BETWEEN_NAMES)
        inner = tree
        for parent in parents:
            inner = inner.setdefault(parent, {})
        inner[leaf] = value
    return tree


def _tensors(arrays: Tree) -> dict[str, torch.Tensor]:
    return {name: torch.from_numpy(array) for name, array in arrays.items()}


def _check_arrays(found: Tree, wanted: Tree) -> None:
    """Refuse what has not all of the wanted leaves, or another kind of array where one is wanted.

    Raises:
        ValueError: with the name, what was found and what was wanted.
    """
    for name, like in wanted.items():
        if name not in found or _kind(found[name]) != _kind(like):
            has = _kind(found[name]) if name in found else "nothing"
            raise ValueError(f"{name}: found {has}; wanted {_kind(like)}")


def check_moments(
    moments: Mapping[int, dict[str, torch.Tensor]], parameters: list[torch.Tensor]
) -> None:
    """Refuse what Adam cannot have found for these parameters."""
    for number, found in moments.items():
        shape = parameters[number].shape
        wanted = {"step": torch.Size(), "exp_avg": shape, "exp_avg_sq": shape}
        shapes = {name: tensor.shape for name, tensor in found.items()}
        if shapes != wanted:
            raise ValueError(f"optimizer/{number}: found {shapes}; wanted {wanted}")


def _kind(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array {value.dtype}{list(value.shape)}"
    return "numbers or text"
