"""What people have reached: one file, SQLite's, which a killed process does not harm.

A game counts for its level as it is written, the physics and the rules it was played with: another
one of these is another game, with records of its own.
"""

from __future__ import annotations

import os
import sqlite3
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from roller_env.game.result import EpisodeResult, Medal
from roller_env.game.version import RULES_VERSION
from roller_env.level.schema import Level
from roller_env.physics.presets import PhysicsPreset
from roller_env.physics.version import PHYSICS_VERSION
from roller_env.problems import shown
from roller_env.replay import Replay, ReplayError
from roller_env.replay.contents import level_hash
from roller_env.replay.file import decode, encode

FILE: Final = "records.sqlite3"
_MEDALS: Final[tuple[Medal, ...]] = ("bronze", "silver", "gold")

_TABLES: Final = """
create table if not exists records (
    level text not null,
    physics text not null,
    attempts integer not null default 0,
    finishes integer not null default 0,
    medal integer not null default 0,
    best_time_s real,
    best_coins integer not null default 0,
    replay blob,
    primary key (level, physics)
) strict
"""


class RecordsError(RuntimeError):
    """The file cannot be used; the message says why and what helps."""


@dataclass(frozen=True, slots=True)
class Record:
    """What has been reached in one level.

    Attributes:
        attempts: games that ended, or were left, after the keys had worked.
        finishes: of them, how many at the finish.
        medal: the best one.
        best_time_s: of the games that finished; None for none.
        best_coins: most coins of a game that finished.
    """

    attempts: int = 0
    finishes: int = 0
    medal: Medal | None = None
    best_time_s: float | None = None
    best_coins: int = 0


class Improved(NamedTuple):
    """Of what a game was the best."""

    time: bool
    coins: bool


def default_file() -> Path:
    """Return where this user's records are kept, by the habits of the operating system."""
    if sys.platform == "win32":
        home = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        home = Path.home() / "Library" / "Application Support"
    else:
        home = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    return home / "roller" / FILE


class Records:
    """The records of one file. Several processes may keep theirs in it at the same time."""

    def __init__(self, file: Path | None = None):
        """Open the file, or make it.

        Args:
            file: where; None keeps the records in memory alone.

        Raises:
            RecordsError: it cannot be opened, or is something else.
        """
        try:
            if file is not None:
                file.parent.mkdir(parents=True, exist_ok=True)
            # No transaction but that of each statement.
            self._database = sqlite3.connect(
                ":memory:" if file is None else file, isolation_level=None, check_same_thread=False
            )
            self._database.execute(_TABLES)
        except (OSError, sqlite3.Error) as error:
            what = error.strerror if isinstance(error, OSError) else str(error)
            raise RecordsError(
                f"{shown(file)}: {what}; records cannot be kept there, --records names another file"
            ) from None

    def of(self, level: Level, preset: PhysicsPreset) -> Record:
        """Return what has been reached in a level."""
        row = self._database.execute(
            "select attempts, finishes, medal, best_time_s, best_coins from records "
            "where level = ? and physics = ?",
            _key(level, preset),
        ).fetchone()
        if row is None:
            return Record()
        attempts, finishes, medal, best_time_s, best_coins = row
        return Record(
            attempts, finishes, _MEDALS[medal - 1] if medal else None, best_time_s, best_coins
        )

    def best_run(self, level: Level, preset: PhysicsPreset) -> Replay | None:
        """Return the fastest game that finished, None if there is none that can be read."""
        row = self._database.execute(
            "select replay from records where level = ? and physics = ?", _key(level, preset)
        ).fetchone()
        if row is None or row[0] is None:
            return None
        try:
            return decode(row[0])
        except ReplayError:
            return None

    def add(
        self, level: Level, preset: PhysicsPreset, result: EpisodeResult, replay: Replay | None
    ) -> Improved:
        """Count a game that has ended, and say of what it was the best.

        Args:
            level: that was played.
            preset: of the physics.
            result: how it ended.
            replay: of it, kept if it is the fastest.
        """
        before = self.of(level, preset)
        medal = result.medal(level.par_time_s)
        finished = result.success
        faster = finished and (before.best_time_s is None or result.time_s < before.best_time_s)
        richer = finished and result.coins > before.best_coins
        rank = max(_rank(medal), _rank(before.medal))
        best_time_s = result.time_s if faster else before.best_time_s
        content = encode(replay) if faster and replay is not None else None
        self._database.execute(
            "insert into records values (?, ?, ?, ?, ?, ?, ?, ?) on conflict do update set "
            "attempts = excluded.attempts, finishes = excluded.finishes, medal = excluded.medal, "
            "best_time_s = excluded.best_time_s, best_coins = excluded.best_coins, "
            "replay = coalesce(excluded.replay, replay)",
            (
                *_key(level, preset),
                before.attempts + 1,
                before.finishes + finished,
                rank,
                best_time_s,
                max(before.best_coins, result.coins if finished else 0),
                content,
            ),
        )
        return Improved(faster, richer)

    def close(self) -> None:
        """Close the file."""
        self._database.close()


def _rank(medal: Medal | None) -> int:
    return 0 if medal is None else _MEDALS.index(medal) + 1


def _key(level: Level, preset: PhysicsPreset) -> tuple[str, str]:
    engine = preset.engine
    return level_hash(level), f"{preset.name}/{PHYSICS_VERSION[engine]}/{RULES_VERSION}"
