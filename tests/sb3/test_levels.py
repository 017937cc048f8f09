"""Many levels for Stable-Baselines3."""

from __future__ import annotations

import numpy as np
from stable_baselines3 import PPO

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.level import shipped_levels

NAMES = tuple(shipped_levels())


def test_stable_baselines_learns_on_all_of_them() -> None:
    envs = RollerVecEnv(
        num_envs=8, levels=NAMES, physics="rigid", seed=0, reward="nearness", max_episode_steps=30
    )
    levels = set()
    envs.reset()
    for _ in range(400):
        _, _, _, infos = envs.step(np.zeros(8, dtype=np.int64))
        levels |= {info["level"] for info in infos}
    assert levels == set(range(len(NAMES)))
    model = PPO("MlpPolicy", envs, n_steps=16, batch_size=64, n_epochs=1, device="cpu")
    model.learn(256)
    assert model.num_timesteps == 256
