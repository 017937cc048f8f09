"""docs/training.md: its examples do what it says, and it leaves no file of a run out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roller_env.envs.sb3 import RollerVecEnv
from roller_env.training.config import load_config
from roller_env.training.config_source import ConfigError
from roller_env.training.files import RunFiles
from roller_env.training.policy import load_policy, save_policy
from roller_env.training.ppo import learn
from tests.training.small import small_config

TEXT = (Path(__file__).parents[2] / "docs" / "training.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```([a-z]*)\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
IN_SB3, IN_NUMPY = (body for kind, body in BLOCKS if kind == "python")
MISTAKEN = next(body for kind, body in BLOCKS if kind == "yaml")
TOLD = next(body for kind, body in BLOCKS if kind == "")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where the examples find the run that they are about."""
    directory = tmp_path_factory.mktemp("docs")
    files = RunFiles(directory / "runs" / "ppo_flat-seed0")
    config = small_config(total_steps=128)
    model, _ = learn(config, files)
    files.config.write_text(config.to_yaml())
    save_policy(model, config, files)
    return directory


@pytest.fixture(autouse=True)
def _there(runs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(runs)


def test_the_example_of_stable_baselines3_acts_as_the_policy_does() -> None:
    said: dict[str, Any] = {}
    exec(IN_SB3, said)  # noqa: S102
    seen = said["environments"].get_original_obs()
    assert np.array_equal(said["actions"], load_policy("runs/ppo_flat-seed0")(seen))


def test_the_example_without_torch_acts_as_the_policy_does() -> None:
    said: dict[str, Any] = {}
    exec(IN_NUMPY, said)  # noqa: S102
    policy = load_policy("runs/ppo_flat-seed0")
    environments = RollerVecEnv(num_envs=8, seed=1, **policy.config.environment.keywords())
    seen = environments.reset()
    for _ in range(20):
        actions = policy(seen)
        assert [said["act"](one) for one in seen] == actions.tolist()
        seen, *_ = environments.step(actions)
    environments.close()


def test_every_file_of_a_run_is_in_the_table() -> None:
    files = RunFiles(Path("run"))
    paths = {name: getattr(files, name) for name in dir(RunFiles) if not name.startswith("_")}
    named = [path for path in paths.values() if isinstance(path, Path) and path != files.directory]
    assert len(named) >= 14
    for path in named:
        assert f"`{path.name}" in TEXT or f"`{path.stem}.*`" in TEXT, path


def test_the_mistakes_are_told_as_printed() -> None:
    Path("mine.yaml").write_text(MISTAKEN)
    with pytest.raises(ConfigError) as caught:
        load_config("mine.yaml", ["num_envs=0"])
    assert f"error: {caught.value}\n" == TOLD
