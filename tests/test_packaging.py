"""The built wheel is the game: it plays where there is no checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
import yaml

import roller_env
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
    """Return the wheel that the source distribution gives, as `make dist` builds it."""
    directory = tmp_path_factory.mktemp("dist")
    hatchling = (sys.executable, "-m", "hatchling", "build", "--target", "sdist")
    run(*hatchling, "--directory", directory, directory=ROOT)
    (sources,) = directory.glob("*.tar.gz")
    pip = (sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation")
    run(*pip, "--wheel-dir", directory, sources, directory=directory)
    (built,) = directory.glob("*.whl")
    return built


def test_the_version_is_said_in_one_place(wheel: Path) -> None:
    assert wheel.name.split("-")[1] == roller_env.__version__
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == roller_env.__version__
    assert [author["name"] for author in cited["authors"]] == ["Roller developers"]


def test_the_wheel_holds_every_level_and_replay_and_says_that_it_is_typed(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert "roller_env/py.typed" in names
    assert {f"roller_env/assets/levels/{level}.yaml" for level in shipped_levels()} <= names
    assert {f"roller_env/assets/replays/{level}.replay" for level in shipped_replays()} <= names
    assert "roller_env/assets/configs/ppo.yaml" in names
    assert "roller_env/assets/sounds/coin.wav" in names
    only_here = ("tests/", "scripts/", "configs/", "roller_env/lab/")
    assert not [name for name in names if name.startswith(only_here)]


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the programs of an environment in which the wheel is installed."""
    environment = tmp_path_factory.mktemp("installed") / "environment"
    run(sys.executable, "-m", "venv", "--without-pip", environment, directory=wheel.parent)
    python = environment / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet")
    run(*pip, "--no-deps", "--no-index", wheel, directory=wheel.parent)
    # The dependencies of this environment, but not its editable install of Roller: a .pth file
    # is obeyed in an environment's own directory only.
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    site_packages = environment / "lib" / version / "site-packages"
    (site_packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return environment / "bin"


def test_the_installed_wheel_plays_in_another_directory(installed: Path, tmp_path: Path) -> None:
    assert run(installed / "python", "-c", PLAY, directory=tmp_path).startswith("ball at ")


def test_the_installed_command_works_in_an_empty_directory(installed: Path, tmp_path: Path) -> None:
    roller = installed / "roller"
    assert "usage: roller COMMAND" in run(roller, "--help", directory=tmp_path)
    run(roller, "level", "new", "mine.yaml", directory=tmp_path)
    assert run(roller, "level", "check", "mine.yaml", "flat", directory=tmp_path) == ""
    program = (
        "from roller_env.assets import asset_directory as a; from roller_env.replay import *; "
        "from roller_env.cli.train import recipe; "
        "print(load_replay(shipped_replays()['flat']).level.name, recipe().name, "
        "(a('sounds') / 'coin.wav').stat().st_size > 0)"
    )
    found = run(installed / "python", "-c", program, directory=tmp_path)
    assert found == "flat ppo.yaml True\n"


def test_the_installed_command_trains_a_shipped_configuration(
    installed: Path, tmp_path: Path
) -> None:
    faulty = subprocess.run(
        [installed / "roller", "train", "classic", "--set", "num_envs=0"],
        cwd=tmp_path,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert faulty.returncode == 1
    assert faulty.stderr.startswith("error: --set 'num_envs=0': num_envs: ")
    assert list(tmp_path.iterdir()) == []
