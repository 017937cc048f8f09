"""The built wheel is the game: it plays where there is no checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from roller_env.level import shipped_levels
from roller_env.replay import shipped_replays

ROOT = Path(__file__).parents[1]

PLAY = """
import pathlib
import sys

import gymnasium as gym
import roller_env

assert pathlib.Path(roller_env.__file__).is_relative_to(sys.prefix), roller_env.__file__
assert "torch" not in sys.modules and "mujoco" not in sys.modules
environment = gym.make("Roller/Classic-v0")
environment.reset(seed=1)
for _ in range(20):
    observation, reward, terminated, truncated, info = environment.step(1)
print("ball at", *observation[:3])
"""


def run(*command: str | Path, directory: Path) -> str:
    """Run a command without this checkout on its path, and return what it printed."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    # In another place the rules would all be compiled again, to play 20 steps.
    environment["NUMBA_DISABLE_JIT"] = "1"
    result = subprocess.run(
        [str(part) for part in command],
        cwd=directory,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation")
    run(*pip, "--wheel-dir", directory, ROOT, directory=directory)
    (built,) = directory.glob("*.whl")
    return built


def test_the_wheel_holds_every_level_and_replay_and_says_that_it_is_typed(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert "roller_env/py.typed" in names
    assert {f"roller_env/assets/levels/{level}.yaml" for level in shipped_levels()} <= names
    assert {f"roller_env/assets/replays/{level}.replay" for level in shipped_replays()} <= names
    only_here = ("tests/", "scripts/", "configs/", "roller_env/lab/")
    assert not [name for name in names if name.startswith(only_here)]


def test_the_installed_wheel_plays_in_another_directory(wheel: Path, tmp_path: Path) -> None:
    environment = tmp_path / "environment"
    run(sys.executable, "-m", "venv", "--without-pip", environment, directory=tmp_path)
    python = environment / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet")
    run(*pip, "--no-deps", "--no-index", wheel, directory=tmp_path)
    # The dependencies of this environment, but not its editable install of Roller: a .pth file
    # is obeyed in an environment's own directory only.
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    site_packages = environment / "lib" / version / "site-packages"
    (site_packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    assert run(python, "-c", PLAY, directory=tmp_path).startswith("ball at ")
