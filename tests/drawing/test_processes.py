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

PATIENCE_S = 60.0
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
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_a_process_forked_from_one_that_has_drawn_says_at_once_what_to_do() -> None:
    lines = lines_of("""
env = environment()
env.render()
fork(lambda: env.render())
fork(lambda: environment().render())
fork(lambda: print(missing_opengl()))
fork(lambda: fork(lambda: env.render()))
print(env.render().shape)
""")
    *refused, shape = lines
    assert len(refused) == 4
    for line in refused:
        assert "forked from one that had drawn" in line
        assert "start_method='spawn'" in line
    assert shape == "(48, 64, 3)", "the parent draws on"


def test_it_plays_on_closes_what_it_inherited_and_ends() -> None:
    lines = lines_of("""
env = environment()
env.render()
def play():
    env.step(1)
    env.close()
    print("played")
fork(play)
fork(lambda: None)
print(env.render().shape)
""")
    assert lines == ["played", "(48, 64, 3)"]


def test_a_process_forked_from_one_that_has_not_drawn_draws() -> None:
    lines = lines_of("""
env = environment()
fork(lambda: print(env.render().shape))
print(env.render().shape)
""")
    assert lines == ["(48, 64, 3)", "(48, 64, 3)"]
