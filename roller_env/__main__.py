"""``python -m roller_env``: see that the installation works, and compile the rules for it.

Numba compiles the rules when they are first used and keeps them on disk, so that only the first
game on a machine waits for it. This is that game.
"""

from __future__ import annotations

import platform
import time
from importlib.metadata import version

import gymnasium as gym
import numpy as np

import roller_env


def main() -> None:
    """Play a moment of every level, alone and in a vector, and say what with and how long."""
    print(
        f"Roller {roller_env.__version__}: Python {platform.python_version()}, "
        + ", ".join(f"{name} {version(name)}" for name in ("mujoco", "numpy", "gymnasium", "numba"))
    )
    start = time.perf_counter()
    for name in roller_env.ENV_IDS:
        _play(name)
    seconds = time.perf_counter() - start
    print(f"every level plays; {seconds:.1f} s (the first time, the rules are compiled)")


def _play(name: str) -> None:
    env = gym.make(name, reward="shaped")
    env.reset(seed=0)
    env.step(env.action_space.sample())
    env.close()
    envs = gym.make_vec(name, num_envs=2, vectorization_mode="vector_entry_point", reward="shaped")
    envs.reset(seed=0)
    envs.step(np.ones(2, dtype=np.int64))
    # One of two, as when one's episode is over.
    envs.reset(options={"reset_mask": np.array([True, False])})
    envs.close()


if __name__ == "__main__":
    main()
