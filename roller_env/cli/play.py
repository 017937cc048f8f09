"""Play the game in a browser page, or watch a trained agent play.

Examples::

    roller play
    roller play bridge --skip-intro
    roller play --policy runs/ppo_classic-seed0
    roller play gate --policy shipped
    roller play --policy runs/ppo_classic-seed0 --agents 64
    roller play classic --against runs/ppo_classic-seed0
    roller play my_level.yaml --physics accurate
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import tyro

from roller_env.assets import LEVELS, SHIPPED
from roller_env.config import EnvConfig
from roller_env.platforms import ENDING_SIGNALS
from roller_env.play.offers import OWN, offers_of
from roller_env.play.records import Records, default_file
from roller_env.play.room import Offer, Room
from roller_env.play.server import DEFAULT_PORT, LOOPBACK, listen, serve, warning_of
from roller_env.play.session import GameSession, Observer, play_config
from roller_env.problems import listed, printable
from roller_env.replay import datasets
from roller_env.replay.keeper import ReplayKeeper

if TYPE_CHECKING:
    from roller_env.play.autopilot import Autopilot
    from roller_env.play.crowd import Crowd

RECORDED: Final = Path("replays")
"""Where games are kept that are to become data sets, if nothing else is asked for."""


@dataclass(frozen=True, slots=True)
class Arguments:
    """Play the game, or watch a trained agent play it."""

    game: Annotated[str | None, tyro.conf.Positional, tyro.conf.arg(metavar="LEVEL")] = None
    """Name of a level, or path of a level file; by default classic, or the agent's own."""

    level: str | None = None
    """The same."""

    port: int = DEFAULT_PORT
    """Where the page is served; 0 takes the first free port from 8080."""

    host: str = LOOPBACK
    """Address to listen on. By default only this machine reaches the page."""

    quality: Literal["high", "low"] = "high"
    """low is for machines that draw without a graphics processor."""

    physics: str | None = None
    """fast, default or accurate; by default default, or that of the agent's evaluation."""

    skip_intro: bool = False
    """Let the keys work at once, not six seconds after the start."""

    seed: int | None = None
    """Of the first game; by default another one every time."""

    policy: Path | None = None
    """A run's directory, or shipped, for the one of each level that comes with Roller: its agent
    plays until you press a key."""

    against: Path | None = None
    """A run's directory, or shipped: balls of its agent play beside the game; by default, with
    --agents, those of --policy."""

    agents: int | None = None
    """How many balls play beside the game, up to 256; by default one, with --against."""

    trust: bool = False
    """Also play an agent that is kept as pickles, as Stable-Baselines3 saves it. A pickle runs any
    program its maker put into it: only for runs of people you trust."""

    replays: Path | None = None
    """Directory for a replay of every game; 'roller replay' verifies, shows and films them."""

    record: str | None = None
    """Prefix of Minari data sets of what was played, one a level, such as roller/human. Every game
    is kept as a replay too, without --replays in the directory replays."""

    records: Path | None = None
    """File of best times, coins and medals; by default one of yours, where programs keep data."""


def main(argv: Sequence[str] | None = None, prog: str | None = None) -> int:
    """Do what the command line says; return the exit status, 1 if something was not written.

    Args:
        argv: the words after the command; by default those of this process.
        prog: what the help calls the command.
    """
    try:
        return play(tyro.cli(Arguments, args=argv, prog=prog, description=__doc__))
    except (RuntimeError, ValueError) as error:
        sys.exit(f"error: {printable(error)}")


def play(arguments: Arguments) -> int:
    """Play what the arguments say; return the exit status, 1 if something was not written."""
    if arguments.game is not None:
        if arguments.level is not None:
            raise ValueError("level: found it twice; give it once, with --level or without")
        arguments = replace(arguments, level=arguments.game)
    directory = arguments.replays
    if arguments.record is not None:
        datasets.check_prefix(arguments.record)
        # The data sets are written at the end, and what is killed before has none.
        directory = directory or RECORDED
    listening = listen(arguments.host, arguments.port)
    # When its terminal is closed, the game still writes what was recorded.
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.default_int_handler)
    config, agent = game_of(arguments)
    player = "human" if agent is None else "agent and human"
    keeper = ReplayKeeper(directory, player, keeps_all=arguments.record is not None)
    records = Records(arguments.records or default_file())
    crowd = crowd_of(agent, arguments)
    if crowd is not None:
        # What does not go together is told before anything is served.
        crowd.steps_per_action(config.control_dt_s)
    chosen = str(config.level) if config.level in LEVELS else OWN
    shipped = those_shipped(agent, crowd, arguments)
    offers = offers_of(config.level)
    for each in (agent, crowd):
        if each is not None and each not in shipped:
            offers = [offer for offer in offers if each.policy.plays(offer.level)]
    if all(offer.name != chosen for offer in offers):
        raise ValueError(
            f"level: found {config.level}, which shows what the agent has not learnt to see; it "
            f"plays {listed([offer.name for offer in offers])}"
        )
    room = Room(
        game_opener(config, agent, arguments, offers, shipped),
        offers,
        chosen,
        keeper=keeper,
        records=records,
        agent=agent,
        agent_name=arguments.policy.name if arguments.policy else "",
        crowd=crowd,
        quality=arguments.quality,
        skip_intro=arguments.skip_intro,
    )
    if warning := warning_of(arguments.host):
        print(warning, file=sys.stderr)
    try:
        serve(room, listening, arguments.host)
    finally:
        status = write_record(keeper, arguments.record)
        records.close()
    return status


def write_record(keeper: ReplayKeeper, record: str | None) -> int:
    """Write the data sets that were asked for, and say where all is; return the exit status."""
    lines = [f"replay: {file}" for file in keeper.files]
    problems: tuple[str, ...] = ()
    if record is not None:
        # Whoever closes the terminal or shuts the machine down asks more than once.
        for number in ENDING_SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        written = datasets.to_minari_by_level(keeper.replays, record)
        lines += [f"data set: {name}" for name in written.names]
        problems = written.problems
        if not (written.names or problems):
            lines.append("no data set: nothing was played with keys that worked")
    # Last, since there may be no terminal any more.
    for line in lines:
        print(line, flush=True)
    for problem in problems:
        print(f"error: {problem}", file=sys.stderr)
    return 1 if problems else 0


def game_of(arguments: Arguments) -> tuple[EnvConfig, Autopilot | None]:
    """Return the options of the game, and the agent that plays it, if one does."""
    if arguments.policy is None:
        physics = arguments.physics or "default"
        return play_config(arguments.level or "classic", physics), None
    # Imported here: it takes torch, which a person's game does not need.
    from roller_env.play.autopilot import load_autopilot

    return load_autopilot(
        arguments.policy, arguments.level, arguments.physics, trust=arguments.trust
    )


def crowd_of(agent: Autopilot | None, arguments: Arguments) -> Crowd | None:
    """Return the balls that play beside the game, if any do."""
    if arguments.against is None and arguments.agents is None:
        return None
    # Imported here: it takes torch, which a person's game does not need.
    from roller_env.play.crowd import Crowd
    from roller_env.training.policy import load_policy
    from roller_env.training.shipped import run_of

    if arguments.against is not None:
        run = run_of(arguments.against, arguments.level)
        policy = load_policy(run, trust=arguments.trust)
    elif agent is not None:
        policy = agent.policy
    else:
        raise ValueError("agents: found no agent to play; --against or --policy names one")
    return Crowd(policy, 1 if arguments.agents is None else arguments.agents)


def those_shipped(
    agent: Autopilot | None, crowd: Crowd | None, arguments: Arguments
) -> list[Autopilot | Crowd]:
    """Return which of the players are, on each level, the agent of it that comes with Roller."""
    runs = ((agent, arguments.policy), (crowd, arguments.against or arguments.policy))
    return [each for each, run in runs if each is not None and run == SHIPPED]


def game_opener(
    config: EnvConfig,
    agent: Autopilot | None,
    arguments: Arguments,
    offers: Sequence[Offer],
    shipped: Sequence[Autopilot | Crowd] = (),
) -> Callable[[str, Sequence[Observer]], GameSession]:
    """Return what makes the game of an offer, and lets the level's own agents play if shipped."""
    levels = {offer.name: offer.level for offer in offers}

    def open_game(name: str, observers: Sequence[Observer]) -> GameSession:
        for each in shipped:
            from roller_env.training.policy import load_policy
            from roller_env.training.shipped import run_of

            each.policy = load_policy(run_of(SHIPPED, name))
        return GameSession(
            replace(config, level=levels[name]),
            skip_intro=arguments.skip_intro,
            seed=arguments.seed,
            agent=agent,
            observers=observers,
        )

    return open_game
