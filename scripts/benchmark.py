"""Measure how fast the environments are, side by side with physics alone and with others' work.

Examples::

    make benchmark                                  # installs the peers into .venv-peers, then this
    python scripts/benchmark.py --physics fast
    python scripts/benchmark.py --quick --peers none
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import tyro

from roller_env.lab import chart
from roller_env.lab.benchmark import breakdown, ratios
from roller_env.lab.benchmark.peers import INTERPRETER, PeerError
from roller_env.lab.runner import Config, header, provenance
from roller_env.level.errors import LevelError
from roller_env.training.config import load_config
from roller_env.training.config_source import ConfigError

_PACKAGES = ("mujoco", "numpy", "gymnasium", "stable-baselines3", "torch")
_QUICK = Config(rounds=2, round_s=0.05, warm_up_s=0.5)
_QUICK_TRAINING = ("num_envs=8", "ppo.rollout_steps=16", "ppo.batch_size=64")


@dataclass(frozen=True, slots=True)
class Arguments:
    """Measure how fast the environments are."""

    level: str = "classic"
    """Name of a shipped level, or the path of a level file."""

    physics: str = "default"
    """Preset of MuJoCo: fast, default or accurate; the rigid engine is beside it in every run."""

    reward: Literal["points", "shaped"] = "shaped"
    """The dearer of the two, unless told otherwise."""

    num_envs: int = 256
    """Environments of the vectors."""

    cores: int = 2
    """That all cases may use; as many threads do the physics."""

    rounds: int = 9
    """Turns of every case."""

    round_s: float = 0.5
    """Length of one turn, about."""

    warm_up_s: float = 10.0
    """Game time before the first turn, for the balls to spread."""

    training_envs: int = 64
    """Of the PPO on RollerVecEnv and on SubprocVecEnv, which starts as many processes."""

    config: Path = Path("configs/ppo.yaml")
    """What make train trains."""

    peers: str = str(INTERPRETER)
    """Python that has scripts/benchmark-peers.txt installed, or none."""

    out: Path = Path("runs/benchmark")
    """Directory of the tables and pictures."""

    quick: bool = False
    """See that all of it works; the figures mean nothing."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    _stay_on_cores(arguments.cores)
    task = _task(arguments)
    if task.peers is None:
        print(f"peers: none at {arguments.peers}; their rows are not measured (make benchmark)")
    goals, speeds, versions = ratios.measure(task, _say)
    facts = provenance(_PACKAGES) | {f"peer {k}": v for k, v in versions.items()}
    parts = ratios.profile(task, _say)
    title = f"{task.num_envs} environments, physics {arguments.physics}, {arguments.cores} cores"
    figures = {
        "ratios": ratios.draw_goals(goals, f"Speed against its goals: {title}"),
        "parts": breakdown.draw(parts),
    }
    text = f"{header(facts)}\n\n{ratios.report(goals, speeds, parts)}"
    tables = {"ratios": goals, "speeds": speeds, "parts": parts}
    chart.write(arguments.out, facts, tables, figures, ("benchmark", text))
    print(f"\n{text}\nTables and pictures: {arguments.out}")


def _say(what: str) -> None:
    print(f"{what} ...", file=sys.stderr, flush=True)


def _stay_on_cores(cores: int) -> None:
    """Keep this process and its children to that many cores."""
    usable = sorted(os.sched_getaffinity(0))
    if not 1 <= cores <= len(usable):
        raise ValueError(f"cores: found {cores}; this machine has 1 to {len(usable)} to use")
    os.sched_setaffinity(0, usable[:cores])


def _task(arguments: Arguments) -> ratios.Task:
    names = ("level", "physics", "reward")
    peers = Path(arguments.peers)
    task = ratios.Task(
        config=Config(arguments.rounds, arguments.round_s, arguments.warm_up_s),
        options={name: getattr(arguments, name) for name in names},
        num_envs=arguments.num_envs,
        num_threads=arguments.cores,
        training_envs=arguments.training_envs,
        training=load_config(arguments.config, _QUICK_TRAINING if arguments.quick else ()),
        peers=peers if arguments.peers != "none" and peers.exists() else None,
    )
    return replace(task, config=_QUICK, num_envs=16, training_envs=2) if arguments.quick else task


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (ConfigError, LevelError, PeerError, ValueError) as error:
        sys.exit(f"error: {error}")
