"""A training at the boundary of two updates, in one file that is whole or not there.

Everything the continuation depends on is inside: weights and optimizer, normalisation statistics,
the state of every environment, of every random generator and of the step counter. A run that was
killed and resumed therefore ends with the same bits as one that never stopped.

The file is one header line with the SHA-256 of all that follows, and a zip archive. It holds
pickles, as Stable-Baselines3's own files do: load only what you trained or trust.
"""

from __future__ import annotations

import hashlib
import io
import json
import pickle
import random
import zipfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from roller_env.training.config import TrainingConfig
from roller_env.training.files import write_atomically
from roller_env.training.practice import PracticeStarts

_HEADER: Final = b"roller-checkpoint-1 sha256 "
"""Starts the file; the number is the format's, raised when an old file can no longer be read."""

_HEADER_LENGTH: Final = len(_HEADER) + hashlib.sha256().digest_size * 2 + 1
_MODEL, _NORMALISER, _RANDOM, _ENVIRONMENTS, _PROGRESS = (
    "model.zip",
    "vecnormalize.pkl",
    "random.pkl",
    "environments.pkl",
    "progress.json",
)


class CheckpointError(RuntimeError):
    """A checkpoint that cannot be used; the message names the file, the fault and the way out."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a training is.

    Attributes:
        steps: environment steps, over all environments.
        wall_s: seconds spent training, over all sessions.
    """

    steps: int = 0
    wall_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """What a checkpoint file holds; `restore` brings it to life.

    Attributes:
        config: of the training.
        progress: when the checkpoint was written.
        members: the rest, as bytes, by the names in the archive.
    """

    config: TrainingConfig
    progress: Progress
    members: dict[str, bytes]

    def restore(self, environments: PracticeStarts) -> PPO:
        """Return the learner as it was, and set environments and random generators back too.

        Args:
            environments: new ones, made as the configuration says.
        """
        normaliser: VecNormalize = pickle.loads(self.members[_NORMALISER])
        normaliser.set_venv(environments)
        model = PPO.load(
            io.BytesIO(self.members[_MODEL]), env=normaliser, device="cpu", force_reset=False
        )
        # Its result is replaced at once, but environments are stepped only after a reset.
        environments.reset()
        normaliser.returns, state = pickle.loads(self.members[_ENVIRONMENTS])
        environments.restore(state)
        # Last, because loading a model seeds the generators anew.
        _set_random_state(pickle.loads(self.members[_RANDOM]))
        return model


def save_checkpoint(file: Path, model: PPO, config: TrainingConfig, progress: Progress) -> None:
    """Write a checkpoint; whenever the process dies, `file` is the old one or the new one.

    Args:
        file: to replace.
        model: between two updates, with its environments inside a VecNormalize.
        config: of the training.
        progress: so far.
    """
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    environments = normaliser.venv
    assert isinstance(environments, PracticeStarts)
    stream = io.BytesIO()
    model.save(stream)
    members = {
        _MODEL: stream.getvalue(),
        _NORMALISER: pickle.dumps(normaliser),
        # VecNormalize leaves its running returns out of its own pickle.
        _ENVIRONMENTS: pickle.dumps((normaliser.returns, environments.snapshot())),
        _RANDOM: pickle.dumps(_random_state()),
        _PROGRESS: json.dumps(
            {"progress": asdict(progress), "config": config.model_dump(mode="json")}
        ).encode(),
    }
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as container:
        for name, content in members.items():
            container.writestr(name, content)
    body = archive.getvalue()
    write_atomically(file, _HEADER + hashlib.sha256(body).hexdigest().encode() + b"\n" + body)


def load_checkpoint(file: Path) -> Checkpoint:
    """Read a checkpoint.

    Raises:
        CheckpointError: not a checkpoint of this format, or damaged.
        OSError: not readable.
    """
    content = file.read_bytes()
    header, body = content[:_HEADER_LENGTH], content[_HEADER_LENGTH:]
    remedy = "remove the run's directory to train again from the start"
    if not header.startswith(_HEADER):
        raise CheckpointError(f"{file}: not a checkpoint of this version of Roller; {remedy}")
    if header != _HEADER + hashlib.sha256(body).hexdigest().encode() + b"\n":
        raise CheckpointError(f"{file}: damaged (its content does not match its hash); {remedy}")
    with zipfile.ZipFile(io.BytesIO(body)) as container:
        members = {name: container.read(name) for name in container.namelist()}
    facts = json.loads(members.pop(_PROGRESS))
    return Checkpoint(
        config=TrainingConfig.model_validate(facts["config"]),
        progress=Progress(**facts["progress"]),
        members=members,
    )


def _random_state() -> dict[str, Any]:
    return {
        "python": random.getstate(),
        "numpy": np.random.get_state(),  # noqa: NPY002  the generator SB3 shuffles samples with
        "torch": torch.get_rng_state(),
    }


def _set_random_state(state: dict[str, Any]) -> None:
    random.setstate(state["python"])
    np.random.set_state(state["numpy"])  # noqa: NPY002
    torch.set_rng_state(state["torch"])
