"""The game's plugin on Studio's simulation thread: messages in, frames out."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest
from mujoco.studio import messages
from mujoco.studio.endpoints import ViewerEndpoint
from mujoco.studio.launch_thread import make_thread_endpoints
from mujoco.studio.viewer_handle import ViewerHandle

from roller_env.play import app
from roller_env.play.app import (
    KEYS_GO_STALE_S,
    Choices,
    FrameSnapshot,
    GamePlugin,
    KeysSnapshot,
    SceneEvent,
    WishEvent,
)
from roller_env.play.panels import Choice, Command, Wish
from roller_env.play.session import Phase
from roller_env.play.sound import CoinSound
from tests.patience import STALLED_S
from tests.play.lane import Witness, game

LEVELS = ("lane", "other")


class Table:
    """A game without a viewer: what a viewer would send is put in, what it would get comes out."""

    def __init__(self) -> None:
        self.witness = Witness()
        self.sessions = {name: game(started=False, observers=[self.witness]) for name in LEVELS}
        choices = Choices(tuple(Choice(name, name.title()) for name in LEVELS), "lane")
        self.plugin = GamePlugin(self.sessions.__getitem__, choices, CoinSound(muted=True), "low")
        self.viewer: ViewerEndpoint
        self.viewer, simulation = make_thread_endpoints()
        self.handle = ViewerHandle(simulation, sim_plugins=[self.plugin])
        self.handle.dispatch(messages.LoadModelEvent(path=""))

    def look(self) -> FrameSnapshot:
        """Let the game look at the clock once, and return what it shows then."""
        self.handle.sync()
        (frame,) = (s for s in self.viewer.get_sim_snapshots() if isinstance(s, FrameSnapshot))
        return frame

    def steps(self) -> int:
        return len(self.witness.forces[-1])

    def look_until(self, holds: Callable[[], bool]) -> FrameSnapshot:
        for _ in range(100):
            frame = self.look()
            if holds():
                return frame
        raise AssertionError("looked 100 times in vain")


@pytest.fixture
def table() -> Table:
    table = Table()
    table.viewer.send_to_sim(WishEvent(Wish(Command.START)))
    table.look_until(lambda: table.steps() > 0)
    return table


def test_the_first_step_after_a_key_is_told_is_made_with_it(
    table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    # However long this process has to wait for a processor.
    monkeypatch.setattr(app, "KEYS_GO_STALE_S", STALLED_S)
    before, told_s = table.steps(), time.monotonic()
    table.viewer.send_to_sim(KeysSnapshot("w", told_s))
    frame = table.look()
    assert frame.told_s == told_s
    table.look_until(lambda: table.steps() > before)
    assert (table.witness.forces[-1][before] != 0.0).any()
    before = table.steps()
    table.viewer.send_to_sim(KeysSnapshot("", time.monotonic()))
    table.look_until(lambda: table.steps() > before)
    assert not np.any(table.witness.forces[-1][before:])


def test_keys_are_let_go_when_the_viewer_falls_silent(table: Table) -> None:
    before = table.steps()
    table.viewer.send_to_sim(KeysSnapshot("w", time.monotonic() - KEYS_GO_STALE_S))
    table.look_until(lambda: table.steps() > before)
    assert not np.any(table.witness.forces[-1][before:])


@pytest.mark.parametrize(("began", "after"), [(False, Phase.START), (True, Phase.PLAYING)])
def test_another_level_waits_at_the_start_panel_and_begins_at_once_from_a_game(
    began: bool, after: Phase
) -> None:
    table = Table()
    if began:
        table.viewer.send_to_sim(WishEvent(Wish(Command.START)))
    table.look()
    table.viewer.get_sim_events()
    table.viewer.send_to_sim(WishEvent(Wish(Command.CHOOSE_LEVEL, "other")))
    frame = table.look().frame
    assert frame.level is table.sessions["other"].level
    assert frame.phase is after
    (scene,) = (e for e in table.viewer.get_sim_events() if isinstance(e, SceneEvent))
    assert scene.choice == "other"
    assert scene.level is frame.level


def test_a_game_that_is_closed_is_over_for_those_who_record_it(table: Table) -> None:
    assert not table.witness.results
    table.handle.close()
    assert len(table.witness.results) == 1
