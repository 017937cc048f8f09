"""Verify a replay bit for bit, show it in the browser, render it, or make something else of it.

Examples::

    roller replay classic
    roller replay classic --show
    roller replay classic --html classic.html
    roller replay mine.replay --against flat --show
    roller replay mine.replay --video mine.mp4 --sheet mine.png
    roller replay old.replay --convert new.replay
    roller replay replays --record roller/human
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from socket import socket
from typing import Annotated, Literal

import tyro

from roller_env.game.cameras import MODES
from roller_env.level import load_level, shipped_levels
from roller_env.physics.presets import PRESETS
from roller_env.problems import printable, shown
from roller_env.replay import (
    Replay,
    ReplayError,
    load_replay,
    save_replay,
    shipped_replays,
    verify,
)
from roller_env.replay.conversion import load_any, record_anew
from roller_env.replay.datasets import check_prefix, to_minari_by_level
from roller_env.replay.file import SUFFIX
from roller_env.replay.pictures import contact_sheet, film

_SHEET_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp")
_VIDEO_SUFFIXES = (".mp4", ".gif")
_PAGE_SUFFIXES = (".html", ".htm")


@dataclass(frozen=True, slots=True)
class Arguments:
    """Verify a replay bit for bit, which is what happens without an option, show or render it."""

    file: Annotated[str, tyro.conf.Positional]
    """A replay file, or the name of a level whose shipped demonstration to take; with --record also
    a directory of replays."""

    verify: bool = False
    """Play it again and compare every step, also when it is rendered."""

    show: bool = False
    """Show it on a page in the browser, with a time line to drag."""

    port: int = 8080
    """Where the page is served, to this machine only; 0 takes the first free port from 8080."""

    html: Path | None = None
    """Write it as one file that anybody opens in a browser, an .html: no server, no network."""

    against: str | None = None
    """Another replay, a file or a level's shipped one: on the page or in the .html its ball rolls
    beside as a ghost."""

    video: Path | None = None
    """Film it, to an .mp4 or a .gif."""

    sheet: Path | None = None
    """Draw moments of it on one sheet, a .png."""

    convert: Path | None = None
    """Play a replay, also one of an older format, again here, and write a new file of it if it ends
    as it did."""

    record: str | None = None
    """Write Minari data sets of it, or of all replays of a directory, one a level, with this prefix
    such as roller/human."""

    camera: Literal["game"] | int = "game"
    """As the game's triggers set it, or a mode 0 to 5 for good."""

    size: tuple[int, int] = (480, 320)
    """Width and height of the pictures in pixels, both even."""


def main(argv: Sequence[str] | None = None, prog: str | None = None) -> int:
    """Do what the command line says; return the exit status, 1 for a replay that is not exact.

    Args:
        argv: the words after the command; by default those of this process.
        prog: what the help calls the command.
    """
    try:
        return _replay(tyro.cli(Arguments, args=argv, prog=prog, description=__doc__))
    except (ReplayError, RuntimeError) as error:
        sys.exit(f"error: {printable(error)}")
    except OSError as error:
        sys.exit(f"error: {shown(error.filename or 'output')}: {error.strerror or error}")


def _replay(arguments: Arguments) -> int:
    _check(arguments)
    listening = _listening(arguments) if arguments.show else None
    file = _file_of(arguments.file)
    against = None if arguments.against is None else load_replay(_file_of(arguments.against))
    if arguments.record is not None:
        return _record(file, arguments.record)
    if arguments.convert is not None:
        replay = record_anew(load_any(file))
        print(f"written to {save_replay(replay, arguments.convert)}")
    else:
        replay = load_replay(file)
    print(about(replay))
    status = 0
    if arguments.verify or not (
        arguments.show or arguments.html or arguments.video or arguments.sheet or arguments.convert
    ):
        verification = verify(replay)
        print(verification)
        status = 0 if verification.is_exact else 1
    if arguments.video is not None:
        print(f"written to {film(replay, arguments.video, arguments.camera, arguments.size)}")
    if arguments.sheet is not None:
        print(
            f"written to {contact_sheet(replay, arguments.sheet, arguments.camera, arguments.size)}"
        )
    if arguments.html is not None:
        # Imported here: it takes what pages are made with.
        from roller_env.play.html import write_html

        print(f"written to {write_html(replay, arguments.html, against)}")
    if listening is not None:
        _show(replay, against, listening)
    return status


def _file_of(name: str) -> Path:
    """Return a shipped replay's file by the name of its level, or the file of that name."""
    shipped = shipped_replays()
    if name not in shipped and not Path(name).exists():
        known = ", ".join(shipped)
        raise ReplayError(f"{name}: there is no such file; shipped are {known}")
    return shipped.get(name, Path(name))


def _listening(arguments: Arguments) -> socket:
    """Return where the page is to be served, before anything is loaded for it."""
    # Imported here: the rest needs no server.
    from roller_env.play.server import LOOPBACK, listen

    return listen(LOOPBACK, arguments.port)


def _record(source: Path, prefix: str) -> int:
    """Write data sets; return the exit status, 1 if a file or a data set failed."""
    files = sorted(source.glob(f"*{SUFFIX}")) if source.is_dir() else [source]
    replays: list[Replay] = []
    problems: list[str] = []
    for file in files:
        try:
            replays.append(load_replay(file))
        except ReplayError as error:
            problems.append(str(error))
    written = to_minari_by_level(replays, prefix)
    for name in written.names:
        print(f"data set: {name}")
    for problem in (*problems, *written.problems):
        print(f"error: {problem}", file=sys.stderr)
    if not written.names:
        raise ReplayError(
            f"{source}: found no replay in which the keys worked; no data set is made"
        )
    return 1 if problems or written.problems else 0


def _show(replay: Replay, against: Replay | None, listening: socket) -> None:
    # Imported here: the rest needs no server.
    from roller_env.play.replay_session import ReplaySession
    from roller_env.play.room import Offer, Room
    from roller_env.play.server import serve

    name = replay.level.name
    offer = Offer(name, replay.level)
    room = Room(lambda *_: ReplaySession(replay), [offer], name, mode="replay", rival=against)
    serve(room, listening)


def _check(arguments: Arguments) -> None:
    """Refuse what could not be written, before anything is played."""
    for path, suffixes in (
        (arguments.video, _VIDEO_SUFFIXES),
        (arguments.sheet, _SHEET_SUFFIXES),
        (arguments.html, _PAGE_SUFFIXES),
    ):
        if path is not None and path.suffix.lower() not in suffixes:
            raise ReplayError(f"{path}: the name must end in {' or '.join(suffixes)}")
    if arguments.convert is not None and arguments.convert.exists():
        raise ReplayError(f"{arguments.convert}: there is such a file, which is not overwritten")
    if arguments.record is not None:
        check_prefix(arguments.record)
    if arguments.camera != "game" and arguments.camera not in range(len(MODES)):
        raise ReplayError(f"camera: found {arguments.camera}; allowed are game and 0 to 5")
    if any(edge % 2 or not 16 <= edge <= 4096 for edge in arguments.size):
        raise ReplayError(f"size: found {arguments.size}; must be even numbers from 16 to 4096")


def about(replay: Replay) -> str:
    """Return what a replay is, in a line, and in more what a reader may be wrong about."""
    result, level, preset = replay.result, replay.level, replay.options.preset
    player = printable(replay.player) or "unknown player"
    lines = [
        f"{level.name}: {player}, {len(replay)} steps, "
        f"{result.time_s:.2f} s, {result.outcome}, {result.coins} coins "
        f"({result.score_percent:.0f} %)"
    ]
    # A replay brings its own level and physics, whatever it calls them.
    if level.name in shipped_levels() and load_level(level.name) != level:
        lines.append(f"note: its level is not the {level.name!r} of this version of Roller")
    if PRESETS.get(preset.name) != preset:
        lines.append(f"note: its physics is not a preset of this version of Roller: {preset}")
    return "\n".join(lines)
