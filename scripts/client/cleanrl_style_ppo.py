"""PPO in one file, in CleanRL's manner: nothing between the reader and the algorithm but torch.

CleanRL's own scripts are copied, not installed, and written for Gymnasium 0.29. With newer ones
they need ``autoreset_mode=SAME_STEP``, and to read ``infos["final_info"]`` as arrays, as below.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from torch import nn
from torch.distributions import Categorical


@dataclass
class Args:
    env_id: str = "roller_env:Roller/Flat-v0"
    seed: int = 1
    total_timesteps: int = 16_384
    learning_rate: float = 1e-3
    num_envs: int = 8
    num_steps: int = 128
    gamma: float = 0.99
    gae_lambda: float = 0.95
    num_minibatches: int = 4
    update_epochs: int = 8
    clip_coef: float = 0.2
    ent_coef: float = 0.01
    vf_coef: float = 0.5
    max_grad_norm: float = 0.5


def make_env(args: Args) -> Any:
    def thunk() -> gym.Env[Any, Any]:
        env = gym.make(
            args.env_id, reward="shaped", physics="rigid", control_dt_s=0.1, max_episode_steps=150
        )
        return gym.wrappers.RecordEpisodeStatistics(env)

    return thunk


class Agent(nn.Module):
    def __init__(self, envs: SyncVectorEnv) -> None:
        super().__init__()
        inputs = int(np.prod(envs.single_observation_space.shape or ()))
        actions = int(envs.single_action_space.n)  # type: ignore[attr-defined]

        def network(outputs: int, gain: float) -> nn.Sequential:
            last = nn.Linear(64, outputs)
            nn.init.orthogonal_(last.weight, gain)
            nn.init.zeros_(last.bias)
            return nn.Sequential(
                nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), last
            )

        self.actor, self.critic = network(actions, 0.01), network(1, 1.0)

    def policy(self, observations: torch.Tensor) -> Categorical:
        return Categorical(logits=self.actor(observations))

    def value(self, observations: torch.Tensor) -> torch.Tensor:
        return self.critic(observations).squeeze(-1)


def train(args: Args) -> list[float]:
    torch.manual_seed(args.seed)
    envs = SyncVectorEnv(
        [make_env(args) for _ in range(args.num_envs)], autoreset_mode=AutoresetMode.SAME_STEP
    )
    agent = Agent(envs)
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    returns: list[float] = []
    shape = (args.num_steps, args.num_envs)
    size = envs.single_observation_space.shape or ()
    observations, actions = torch.zeros(shape + size), torch.zeros(shape, dtype=torch.long)
    log_probs, values, rewards, continues = (torch.zeros(shape) for _ in range(4))
    now = torch.as_tensor(envs.reset(seed=args.seed)[0])
    for _ in range(args.total_timesteps // (args.num_steps * args.num_envs)):
        for step in range(args.num_steps):
            with torch.no_grad():
                policy = agent.policy(now)
                actions[step] = policy.sample()
                log_probs[step] = policy.log_prob(actions[step])
                values[step] = agent.value(now)
            observations[step] = now
            after, reward, terminated, truncated, infos = envs.step(actions[step].numpy())
            rewards[step] = torch.as_tensor(reward)
            continues[step] = 1.0 - torch.as_tensor(terminated | truncated, dtype=torch.float32)
            for env in np.flatnonzero(truncated & ~terminated):
                # Time is up, but the game is not: what it was still worth belongs to the reward.
                last = torch.as_tensor(infos["final_obs"][env])
                with torch.no_grad():
                    rewards[step, env] += args.gamma * agent.value(last)
            if "final_info" in infos:
                ended = infos["_final_info"]
                returns.extend(infos["final_info"]["episode"]["r"][ended].tolist())
            now = torch.as_tensor(after)

        advantages = torch.zeros(shape)
        with torch.no_grad():
            later, advantage = agent.value(now), torch.zeros(args.num_envs)
        for step in reversed(range(args.num_steps)):
            delta = rewards[step] + args.gamma * continues[step] * later - values[step]
            advantage = delta + args.gamma * args.gae_lambda * continues[step] * advantage
            advantages[step], later = advantage, values[step]
        flat = [
            x.flatten(0, 1)
            for x in (observations, actions, log_probs, advantages, advantages + values)
        ]
        batch = args.num_steps * args.num_envs
        for _ in range(args.update_epochs):
            for rows in torch.randperm(batch).chunk(args.num_minibatches):
                obs, action, old_log_prob, advantage, target = (x[rows] for x in flat)
                policy = agent.policy(obs)
                ratio = (policy.log_prob(action) - old_log_prob).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                clipped = ratio.clamp(1 - args.clip_coef, 1 + args.clip_coef)
                gain = torch.min(ratio * advantage, clipped * advantage).mean()
                error = 0.5 * (agent.value(obs) - target).square().mean()
                loss = args.vf_coef * error - gain - args.ent_coef * policy.entropy().mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), args.max_grad_norm)
                optimizer.step()
    envs.close()
    return returns


if __name__ == "__main__":
    used = "one file in CleanRL's manner: SyncVectorEnv, SAME_STEP, final_info"
    print(json.dumps({"used": used, "returns": train(Args())}))
