"""Train Stable-Baselines3's SAC with the ``force`` action: is the game made for one algorithm only?

Nothing is tuned: SB3's own numbers, but for the discount, the network and what follows from many
environments. The reward and the physics are those of ``configs/ppo.yaml``, without its curriculum.

Examples::

    python scripts/sac.py flat bridge
    python scripts/sac.py flat --steps 2000
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import torch
import tyro
from gymnasium.vector import AutoresetMode
from stable_baselines3 import SAC

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.envs.vector import RollerVectorEnv
from roller_env.game.actions import forces
from roller_env.level import LevelError

ENVS = 32
UPDATES = 8
"""Of the networks in a step of all environments."""

OPTIONS: dict[str, Any] = {
    "action": "force",
    "control_dt_s": 0.1,
    "max_episode_steps": 600,
    "reward": "nearness",
    "reward_weights": {"coin": 8.0, "finish": 40.0, "fall": -1.0, "progress": 12.0},
}


@dataclass(frozen=True, slots=True)
class Arguments:
    """Train SAC on levels, and play 100 games of each agent on MuJoCo's default."""

    levels: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Names of levels, or level files."""

    steps: int = 300_000
    """Environment steps of a training."""

    seed: int = 0
    """Of the environments and the networks."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    torch.set_num_threads(1)
    for level in arguments.levels:
        begun = time.process_time()
        envs = RollerVecEnv(
            num_envs=ENVS, seed=arguments.seed, level=level, physics="relaxed", **OPTIONS
        )
        model = SAC(
            "MlpPolicy",
            envs,
            gamma=0.998,
            train_freq=1,
            gradient_steps=UPDATES,
            learning_starts=min(10_000, arguments.steps // 2),
            seed=arguments.seed,
            device="cpu",
        )
        model.learn(arguments.steps)
        finish, coins = judged(model, level)
        spent = time.process_time() - begun
        print(
            f"{level}: {finish:.0%} at the finish, {coins:.0%} of the coins, "
            f"{arguments.steps:,} steps, {spent:.0f} s of CPU",
            flush=True,
        )


def judged(model: SAC, level: str, games: int = 100) -> tuple[float, float]:
    """Return the share of games at the finish and of the coins, on MuJoCo's default."""
    envs = RollerVectorEnv(games, autoreset_mode=AutoresetMode.DISABLED, level=level, **OPTIONS)
    observations, _ = envs.reset(seed=1_000_000)
    simulation = envs.simulation
    while not simulation.state.over.all():
        actions, _ = model.predict(observations, deterministic=True)
        over = simulation.state.over
        simulation.step(forces("force", actions), hold=over)
        observations = simulation.observe()
    shares = simulation.results()["score_percent"] / 100.0
    return float(simulation.state.finished.mean()), float(np.mean(shares))


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (LevelError, ValueError) as error:
        sys.exit(f"sac.py: {error}")
