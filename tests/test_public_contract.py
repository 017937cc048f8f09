"""What importing the package promises."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

import roller_env

HEAVY = ("mujoco", "numba", "torch", "stable_baselines3", "pydantic", "matplotlib")


def modules_after(statement: str) -> set[str]:
    """Return the names of the modules that a new interpreter has loaded after a statement."""
    code = f"{statement}\nimport json, sys; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout))


def test_importing_the_package_registers_its_ids_and_loads_nothing_heavy() -> None:
    loaded = modules_after("import roller_env, gymnasium; gymnasium.spec('Roller/Classic-v0')")
    assert loaded.isdisjoint(HEAVY)


@pytest.mark.parametrize("module", ["roller_env.envs.single", "roller_env.envs.vector"])
def test_gymnasiums_environments_need_no_training_library_and_no_opengl(module: str) -> None:
    loaded = modules_after(f"import {module} as module")
    assert loaded.isdisjoint({"torch", "stable_baselines3", "matplotlib", "OpenGL", "mujoco.egl"})


def test_the_package_run_as_a_program_plays_every_level_and_says_with_what() -> None:
    command = [sys.executable, "-m", "roller_env"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert lines[0].startswith(f"Roller {roller_env.__version__}: Python ")
    assert "mujoco 4." in lines[0]
    assert lines[1].startswith("every level plays; ")
