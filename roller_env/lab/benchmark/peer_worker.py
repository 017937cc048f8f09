"""One environment of somebody else's, stepped on demand; runs in the peers' own interpreter.

It is started by `roller_env.lab.benchmark.peers` as ``python peer_worker.py '<json>'`` and imports
nothing of this package, which is not installed there. One line of JSON each way: it says what it
is, then answers ``{"steps": n}`` with ``{"seconds": s}`` until its input ends.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any, TextIO

import numpy as np

Run = Callable[[int], float]


def envpool_maze(num_envs: int, num_threads: int) -> tuple[Run, dict[str, Any]]:
    """Return EnvPool's PointMaze_Large-v3, which resets by itself, and what it is."""
    import envpool

    env = envpool.make_gymnasium(
        "PointMaze_Large-v3", num_envs=num_envs, num_threads=num_threads, seed=0
    )
    env.reset()
    rng = np.random.default_rng(0)

    def run(steps: int) -> float:
        actions = rng.uniform(-1.0, 1.0, (steps, num_envs, 2)).astype(np.float32)
        start = time.perf_counter()
        for action in actions:
            env.step(action)
        return time.perf_counter() - start

    # Its C++ task steps MuJoCo once, 0.01 s, an action (point_maze.xml; frame_skip 1).
    facts = {"env_steps": num_envs, "simulated_s": 0.01 * env.spec.config.frame_skip}
    return run, facts | {"versions": {"envpool": version("envpool")}}


def robotics_maze() -> tuple[Run, dict[str, Any]]:
    """Return gymnasium-robotics' PointMaze_Large-v3 as `gymnasium.make` makes it."""
    import gymnasium
    import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    env: Any = gymnasium.make("PointMaze_Large-v3")
    env.reset(seed=0)
    rng = np.random.default_rng(0)

    def run(steps: int) -> float:
        actions = rng.uniform(-1.0, 1.0, (steps, 2)).astype(np.float32)
        start = time.perf_counter()
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return time.perf_counter() - start

    facts = {"env_steps": 1, "simulated_s": float(env.unwrapped.point_env.dt)}
    packages = ("gymnasium-robotics", "mujoco", "gymnasium")
    return run, facts | {"versions": {name: version(name) for name in packages}}


PEERS: dict[str, Callable[..., tuple[Run, dict[str, Any]]]] = {
    "envpool": envpool_maze,
    "gymnasium-robotics": robotics_maze,
}


def serve(run: Run, facts: dict[str, Any], requests: TextIO, answers: TextIO) -> None:
    """Say what is run, then run as many steps as every request asks for."""
    print(json.dumps(facts), file=answers, flush=True)
    for line in requests:
        seconds = run(json.loads(line)["steps"])
        print(json.dumps({"seconds": seconds}), file=answers, flush=True)


def main() -> None:
    """Serve the peer that the command line names."""
    # Libraries print to standard output; the answers keep it for themselves.
    with os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8") as answers:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        wanted = json.loads(sys.argv[1])
        run, facts = PEERS[wanted.pop("peer")](**wanted)
        serve(run, facts, sys.stdin, answers)


if __name__ == "__main__":
    main()
