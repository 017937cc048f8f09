"""tianshou: PPO over its own vectors of Gymnasium environments, in this process and in others."""

from __future__ import annotations

import json
from typing import Any

import gymnasium as gym
import torch
from tianshou.algorithm import PPO
from tianshou.algorithm.modelfree.reinforce import DiscreteActorPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv, SubprocVectorEnv
from tianshou.trainer import OnPolicyTrainerParams
from tianshou.utils.net.common import Net
from tianshou.utils.net.discrete import DiscreteActor, DiscreteCritic

ENVS = 8


def make() -> gym.Env[Any, Any]:
    return gym.make(
        "roller_env:Roller/Flat-v0",
        reward="shaped",
        physics="rigid",
        control_dt_s=0.1,
        max_episode_steps=150,
    )


def main() -> None:
    torch.manual_seed(0)
    env = make()
    shape, actions = env.observation_space.shape, env.action_space.n

    def body() -> Net:
        return Net(state_shape=shape, hidden_sizes=(64, 64), activation=torch.nn.Tanh)

    actor = DiscreteActor(preprocess_net=body(), action_shape=actions, softmax_output=False)
    algorithm = PPO(
        policy=DiscreteActorPolicy(actor=actor, action_space=env.action_space),
        critic=DiscreteCritic(preprocess_net=body()),
        optim=AdamOptimizerFactory(lr=1e-3),
        max_grad_norm=0.5,
    )
    returns: list[float] = []

    def keep(episode: Any) -> None:
        returns.append(float(episode.rew.sum()))

    learning = Collector(
        algorithm,
        DummyVectorEnv([make] * ENVS),
        VectorReplayBuffer(20_000, ENVS),
        on_episode_done_hook=keep,
    )
    algorithm.run_training(
        OnPolicyTrainerParams(
            training_collector=learning,
            max_epochs=1,
            epoch_num_steps=16_384,
            collection_step_num_env_steps=1_024,
            update_step_num_repetitions=8,
            batch_size=256,
            show_progress=False,
            verbose=False,
        )
    )
    judged = Collector(algorithm, SubprocVectorEnv([make] * 2))
    result = judged.collect(n_episode=10, reset_before_collect=True)
    used = "DummyVectorEnv, SubprocVectorEnv, Collector; PPO"
    print(f"judged in {result.n_collected_episodes} episodes: {result.returns.mean():.2f}")
    print(json.dumps({"used": used, "returns": returns}))


if __name__ == "__main__":
    main()
