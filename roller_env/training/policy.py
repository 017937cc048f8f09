"""A trained agent as a function from observations to actions, and its two files.

``policy.json`` says what the agent is: its training's configuration, the spaces, the normalisation
of what it sees. ``policy.safetensors`` holds the weights. Nothing in either can be executed,
whoever wrote them. What Stable-Baselines3 itself saves is written beside them, for use there; it is
pickles, which execute what they say, and is read only if the caller says that its maker is trusted.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import pickle
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Protocol

import numpy as np
import numpy.typing as npt
import safetensors.torch
import torch
from gymnasium import Space, spaces
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from safetensors import SafetensorError
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecNormalize

from roller_env import __version__
from roller_env.arrays import Float64
from roller_env.config import LevelSource
from roller_env.envs.spaces import Observations, entries_of
from roller_env.problems import field_name, shown
from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.files import RunError, RunFiles, read_whole, write_atomically
from roller_env.training.network import network_of, network_spaces
from roller_env.training.normalisation import WHOLE, Normalisation

MAX_DESCRIPTION_BYTES: Final = 2**26
MAX_WEIGHTS_BYTES: Final = 2**31

Numbers = list[Annotated[float, Field(allow_inf_nan=False)]]


class Policy(Protocol):
    """Anything that plays: a trained agent, or a function a person wrote."""

    def __call__(self, observations: Observations, /) -> npt.NDArray[Any]:
        """Return one action a row.

        Args:
            observations: as the environment gives them, leading axis of environments.
        """


class TrainedPolicy:
    """The deterministic agent of a run: normalises what it sees and takes its best action.

    Attributes:
        config: the training's, which says what environment it plays.
        network: its policy and value networks.
        normalisation: of what it sees; None if it sees observations as they are.
    """

    def __init__(
        self,
        network: ActorCriticPolicy,
        normalisation: Normalisation | None,
        config: TrainingConfig,
    ) -> None:
        self.config = config
        self.network = network
        self.normalisation = normalisation

    @staticmethod
    def of(model: PPO, config: TrainingConfig) -> TrainedPolicy:
        """Return a learner's agent as it is now; it changes when the learner goes on learning.

        Args:
            model: with its environments inside a VecNormalize.
            config: of its training.
        """
        normaliser = model.get_vec_normalize_env()
        assert normaliser is not None
        return TrainedPolicy(model.policy, Normalisation.of(normaliser), config)

    def __call__(self, observations: Observations, /) -> npt.NDArray[Any]:
        """Return one action a row; see `Policy`."""
        seen = observations if self.normalisation is None else self.normalisation(observations)
        actions, _ = self.network.predict(seen, deterministic=True)
        return actions

    def plays(self, level: LevelSource) -> bool:
        """Say whether a level shows what this agent has learnt to see: the same entries."""
        trained = self.config.evaluation_environment
        mine, its = (
            [(entry.name, entry.size) for entry in entries_of(config)]
            for config in (trained, replace(trained, level=level))
        )
        return mine == its

    def judge(self, observations: Observations, /) -> tuple[Float64 | None, Float64]:
        """Return what the agent thinks of its choice, and of where it is.

        Args:
            observations: as the environment gives them, leading axis of n environments.

        Returns:
            The actions' probabilities, (n, actions), None where they are not of a finite number;
            and the discounted reward that it expects, (n,), in the units of its training.
        """
        seen = observations if self.normalisation is None else self.normalisation(observations)
        with torch.no_grad():
            tensors, _ = self.network.obs_to_tensor(seen)
            chosen: Any = self.network.get_distribution(tensors).distribution
            value = self.network.predict_values(tensors)[:, 0]
        among = isinstance(chosen, torch.distributions.Categorical)
        return chosen.probs.double().numpy() if among else None, value.double().numpy()


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class _Normalisation(_Strict):
    """`Normalisation`, each array as the list of its numbers, the last axis first."""

    mean: dict[str, Numbers]
    variance: dict[str, Numbers]
    epsilon: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
    clip: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class _Description(_Strict):
    """The content of ``policy.json``."""

    kind: Literal["roller-policy"] = "roller-policy"
    format: Literal[1] = 1
    versions: dict[str, str]
    weights_sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    observation_space: dict[str, Any]
    action_space: dict[str, Any]
    normalisation: _Normalisation | None
    training: TrainingConfig


def save_policy(model: PPO, config: TrainingConfig, files: RunFiles) -> None:
    """Write what `load_policy` reads, and what Stable-Baselines3 itself does.

    Raises:
        OSError: the disk is full or not writable.
    """
    policy = TrainedPolicy.of(model, config)
    weights = safetensors.torch.save(policy.network.state_dict())
    normalisation = policy.normalisation
    seen, done = network_spaces(config, _clip(normalisation))
    description = _Description(
        versions={name: version(name) for name in ("stable-baselines3", "torch", "numpy")}
        | {"roller": __version__},
        weights_sha256=hashlib.sha256(weights).hexdigest(),
        observation_space=described(seen),
        action_space=described(done),
        normalisation=None if normalisation is None else _listed(normalisation),
        training=config,
    )
    write_atomically(files.weights, weights)
    text = json.dumps(description.model_dump(mode="json"), indent=1, allow_nan=False)
    write_atomically(files.policy, text + "\n")
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    model.save(files.sb3_policy)
    normaliser.save(str(files.sb3_normaliser))


def load_policy(run: str | os.PathLike[str], *, trust: bool = False) -> TrainedPolicy:
    """Return the agent a run left behind.

    Args:
        run: its directory, such as ``runs/ppo_classic-seed0``; ``policy.json`` and
            ``policy.safetensors`` in it are all that is read.
        trust: whether a run that has only what Stable-Baselines3 saves is read too. That is
            pickles, which execute whatever their maker put into them.

    Raises:
        RunError: not a run, its training has not ended yet, its files are damaged, or they are of
            the kind that can execute and that is not trusted.
    """
    files = RunFiles(Path(run))
    if files.policy.exists():
        return _load(files)
    name = shown(run)
    if not files.directory.is_dir():
        raise RunError(f"{name}: there is no such directory; a run's has a policy.json")
    if not (files.sb3_policy.exists() and files.sb3_normaliser.exists()):
        raise RunError(f"{name} has no policy.json; 'roller train --resume' finishes a run")
    if not trust:
        raise RunError(
            f"{name} has no policy.json, only Stable-Baselines3's policy.zip and "
            "vecnormalize.pkl: pickles, which run any program that their maker put into them; "
            "--trust reads them all the same"
        )
    return _load_pickles(files)


def _load(files: RunFiles) -> TrainedPolicy:
    content = read_whole(files.policy, MAX_DESCRIPTION_BYTES)
    try:
        description = _Description.model_validate_json(content)
    except ValidationError as error:
        raise _unusable(files.policy, _first(error)) from None
    weights = read_whole(files.weights, MAX_WEIGHTS_BYTES)
    if hashlib.sha256(weights).hexdigest() != description.weights_sha256:
        raise _unusable(files.weights, "its content does not match the hash in policy.json")
    try:
        tensors = safetensors.torch.load(weights)
    except SafetensorError as error:
        raise _unusable(files.weights, f"not in the safetensors format ({error})") from None
    config = description.training
    try:
        seen, done = network_spaces(config, _clip(description.normalisation))
        _check_space("observation_space", description.observation_space, seen)
        _check_space("action_space", description.action_space, done)
        normalisation = _arrays(description.normalisation, seen)
    except ValueError as error:
        raise _unusable(files.policy, str(error)) from None
    try:
        network = network_of(config, seen, done, tensors)
    except ValueError as error:
        raise _unusable(files.weights, str(error)) from None
    return TrainedPolicy(network, normalisation, config)


def _load_pickles(files: RunFiles) -> TrainedPolicy:
    config = load_config(files.config)
    try:
        normaliser = pickle.loads(files.sb3_normaliser.read_bytes())
    except Exception as error:  # noqa: BLE001 - there is none that a pickle cannot raise
        raise _unusable(files.sb3_normaliser, f"{type(error).__name__}: {error}") from None
    if not isinstance(normaliser, VecNormalize):
        raise _unusable(files.sb3_normaliser, f"found a {type(normaliser).__name__}")
    try:
        network = PPO.load(files.sb3_policy, device="cpu").policy
    except Exception as error:  # noqa: BLE001
        raise _unusable(files.sb3_policy, f"{type(error).__name__}: {error}") from None
    return TrainedPolicy(network, Normalisation.of(normaliser), config)


def described(space: Space[Any]) -> dict[str, Any]:
    """Return a space of the game's in JSON's values; bounds that are all the same as one number."""
    if isinstance(space, spaces.Dict):
        return {"type": "Dict", "entries": {name: described(s) for name, s in space.items()}}
    if isinstance(space, spaces.Box):
        low, high = _bound(space.low), _bound(space.high)
        shape, dtype = list(space.shape), str(space.dtype)
        return {"type": "Box", "shape": shape, "dtype": dtype, "low": low, "high": high}
    assert isinstance(space, spaces.Discrete | spaces.MultiBinary)
    return {"type": type(space).__name__, "n": np.asarray(space.n).tolist()}


def _bound(values: npt.NDArray[Any]) -> Any:
    """Return a bound as numbers, and what is infinite as the words that mean it."""
    flat = values.ravel()
    if flat.size and (flat == flat[0]).all():
        value = flat[0].item()
        return value if np.isfinite(value) else str(value)
    return [value if np.isfinite(value) else str(value) for value in flat.tolist()]


def _check_space(name: str, found: dict[str, Any], space: Space[Any]) -> None:
    if found != described(space):
        raise ValueError(
            f"{name}: not the one that this version of Roller ({__version__}) has for the same "
            "options; 'versions' says which trained it"
        )


def _clip(normalisation: Normalisation | _Normalisation | None) -> float | None:
    return None if normalisation is None else normalisation.clip


def _listed(normalisation: Normalisation) -> _Normalisation:
    return _Normalisation(
        mean={name: values.ravel().tolist() for name, values in normalisation.mean.items()},
        variance={name: values.ravel().tolist() for name, values in normalisation.variance.items()},
        epsilon=normalisation.epsilon,
        clip=normalisation.clip,
    )


def _arrays(listed: _Normalisation | None, space: Space[Any]) -> Normalisation | None:
    """Return what the file says in the shapes of a space.

    Raises:
        ValueError: it has other entries, or another number of values.
    """
    if listed is None:
        return None
    entries = dict(space) if isinstance(space, spaces.Dict) else {WHOLE: space}
    arrays: dict[str, dict[str, Float64]] = {}
    for name in ("mean", "variance"):
        numbers: dict[str, Numbers] = getattr(listed, name)
        found = {entry: len(values) for entry, values in numbers.items()}
        wanted = {entry: math.prod(part.shape or ()) for entry, part in entries.items()}
        if found != wanted:
            raise ValueError(f"normalisation.{name}: found {found} numbers; wanted {wanted}")
        arrays[name] = {
            entry: np.array(numbers[entry]).reshape(part.shape) for entry, part in entries.items()
        }
    return Normalisation(**arrays, epsilon=listed.epsilon, clip=listed.clip)


def _first(error: ValidationError) -> str:
    details = error.errors(include_url=False, include_input=False)[0]
    where = field_name(details["loc"])
    return f"{where}: {details['msg']}" if where else details["msg"]


def _unusable(file: Path, fault: str) -> RunError:
    return RunError(f"{shown(file)}: not a usable policy: {fault}")
