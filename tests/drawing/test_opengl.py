"""What happens on machines that cannot draw."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import STALLED_S

LIBRARIES = ("libEGL.so", "libEGL.so.1", "libOpenGL.so", "libOpenGL.so.0")

PLAY_AND_DRAW = """
from roller_env.drawing.opengl import missing_opengl
from roller_env.drawing.renderer import DrawingUnavailable
from roller_env.envs.single import RollerEnv
env = RollerEnv(level="flat", render_mode="rgb_array", width=64, height=48)
env.reset(seed=0)
env.step(1)
try:
    print("drew", env.render().shape)
except DrawingUnavailable as error:
    assert str(error) == missing_opengl(), (str(error), missing_opengl())
    print(error)
env.step(1)
env.close()
print("played on")
"""


def play_and_draw(code: str = PLAY_AND_DRAW, **environment: str) -> list[str]:
    """Run code in a new process without a display; return the lines it printed."""
    inherited = {
        name: value
        for name, value in os.environ.items()
        if name not in ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
    }
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=inherited | environment,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=STALLED_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.skipif(sys.platform != "linux", reason="hides libraries as Linux finds them")
def test_without_opengl_libraries_the_game_plays_and_one_line_says_what_to_install(
    tmp_path: Path,
) -> None:
    # The dynamic linker takes the first library of a name, and an empty file is none.
    for name in LIBRARIES:
        (tmp_path / name).touch()
    message, played = play_and_draw(LD_LIBRARY_PATH=str(tmp_path))
    assert "apt-get install libegl1 libgl1-mesa-dri" in message
    assert played == "played on"


def test_switched_off_opengl_is_said_to_be_switched_off() -> None:
    message, played = play_and_draw(MUJOCO_GL="disable")
    assert "MUJOCO_GL=disable" in message
    assert played == "played on"


@pytest.mark.usefixtures("opengl")
def test_it_draws_without_a_display_even_if_mujoco_was_imported_first() -> None:
    drew, played = play_and_draw("import mujoco\n" + PLAY_AND_DRAW)
    assert drew == "drew (48, 64, 3)"
    assert played == "played on"
