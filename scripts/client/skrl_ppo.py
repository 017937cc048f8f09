"""skrl: PPO over `gym.make_vec`, which it takes as it comes."""

from __future__ import annotations

import json
from typing import Any

import gymnasium as gym
import torch
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import CategoricalMixin, DeterministicMixin, Model
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from torch import nn

ENVS = 16
ROLLOUT = 64


def network(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)
    )


class Policy(CategoricalMixin, Model):
    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        CategoricalMixin.__init__(self)
        self.net = network(self.num_observations, self.num_actions)

    def compute(self, inputs: dict[str, Any], role: str) -> tuple[torch.Tensor, dict[str, Any]]:
        return self.net(inputs["observations"]), {}


class Value(DeterministicMixin, Model):
    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.net = network(self.num_observations, 1)

    def compute(self, inputs: dict[str, Any], role: str) -> tuple[torch.Tensor, dict[str, Any]]:
        return self.net(inputs["observations"]), {}


def main() -> None:
    set_seed(0)
    envs = RecordEpisodeStatistics(
        gym.make_vec(
            "roller_env:Roller/Flat-v0",
            ENVS,
            reward="shaped",
            physics="rigid",
            control_dt_s=0.1,
            max_episode_steps=150,
            autoreset_mode=AutoresetMode.SAME_STEP,
        ),
        buffer_length=10**6,
    )
    env = wrap_env(envs)
    spaces = {
        "observation_space": env.observation_space,
        "action_space": env.action_space,
        "device": "cpu",
    }
    cfg = PPO_CFG(rollouts=ROLLOUT, mini_batches=4, learning_rate=1e-3, entropy_loss_scale=0.01)
    cfg.experiment.write_interval = cfg.experiment.checkpoint_interval = 0
    agent = PPO(
        models={"policy": Policy(**spaces), "value": Value(**spaces)},
        memory=RandomMemory(memory_size=ROLLOUT, num_envs=ENVS, device="cpu"),
        cfg=cfg,
        **spaces,
    )
    trainer = SequentialTrainer(
        env=env,
        agents=agent,
        cfg={"timesteps": 1280, "headless": True, "disable_progressbar": True},
    )
    trainer.train()
    returns = [float(value) for value in envs.return_queue]
    print(json.dumps({"used": "wrap_env of make_vec; PPO, SequentialTrainer", "returns": returns}))


if __name__ == "__main__":
    main()
