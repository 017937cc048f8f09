"""A level on the page while it is written: played, loaded anew on every save, judged in place."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from roller_env.game.actions import hardest_play
from roller_env.level import Level, LevelError, examine_level, files_of, load_level
from roller_env.physics.presets import physics_preset
from roller_env.play.room import Message, Offer, Room
from roller_env.play.server import listen, serve
from roller_env.play.session import GameSession, Observer, play_config
from roller_env.play.wire import message
from roller_env.problems import Problem
from roller_env.regular_files import LOOK_EVERY_S, SavedFile

HOST: Final = "127.0.0.1"
STAND_IN: Final = "flat"
"""What is shown as long as the file has never been a level."""


def watch_level(file: Path, physics: str, port: int = 0) -> None:
    """Serve a page on which a level file is played, until Ctrl+C is pressed.

    Args:
        file: the level file; it need not be there, or right, yet.
        physics: name of the physics preset.
        port: 0 for the first free one from 8080.

    Raises:
        PlayError: the page cannot be served there.
    """
    listening = listen(HOST, port)
    workbench = Workbench(file, physics)
    serve(workbench.room, listening, HOST, workbench.watch)


class Workbench:
    """A level file and the room in which it is played.

    Attributes:
        room: the room.
    """

    def __init__(self, file: Path, physics: str):
        """Put the file there as it stands."""
        self._file, self._physics = file, physics
        self._play = hardest_play(physics_preset(physics))
        self._saved = SavedFile(file, files_of)
        self._saved.is_new()
        level, problems = self._examined()
        offer = Offer(str(file), level or load_level(STAND_IN))
        self.room = Room(self._open, [offer], offer.name, mode="watch", skip_intro=True)
        self.room.tell_problems(problems)

    async def watch(self) -> None:
        """Look after the file, for ever."""
        while True:
            await asyncio.sleep(LOOK_EVERY_S)
            if self._saved.is_new():
                level, problems = await asyncio.to_thread(self._examined)
                self.room.tell_problems(problems)
                if level is not None:
                    self.room.put(Offer(str(self._file), level))

    def _open(self, name: str, observers: Sequence[Observer]) -> GameSession:
        level = self.room.offers[name].level
        config = play_config(level, self._physics)
        return GameSession(config, skip_intro=True, observers=observers)

    def _examined(self) -> tuple[Level | None, Message]:
        """Return the level, if the file is one, and what is to be said of it."""
        try:
            level, warnings = examine_level(self._file, self._play)
        except LevelError as error:
            return None, self._told(error.problems, ())
        return level, self._told((), warnings)

    def _told(self, errors: Iterable[Problem], warnings: Iterable[Problem]) -> Message:
        return message(
            "problems",
            file=self._file.name,
            errors=[_row(problem) for problem in errors],
            warnings=[_row(problem) for problem in warnings],
        )


def _row(problem: Problem) -> Message:
    return {"where": problem.where, "line": problem.line, "text": problem.what}
