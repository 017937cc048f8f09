"""Room: one game, the player who steers it, and everybody who watches.

It knows nothing of sockets: a `Guest` is whatever takes what is told and shown. Nothing waits for a
guest: a frame that one cannot take in time is left out for it.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol, TypeVar

from roller_env.arrays import Float64
from roller_env.game.actions import KEYS
from roller_env.game.result import EpisodeResult
from roller_env.game.state import COIN_ON_PANELS
from roller_env.level import Level
from roller_env.level.expand import expand
from roller_env.play.ghost import Ghost, par_run
from roller_env.play.records import Improved, Records, RecordsError
from roller_env.play.replay_session import ReplaySession
from roller_env.play.scene import Scene
from roller_env.play.session import GameSession, Observer, Phase
from roller_env.play.wire import (
    FORMAT,
    Choose,
    GhostChoice,
    GhostKind,
    Keys,
    Seek,
    Speed,
    ToServer,
    frame_bytes,
    message,
)
from roller_env.replay import Replay
from roller_env.replay.contents import level_hash
from roller_env.replay.keeper import ReplayKeeper
from roller_env.simulation import Simulation, Transition

if TYPE_CHECKING:
    from roller_env.play.autopilot import Autopilot
    from roller_env.play.crowd import Crowd

FRAME_S: Final = 1 / 60
STANDING_FRAME_S: Final = 1 / 10
PAUSED_FRAME_S: Final = 1 / 4
"""Time from one frame to the next: while something moves, while only the scenery does, and while
nothing does."""

KEYS_GO_STALE_S: Final = 0.75
"""Keys of which nothing was heard for so long are let go: a page tells them four times a second."""

MAX_WISHES: Final = 64
"""What a player may ask for and not have got yet; what is beyond is not heard."""

AGENT_S: Final = 0.1
"""Time from one message about what an agent thinks to the next."""

Mode = Literal["play", "replay", "watch"]
Game = GameSession | ReplaySession
Message = dict[str, Any]
Answer = TypeVar("Answer")


class Guest(Protocol):
    """Somebody at the page."""

    def tell(self, told: Message) -> None:
        """Send a message, sooner or later."""

    def show(self, frame: bytes) -> None:
        """Send a frame, or leave it out if the next one comes first."""


@dataclass(frozen=True, slots=True)
class Offer:
    """A level that can be chosen.

    Attributes:
        name: what the room's ``open_game`` takes.
        level: the level.
        number: place in the order of difficulty, from 1; 0 for a file of somebody's own.
        picture: address of its picture, if there is one.
    """

    name: str
    level: Level
    number: int = 0
    picture: str | None = None


class Room:
    """A game and who is there; an observer of the game, too.

    Attributes:
        offers: the levels that can be chosen, by name.
        scene: of the level that is played, None before it is loaded.
        keeper: of what is played.
    """

    def __init__(
        self,
        open_game: Callable[[str, Sequence[Observer]], Game],
        offers: Sequence[Offer],
        chosen: str,
        *,
        mode: Mode = "play",
        keeper: ReplayKeeper | None = None,
        records: Records | None = None,
        agent: Autopilot | None = None,
        agent_name: str = "",
        crowd: Crowd | None = None,
        rival: Replay | None = None,
        quality: Literal["high", "low"] = "high",
        skip_intro: bool = False,
    ) -> None:
        """Make a room in which nothing is loaded yet.

        Args:
            open_game: makes the game of an offer by its name; it tells the observers that it is
                given of what is played.
            offers: the levels that can be chosen.
            chosen: name of the first one.
            mode: what pages are told that this is.
            keeper: keeps replays of what is played.
            records: of what people reach; None keeps them as long as the room.
            agent: who plays until a key is held.
            agent_name: what pages call it.
            crowd: balls that play beside the game.
            rival: the run whose ball rolls beside as a ghost, if no other one is chosen.
            quality: of the picture, as pages are told.
            skip_intro: whether the keys work at once, as pages are told.
        """
        self.offers = {offer.name: offer for offer in offers}
        self.scene: Scene | None = None
        self.keeper = keeper or ReplayKeeper()
        self._open, self._name, self._mode = open_game, chosen, mode
        self._records = records or Records()
        self._agent, self._agent_name, self._crowd = agent, agent_name, crowd
        self._quality, self._skip_intro = quality, skip_intro
        self._game: Game | None = None
        self._guests: list[Guest] = []
        self._player: Guest | None = None
        self._asking: list[Guest] = []
        self._held, self._tapped, self._told_s = "", "", 0.0
        self._ghost: Ghost | None = None
        self._rival = rival
        self._ghost_kind: GhostKind = "none"
        self._ended: list[tuple[EpisodeResult, bool, Replay | None]] = []
        self._agent_told_s = 0.0
        self._problems: Message | None = None
        self._result: Message | None = None
        self._timeline_told: Message | None = None
        self._wishes: list[ToServer] = []
        self._changed = False
        self._woken = asyncio.Event()

    # Who is there ----------------------------------------------------------------------------

    def enter(self, guest: Guest) -> None:
        """Somebody comes: the player if nobody else is, else one who watches."""
        self._guests.append(guest)
        if self._player is None:
            self._player = guest
        guest.tell(self._hello(guest))
        ended = self._game is not None and self._game.phase is Phase.ENDED
        result = self._result if ended else None
        for told in (self._level_message(), self._timeline(), self._problems, result):
            if told is not None:
                guest.tell(told)
        self._woken.set()

    def leave(self, guest: Guest) -> None:
        """Somebody goes; if it was the player, the game waits, and who is next steers.

        That is who has asked for it, or else who has been there longest: a page that is reloaded
        may come before the one that it was is known to be gone.
        """
        if guest not in self._guests:
            return
        self._guests.remove(guest)
        if guest in self._asking:
            self._asking.remove(guest)
        if guest is self._player:
            self._seat_next(self._guests[0] if self._guests else None)

    def _seat_next(self, otherwise: Guest | None) -> None:
        """Give the controls to who has asked for them first; the game waits meanwhile."""
        before = self._player
        self._player = self._asking.pop(0) if self._asking else otherwise
        if self._player is before:
            return
        self._held = self._tapped = ""
        self._wishes.clear()
        if self._game is not None and self._mode != "replay":
            self._game.pause()
        for guest, seat in ((before, "spectator"), (self._player, "player")):
            if guest in self._guests:
                guest.tell(message("seat", seat=seat))
        self._woken.set()

    # What is asked for -----------------------------------------------------------------------

    def hear(self, guest: Guest, wish: ToServer) -> None:
        """Take what somebody asks for; only the player steers, others are not heard."""
        kind = wish.type
        if kind == "ask_seat":
            if self._player is None:
                self._asking.insert(0, guest)
                self._seat_next(None)
            elif guest is not self._player and guest not in self._asking:
                self._asking.append(guest)
        elif guest is not self._player:
            return
        elif kind == "leave_seat":
            self._seat_next(guest)
        elif isinstance(wish, Keys):
            self._held, self._told_s = wish.held, time.monotonic()
            self._tapped = "".join(key for key in KEYS if key in self._tapped + wish.held)
        elif len(self._wishes) < MAX_WISHES:
            if _loads(wish):
                # Of several levels that are asked for, the last one is meant.
                self._wishes = [other for other in self._wishes if not _loads(other)]
            self._wishes.append(wish)
            self._woken.set()

    def tell_problems(self, problems: Message | None) -> None:
        """Tell everybody, also who comes later, what is wrong with the level file."""
        self._problems = problems
        if problems is not None:
            self._tell(problems)

    def put(self, offer: Offer) -> None:
        """Put another level in the place of the offer of that name, and load it if it is played."""
        self.offers[offer.name] = offer
        if offer.name == self._name:
            self._changed = True
            self._woken.set()

    # What time does --------------------------------------------------------------------------

    async def run(self) -> None:
        """Let time pass, for ever."""
        await self._load(self._name)
        before = due = time.monotonic()
        while True:
            # Whatever wakes the room: the next frame is due an interval from now at the latest.
            now, interval_s = time.monotonic(), self._interval_s()
            due = min(max(due + interval_s, now), now + interval_s)
            await self._sleep_until(due)
            now = time.monotonic()
            await self._answer()
            self._advance(now - before)
            before = now

    def close(self) -> None:
        """Leave the game; what is under way is kept as it stands."""
        if self._game is not None:
            self._game.close()
            self._count_ends()

    async def _sleep_until(self, due_s: float) -> None:
        """Sleep, but not longer than until somebody comes or asks for something."""
        self._woken.clear()
        if self._wishes or self._changed:
            return
        rest = due_s - time.monotonic() if self._guests else None
        try:
            async with asyncio.timeout(None if rest is None else max(rest, 0.0)):
                await self._woken.wait()
        except TimeoutError:
            pass

    @property
    def _played(self) -> Game:
        """The game, once it is loaded."""
        assert self._game is not None
        return self._game

    def _interval_s(self) -> float:
        if self._played.is_moving:
            return FRAME_S
        return PAUSED_FRAME_S if self._played.phase is Phase.PAUSED else STANDING_FRAME_S

    def _advance(self, elapsed_s: float) -> None:
        """Let the game go on and show it."""
        game, now = self._played, time.monotonic()
        if now - self._told_s > KEYS_GO_STALE_S:
            self._held = self._tapped = ""
        # A key that went down and up since the last look has been held.
        if game.advance(elapsed_s, self._tapped or self._held):
            self._tapped = ""
        self._count_ends()
        self._tell_timeline()
        if self._agent is not None and game.is_moving and now >= self._agent_told_s + AGENT_S:
            self._agent_told_s = now
            self._tell(self._agent_message())
        self._show()

    def _show(self) -> None:
        assert self.scene is not None
        frame = self._played.frame()
        ghost = None
        if self._ghost is not None and frame.phase in (Phase.PLAYING, Phase.PAUSED, Phase.ENDED):
            ghost = self._ghost.at(frame.result.time_s - self._played.intro_s)
        crowd = None if self._crowd is None else self._crowd.centres(frame.fraction)
        shown = frame_bytes(frame, self.scene, ghost, crowd, self.keeper.directory is not None)
        for guest in self._guests:
            guest.show(shown)

    async def _answer(self) -> None:
        """Do what the player asked for."""
        if self._changed:
            self._changed = False
            await self._load(self._name)
        while self._wishes:
            await self._do(self._wishes.pop(0))

    async def _do(self, wish: ToServer) -> None:
        game = self._played
        if isinstance(wish, Choose):
            if wish.level in self.offers:
                await self._load(wish.level)
        elif isinstance(wish, Seek):
            game.seek(wish.time_s)
        elif isinstance(wish, Speed):
            game.set_speed(wish.factor)
        elif isinstance(wish, GhostChoice):
            await self._race(wish.kind)
        elif wish.type == "next":
            await self._load(self._following() or self._name, begin=True)
        elif wish.type == "menu":
            await self._load(self._name)
        else:
            deeds: dict[str, Callable[[], None]] = {
                "start": game.start,
                "skip": game.skip_intro,
                "restart": game.restart,
                "pause": game.pause,
                "resume": game.resume,
                "hand_back": game.hand_back,
                "step": lambda: game.step_once(self._held),
            }
            deeds[wish.type]()

    async def _load(self, name: str, begin: bool = False) -> None:
        """Load a level, while pages are still served."""
        if self._game is not None:
            self._game.close()
            self._count_ends()
        self._name = name
        self._held = self._tapped = ""

        def load() -> tuple[Game, Scene]:
            beside = () if self._crowd is None else (self._crowd,)
            game = self._open(name, (self.keeper, self, *beside))
            if isinstance(game, GameSession):
                game.warm_up()
            scene = Scene(game.level)
            _ = scene.content
            return game, scene

        self._game, self.scene = await asyncio.to_thread(load)
        if begin and self._player is not None:
            self._played.start()
        self._timeline_told = self._result = None
        self._tell(self._level_message())
        self._tell(message("levels", levels=self._levels()))
        await self._race(self._ghost_kind)

    async def _race(self, kind: GhostKind) -> None:
        """Have a ghost, or none."""
        self._ghost_kind = kind
        game = self._played

        replay = self._rival
        if kind == "best":
            replay = self._of_records(lambda records: records.best_run(game.level, game.preset))
        elif kind == "par":
            replay = par_run(self._name, level_hash(game.level))
        self._ghost = None if replay is None else await asyncio.to_thread(Ghost, replay)

    def _of_records(self, ask: Callable[[Records], Answer]) -> Answer:
        """Return what the records say; if their file fails, go on with ones in memory."""
        try:
            return ask(self._records)
        except RecordsError as error:
            self._records = Records()
            self._tell(message("notice", text=str(error)))
            return ask(self._records)

    # What pages are told ---------------------------------------------------------------------

    def _tell(self, told: Message | None) -> None:
        if told is not None:
            for guest in self._guests:
                guest.tell(told)

    def _hello(self, guest: Guest) -> Message:
        return message(
            "hello",
            format=FORMAT,
            title="Roller",
            seat="player" if guest is self._player else "spectator",
            mode=self._mode,
            physics=None if self._game is None else self._game.preset.name,
            agent=self._agent_name if self._agent is not None else None,
            levels=self._levels(),
            quality=self._quality,
            skip_intro=self._skip_intro,
        )

    def _levels(self) -> list[Message]:
        return [self._row(offer) for offer in self.offers.values()]

    def _row(self, offer: Offer) -> Message:
        level = offer.level
        row = {
            "name": offer.name,
            "title": level.title or level.name,
            "description": level.description,
            "number": offer.number,
            "coins": len(expand(level).coins),
            "par_time_s": level.par_time_s,
            "picture": offer.picture,
            "medal": None,
            "best_time_s": None,
            "best_coins": None,
            "attempts": 0,
        }
        if self._game is not None:
            preset = self._game.preset
            record = self._of_records(lambda records: records.of(level, preset))
            row |= {
                "medal": record.medal,
                "best_time_s": record.best_time_s,
                "best_coins": record.best_coins if record.finishes else None,
                "attempts": record.attempts,
            }
        return row

    def _level_message(self) -> Message | None:
        if self._game is None or self.scene is None:
            return None
        return message(
            "level",
            name=self._name,
            scene=f"/scene/{self.scene.hash}.json",
            control_dt_s=self._game.control_dt_s,
            points_per_coin=COIN_ON_PANELS,
            ghost=self._ghost_kind,
        )

    def _timeline(self) -> Message | None:
        if self._game is None or not (self._mode == "replay" or self._game.phase is Phase.PAUSED):
            return None
        first_s, last_s = self._game.moments_s
        return message(
            "timeline", first_s=first_s, last_s=last_s, can_branch=self._mode != "replay"
        )

    def _tell_timeline(self) -> None:
        told = self._timeline()
        if told != self._timeline_told:
            self._timeline_told = told
            self._tell(told)

    def _agent_message(self) -> Message:
        assert self._agent is not None
        assert isinstance(self._game, GameSession)
        insight = self._agent.insight(self._game.simulation)
        terms = self._game.result.reward_terms or {}
        return message(
            "agent",
            actions=list(insight.actions),
            probabilities=[_number(p) for p in insight.probabilities] or None,
            value=_number(insight.value),
            entries=[
                {"name": name, "value": [_number(number) for number in numbers]}
                for name, numbers in insight.entries.items()
            ],
            reward_terms={name: _number(value) for name, value in terms.items()},
        )

    # What has ended --------------------------------------------------------------------------

    def on_reset(self, simulation: Simulation, seed: int) -> None:
        """Nothing; see `roller_env.play.session.Observer`."""

    def on_step(self, simulation: Simulation, force_n: Float64, transition: Transition) -> None:
        """Nothing."""

    def on_rewind(self, simulation: Simulation) -> None:
        """Nothing."""

    def on_end(self, simulation: Simulation, result: EpisodeResult) -> None:
        """Remember how a game ended, until the room comes to it."""
        game = self._game
        assert isinstance(game, GameSession)
        played_s = result.time_s - game.intro_s
        if played_s > 0.0:
            # The intro is no time of a player's.
            result = replace(result, time_s=played_s)
            self._ended.append((result, game.practice, self.keeper.latest))

    def _count_ends(self) -> None:
        """Enter games that have ended into the records, and tell pages of them."""
        ended, self._ended = self._ended, []
        for result, practice, replay in ended:
            self._count(result, replay, counts=not practice and self._agent is None)
        if ended:
            self._tell(message("levels", levels=self._levels()))

    def _count(self, result: EpisodeResult, replay: Replay | None, counts: bool) -> None:
        game = self._played
        improved = Improved(False, False)
        if counts:
            improved = self._of_records(
                lambda records: records.add(game.level, game.preset, result, replay)
            )
            if improved.time and self._ghost_kind == "best":
                self._wishes.append(GhostChoice(type="ghost", kind="best"))
        if result.outcome == "not ended":
            return
        whole = result.success and result.score_percent == 100.0
        self._result = message(
            "result",
            outcome=result.outcome,
            coins=result.coins,
            coins_in_level=len(expand(game.level).coins),
            score_percent=result.score_percent,
            time_s=result.time_s,
            points=COIN_ON_PANELS * result.coins,
            medal=result.medal(game.level.par_time_s),
            best_time=improved.time,
            best_coins=improved.coins,
            counts=counts,
            next=self._following() if whole else None,
        )
        self._tell(self._result)

    def _following(self) -> str | None:
        """Return the level after the one that is played, if there is one."""
        names = list(self.offers)
        number = names.index(self._name) + 1
        return names[number] if number < len(names) else None


def _loads(wish: ToServer) -> bool:
    return isinstance(wish, Choose) or wish.type in ("next", "menu")


def _number(value: float) -> float | None:
    """Return a number as pages are told it: what is not finite is nothing."""
    return round(value, 3) if math.isfinite(value) else None
