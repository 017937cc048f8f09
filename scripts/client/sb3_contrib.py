"""sb3-contrib: QR-DQN and RecurrentPPO over Roller's own `VecEnv`.

MaskablePPO would learn what PPO learns: no action of Roller is ever forbidden. Keys can be held
whatever the ball does, and pressing one is the only way to see what it does there.
"""

from __future__ import annotations

import json
from typing import Any

from sb3_contrib import QRDQN, RecurrentPPO
from stable_baselines3.common.callbacks import BaseCallback

from roller_env.envs.sb3 import RollerVecEnv

OPTIONS: dict[str, Any] = {
    "reward": "shaped",
    "physics": "rigid",
    "control_dt_s": 0.2,
    "max_episode_steps": 75,
}


class Returns(BaseCallback):
    """Keep the return of every episode."""

    def __init__(self) -> None:
        super().__init__()
        self.returns: list[float] = []

    def _on_step(self) -> bool:
        infos = self.locals["infos"]
        self.returns += [float(info["episode"]["r"]) for info in infos if "episode" in info]
        return True


def qr_dqn() -> list[float]:
    kept = Returns()
    agent = QRDQN(
        "MlpPolicy",
        RollerVecEnv("flat", num_envs=8, seed=0, **OPTIONS),
        learning_rate=5e-4,
        learning_starts=1_000,
        target_update_interval=500,
        train_freq=1,
        gradient_steps=4,
        batch_size=64,
        gamma=0.98,
        exploration_fraction=0.6,
        policy_kwargs={"n_quantiles": 10},
        seed=0,
    )
    agent.learn(10_000, callback=kept)
    return kept.returns


def recurrent_ppo() -> list[float]:
    kept = Returns()
    agent = RecurrentPPO(
        "MlpLstmPolicy",
        RollerVecEnv("flat", num_envs=16, seed=0, **OPTIONS),
        n_steps=32,
        batch_size=256,
        n_epochs=6,
        learning_rate=2e-3,
        policy_kwargs={"lstm_hidden_size": 32},
        seed=0,
    )
    agent.learn(16_000, callback=kept)
    return kept.returns


if __name__ == "__main__":
    for name, learn in (("QR-DQN", qr_dqn), ("RecurrentPPO", recurrent_ppo)):
        print(json.dumps({"used": f"{name}, RollerVecEnv", "returns": learn()}))
