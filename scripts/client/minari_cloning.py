"""Minari: collect, recover the environment, replay, and learn from what was collected.

The data set holds games of the player that comes with Roller, wrong keys now and then among them. A
network that does as it did is judged in the recovered environment, after one that was not taught.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import gymnasium as gym
import minari
import numpy as np
import torch
from torch import nn

from roller_env.config import EnvConfig
from roller_env.level import load_level
from roller_env.replay.recorder import record_episode
from roller_env.replay.scripted import ScriptedPlayer

ID = "roller_env:Roller/Flat-v0"
OPTIONS: dict[str, Any] = {"physics": "rigid", "control_dt_s": 0.1}
EPISODES = 40
JUDGED = 20


def collect() -> minari.MinariDataset:
    """Play the player's keys in Minari's collector and let it write the data set."""
    level = load_level("flat")
    config = EnvConfig(level=level, **OPTIONS)
    env = minari.DataCollector(gym.make(ID, **OPTIONS), record_infos=False)
    for seed in range(EPISODES):
        player = ScriptedPlayer(level, action_noise=0.2, seed=seed)
        keys = record_episode(config, player, seed=seed).actions
        env.reset(seed=seed)
        for key in keys:
            env.step(int(key))
    dataset = env.create_dataset("roller/flat/noisy-v0", algorithm_name="scripted player")
    env.close()
    return dataset


def check_replay(dataset: minari.MinariDataset, env: gym.Env[Any, Any]) -> None:
    """Play what was collected again, and see that it is what was collected, to the bit."""
    for episode in dataset.iterate_episodes(range(5)):
        seen, _ = env.reset(seed=int(episode.id))
        assert np.array_equal(seen, episode.observations[0])
        for step, action in enumerate(episode.actions):
            seen, reward, *_ = env.step(action)
            assert np.array_equal(seen, episode.observations[step + 1])
            assert reward == episode.rewards[step]


def judge(network: nn.Module, env: gym.Env[Any, Any]) -> list[float]:
    """Return the returns of a network's likeliest actions."""
    returns = []
    for seed in range(1000, 1000 + JUDGED):
        observation, _ = env.reset(seed=seed)
        over, total = False, 0.0
        while not over:
            with torch.no_grad():
                action = int(network(torch.as_tensor(observation)).argmax())
            observation, reward, terminated, truncated, _ = env.step(action)
            total += float(reward)
            over = terminated or truncated
        returns.append(total)
    return returns


def main() -> None:
    os.environ["MINARI_DATASETS_PATH"] = str(Path.cwd())
    torch.manual_seed(0)
    collect()
    dataset = minari.load_dataset("roller/flat/noisy-v0")
    env = dataset.recover_environment(max_episode_steps=200)
    check_replay(dataset, env)
    episodes = list(dataset.iterate_episodes())
    seen = torch.as_tensor(np.concatenate([episode.observations[:-1] for episode in episodes]))
    done = torch.as_tensor(np.concatenate([episode.actions for episode in episodes]))
    mean, spread = seen.mean(0), seen.std(0) + 1e-6

    class Standard(nn.Module):
        def forward(self, observations: torch.Tensor) -> torch.Tensor:
            return ((observations - mean) / spread).clamp(-5.0, 5.0)

    network = nn.Sequential(
        Standard(),
        nn.Linear(seen.shape[1], 64),
        nn.ReLU(),
        nn.Linear(64, 64),
        nn.ReLU(),
        nn.Linear(64, 9),
    )
    untaught = judge(network, env)
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)
    for _ in range(40):
        for rows in torch.randperm(len(seen)).split(128):
            loss = nn.functional.cross_entropy(network(seen[rows]), done[rows])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
    used = "DataCollector, recover_environment, replay to the bit; cloning, before and after"
    # A fifth of the untaught network's games and a fifth of the taught one's are compared.
    print(json.dumps({"used": used, "returns": untaught + judge(network, env)}))


if __name__ == "__main__":
    main()
