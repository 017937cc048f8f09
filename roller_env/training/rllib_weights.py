"""The weights of RLlib's networks by their names in those of Stable-Baselines3, and back.

RLlib's default PPO module with layers of its own for the values (``vf_share_layers=False``) and
Stable-Baselines3's policy are the same networks: hidden layers and one more, twice. So whatever
RLlib has trained becomes a policy of Roller's by renaming. Needs no Ray.
"""

from __future__ import annotations

from typing import Final

from roller_env.training.config import TrainingConfig
from roller_env.training.network import Weights

_HIDDEN: Final = {
    "mlp_extractor.policy_net": "encoder.actor_encoder.net.mlp",
    "mlp_extractor.value_net": "encoder.critic_encoder.net.mlp",
}
_LAST: Final = {"action_net": "pi.net.mlp.0", "value_net": "vf.net.mlp.0"}


def names_in_rllib(config: TrainingConfig) -> dict[str, str]:
    """Return for each weight of Stable-Baselines3's network its name in RLlib's module."""
    # Between two layers is an activation, which both count.
    layers = {
        f"{ours}.{2 * number}": f"{theirs}.{2 * number}"
        for ours, theirs in _HIDDEN.items()
        for number in range(len(config.ppo.hidden_sizes))
    }
    return {
        f"{ours}.{kind}": f"{theirs}.{kind}"
        for ours, theirs in (layers | _LAST).items()
        for kind in ("weight", "bias")
    }


def from_rllib(config: TrainingConfig, weights: Weights) -> Weights:
    """Return a module's weights by the names that `roller_env.training.network.network_of` takes.

    Args:
        config: says of what layers.
        weights: ``state_dict()`` of the learner's module; the runners' have no value network.

    Raises:
        ValueError: one is missing.
    """
    names = names_in_rllib(config)
    missing = [theirs for theirs in names.values() if theirs not in weights]
    if missing:
        raise ValueError(
            f"{missing[0]}: not there; wanted a PPO module of RLlib's with "
            "vf_share_layers=False, fcnet_hiddens as ppo.hidden_sizes, and its value network"
        )
    return {ours: weights[theirs] for ours, theirs in names.items()}


def to_rllib(config: TrainingConfig, weights: Weights) -> Weights:
    """Return weights of Stable-Baselines3's network by the names of RLlib's module."""
    return {theirs: weights[ours] for ours, theirs in names_in_rllib(config).items()}
