"""Training, evaluating and keeping agents: what turns a file of ``configs/`` into ``runs/<name>/``.

The one part of the package, beside `roller_env.envs.sb3`, that imports Stable-Baselines3 and torch;
it needs the ``train`` extra.
"""

from roller_env.training.config import TrainingConfig, load_config
from roller_env.training.config_source import ConfigError
from roller_env.training.evaluate import Evaluation, evaluate
from roller_env.training.policy import Policy, load_policy
from roller_env.training.run import TrainingRun, train

__all__ = [
    "ConfigError",
    "Evaluation",
    "Policy",
    "TrainingConfig",
    "TrainingRun",
    "evaluate",
    "load_config",
    "load_policy",
    "train",
]
