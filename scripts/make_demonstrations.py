"""Let the scripted player play, or the solver where a level has no route, and keep replays of it.

Without options it makes the demonstrations that are shipped, one a level; do so after changing a
level, a material, a preset or the rules. With --rerecord it plays what is there again, action by
action, and keeps it where the game ends as it did: enough after a change that leaves the games what
they are. With --episodes it makes demonstrations to learn from.

Examples::

    python scripts/make_demonstrations.py
    python scripts/make_demonstrations.py --rerecord
    python scripts/make_demonstrations.py classic --episodes 40 --action-noise 0.1 --output demos
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import tyro
from tqdm import tqdm

from roller_env.assets import asset_directory
from roller_env.config import EnvConfig
from roller_env.level import Level, LevelError, load_level, shipped_levels
from roller_env.problems import printable
from roller_env.replay import (
    Replay,
    ReplayError,
    load_replay,
    record_episode,
    save_replay,
    verify,
)
from roller_env.replay.conversion import load_any, record_anew
from roller_env.replay.scripted import PLAYER, ScriptedPlayer
from roller_env.solver import Search

BUDGET = 5_000_000
"""Environment steps of the solver; on MuJoCo, some minutes."""


@dataclass(frozen=True, slots=True)
class Arguments:
    """Let the scripted player play, and keep what it does as replays."""

    levels: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Names or files of the levels; by default all that are shipped."""

    output: Path = field(default_factory=lambda: asset_directory("replays"))
    """Directory for them: LEVEL.replay, or LEVEL-NUMBER.replay if there are several."""

    rerecord: bool = False
    """Record the actions of the replays that are there anew, instead of playing otherwise."""

    episodes: int = 1
    """How many of each level."""

    seed: int = 0
    """Of the first one's start; the others follow."""

    action_noise: float = 0.0
    """Fraction of the time in which it holds any keys at all, from which it then has to recover."""

    slips: Annotated[float | None, tyro.conf.arg(help_behavior_hint="deprecated")] = None
    """What --action-noise was called."""

    physics: str = "default"
    """Preset to play with."""


def main(arguments: Arguments) -> int:
    """Do what the command line says; return the exit status, 1 if an episode did not end well."""
    failed = 0
    if arguments.slips is not None:
        warnings.warn("--slips is called --action-noise now", DeprecationWarning, stacklevel=2)
        arguments = replace(arguments, action_noise=arguments.slips, slips=None)
    for source in arguments.levels or shipped_levels():
        level = load_level(source)
        numbers = range(arguments.seed, arguments.seed + arguments.episodes)
        for seed in tqdm(numbers, desc=level.name, unit=" episodes"):
            failed += not demonstrate(level, seed, arguments)
    if failed:
        print(f"{failed} were not kept", file=sys.stderr)
    # Recovering from noise does not always succeed, and need not.
    return 1 if failed and arguments.action_noise == 0.0 else 0


def demonstrate(level: Level, seed: int, arguments: Arguments) -> bool:
    """Play an episode; return whether it reached the finish, and only then keep it."""
    name = level.name if arguments.episodes == 1 else f"{level.name}-{seed}"
    file = arguments.output / f"{name}.replay"
    config = EnvConfig(level=level, physics=arguments.physics, num_threads=1)
    if arguments.rerecord:
        try:
            replay = play_again(file, config)
        except ReplayError as error:
            tqdm.write(f"{error}; not kept")
            return False
    elif level.route is None:
        search = Search(level, seed, arguments.physics)
        solution = search.run(BUDGET, all_coins=True)
        if solution is None:
            tqdm.write(f"{level.name}, seed {seed}: not won in {search.steps:,} steps; not kept")
            return False
        replay = search.replay(solution)
    else:
        player = ScriptedPlayer(level, action_noise=arguments.action_noise, seed=seed)
        replay = record_episode(config, player, seed=seed, player=PLAYER)
    result = replay.result
    told = (
        f"{result.outcome}, {result.coins} coins ({result.score_percent:.0f} %), "
        f"{result.time_s:.2f} s"
    )
    if not result.success:
        tqdm.write(f"{level.name}, seed {seed}: {told}; not kept")
        return False
    save_replay(replay, file)
    tqdm.write(f"{file}: {told}, {file.stat().st_size} bytes, {verify(load_replay(file))}")
    return True


def play_again(file: Path, config: EnvConfig) -> Replay:
    """Play the actions of a file, of any format, on a level and preset as they are now.

    Raises:
        ReplayError: it cannot be read, or its game ends otherwise now.
    """
    played = load_any(file)
    return record_anew(played, replace(played.options, level=config.level, physics=config.physics))


if __name__ == "__main__":
    try:
        sys.exit(main(tyro.cli(Arguments, description=__doc__)))
    except (LevelError, ValueError) as error:
        sys.exit(f"error: {printable(error)}")
