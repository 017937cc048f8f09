"""What people have reached: one file, SQLite's, which a killed process does not harm.

A game counts for its level as it is written, the physics and the rules it was played with: another
one of these is another game, with records of its own.
"""

from __future__ import annotations

import os
import sqlite3
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

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
)
"""

_COLUMNS: Final = "attempts, finishes, medal, best_time_s, best_coins, replay"
_WAIT_S: Final = 0.2
"""How long another process that writes is waited for, at most: a game goes on meanwhile."""


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
        self._file = file
        try:
            if file is not None:
                file.parent.mkdir(parents=True, exist_ok=True)
            self._database = sqlite3.connect(
                ":memory:" if file is None else file,
                timeout=_WAIT_S,
                isolation_level=None,
                check_same_thread=False,
            )
            self._database.execute(_TABLES)
            self._database.execute(f"select {_COLUMNS} from records where level = ''")
            # What cannot be written is told now, and not when there is something to be kept.
            self._database.execute("begin immediate")
            self._database.execute("rollback")
        except (OSError, sqlite3.Error) as error:
            raise self._unusable(error) from None

    def of(self, level: Level, preset: PhysicsPreset) -> Record:
        """Return what has been reached in a level.

        Raises:
            RecordsError: the file cannot be read any more.
        """
        row = self._row(level, preset)
        if row is None:
            return Record()
        attempts, finishes, medal, best_time_s, best_coins, _ = row
        return Record(
            attempts, finishes, _MEDALS[medal - 1] if medal else None, best_time_s, best_coins
        )

    def best_run(self, level: Level, preset: PhysicsPreset) -> Replay | None:
        """Return the fastest game that finished, None if there is none that can be read.

        Raises:
            RecordsError: the file cannot be read any more.
        """
        row = self._row(level, preset)
        if row is None or row[-1] is None:
            return None
        try:
            return decode(row[-1])
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

        Raises:
            RecordsError: the file cannot be written any more.
        """
        with self._transaction():
            return self._add(level, preset, result, replay)

    def _add(
        self, level: Level, preset: PhysicsPreset, result: EpisodeResult, replay: Replay | None
    ) -> Improved:
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

    def _row(self, level: Level, preset: PhysicsPreset) -> tuple[Any, ...] | None:
        try:
            row: tuple[Any, ...] | None = self._database.execute(
                f"select {_COLUMNS} from records where level = ? and physics = ?",
                _key(level, preset),
            ).fetchone()
        except sqlite3.Error as error:
            raise self._unusable(error) from None
        return row

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Let nobody else write from what is read until what is written."""
        try:
            self._database.execute("begin immediate")
            try:
                yield
                self._database.execute("commit")
            except BaseException:
                self._database.execute("rollback")
                raise
        except sqlite3.Error as error:
            raise self._unusable(error) from None

    def _unusable(self, error: Exception) -> RecordsError:
        what = error.strerror if isinstance(error, OSError) else str(error)
        return RecordsError(
            f"{shown(self._file)}: {what}; records cannot be kept there, "
            "--records names another file"
        )


def _rank(medal: Medal | None) -> int:
    return 0 if medal is None else _MEDALS.index(medal) + 1


def _key(level: Level, preset: PhysicsPreset) -> tuple[str, str]:
    engine = preset.engine
    return level_hash(level), f"{preset.name}/{PHYSICS_VERSION[engine]}/{RULES_VERSION}"
