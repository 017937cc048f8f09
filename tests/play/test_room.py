"""Who steers, who watches, and what everybody is told."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from roller_env.level import Level
from roller_env.physics.presets import physics_preset
from roller_env.play.records import Records
from roller_env.play.replay_session import ReplaySession
from roller_env.play.room import Message, Offer, Room
from roller_env.play.session import GameSession, Observer, play_config
from roller_env.play.wire import read_message
from roller_env.replay import load_replay, shipped_replays
from tests.patience import STALLED_S
from tests.play.lane import lane

PLAYING, PAUSED, ENDED = 2, 3, 4


class Somebody:
    """A guest that keeps what it is told and shown."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self.told: list[Message] = []
        self.frames: list[bytes] = []
        room.enter(self)

    def tell(self, told: Message) -> None:
        self.told.append(told)

    def show(self, frame: bytes) -> None:
        self.frames.append(frame)

    def say(self, text: str) -> None:
        self._room.hear(self, read_message(text))

    def last(self, kind: str) -> Any:
        return [told for told in self.told if told["type"] == kind][-1]

    @property
    def phase(self) -> int:
        return self.frames[-1][1]

    @property
    def x(self) -> float:
        return float(struct.unpack_from("<f", self.frames[-1], 32)[0])

    @property
    def seat(self) -> Any:
        seats = [told["seat"] for told in self.told if told["type"] in ("hello", "seat")]
        return seats[-1]


def played(*levels: Level, records: Records | None = None, **options: Any) -> Room:
    offers = [Offer(level.name, level, n + 1) for n, level in enumerate(levels or (lane(),))]
    known = {offer.name: offer.level for offer in offers}

    def open_game(name: str, observers: Sequence[Observer]) -> GameSession:
        config = play_config(known[name], "rigid")
        return GameSession(config, skip_intro=True, seed=1, observers=observers)

    return Room(open_game, offers, offers[0].name, records=records, **options)


def among(room: Room, scene: Callable[[], Awaitable[None]]) -> None:
    """Let something happen in a room in which time passes."""

    async def everything() -> None:
        running = asyncio.create_task(room.run())
        try:
            async with asyncio.timeout(STALLED_S):
                await scene()
        finally:
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)
            room.close()

    apart(everything)


def apart(happens: Callable[[], Coroutine[Any, Any, None]]) -> None:
    """Let something happen in an event loop of a thread of its own.

    In this one Playwright may have one that runs, for tests in a browser.
    """
    with ThreadPoolExecutor(max_workers=1) as thread:
        thread.submit(lambda: asyncio.run(happens())).result()


async def until(condition: Callable[[], bool]) -> None:
    while not condition():
        await asyncio.sleep(0.005)


async def push(guest: Somebody, condition: Callable[[], bool]) -> None:
    """Hold W until something is so, as a page does: it says so again and again."""
    while not condition():
        guest.say('{"type":"keys","held":"w"}')
        await asyncio.sleep(0.01)


async def started(guest: Somebody) -> None:
    await until(lambda: bool(guest.frames))
    guest.say('{"type":"start"}')
    await until(lambda: guest.phase == PLAYING)


def test_who_comes_first_plays_and_who_comes_later_watches() -> None:
    room = played()

    async def scene() -> None:
        player, watcher = Somebody(room), Somebody(room)
        assert (player.seat, watcher.seat) == ("player", "spectator")
        await started(player)
        watcher.say('{"type":"keys","held":"s"}')
        watcher.say('{"type":"pause"}')
        await push(player, lambda: watcher.x > 0.3)
        assert watcher.phase == PLAYING
        player.say('{"type":"pause"}')
        await until(lambda: watcher.phase == PAUSED)
        assert watcher.last("timeline")["can_branch"]

    among(room, scene)


def test_the_controls_go_to_who_asks_when_the_player_gives_them_up_or_is_gone() -> None:
    room = played()

    async def scene() -> None:
        first, second, third = Somebody(room), Somebody(room), Somebody(room)
        await started(first)
        second.say('{"type":"ask_seat"}')
        third.say('{"type":"ask_seat"}')
        assert second.seat == "spectator"
        first.say('{"type":"leave_seat"}')
        assert (first.seat, second.seat, third.seat) == ("spectator", "player", "spectator")
        await until(lambda: second.phase == PAUSED)
        room.leave(second)
        assert third.seat == "player"
        third.say('{"type":"resume"}')
        await until(lambda: first.phase == PLAYING)

    among(room, scene)


def test_a_game_waits_for_its_player_and_goes_on_after_a_reload() -> None:
    room = played()

    async def scene() -> None:
        player = Somebody(room)
        await started(player)
        await push(player, lambda: player.x > 0.3)
        room.leave(player)
        again = Somebody(room)
        assert again.seat == "player"
        await until(lambda: bool(again.frames))
        assert again.phase == PAUSED
        assert again.x >= player.x
        assert again.last("level")["name"] == lane().name

    among(room, scene)


def test_a_page_that_is_back_before_it_is_known_to_be_gone_steers_again() -> None:
    room = played()

    async def scene() -> None:
        player = Somebody(room)
        await started(player)
        again = Somebody(room)
        assert again.seat == "spectator"
        room.leave(player)
        assert again.seat == "player"
        await until(lambda: bool(again.frames) and again.phase == PAUSED)
        again.say('{"type":"resume"}')
        await until(lambda: again.phase == PLAYING)

    among(room, scene)


def test_keys_of_which_nothing_is_heard_are_let_go(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roller_env.play.room.KEYS_GO_STALE_S", 0.2)
    room = played()

    async def scene() -> None:
        player = Somebody(room)
        await started(player)
        await push(player, lambda: player.frames[-1][30] == 1)
        await until(lambda: player.frames[-1][30] == 0)

    among(room, scene)


def test_a_key_that_is_tapped_between_two_frames_pushes_all_the_same() -> None:
    room = played()

    async def scene() -> None:
        player = Somebody(room)
        await started(player)
        player.say('{"type":"keys","held":"w"}')
        player.say('{"type":"keys","held":""}')
        await until(lambda: struct.unpack_from("<f", player.frames[-1], 60)[0] > 0.0)
        await until(lambda: player.frames[-1][30] == 0)

    among(room, scene)


def test_a_finish_is_a_record_and_with_every_coin_leads_to_the_next_level() -> None:
    first = lane(par_time_s=30.0)
    second = lane(name="second")
    records = Records()
    room = played(first, second, records=records)

    async def scene() -> None:
        player = Somebody(room)
        await started(player)
        await push(player, lambda: player.phase == ENDED)
        await until(lambda: any(told["type"] == "result" for told in player.told))
        result = player.last("result")
        assert (result["outcome"], result["coins"], result["points"]) == ("finish", 1, 10)
        assert (result["medal"], result["counts"], result["best_time"]) == ("gold", True, True)
        assert result["next"] == "second"
        row = player.last("levels")["levels"][0]
        assert (row["medal"], row["attempts"], row["best_coins"]) == ("gold", 1, 1)
        assert row["best_time_s"] == result["time_s"]
        # Who reloads the page is told once more how it ended.
        assert Somebody(room).last("result") == result
        player.say('{"type":"ghost","kind":"best"}')
        player.say('{"type":"next"}')
        await until(lambda: player.last("level")["name"] == "second" and player.phase == PLAYING)

    among(room, scene)
    best = records.best_run(first, physics_preset("rigid"))
    assert best is not None
    assert best.result.success


def test_whoever_went_back_in_a_game_has_practised_and_sets_no_record() -> None:
    room = played()

    async def scene() -> None:
        player = Somebody(room)
        await started(player)
        await push(player, lambda: player.x > 0.5)
        player.say('{"type":"pause"}')
        await until(lambda: player.phase == PAUSED)
        player.say('{"type":"seek","time_s":0.1}')
        await until(lambda: player.x < 0.2)
        player.say('{"type":"step"}')
        player.say('{"type":"resume"}')
        await push(player, lambda: player.phase == ENDED)
        await until(lambda: any(told["type"] == "result" for told in player.told))
        result = player.last("result")
        assert (result["outcome"], result["counts"]) == ("finish", False)
        assert player.last("levels")["levels"][0]["attempts"] == 0

    among(room, scene)


def test_a_ghost_rolls_where_the_best_run_did() -> None:
    replay = load_replay(shipped_replays()["flat"])
    records = Records()
    rigid = physics_preset("rigid")
    records.add(replay.level, rigid, replay.result, replay)
    room = played(replay.level, records=records)

    async def scene() -> None:
        player = Somebody(room)
        await until(lambda: bool(player.frames))
        player.say('{"type":"ghost","kind":"best"}')
        await started(player)
        await until(lambda: player.frames[-1][2] & 8 == 8)
        await until(lambda: struct.unpack_from("<f", player.frames[-1], 80)[0] > 0.5)
        player.say('{"type":"ghost","kind":"none"}')
        await until(lambda: player.frames[-1][2] & 8 == 0)

    among(room, scene)


def test_a_replay_is_played_and_dragged_by_who_steers() -> None:
    replay = load_replay(shipped_replays()["flat"])
    offer = Offer("flat", replay.level)
    room = Room(lambda _, __: ReplaySession(replay), [offer], "flat", mode="replay")

    async def scene() -> None:
        player = Somebody(room)
        await until(lambda: bool(player.frames))
        end_s = player.last("timeline")["last_s"]
        assert end_s == pytest.approx(replay.result.time_s)
        player.say(f'{{"type":"seek","time_s":{end_s}}}')
        await until(lambda: player.phase == PAUSED)
        assert struct.unpack_from("<f", player.frames[-1], 12)[0] == pytest.approx(end_s)
        player.say('{"type":"restart"}')
        await until(lambda: player.phase == PLAYING and player.x < 1.0)

    among(room, scene)


def test_an_unknown_level_is_not_loaded() -> None:
    room = played()

    async def scene() -> None:
        player = Somebody(room)
        await started(player)
        player.say('{"type":"choose","level":"../../etc/passwd"}')
        await push(player, lambda: player.x > 0.1)

    among(room, scene)
