"""Train with RLlib's own PPO and runners, without the recipe's practice. To be read.

Needs an environment with Ray: ``pip install '.[train,cluster]'``. What `roller train --cluster`
does beyond this is in `roller_env.training.rllib`.

Examples::

    python scripts/rllib.py --address auto --runners 8 --updates 20
"""

from __future__ import annotations

import gymnasium as gym
import ray
import torch
import tyro
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.tune.registry import register_env

from roller_env.cli.train import recipe
from roller_env.envs.vector import RollerVectorEnv
from roller_env.training import load_config
from roller_env.training.network import network_of, network_spaces
from roller_env.training.policy import TrainedPolicy
from roller_env.training.report import markdown_table
from roller_env.training.rllib_weights import from_rllib
from roller_env.training.run import evaluate_policy


def main(level: str = "flat", address: str = "local", runners: int = 1, updates: int = 50) -> None:
    """Train on a level that comes with Roller, and judge the policy on MuJoCo's default.

    Args:
        level: to train on.
        address: of the Ray cluster; local: this machine alone.
        runners: processes that play 64 games each.
        updates: of the network.
    """
    recipe_s = load_config(recipe(), (f"level={level}", "normalise_observations=false"))
    options, ppo = recipe_s.environment.keywords(), recipe_s.ppo
    ray.init(address=address, log_to_driver=False)
    # RLlib wants rows that begin anew in a step of their own, which is Gymnasium's default.
    register_env("roller", lambda asked: RollerVectorEnv(asked["num_envs"], **options))
    config = (
        PPOConfig()
        .environment("roller")
        .env_runners(
            num_env_runners=runners,
            num_envs_per_env_runner=64,
            gym_env_vectorize_mode=gym.VectorizeMode.VECTOR_ENTRY_POINT,
            rollout_fragment_length=ppo.rollout_steps,
        )
        .rl_module(model_config=DefaultModelConfig(list(ppo.hidden_sizes), vf_share_layers=False))
        .training(
            train_batch_size_per_learner=64 * runners * ppo.rollout_steps,
            minibatch_size=ppo.batch_size,
            num_epochs=ppo.epochs,
            lr=ppo.learning_rate,
            gamma=ppo.gamma,
            vf_clip_param=float("inf"),
        )
    )
    algorithm = config.build_algo()
    for number in range(updates):
        told = algorithm.train()["env_runners"]
        print(f"update {number}: mean return {told.get('episode_return_mean', float('nan')):.2f}")
    learner_s = algorithm.learner_group.get_weights()["default_policy"]
    algorithm.stop()
    weights = from_rllib(
        recipe_s, {name: torch.as_tensor(value) for name, value in learner_s.items()}
    )
    network = network_of(recipe_s, *network_spaces(recipe_s, None), weights)
    policy = TrainedPolicy(network, None, recipe_s)
    print(markdown_table(evaluate_policy(policy, recipe_s, 100), recipe_s))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
