"""Train an agent, evaluate it and draw what it does.

Examples::

    roller train classic --seed 1
    roller train classic --seed 1 --resume
    roller train classic --demos demonstrations --name taught
    roller train gate --set ppo.gamma=0.995 --name far-sighted
    roller train mine.yaml
    roller train classic --cluster 10.0.0.1:6379 --set cluster.runners=16
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro

from roller_env.assets import asset_directory
from roller_env.level import LevelError, is_path, shipped_levels
from roller_env.problems import Problem, listed, printable, quoted, shown
from roller_env.training import ConfigError, TrainingRun, load_config, train
from roller_env.training.checkpoint import CheckpointError
from roller_env.training.demonstrations import DemonstrationError
from roller_env.training.files import RunError, run_directory

DEFAULT: Final = "classic"
"""What is trained if nothing else is asked for."""


@dataclass(frozen=True, slots=True)
class Arguments:
    """Train an agent, evaluate it and draw what it does; all of it goes into runs/<name>/."""

    what: Annotated[str | None, tyro.conf.Positional, tyro.conf.arg(metavar="LEVEL|FILE")] = None
    """A level that comes with Roller, which the recipe that comes with Roller is trained on; or the
    file of a configuration of your own; by default classic."""

    config: Path | None = None
    """A configuration's file."""

    name: str | None = None
    """The run's; by default the names of the configuration's file and of the level it was asked
    for, and the seed."""

    seed: int | None = None
    """Instead of the configuration's."""

    set: Annotated[tuple[str, ...], tyro.conf.arg(metavar="FIELD=VALUE")] = ()
    """Other values than the configuration's, such as num_envs=64 ppo.gamma=0.995."""

    demos: str | None = None
    """Replays, or a Minari data set, that the policy learns to imitate before its first step."""

    cluster: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Train by RLlib on a Ray cluster: auto, the one that this machine is part of; local, this
    machine alone; or its head node's host:port. How: --set cluster.runners=8 and the like."""

    resume: bool = False
    """Go on with a run that was stopped, even by a kill; says where the results are if none was."""

    runs: Path = Path("runs")
    """Directory of all runs."""


def main(argv: Sequence[str] | None = None, prog: str | None = None) -> None:
    """Do what the command line says.

    Args:
        argv: the words after the command; by default those of this process.
        prog: what the help calls the command.
    """
    try:
        _train(tyro.cli(Arguments, args=argv, prog=prog, description=__doc__))
    except (ConfigError, RunError, CheckpointError, DemonstrationError, LevelError) as error:
        sys.exit(f"error: {printable(error)}")
    except KeyboardInterrupt:
        sys.exit("\nstopped; --resume goes on from the last checkpoint")


def recipe() -> Path:
    """Return the file of the configuration that comes with the package."""
    return asset_directory("configs") / "ppo.yaml"


def what_to_train(what: str | None, config: Path | None) -> tuple[Path, str | None]:
    """Return the configuration's file and the level that the command line asks for.

    Raises:
        ConfigError: it asks for two files, or for a level that there is not.
    """
    if config is not None:
        if what is not None:
            message = f"found both {quoted(what)} and --config; give one of the two"
            raise ConfigError([Problem((), message)])
        return config, None
    what = what or DEFAULT
    if is_path(what):
        return Path(what), None
    known = shipped_levels()
    if what not in known:
        message = f"no level is called {quoted(what)}; there are {listed(known)}"
        problem = Problem((), f"{message}, and paths end in .yaml", written=what, known=known)
        raise ConfigError([problem])
    return recipe(), what


def _train(arguments: Arguments) -> None:
    file, level = what_to_train(arguments.what, arguments.config)
    asked = () if level is None else (f"level={level}",)
    seed = () if arguments.seed is None else (f"seed={arguments.seed}",)
    demos = () if arguments.demos is None else (f"demonstrations={json.dumps(arguments.demos)}",)
    config = load_config(file, (*asked, *arguments.set, *seed, *demos))
    parts = (file.stem,) if level is None else (file.stem, Path(config.level).stem)
    default = f"{'_'.join(parts)}-seed{config.seed}"
    name = default if arguments.name is None else arguments.name
    directory = run_directory(arguments.runs, name)
    algorithm, played = config.algorithm.upper(), shown(config.level)
    print(f"Training {algorithm} on {played}, seed {config.seed}: {shown(directory)}")
    print_results(train(config, directory, resume=arguments.resume, cluster=arguments.cluster))


def print_results(run: TrainingRun) -> None:
    """Say where everything is."""
    if run.was_finished:
        print(f"{shown(run.files.directory)} is finished already; remove it to train it anew.")
        print(run.files.evaluation_table.read_text(encoding="utf-8"))
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
