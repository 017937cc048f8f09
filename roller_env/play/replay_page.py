"""A replay on the game's page: it plays, stands still, and goes to wherever a person drags it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar, Final, cast

from mujoco.studio import messages
from mujoco.studio.dear_imgui import dear_imgui as imgui

from roller_env.level.schema import Level
from roller_env.physics.presets import PhysicsPreset
from roller_env.play import panels
from roller_env.play.app import Choices, GamePlugin, SceneEvent, ScreenPlugin
from roller_env.play.panels import Choice, Wish
from roller_env.play.scene import Quality
from roller_env.play.session import GameFrame, GameSession, Phase
from roller_env.play.sound import CoinSound
from roller_env.replay import Playback, Replay

JUMP_S: Final = 1.0
"""What the arrow keys go forward and back."""

KEYS_HELP: Final = (
    ("Space, P, Esc", "stand still and go on; at the end, play again"),
    ("Left, Right", f"go {JUMP_S:.0f} s back or forward; hold to go on"),
    ("R", "play from the start"),
    ("C", "next camera"),
    ("H", "show or hide this help"),
    ("Mouse", "drag the time line, or click on it"),
)

_TIMELINE_PIXELS: Final = 640.0
_MARGIN_PIXELS: Final = 80.0
_BUTTON_SIZE: Final = imgui.Vec2(72.0, 0.0)
_COLOURS: Final = (
    (imgui.Col.Button, (0.13, 0.50, 0.86, 1.0)),
    (imgui.Col.ButtonHovered, (0.20, 0.60, 0.98, 1.0)),
    (imgui.Col.FrameBg, (0.17, 0.24, 0.35, 1.0)),
    (imgui.Col.FrameBgHovered, (0.20, 0.28, 0.40, 1.0)),
    (imgui.Col.FrameBgActive, (0.20, 0.28, 0.40, 1.0)),
    (imgui.Col.SliderGrab, (1.0, 0.80, 0.22, 1.0)),
    (imgui.Col.SliderGrabActive, (1.0, 0.88, 0.50, 1.0)),
)
_TIMELINE_SHARE: Final = 0.94
"""Of the page's height, from the top: over Studio's own status bar."""


class ReplaySession:
    """A replay in the place of a person's game: it gives frames, and takes no keys.

    Attributes:
        phase: playing or paused.
        time_s: the moment shown, since the episode's start.
    """

    def __init__(self, replay: Replay):
        """Stand at the start, playing."""
        self.phase = Phase.PLAYING
        self.time_s = 0.0
        self._playback = Playback(replay)
        # Played once, so that from now on every moment is near to one that is kept.
        self._playback.seek(len(self._playback))
        self._scenery_s = 0.0
        self._rewinds = 0
        self._step = -1
        self._show()

    @property
    def level(self) -> Level:
        """What is played."""
        return self._playback.simulation.level

    @property
    def preset(self) -> PhysicsPreset:
        """The settings of the physics."""
        return self._playback.simulation.preset

    @property
    def duration_s(self) -> float:
        """Length of the episode."""
        return self._playback.duration_s

    def start(self) -> None:
        """Nothing: there is no start panel."""

    def restart(self) -> None:
        """Play from the start."""
        self.seek(0.0)
        self.phase = Phase.PLAYING

    def toggle_pause(self) -> None:
        """Stand still, or go on; at the end, from the start."""
        if self.phase is Phase.PLAYING:
            self.phase = Phase.PAUSED
        elif self.time_s >= self.duration_s:
            self.restart()
        else:
            self.phase = Phase.PLAYING

    def hand_back(self) -> None:
        """Nothing: nobody else plays."""

    def close(self) -> None:
        """Nothing: nothing is recorded."""

    def seek(self, time_s: float) -> None:
        """Show another moment, between the start and the end."""
        time_s = min(max(time_s, 0.0), self.duration_s)
        if time_s < self.time_s:
            self._rewinds += 1
        self.time_s = time_s
        self._show()

    def advance(self, elapsed_s: float, held: str = "") -> int:
        """Let real time pass; return how many control steps that was."""
        del held
        self._scenery_s += elapsed_s
        if self.phase is not Phase.PLAYING:
            return 0
        before, self.time_s = self._step, min(self.time_s + elapsed_s, self.duration_s)
        self._show()
        if self.time_s >= self.duration_s:
            self.phase = Phase.PAUSED
        return self._step - before

    def frame(self) -> GameFrame:
        """Return what is to be drawn now."""
        simulation = self._playback.simulation
        step_s = simulation.duration_s
        return GameFrame(
            level=self.level,
            phase=self.phase,
            episode=self._rewinds,
            before=self._before,
            after=self._after,
            fraction=min(max(self.time_s / step_s - self._step, 0.0), 1.0),
            made_s=time.monotonic(),
            step_s=step_s,
            state=simulation.state.copy_rows(),
            clock_s=self._scenery_s,
            result=simulation.result(),
            coins_in_level=int(simulation.coins_in_level[0]),
            control_in_s=float(simulation.state.control_delay_s[0]),
            falls=0,
            agent=False,
            agent_plays=False,
        )

    def _show(self) -> None:
        """Find the two states between which the moment lies; the game's is the later one."""
        playback = self._playback
        last = max(len(playback) - 1, 0)
        step = min(int(self.time_s / playback.simulation.duration_s + 1e-6), last)
        if step == self._step:
            return
        self._step = step
        playback.seek(step)
        self._before = playback.simulation.qpos[0]
        playback.seek(step + 1)
        self._after = playback.simulation.qpos[0]


@dataclass(frozen=True)
class SeekEvent(messages.Event):
    """The person wants to see another moment."""

    time_s: float


class ReplayPlugin(GamePlugin):
    """The replay, on the simulation thread."""

    def __init__(self, replay: Replay, sound: CoinSound, quality: Quality = "high") -> None:
        """Begin to play.

        Args:
            replay: what to show.
            sound: of coins.
            quality: of the picture.
        """
        self.replay_session = ReplaySession(replay)
        # It stands in for the game with what the page uses of one.
        session = cast("GameSession", self.replay_session)
        super().__init__(lambda _: session, choices_of(replay), sound, quality)

    @messages.handler
    def on_seek(self, event: SeekEvent) -> None:
        """Go where the person wants to."""
        self.replay_session.seek(event.time_s)


class ReplayScreen(ScreenPlugin):
    """The picture with a time line, on the viewer's thread."""

    keys_help: ClassVar = KEYS_HELP

    def __init__(self, replay: Replay) -> None:
        """Show nothing until the replay's plugin sends its level."""
        super().__init__(choices_of(replay))
        self._duration_s = len(replay) * replay.options.control_dt_s
        self._dragged_s: float | None = None

    def _build_panels(self, frame: GameFrame, scene: SceneEvent) -> Wish | None:
        panels.build_points_gui(frame, self.camera.mode)
        panels.build_hint_gui()
        if self._help:
            panels.build_help_gui(self.keys_help)
        return self._build_time_line(frame)

    def _build_time_line(self, frame: GameFrame) -> Wish | None:
        """Show where in the replay one is; whoever drags it goes elsewhere."""
        wish = None
        now_s = frame.result.time_s
        is_playing = frame.phase is Phase.PLAYING
        shown_s = now_s if self._dragged_s is None else self._dragged_s
        with panels.panel("time", pivot=(0.5, 1.0), y_share=_TIMELINE_SHARE), _styled():
            clicked = imgui.Button("Pause" if is_playing else "Play", _BUTTON_SIZE)
            if clicked or imgui.IsKeyPressed(imgui.Key.Space, False):
                wish = Wish(panels.Command.PAUSE)
            imgui.SameLine()
            room = imgui.GetIO().DisplaySize.x - _BUTTON_SIZE.x - _MARGIN_PIXELS
            imgui.SetNextItemWidth(min(_TIMELINE_PIXELS, room))
            _, wanted_s = imgui.SliderFloat(
                "###time", shown_s, 0.0, self._duration_s, f"%.1f / {self._duration_s:.1f} s"
            )
            self._dragged_s = wanted_s if imgui.IsItemActive() else None
        if self._dragged_s is not None:
            self._seek(self._dragged_s)
        elif imgui.IsKeyPressed(imgui.Key.RightArrow):
            self._seek(now_s + JUMP_S)
        elif imgui.IsKeyPressed(imgui.Key.LeftArrow):
            self._seek(now_s - JUMP_S)
        return wish

    def _seek(self, time_s: float) -> None:
        self.viewer.send_to_sim(SeekEvent(time_s))


@contextmanager
def _styled() -> Iterator[None]:
    """Colours and sizes of the time line, whatever Studio's theme."""
    for part, colour in _COLOURS:
        imgui.PushStyleColor(int(part), imgui.Vec4(*colour))
    imgui.PushStyleVar(int(imgui.StyleVar.FramePadding), imgui.Vec2(8.0, 6.0))
    imgui.PushStyleVar(int(imgui.StyleVar.FrameRounding), 6.0)
    try:
        yield
    finally:
        imgui.PopStyleVar(2)
        imgui.PopStyleColor(len(_COLOURS))


def choices_of(replay: Replay) -> Choices:
    """Return the one level there is to choose."""
    level = replay.level
    return Choices((Choice(level.name, level.title or level.name),), level.name)


def replay_plugins(replay: Replay, sound: CoinSound, quality: Quality = "high") -> tuple[Any, Any]:
    """Return the plugins that show a replay, for `roller_env.play.server.open_page`."""
    return ReplayPlugin(replay, sound, quality), ReplayScreen(replay)
