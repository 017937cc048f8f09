"""Pictures in processes that were started by one that has drawn, or has not."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.usefixtures("opengl"),
    pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks here"),
]

PATIENCE_S = 240.0
"""Whoever has not ended by then hangs."""

PRELUDE = """
import os, sys
from roller_env.drawing.opengl import missing_opengl
from roller_env.envs.single import RollerEnv

def environment():
    env = RollerEnv(level="flat", render_mode="rgb_array", width=64, height=48)
    env.reset(seed=0)
    return env

def fork(work):
    if (child := os.fork()) == 0:
        try:
            work()
        except RuntimeError as error:
            print(f"{type(error).__name__}: {error}")
        sys.exit(0)  # an ordinary end, with all its destructors
    assert os.waitpid(child, 0)[1] == 0
"""


def lines_of(code: str) -> list[str]:
    """Return what a new process printed that ran the prelude and ``code`` and ended well."""
    done = subprocess.run(
        [sys.executable, "-uc", PRELUDE + code],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def after_drawing() -> list[str]:
    """What the children of a process that has drawn say, and then itself."""
    return lines_of("""
env = environment()
env.render()
fork(lambda: env.render())
fork(lambda: environment().render())
fork(lambda: print(missing_opengl()))
fork(lambda: fork(lambda: env.render()))
def play():
    env.step(1)
    env.close()
    print("played on")
fork(play)
fork(lambda: None)
print(env.render().shape)
""")


def test_a_process_forked_from_one_that_has_drawn_says_at_once_what_to_do(
    after_drawing: list[str],
) -> None:
    refused = after_drawing[:4]
    assert all("forked from one that had drawn" in line for line in refused)
    assert all("start_method='spawn'" in line for line in refused)


def test_it_plays_on_closes_what_it_inherited_and_ends(after_drawing: list[str]) -> None:
    assert after_drawing[4] == "played on"


def test_the_parent_draws_on(after_drawing: list[str]) -> None:
    assert after_drawing[5:] == ["(48, 64, 3)"]


def test_a_process_draws_only_if_the_one_it_was_forked_from_has_not() -> None:
    drawn, refused, parent = lines_of("""
env = environment()
fork(lambda: print(env.render().shape))
import mujoco.egl
theirs = mujoco.egl.GLContext(8, 8)  # the program draws something of its own
fork(lambda: env.render())
print(env.render().shape)
""")
    assert drawn == parent == "(48, 64, 3)"
    assert "forked from one that had drawn" in refused
