"""Train an agent, evaluate it and draw what it does.

Examples::

    python scripts/train.py --config configs/ppo_classic.yaml --seed 1
    python scripts/train.py --config configs/ppo_classic.yaml --seed 1 --resume
    python scripts/train.py --config configs/ppo_classic.yaml --demos demonstrations --name taught
    python scripts/train.py --config configs/ppo_gate.yaml --set ppo.gamma=0.995 --name far-sighted
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from roller_env.level.errors import LevelError
from roller_env.problems import printable, shown
from roller_env.training import ConfigError, TrainingRun, load_config, train
from roller_env.training.checkpoint import CheckpointError
from roller_env.training.demonstrations import DemonstrationError
from roller_env.training.files import RunError, run_directory


@dataclass(frozen=True, slots=True)
class Arguments:
    """Train an agent, evaluate it and draw what it does; all of it goes into runs/<name>/."""

    config: Path = Path("configs/ppo_classic.yaml")
    """What to train, and how."""

    name: str | None = None
    """The run's; by default the name of the configuration's file and the seed."""

    seed: int | None = None
    """Instead of the configuration's."""

    set: Annotated[tuple[str, ...], tyro.conf.arg(metavar="FIELD=VALUE")] = ()
    """Other values than the configuration's, such as num_envs=64 ppo.gamma=0.995."""

    demos: str | None = None
    """Replays, or a Minari data set, that the policy learns to imitate before its first step."""

    resume: bool = False
    """Go on with a run that was stopped, even by a kill; says where the results are if none was."""

    runs: Path = Path("runs")
    """Directory of all runs."""


def main(arguments: Arguments) -> None:
    """Do what the command line says."""
    seed = () if arguments.seed is None else (f"seed={arguments.seed}",)
    demos = () if arguments.demos is None else (f"demonstrations={json.dumps(arguments.demos)}",)
    config = load_config(arguments.config, (*arguments.set, *seed, *demos))
    default = f"{arguments.config.stem}-seed{config.seed}"
    name = default if arguments.name is None else arguments.name
    directory = run_directory(arguments.runs, name)
    algorithm, level = config.algorithm.upper(), shown(config.level)
    print(f"Training {algorithm} on {level}, seed {config.seed}: {shown(directory)}")
    print_results(train(config, directory, resume=arguments.resume))


def print_results(run: TrainingRun) -> None:
    """Say where everything is."""
    if run.was_finished:
        print(f"{shown(run.files.directory)} is finished already; remove it to train it anew.")
        print(run.files.evaluation_table.read_text())
    files = run.files
    results = {
        "policy": files.policy,
        "its weights": files.weights,
        "the same for SB3": files.sb3_policy,
        "training log": files.progress,
        "TensorBoard": files.tensorboard,
        "learning curve": files.learning_curve,
        "evaluation": files.evaluation_table,
        "episodes": files.episodes,
        "paths from above": files.paths,
        # A GIF where there is no ffmpeg.
        "video": next(files.directory.glob(f"{files.video.stem}.*"), files.video),
        "all about the run": files.summary,
    }
    for title, path in results.items():
        print(f"  {title:<18} {shown(path) if path.exists() else '(not drawn)'}")


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except (ConfigError, RunError, CheckpointError, DemonstrationError, LevelError) as error:
        sys.exit(f"error: {printable(error)}")
    except KeyboardInterrupt:
        sys.exit("\nstopped; --resume goes on from the last checkpoint")
