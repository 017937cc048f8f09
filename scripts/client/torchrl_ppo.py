"""TorchRL: `GymEnv` under its own checks, `ParallelEnv` of two processes, a collector; PPO."""

from __future__ import annotations

import json

import torch
from tensordict.nn import TensorDictModule
from torch import nn
from torch.distributions import Categorical
from torchrl.collectors import Collector
from torchrl.envs import ParallelEnv, RewardSum, TransformedEnv, check_env_specs
from torchrl.envs.libs.gym import GymEnv
from torchrl.modules import ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

WORKERS = 2
FRAMES = 12_288
BATCH = 1_024


def make() -> GymEnv:
    return GymEnv(
        "roller_env:Roller/Flat-v0",
        reward="shaped",
        physics="rigid",
        control_dt_s=0.1,
        max_episode_steps=150,
        categorical_action_encoding=True,
    )


def network(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)
    )


def main() -> None:
    torch.manual_seed(0)
    single = make()
    check_env_specs(single)
    inputs, actions = single.observation_spec["observation"].shape[-1], single.action_spec.space.n
    single.close()

    body = TensorDictModule(network(inputs, actions), ["observation"], ["logits"])
    actor = ProbabilisticActor(
        body, in_keys=["logits"], distribution_class=Categorical, return_log_prob=True
    )
    critic = ValueOperator(network(inputs, 1), in_keys=["observation"])
    advantage = GAE(gamma=0.99, lmbda=0.95, value_network=critic, average_gae=True)
    loss = ClipPPOLoss(actor, critic, entropy_coeff=0.01)
    optimizer = torch.optim.Adam(loss.parameters(), lr=1e-3)

    envs = TransformedEnv(ParallelEnv(WORKERS, make), RewardSum())
    collector = Collector(envs, actor, frames_per_batch=BATCH, total_frames=FRAMES)
    returns: list[float] = []
    for data in collector:
        ended = data["next", "done"]
        returns += data["next", "episode_reward"][ended].tolist()
        for _ in range(8):
            with torch.no_grad():
                advantage(data)
            flat = data.reshape(-1)
            for rows in torch.randperm(BATCH).chunk(4):
                losses = loss(flat[rows])
                total = sum(one for name, one in losses.items() if name.startswith("loss_"))
                optimizer.zero_grad()
                total.backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimizer.step()
    collector.shutdown()
    used = "check_env_specs, GymEnv, ParallelEnv, Collector; ClipPPOLoss"
    print(json.dumps({"used": used, "returns": returns}))


if __name__ == "__main__":
    main()
