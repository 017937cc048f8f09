"""What a training on a cluster is told, and whether it can be done. Needs no Ray."""

from __future__ import annotations

import importlib.util
import re
from typing import Final

from gymnasium import spaces

from roller_env.problems import quoted
from roller_env.training.config import TrainingConfig
from roller_env.training.files import RunError
from roller_env.training.network import network_spaces

AUTO: Final = "auto"
LOCAL: Final = "local"

RAY: Final = "ray[rllib]==2.60.0"
"""What is tested; it pins Gymnasium, so that it belongs into an environment of its own."""

_HOST_AND_PORT: Final = re.compile(
    r"(?:\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9](?:[A-Za-z0-9._-]*)):(\d{1,5})"
)


def check_cluster(config: TrainingConfig, address: str) -> None:
    """Refuse what cannot be trained on a cluster, before anything runs.

    Args:
        config: of the training.
        address: of the cluster, as `roller_env.training.train` takes it.

    Raises:
        RunError: the address is none, RLlib cannot train this, or Ray is not installed.
    """
    _check_address(address)
    cluster = config.cluster
    if config.num_envs % cluster.runners:
        raise RunError(
            f"num_envs: found {config.num_envs}; must be a multiple of the {cluster.runners} "
            "runners (cluster.runners), which play equally many"
        )
    learners = max(cluster.learners, 1)
    if config.ppo.batch_size % learners:
        raise RunError(
            f"ppo.batch_size: found {config.ppo.batch_size}; must be a multiple of the "
            f"{learners} learners (cluster.learners), which share a batch"
        )
    if config.demonstrations is not None:
        raise RunError("demonstrations: cannot be cloned on a cluster; leave out --demos")
    if config.ppo.target_kl is not None:
        raise RunError("ppo.target_kl: RLlib's PPO has no such end of an update; remove it")
    _check_spaces(config)
    if importlib.util.find_spec("ray") is None:
        raise RunError(
            f"--cluster needs Ray, which is not installed: pip install '{RAY}' in an environment "
            "of its own on every machine ('roller-env[train,cluster]' is both); it brings a "
            "Gymnasium of its own"
        )


def _check_address(address: str) -> None:
    if address in (AUTO, LOCAL):
        return
    found = _HOST_AND_PORT.fullmatch(address)
    if found is None or not 1 <= int(found[1]) <= 65535:
        raise RunError(
            f"cluster: found {quoted(address)}; must be {AUTO} (the cluster that this machine "
            f"is part of), {LOCAL} (this machine alone), or a head node's host:port"
        )


def _check_spaces(config: TrainingConfig) -> None:
    """Refuse observations and actions for which RLlib's module is not Roller's network."""
    seen, done = network_spaces(config, None)
    if not isinstance(seen, spaces.Box) or len(seen.shape) != 1:
        raise RunError(
            f"environment.observation: found {config.environment.observation!r}; on a cluster "
            "'state' and 'rays' can be trained, which are vectors"
        )
    if not isinstance(done, spaces.Discrete):
        raise RunError(
            f"environment.action: found {config.environment.action!r}; on a cluster the nine "
            "directions can be trained, which is the default"
        )
