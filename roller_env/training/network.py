"""The policy and value networks that a configuration asks for."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import torch
from gymnasium import Space, spaces
from stable_baselines3.common.policies import ActorCriticPolicy, MultiInputActorCriticPolicy
from stable_baselines3.common.preprocessing import is_image_space

from roller_env.envs.spaces import action_space, entries_of, observation_space
from roller_env.training.config import TrainingConfig

Weights = dict[str, torch.Tensor]

_ACTIVATIONS: Final[dict[str, type[torch.nn.Module]]] = {
    "tanh": torch.nn.Tanh,
    "relu": torch.nn.ReLU,
    "elu": torch.nn.ELU,
}


def network_class(config: TrainingConfig) -> type[ActorCriticPolicy]:
    """Return Stable-Baselines3's class of networks for the observations of a configuration."""
    is_dict = config.environment.observation == "dict"
    return MultiInputActorCriticPolicy if is_dict else ActorCriticPolicy


def network_options(config: TrainingConfig) -> dict[str, Any]:
    """Return what that class is told."""
    return {
        "net_arch": list(config.ppo.hidden_sizes),
        "activation_fn": _ACTIVATIONS[config.ppo.activation],
        # Adam's epsilon is SB3's own; fused, an update of these small networks is a tenth cheaper.
        "optimizer_kwargs": {"eps": 1e-5, "fused": True},
    }


def network_spaces(config: TrainingConfig, clip: float | None) -> tuple[Space[Any], Space[Any]]:
    """Return the spaces of what the network sees and of what it does.

    Args:
        config: says in what environment.
        clip: largest magnitude of normalised observations; None if they are not normalised.
    """
    seen = observation_space(config.environment, entries_of(config.environment))
    if clip is not None and is_image_space(seen):
        # As VecNormalize says of pictures that it has normalised.
        seen = spaces.Box(-clip, clip, seen.shape, np.float32)
    return seen, action_space(config.environment)


def network_of(
    config: TrainingConfig, seen: Space[Any], done: Space[Any], weights: Weights
) -> ActorCriticPolicy:
    """Return networks with these weights.

    Args:
        config: says of what layers.
        seen: the space of what they see.
        done: the space of what they do.
        weights: by their names in the networks.

    Raises:
        ValueError: the weights are those of other networks.
    """
    _check_layers(config, weights)
    # Its first weights are random and thrown away; the caller's random numbers are not to change.
    with torch.random.fork_rng(devices=[]):
        network = network_class(config)(seen, done, lambda _: 0.0, **network_options(config))
    expected = network.state_dict()
    for name in sorted(expected.keys() | weights.keys()):
        _check_same(name, expected.get(name), weights.get(name))
    network.load_state_dict(weights)
    network.set_training_mode(False)
    return network


def _check_layers(config: TrainingConfig, weights: Weights) -> None:
    """Refuse hidden layers that the weights have not, before memory of their size is asked for."""
    below: int | None = None
    for number, size in enumerate(config.ppo.hidden_sizes):
        name = f"mlp_extractor.policy_net.{2 * number}.weight"
        shape = tuple(weights[name].shape) if name in weights else None
        if shape is None or shape[0] != size or (below is not None and shape != (size, below)):
            raise ValueError(f"{name}: found shape {shape}; hidden layer {number} has {size} units")
        below = size


def _check_same(name: str, wanted: torch.Tensor | None, found: torch.Tensor | None) -> None:
    if (
        wanted is None
        or found is None
        or (wanted.dtype, wanted.shape) != (found.dtype, found.shape)
    ):
        raise ValueError(f"{name}: found {_kind(found)}; wanted {_kind(wanted)}")


def _kind(tensor: torch.Tensor | None) -> str:
    return "nothing" if tensor is None else f"{tensor.dtype} {tuple(tensor.shape)}"
