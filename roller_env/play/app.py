"""The game in MuJoCo Studio: two plugins, the same for the browser and for a window.

`GamePlugin` runs on Studio's simulation thread: it owns the session, lets time pass and answers
commands. `ScreenPlugin` runs on the viewer's thread: it reads the keys, draws the latest frame and
the panels. They meet only in the messages below. Studio's own application is not loaded, so none
of its shortcuts exists.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Final, NamedTuple

import mujoco
import numpy as np
from mujoco.studio import messages, plugin
from mujoco.studio.dear_imgui import dear_imgui as imgui

from roller_env.config import LevelSource
from roller_env.drawing.renderer import look
from roller_env.level import Level, load_level, shipped_levels
from roller_env.level.expand import expand
from roller_env.pieces.coin import COIN
from roller_env.play import panels
from roller_env.play.camera import PlayerCamera
from roller_env.play.effects import Flares
from roller_env.play.keyboard import NO_KEYS, letters
from roller_env.play.panels import Choice, Command, Wish
from roller_env.play.scene import PlayScene, Quality
from roller_env.play.session import GameFrame, GameSession, Phase
from roller_env.play.sound import CoinSound

TICK_S: Final = 0.004
"""Pause between two looks at the clock: what it adds to the way from a key to the picture."""

ANSWER_S: Final = 0.012
"""How long a picture waits for the game when a key has gone down or up: so the key is in this
picture and not in the next, and still there is time to draw it before 1/60 s is over."""

ASK_S: Final = 0.0005
"""Pause between two looks whether the game has answered."""

KEYS_GO_STALE_S: Final = 0.25
"""Keys of which nothing was heard for so long are let go: the viewer's thread tells them 60 times
a second while it lives."""

MakeSession = Callable[[str], GameSession]


class Choices(NamedTuple):
    """The levels a person can choose from, and the one that is chosen at first."""

    levels: tuple[Choice, ...]
    chosen: str


def level_choices(level: LevelSource) -> Choices:
    """Return the shipped levels, and ``level`` itself if it is none of them.

    Raises:
        LevelError: ``level`` is not valid.
    """
    levels = [Choice(name, load_level(name).title) for name in shipped_levels()]
    if level not in shipped_levels():
        levels.insert(0, Choice(str(level), load_level(level).title))
    return Choices(tuple(levels), str(level))


@dataclass(frozen=True)
class KeysSnapshot(messages.Snapshot):
    """What the person holds, told in every frame of the viewer.

    Attributes:
        held: letters of "wasd".
        told_s: when, by `time.monotonic`.
    """

    held: str
    told_s: float


@dataclass(frozen=True)
class WishEvent(messages.Event):
    """What the person asked for."""

    wish: Wish


@dataclass(frozen=True, eq=False)
class FrameSnapshot(messages.Snapshot):
    """The game as it stands.

    Attributes:
        frame: the game.
        told_s: when the keys were told that it has heard of.
    """

    frame: GameFrame
    told_s: float


@dataclass(frozen=True, eq=False)
class SceneEvent(messages.Event):
    """A level's scenery, which is the viewer thread's from then on."""

    scene: PlayScene
    level: Level
    choice: str


class GamePlugin(plugin.SimPlugin):
    """The game, on the simulation thread.

    Attributes:
        latest: the frame shown last, for whoever watches.
    """

    def __init__(
        self,
        make_session: MakeSession,
        choices: Choices,
        sound: CoinSound,
        quality: Quality = "high",
    ) -> None:
        """Begin with the chosen level.

        Args:
            make_session: makes the game of a level by its name.
            choices: the levels.
            sound: of coins.
            quality: of the picture.
        """
        self._make_session = make_session
        self._choice = choices.chosen
        self._sound = sound
        self._quality: Quality = quality
        self._session = make_session(self._choice)
        self._keys = KeysSnapshot(NO_KEYS, 0.0)
        self._looked_s = time.monotonic()
        self.latest = self._session.frame()

    @messages.handler
    def on_load_model(self, _: messages.LoadModelEvent) -> bool:
        """Publish the level; Studio asks for it at the start."""
        self._publish()
        return True

    @messages.handler
    def on_keys(self, snapshot: KeysSnapshot) -> None:
        """Keep what is held."""
        self._keys = snapshot

    @messages.handler
    def on_wish(self, event: WishEvent) -> None:
        """Do what the person asked for."""
        wish, session = event.wish, self._session
        if wish.command is Command.CHOOSE_LEVEL:
            self._play(wish.level)
        elif wish.command is Command.START:
            session.start()
        elif wish.command is Command.RESTART:
            session.restart()
        elif wish.command is Command.PAUSE:
            session.toggle_pause()
        else:
            session.hand_back()

    @messages.handler
    def on_step(self, event: messages.StepEvent) -> bool:
        """Let the time pass that has passed, and show the result."""
        now = time.monotonic()
        fresh = now - self._keys.told_s < KEYS_GO_STALE_S
        self._session.advance(now - self._looked_s, self._keys.held if fresh else NO_KEYS)
        self._looked_s = now
        frame = self._session.frame()
        if frame.episode == self.latest.episode and frame.result.coins > self.latest.result.coins:
            self._sound.play()
        self.latest = frame
        event.data.qpos[:] = frame.qpos()
        self.handle.send_to_viewer(FrameSnapshot(frame, self._keys.told_s))
        # Not before: keys that were told meanwhile are in the next step at once.
        time.sleep(TICK_S)
        return True

    @messages.handler
    def on_exit(self, _: messages.ExitEvent) -> None:
        """End the game properly, for those who record it."""
        self._session.close()

    def _play(self, choice: str) -> None:
        """Change the level; from the end panel it begins at once, from the start panel it waits."""
        begins = self._session.phase is not Phase.START
        self._session.close()
        self._choice = choice
        self._session = self._make_session(choice)
        if begins:
            self._session.start()
        self._publish()

    def _publish(self) -> None:
        level, preset = self._session.level, self._session.preset
        scene = PlayScene(level, preset, self._quality)
        self.handle.set_model(scene.model)
        self.handle.send_to_viewer(SceneEvent(scene, level, self._choice))
        self._looked_s = time.monotonic()


_STEERING: Final = {
    "w": (imgui.Key.W, imgui.Key.UpArrow),
    "a": (imgui.Key.A, imgui.Key.LeftArrow),
    "s": (imgui.Key.S, imgui.Key.DownArrow),
    "d": (imgui.Key.D, imgui.Key.RightArrow),
}


class ScreenPlugin(plugin.ViewerPlugin):
    """Keys, picture and panels, on the viewer's thread.

    Attributes:
        keys_help: the keys, and what they do.
        camera: the player's.
    """

    keys_help: ClassVar = panels.KEYS_HELP

    def __init__(self, choices: Choices) -> None:
        """Show nothing until the game sends a level.

        Args:
            choices: the levels.
        """
        self.camera = PlayerCamera()
        self._choices = choices.levels
        self._scene: SceneEvent | None = None
        self._frame: GameFrame | None = None
        self._held = NO_KEYS
        self._answered_s = 0.0
        self._flares = Flares(np.zeros((0, 3)))
        self._shown: GameFrame | None = None
        self._fell_s = -np.inf
        self._help = False

    @messages.handler
    def on_scene(self, event: SceneEvent) -> None:
        """Take over a level's scenery."""
        self._scene, self._frame, self._shown = event, None, None
        self._flares = Flares(expand(event.level).coins)
        self.camera.reset()

    @messages.handler
    def on_frame(self, snapshot: FrameSnapshot) -> None:
        """Keep the game's latest frame; one of another level comes too early or too late."""
        if self._scene is not None and snapshot.frame.level is self._scene.level:
            self._frame = snapshot.frame
        self._answered_s = snapshot.told_s

    @messages.handler
    def on_update(self, _: messages.UpdateEvent) -> None:
        """Read the keys and draw the frame."""
        held = letters(
            letter
            for letter, keys in _STEERING.items()
            if any(imgui.IsKeyDown(key) for key in keys)
        )
        told_s = time.monotonic()
        self.viewer.send_to_sim(KeysSnapshot(held, told_s))
        if held != self._held:
            self._held = held
            self._wait_for_answer(told_s)
        frame, scene = self._frame, self._scene
        if frame is None or scene is None or len(self.viewer.data.qpos) != len(frame.after):
            return
        self._notice(frame)
        self._draw(frame, scene.scene, time.monotonic())
        self._shown = frame

    @messages.handler
    def on_build_gui(self, _: messages.BuildGuiEvent) -> None:
        """Show the panels, and pass on what the person asks for."""
        # All keys and the mouse are the game's: the browser is not to move the camera itself.
        imgui.SetNextFrameWantCaptureKeyboard(True)
        imgui.SetNextFrameWantCaptureMouse(True)
        if self._frame is None or self._scene is None:
            return
        for wish in (self._wish_of_keys(), self._build_panels(self._frame, self._scene)):
            if wish is not None:
                self.viewer.send_to_sim(WishEvent(wish))

    def _wait_for_answer(self, told_s: float) -> None:
        """Wait until the game has heard of the keys told at ``told_s``, but not for long."""
        while self._answered_s < told_s and time.monotonic() < told_s + ANSWER_S:
            time.sleep(ASK_S)
            for snapshot in self.viewer.get_sim_snapshots():
                self.viewer.dispatch(snapshot)

    def _notice(self, frame: GameFrame) -> None:
        """Start what begins with this frame: flares, the message of a fall."""
        before = self._shown
        if before is not None and frame.episode != before.episode:
            self.camera.reset()
            if frame.falls > before.falls:
                self._fell_s = frame.clock_s
        self._flares.watch(frame.state.of(COIN).taken[0], frame.clock_s)

    def _draw(self, frame: GameFrame, scene: PlayScene, now: float) -> None:
        viewer, qpos = self.viewer, frame.qpos(now)
        elapsed = frame.clock_s - self._shown.clock_s if self._shown is not None else 0.0
        view = self.camera.follow(
            int(frame.state.camera.mode[0]),
            qpos[:3],
            elapsed,
        )
        _copy_camera(viewer.camera, look(view.position, view.target))
        scene.show(viewer.data, qpos, frame.state, frame.clock_s)
        viewer.vis_options.geomgroup[:] = scene.groups(self.camera.mode)
        viewer.extra_geoms[:] = scene.loose_geoms(self._flares.lights(frame.clock_s))

    def _wish_of_keys(self) -> Wish | None:
        if imgui.IsKeyPressed(imgui.Key.C, False):
            self.camera.next()
        if imgui.IsKeyPressed(imgui.Key.H, False):
            self._help = not self._help
        if imgui.IsKeyPressed(imgui.Key.R, False):
            return Wish(Command.RESTART)
        if imgui.IsKeyPressed(imgui.Key.P, False) or imgui.IsKeyPressed(imgui.Key.Escape, False):
            return Wish(Command.PAUSE)
        if imgui.IsKeyPressed(imgui.Key.T, False):
            return Wish(Command.HAND_BACK)
        return None

    def _build_panels(self, frame: GameFrame, scene: SceneEvent) -> Wish | None:
        panels.build_points_gui(frame, self.camera.mode)
        panels.build_hint_gui()
        if frame.agent and frame.phase is not Phase.START:
            panels.build_agent_gui(frame)
        if self._help:
            # In the place of the panel in the middle, which would shine through.
            panels.build_help_gui(self.keys_help)
            return None
        if frame.clock_s - self._fell_s < panels.FALL_MESSAGE_S:
            panels.build_fall_gui()
        wish = None
        if frame.phase is Phase.START:
            wish = panels.build_start_gui(frame, self._choices, scene.choice)
        elif frame.phase is Phase.INTRO:
            panels.build_intro_gui(frame)
        elif frame.phase is Phase.PAUSED:
            wish = panels.build_pause_gui()
        elif frame.phase is Phase.ENDED:
            wish = panels.build_end_gui(frame, self._following(scene.choice))
        return wish

    def _following(self, choice: str) -> Choice | None:
        names = [candidate.name for candidate in self._choices]
        number = names.index(choice) + 1
        return self._choices[number] if number < len(names) else None


def _copy_camera(to: Any, of: mujoco.MjvCamera) -> None:
    to.type, to.distance = of.type, of.distance
    to.azimuth, to.elevation = of.azimuth, of.elevation
    to.lookat[:] = of.lookat
