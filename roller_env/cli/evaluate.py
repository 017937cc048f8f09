"""Play a trained agent and say how good it is.

Examples::

    roller evaluate runs/ppo_classic-seed0
    roller evaluate runs/ppo_classic-seed0 --episodes 1000 --seed 7 --output evaluations/
    roller evaluate shipped --level gate
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from roller_env.divergence import reports_in
from roller_env.level.errors import LevelError
from roller_env.problems import printable, shown
from roller_env.training import ConfigError, load_policy
from roller_env.training.files import RunError, RunFiles
from roller_env.training.pictures import draw_paths, film_episode
from roller_env.training.report import markdown_table, write_evaluation
from roller_env.training.run import evaluate_policy, player_of
from roller_env.training.shipped import run_of


@dataclass(frozen=True, slots=True)
class Arguments:
    """Play a trained agent and print its evaluation table."""

    run: Annotated[Path, tyro.conf.Positional]
    """Directory of the run; or shipped: the agent of the level that comes with Roller."""

    level: str | None = None
    """Name or path of another level than the one trained on; of shipped agents, which one."""

    episodes: int = 100
    """How many to play."""

    seed: int | None = None
    """Of the environments; by default one that training never used."""

    replays: Path | None = None
    """Directory for a replay of every episode; 'roller replay' verifies, shows and films them."""

    trust: bool = False
    """Also play an agent that is kept as pickles, as Stable-Baselines3 saves it. A pickle runs any
    program its maker put into it: only for runs of people you trust."""

    output: Path | None = None
    """Directory for the table, the episodes, the paths from above and a video."""


def main(argv: Sequence[str] | None = None, prog: str | None = None) -> None:
    """Do what the command line says.

    Args:
        argv: the words after the command; by default those of this process.
        prog: what the help calls the command.
    """
    try:
        _evaluate(tyro.cli(Arguments, args=argv, prog=prog, description=__doc__))
    except (ConfigError, RunError, LevelError) as error:
        sys.exit(f"error: {printable(error)}")
    except OSError as error:
        sys.exit(f"error: {shown(error.filename or 'output')}: {error.strerror or error}")


def _evaluate(arguments: Arguments) -> None:
    run = run_of(arguments.run, arguments.level)
    policy = load_policy(run, trust=arguments.trust)
    config = policy.config
    if arguments.level is not None:
        config = config.on_level(arguments.level)
    with reports_in(arguments.output or arguments.run):
        evaluation = evaluate_policy(
            policy, config, arguments.episodes, arguments.seed, player_of(run)
        )
    print(markdown_table(evaluation, config))
    if arguments.replays is not None:
        evaluation.save_replays(arguments.replays)
        print(f"{len(evaluation)} replays written to {shown(arguments.replays)}")
    if arguments.output is None:
        return
    arguments.output.mkdir(parents=True, exist_ok=True)
    files = RunFiles(arguments.output)
    write_evaluation(evaluation, config, files)
    draw_paths(evaluation, files.paths)
    film_episode(evaluation, files.video)
    print(f"written to {shown(arguments.output)}")
