"""The game's panels, in Dear ImGui: start, intro, points, pause, help, end.

A panel shows what it is given and returns what the person asked for; it decides nothing.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from mujoco.studio.dear_imgui import dear_imgui as imgui

from roller_env.game.cameras import MODES
from roller_env.game.result import EpisodeResult, Outcome
from roller_env.game.state import COIN_ON_PANELS
from roller_env.game.step import INTRO_S, SPLASH_S
from roller_env.play.session import GameFrame

Rows = Sequence[tuple[str, str]]

KEYS_HELP: Final[Rows] = (
    ("W A S D, arrows", "push the ball forward, left, back, right; two at once push diagonally"),
    ("R", "restart the level"),
    ("C", "next camera"),
    ("P, Esc", "pause and go on"),
    ("T", "hand the ball back to the agent, if one is playing"),
    ("H", "show or hide this help"),
    ("Enter", "the button that is lit"),
)

_TITLE_SIZE: Final = 54.0
_LARGE_SIZE: Final = 34.0
_NORMAL_SIZE: Final = 20.0
_SMALL_SIZE: Final = 16.0
_MARGIN: Final = 18.0
"""Pixels, as all lengths here."""

_GOLD: Final = (1.0, 0.80, 0.22, 1.0)
_FAINT: Final = (0.72, 0.78, 0.86, 1.0)
_WHITE: Final = (1.0, 1.0, 1.0, 1.0)
_GREEN: Final = (0.36, 0.90, 0.58, 1.0)
_RED: Final = (1.0, 0.45, 0.40, 1.0)
_PANEL: Final = (0.06, 0.10, 0.17, 0.86)
_BUTTON: Final = (0.13, 0.50, 0.86, 1.0)
_BUTTON_LIT: Final = (0.20, 0.60, 0.98, 1.0)
_BUTTON_DIM: Final = (0.17, 0.24, 0.35, 1.0)

_END_TITLES: Final[dict[Outcome, tuple[str, Colour]]] = {
    "finish": ("Finish!", _GREEN),
    "diverged": ("The physics failed", _RED),
    "time limit": ("The time is up", _RED),
}
"""How the end panel says how a game ended; after a fall there is none, the level begins anew."""

FALL_MESSAGE_S: Final = 2.0

Colour = tuple[float, float, float, float]


class Command(Enum):
    """What a person can ask of the game."""

    START = "start"
    RESTART = "restart"
    PAUSE = "pause"
    HAND_BACK = "hand back"
    CHOOSE_LEVEL = "choose level"


@dataclass(frozen=True)
class Wish:
    """A command, and the level it names, if it names one."""

    command: Command
    level: str = ""


@dataclass(frozen=True)
class Choice:
    """A level that can be chosen.

    Attributes:
        name: what `roller_env.level.load_level` takes.
        title: what a person reads.
    """

    name: str
    title: str


def build_points_gui(frame: GameFrame, camera_mode: int) -> None:
    """Show the points at the top left, always."""
    with panel("points", x=_MARGIN, y=_MARGIN):
        points, *details = points_lines(frame.result, frame.coins_in_level, camera_mode)
        _text(points, _LARGE_SIZE, _GOLD)
        for detail in details:
            _text(detail, _SMALL_SIZE, _FAINT)


def points_lines(result: EpisodeResult, coins_in_level: int, camera_mode: int) -> list[str]:
    """Return the lines of the points panel: the points, then what they are and what else counts."""
    lines = [
        f"{COIN_ON_PANELS * result.coins}",
        f"points   {result.time_s:.1f} s",
        f"{result.coins} of {coins_in_level} coins",
    ]
    if camera_mode:
        lines.append(f"camera: {MODES[camera_mode].replace('_', ' ')}")
    return lines


def build_hint_gui() -> None:
    """Say at the top right where the help is."""
    with panel("hint", x=-_MARGIN, y=_MARGIN, pivot=(1.0, 0.0)):
        _text("H  help", _SMALL_SIZE, _FAINT)


def build_start_gui(frame: GameFrame, choices: Sequence[Choice], chosen: str) -> Wish | None:
    """Show the start panel: the levels, and the button."""
    wish = None
    # Left of the ball, where there is room.
    roomy = imgui.GetIO().DisplaySize.x >= 2.4 * _WIDTH
    left, pivot = (_MARGIN, 0.0) if roomy else (None, 0.5)
    with panel("start", x=left, pivot=(pivot, 0.5), pad=28.0):
        _text("ROLLER", _TITLE_SIZE, _GOLD)
        _text("Collect the coins. Reach the finish. Do not fall.", _NORMAL_SIZE, _FAINT)
        imgui.Dummy(imgui.Vec2(0.0, 8.0))
        for choice in choices:
            label = f"{choice.title}###level {choice.name}"
            if _button(label, lit=choice.name == chosen, height=34.0):
                wish = Wish(Command.CHOOSE_LEVEL, choice.name)
        imgui.Dummy(imgui.Vec2(0.0, 8.0))
        if imgui.GetIO().DisplaySize.y >= _ROOMY:
            _wrapped(frame.level.description)
            imgui.Dummy(imgui.Vec2(0.0, 8.0))
        if _button("Start", lit=True, height=52.0, size=_LARGE_SIZE) or _enter():
            wish = Wish(Command.START)
        _text("W A S D or the arrow keys steer; H shows all keys", _SMALL_SIZE, _FAINT)
    return wish


def build_intro_gui(frame: GameFrame) -> None:
    """Show the intro panel; while the splash has frozen the game there is only the level."""
    if INTRO_S - frame.control_in_s < SPLASH_S:
        return
    with panel("intro", pivot=(0.5, 0.5), y_share=0.3, pad=24.0):
        _text(frame.level.title, _LARGE_SIZE, _GOLD)
        _wrapped(frame.level.description)
        _text(f"The keys work in {frame.control_in_s:.0f} s", _NORMAL_SIZE, _FAINT)


def build_pause_gui() -> Wish | None:
    """Show that the game stands still."""
    wish = None
    with panel("pause", pivot=(0.5, 0.5), pad=28.0):
        _text("Pause", _TITLE_SIZE, _WHITE)
        if _button("Go on", lit=True, height=44.0) or _enter():
            wish = Wish(Command.PAUSE)
        if _button("Restart", lit=False, height=44.0):
            wish = Wish(Command.RESTART)
    return wish


def build_end_gui(frame: GameFrame, following: Choice | None) -> Wish | None:
    """Show how the game ended, and what one can do then.

    Args:
        frame: the moment.
        following: the next level, if there is one.
    """
    result, wish = frame.result, None
    with panel("end", pivot=(0.5, 0.5), pad=28.0):
        title, colour = _END_TITLES.get(result.outcome, (result.outcome, _WHITE))
        _text(title, _TITLE_SIZE, colour)
        _rows(end_rows(result, frame.coins_in_level, frame.level.par_time_s))
        imgui.Dummy(imgui.Vec2(0.0, 8.0))
        ahead = result.success and following is not None
        if _button("Play again", lit=not ahead, height=44.0) or (not ahead and _enter()):
            wish = Wish(Command.RESTART)
        if following is not None:
            label = f"Next level: {following.title}"
            if _button(label, lit=ahead, height=44.0) or (ahead and _enter()):
                wish = Wish(Command.CHOOSE_LEVEL, following.name)
    return wish


def end_rows(result: EpisodeResult, coins_in_level: int, par_time_s: float | None = None) -> Rows:
    """Return what the end panel tells of a game: names and values."""
    points, all_points = COIN_ON_PANELS * result.coins, COIN_ON_PANELS * coins_in_level
    par = "" if par_time_s is None else f", par {par_time_s:g} s"
    medal = result.medal(par_time_s)
    return (
        ("Points", f"{points} of {all_points}"),
        ("Coins", f"{result.coins} of {coins_in_level}"),
        ("Score", f"{result.score_percent:.0f} %"),
        ("Time", f"{result.time_s:.1f} s{par}"),
        *((("Medal", medal),) if medal is not None else ()),
    )


def build_agent_gui(frame: GameFrame) -> None:
    """Say who plays, and how that changes."""
    with panel("agent", pivot=(0.5, 0.0), y=_MARGIN):
        if frame.agent_plays:
            _text("The agent plays. Press a direction to take over.", _NORMAL_SIZE, _GREEN)
        else:
            _text("You play. T hands the ball back to the agent.", _NORMAL_SIZE, _GOLD)


def build_fall_gui() -> None:
    """Say that the ball fell: the level was loaded again under the player's eyes."""
    with panel("fall", pivot=(0.5, 0.5), y_share=0.25):
        _text("You fell. Once more!", _LARGE_SIZE, _RED)


def build_help_gui(keys: Rows) -> None:
    """Show ``keys``, and what they do."""
    with panel("help", pivot=(0.5, 0.5), pad=24.0):
        _text("Keys", _LARGE_SIZE, _GOLD)
        _rows(keys)


# Pieces ----------------------------------------------------------------------------------------


@contextmanager
def panel(
    name: str,
    *,
    x: float | None = None,
    y: float | None = None,
    y_share: float = 0.5,
    pivot: tuple[float, float] = (0.0, 0.0),
    pad: float = 12.0,
) -> Iterator[None]:
    """A window as large as what is in it.

    Args:
        name: unique.
        x: from the left in pixels; from the right, if negative; None is the middle.
        y: from the top in pixels; None is at ``y_share`` of the height.
        y_share: 0 is the top, 1 the bottom.
        pivot: which point of the window is put there, 0 to 1 across and down.
        pad: between its edge and what is in it, pixels.
    """
    display = imgui.GetIO().DisplaySize
    left = display.x / 2.0 if x is None else (x if x >= 0.0 else display.x + x)
    top = display.y * y_share if y is None else y
    imgui.SetNextWindowPos(imgui.Vec2(left, top), 0, imgui.Vec2(*pivot))
    imgui.PushStyleColor(int(imgui.Col.WindowBg), imgui.Vec4(*_PANEL))
    imgui.PushStyleColor(int(imgui.Col.Text), imgui.Vec4(*_WHITE))
    imgui.PushStyleVar(int(imgui.StyleVar.WindowPadding), imgui.Vec2(pad, 0.75 * pad))
    imgui.PushStyleVar(int(imgui.StyleVar.WindowRounding), 10.0)
    imgui.PushStyleVar(int(imgui.StyleVar.WindowBorderSize), 0.0)
    imgui.Begin(name, None, _WINDOW)
    try:
        yield
    finally:
        imgui.End()
        imgui.PopStyleVar(3)
        imgui.PopStyleColor(2)


def _flags(*flags: Any) -> int:
    total = 0
    for flag in flags:
        total |= int(flag)
    return total


_WINDOW: Final = _flags(
    imgui.WindowFlags.NoTitleBar,
    imgui.WindowFlags.NoResize,
    imgui.WindowFlags.NoMove,
    imgui.WindowFlags.NoScrollbar,
    imgui.WindowFlags.NoCollapse,
    imgui.WindowFlags.NoSavedSettings,
    imgui.WindowFlags.AlwaysAutoResize,
    imgui.WindowFlags.NoNav,
    imgui.WindowFlags.NoDocking,
)

_WIDTH: Final = 460.0
"""Of what is in a large panel, where the page is wide enough."""


_ROOMY: Final = 560.0
"""A page lower than this shows no description of the level at the start."""


def _width() -> float:
    return float(min(_WIDTH, imgui.GetIO().DisplaySize.x - 96.0))


def _text(text: str, size: float, colour: Colour) -> None:
    with _sized(size):
        imgui.TextColored(imgui.Vec4(*colour), text)


def _wrapped(text: str) -> None:
    """Show a paragraph, if there is one; ImGui's own wrapping would break words."""
    if not text:
        return
    with _sized(_SMALL_SIZE):
        letter = imgui.CalcTextSize(text).x / len(text)
        for line in textwrap.wrap(text, max(int(0.95 * _width() / letter), 20)):
            imgui.TextColored(imgui.Vec4(*_WHITE), line)


@contextmanager
def _sized(size: float) -> Iterator[None]:
    imgui.PushFont(None, size)
    try:
        yield
    finally:
        imgui.PopFont()


def _button(label: str, *, lit: bool, height: float, size: float = _NORMAL_SIZE) -> bool:
    """A button as wide as the panel; returns whether it was clicked."""
    colour = _BUTTON if lit else _BUTTON_DIM
    imgui.PushStyleColor(int(imgui.Col.Button), imgui.Vec4(*colour))
    imgui.PushStyleColor(int(imgui.Col.ButtonHovered), imgui.Vec4(*_BUTTON_LIT))
    imgui.PushStyleVar(int(imgui.StyleVar.FrameRounding), 6.0)
    with _sized(size):
        clicked = bool(imgui.Button(label, imgui.Vec2(_width(), height)))
    imgui.PopStyleVar()
    imgui.PopStyleColor(2)
    return clicked


def _enter() -> bool:
    return bool(
        imgui.IsKeyPressed(imgui.Key.Enter, False)
        or imgui.IsKeyPressed(imgui.Key.KeypadEnter, False)
    )


def _rows(rows: Rows) -> None:
    """Show a table of two columns."""
    with _sized(_NORMAL_SIZE):
        if not imgui.BeginTable("rows", 2, int(imgui.TableFlags.SizingFixedFit)):
            return
        for name, value in rows:
            imgui.TableNextRow()
            imgui.TableNextColumn()
            imgui.TextColored(imgui.Vec4(*_FAINT), name + "   ")
            imgui.TableNextColumn()
            imgui.TextUnformatted(value)
        imgui.EndTable()
